"""Values of options that several commands read: lists of numbers, polarities."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbfrag.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rbfrag.motions.polarity import Polarity


def number_list(text: str, option: str) -> list[float]:
    """Return the numbers of a list separated by commas."""
    values = []
    for part in text.split(","):
        try:
            values.append(float(part))
        except ValueError:
            raise InputError(
                f"{option}: {part.strip()!r} is no number: write a list such as 30,10,3,1"
            ) from None
    return values


def polarities(text: str) -> Sequence[Polarity]:
    """Return the polarities that forward, reverse or both means."""
    from rbfrag.motions.polarity import POLARITIES

    if text == "both":
        return POLARITIES
    chosen = [each for each in POLARITIES if each == text]
    if not chosen:
        raise InputError(f"--polarity is {text!r}: write forward, reverse or both")
    return chosen
