"""Contents of buildings in FEMA P-58 beside free-standing blocks:  python -m benchmarks.contents"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from scipy.optimize import brentq

import rbfrag
from benchmarks.page import ROOT, markdown, parser, report
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

PAGE = ROOT / "docs" / "evidence" / "contents.md"
INCH_M = 0.0254
MODEL = "rocking-pgv"
FLOOR_PERIOD_S = 1.0


class Item(NamedTuple):
    """An unanchored item of FEMA P-58: depth and height [in], median peak floor velocity [m/s]."""

    code: str
    name: str
    depth_in: float
    height_in: float
    median_m_s: float


ITEMS = (
    Item("E.20.22.102a", "bookcase", 12.6, 29.0, 0.724),
    Item("E.20.22.104a", "bookcase", 12.6, 56.0, 0.361),
    Item("E.20.22.106a", "bookcase", 12.6, 81.25, 0.251),
    Item("E.20.22.114a", "filing cabinet", 15.0, 52.0, 0.498),
)


def velocity_m_s(item: Item, probability: float) -> float:
    """Return the PGV of the ground at which a block of these sides falls so often [m/s]."""

    def excess(pgv_m_s: float) -> float:
        answer = rbfrag.predict(
            height_m=item.height_in * INCH_M, width_m=item.depth_in * INCH_M, kind="rocking",
            pgv_m_s=pgv_m_s, model=MODEL,
        )  # fmt: skip
        return answer.probability - probability

    return float(brentq(excess, 0.02, 6.0))


def row_of(item: Item) -> list[str]:
    """Return an item's line: medians and their ratio, scatter, and where a floor lifts it."""
    median, low, high = (velocity_m_s(item, p) for p in (0.5, 0.16, 0.84))
    scatter = math.log(high / low) / 2.0 / 0.994
    lifts = item.depth_in / item.height_in * STANDARD_GRAVITY_M_S2 * FLOOR_PERIOD_S / (2 * math.pi)
    sides = f"{item.depth_in:g} × {item.height_in:g} in"
    numbers = (item.median_m_s, median, median / item.median_m_s, scatter, lifts)
    return [item.code, f"{item.name}, {sides}", *(f"{number:.2f}" for number in numbers)]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, or write it into its page."""
    chosen = parser(__doc__).parse_args(arguments)
    head = [
        "item", "depth × height", "P-58, floor [m/s]", "here, ground [m/s]", "ratio",
        "scatter here (P-58: 0.5)", "lifted by a floor of 1 s [m/s]",
    ]  # fmt: skip
    table = markdown((head, [row_of(item) for item in ITEMS]))
    report("contents", table, write=chosen.write, page=PAGE)


if __name__ == "__main__":
    main()
