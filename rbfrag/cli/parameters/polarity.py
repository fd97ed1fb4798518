"""The --polarity option of commands that answer for one polarity or for both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbfrag.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rbfrag.motions.polarity import Polarity


def polarities(text: str) -> Sequence[Polarity]:
    """Return the polarities that forward, reverse or both means.

    Raises:
        InputError: it is none of the three.
    """
    from rbfrag.motions.polarity import POLARITIES

    if text == "both":
        return POLARITIES
    chosen = [each for each in POLARITIES if each == text]
    if not chosen:
        raise InputError(f"--polarity is {text!r}: write forward, reverse or both")
    return chosen
