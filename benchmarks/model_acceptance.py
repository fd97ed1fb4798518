"""What the models have to reach, and what they reach."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.page import markdown


@dataclass(frozen=True)
class Mark:
    """One number that is aimed at.

    Args:
        model: whose number it is.
        words: what it is.
        low: least value that is accepted.
        high: greatest value that is accepted.
        value: what is reached.
        also: a further condition, in words, with whether it holds.
    """

    model: str
    words: str
    low: float
    high: float
    value: float
    also: tuple[str, bool] | None = None

    @property
    def aim(self) -> str:
        """The range in words."""
        if math.isinf(self.low):
            words = f"≤ {self.high:g}"
        elif math.isinf(self.high):
            words = f"≥ {self.low:g}"
        else:
            words = f"{self.low:g} to {self.high:g}"
        return words if self.also is None else f"{words}, {self.also[0]}"

    @property
    def reached(self) -> bool:
        """Whether it is."""
        return self.low <= self.value <= self.high and (self.also is None or self.also[1])

    @property
    def cell(self) -> str:
        """The value with whether it is reached."""
        return f"{self.value:.4g}" if self.reached else f"**{self.value:.4g}, missed**"


def acceptance_table(marks: Sequence[Mark]) -> str:
    """Return the table of the page."""
    head = ["model", "what", "aim", "reached"]
    return markdown((head, [[m.model, m.words, m.aim, m.cell] for m in marks]))
