"""Two maps of one combination, made on different machines: where do they contradict?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

BORDER_ERROR = 1e-7
"""Relative error of a border that another processor's last bits can make."""

Interval = tuple[float, float, str]
"""Lower end, upper end [k_r/PGA] and outcome."""


def contradictions(
    one: Sequence[Interval], other: Sequence[Interval]
) -> Iterator[tuple[float, float, str, str]]:
    """Yield stretches that one map has toppling and the other safe.

    Args:
        one: intervals by rising ends.
        other: likewise.

    Returns:
        Lower end, upper end, what the first says, what the second says.
    """
    i = j = 0
    while i < len(one) and j < len(other):
        low, high, word = one[i]
        low_2, high_2, word_2 = other[j]
        bottom, top = max(low, low_2), min(high, high_2)
        if {word, word_2} == {"topples", "safe"} and top - bottom > BORDER_ERROR * top:
            yield bottom, top, word, word_2
        if high <= high_2:
            i += 1
        else:
            j += 1
