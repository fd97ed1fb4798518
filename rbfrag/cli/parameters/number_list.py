"""Lists of numbers on the command line: 30,10,3,1."""

from __future__ import annotations

from rbfrag.errors import InputError


def number_list(text: str, option: str) -> list[float]:
    """Return the numbers of a list separated by commas.

    Args:
        text: what was given.
        option: the option it was given to, for the message.

    Raises:
        InputError: a part is no number.
    """
    values = []
    for part in text.split(","):
        try:
            values.append(float(part))
        except ValueError:
            raise InputError(
                f"{option}: {part.strip()!r} is no number: write a list such as 30,10,3,1"
            ) from None
    return values
