"""The numbers of a block in words: its symbols, or what a field is."""

from __future__ import annotations

from collections.abc import Mapping

from rbfrag.vocabulary.quantities import NUMBERS, QUANTITIES, word_of

_LONGEST = 30
"""Letters of a label."""


def number_in_words(name: str, value: float, digits: int = 4) -> tuple[str, str]:
    """Return what a field of a block is called, and its value with the unit."""
    about = QUANTITIES[name]
    label = about.noun if len(about.noun) <= _LONGEST else word_of(name)
    if name in NUMBERS:
        label = about.symbol
    return label, f"{value:.{digits}g} {about.unit}".rstrip()


def numbers_in_words(numbers: Mapping[str, float], digits: int) -> str:
    """Return the numbers of a block with their names and units."""
    each = (number_in_words(name, value, digits) for name, value in numbers.items())
    return ", ".join(f"{label} = {value}" for label, value in each)
