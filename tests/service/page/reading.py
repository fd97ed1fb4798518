"""Text of the page, read back into numbers."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from playwright.sync_api import Page

from rbfrag.db.location import REFERENCE
from rbfrag.question.question import predict

PERCENT = re.compile(r"([<>]?)\s*([\d.]+)\s*%")


FIRST_ANSWER = f"{100.0 * predict(3.0, 0.1, pgv_m_s=0.6, db=REFERENCE).probability:.2g} %"
"""What the page shows of p² = 3 1/s², k_r = 0.1, PGV 0.6 m/s."""


def probability_shown(page: Page) -> str:
    """The probability of the headline: "15 %" of "P(toppling) = 15 %"."""
    headline = " ".join((page.text_content("#probability") or "").split())
    return headline.partition(")")[2].removeprefix(" = ").strip()


def agrees(shown: str, probability: float) -> bool:
    """Return whether a page shows this probability in percent, to the digits that it shows."""
    if shown in ("0", "1"):  # by mechanics
        return probability == float(shown)
    result = PERCENT.fullmatch(shown)
    assert result, shown
    sign, digits = result.groups()
    value = float(digits) / 100.0
    if sign == "<":
        return 0.0 < probability < value
    if sign == ">":
        return value < probability < 1.0
    decimals = len(digits.partition(".")[2])
    return abs(probability - value) <= 0.5 * 10.0 ** (-2 - decimals) * (1 + 1e-9)


@dataclass
class Plane:
    """The chart's rectangle on the screen and the ranges of its axes.

    Args:
        box: left, top, width and height of the plot in the sheet.
        x: range across.
        y: range upwards.
    """

    box: tuple[float, float, float, float]
    x: tuple[float, float]
    y: tuple[float, float]

    def value(self, px: float, py: float) -> tuple[float, float]:
        remaining, top, width, height = self.box
        across, up = (px - remaining) / width, 1.0 - (py - top) / height
        return _between(self.x, across), _between(self.y, up)

    def place(self, x: float, y: float) -> tuple[float, float]:
        remaining, top, width, height = self.box
        return (
            remaining + width * _share(self.x, x),
            top + height * (1.0 - _share(self.y, y)),
        )


def plane_of(page: Page, x: tuple[float, float] = (0.05, 3.0)) -> Plane:
    """Return the plane of the design chart as it is drawn with its usual ranges."""
    box = page.eval_on_selector(
        "#chart .area",
        "a => ['x', 'y', 'width', 'height'].map((name) => Number(a.getAttribute(name)))",
    )
    return Plane(tuple(box), x, (0.02, 3.0))


def points_of(path: str) -> list[tuple[float, float]]:
    """Return the points of a path of straight lines."""
    pairs = re.findall(r"(-?[\d.]+),(-?[\d.]+)", path)
    return [(float(x), float(y)) for x, y in pairs]


def _between(ends: tuple[float, float], share: float) -> float:
    return ends[0] * math.exp(share * math.log(ends[1] / ends[0]))


def _share(ends: tuple[float, float], value: float) -> float:
    return math.log(value / ends[0]) / math.log(ends[1] / ends[0])
