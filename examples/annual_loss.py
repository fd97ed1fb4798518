"""Mean annual loss of a road under rock faces, and how probable it is that any rock falls.

    python examples/annual_loss.py [DATABASE]

Reads segments.csv (numbers of blocks, their size and strength, the cost of a fall) and one hazard
curve a site, all made up for this example. DATABASE holds a fragility model on PGV; without it
the default is used, as everywhere in rbfrag.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

import rbfrag

FOLDER = Path(__file__).parent


class Site(NamedTuple):
    """How often an earthquake brings down any block of a site [1/a], and the bounds of that."""

    name: str
    rate_any: float | None
    fully_dependent: float
    independent: float


def annual_loss(segments: pd.DataFrame, db: str | None) -> tuple[pd.DataFrame, list[Site]]:
    """Return segments with falls and loss a year and the ends of their 95 % intervals, and sites.

    Every block of a site is a row of its own: an earthquake that shakes one shakes all of them.
    """
    parts, sites = [], []
    for curve_file, buildings in segments.groupby("curve", sort=False):
        (curve,) = rbfrag.read_hazard_curves(FOLDER / str(curve_file))
        blocks = buildings.loc[buildings.index.repeat(buildings["blocks"])]
        answer = rbfrag.hazard(
            curve, blocks["p2_1_s2"], blocks["kr"], component="geometric_mean", joint=True, db=db
        )
        for text in answer.warnings:
            print(f"{curve_file}: {text}", file=sys.stderr)
        rates = pd.DataFrame(
            {"per_year": answer.annual_rate, "low": answer.ci_low, "high": answer.ci_high},
            index=blocks.index,
        )
        falls = rates.groupby(level=0).sum().add_prefix("falls_")
        parts.append(buildings.join(falls))
        assert answer.joint is not None
        bounds = answer.joint.bounds
        ends = [bounds[law]["annual_rate_any"] for law in ("fully_dependent", "independent")]
        sites.append(Site(str(curve_file), answer.annual_rate_any, ends[0], ends[1]))
    table = pd.concat(parts)
    for end in ("per_year", "low", "high"):
        table[f"loss_{end}_eur"] = table[f"falls_{end}"] * table["cost_per_block_eur"]
    return table, sites


def in_50_years(annual_rate: float) -> str:
    """Return the probability of at least one earthquake of a rate in 50 years, in percent."""
    return f"{-100.0 * np.expm1(-50.0 * annual_rate):.2g} %"


def print_falls(falls_per_year: float, sites: list[Site]) -> None:
    """Print how probable it is that any block falls.

    The two curves do not tell whether one earthquake shakes both sites. The rate for the road is
    the greater one's if the same earthquakes do, and the sum if no earthquake shakes both.
    """
    print(f"falls expected in 50 years, several in one earthquake: {50.0 * falls_per_year:.2g}")
    print("probability in 50 years that")
    for site in sites:
        shown = in_50_years(site.rate_any) if site.rate_any is not None else "not known"
        least, most = in_50_years(site.fully_dependent), in_50_years(site.independent)
        print(f"  any block of {site.name} falls: {shown} ({least} if all fall together, {most} "
              "if independently)")  # fmt: skip
        rate = "not known" if site.rate_any is None else f"{site.rate_any:.2g}"
        print(f"    earthquakes a year that bring down any: {rate} "
              f"({site.fully_dependent:.2g} to {site.independent:.2g})")  # fmt: skip
    low = [site.fully_dependent if site.rate_any is None else site.rate_any for site in sites]
    high = [site.independent if site.rate_any is None else site.rate_any for site in sites]
    print(f"  any block of the road falls: {in_50_years(max(low))} to {in_50_years(sum(high))}")
    print(
        f"not {in_50_years(falls_per_year)}, by the sum of the rates of all blocks: that takes "
        "every block to have earthquakes of its own"
    )


def main() -> None:
    """Print the table and the sums."""
    table, sites = annual_loss(
        pd.read_csv(FOLDER / "segments.csv"), sys.argv[1] if sys.argv[1:] else None
    )
    shown = ["segment", "blocks", "falls_per_year", "loss_per_year_eur", "loss_low_eur",
             "loss_high_eur"]  # fmt: skip
    print(table[shown].to_string(index=False, float_format=lambda value: f"{value:.4g}"))
    # the parameters of the model are common to all segments, so the ends add up
    loss, low, high = (table[f"loss_{end}_eur"].sum() for end in ("per_year", "low", "high"))
    if not np.isfinite([loss, low, high]).all():
        sys.exit("no loss: a number is missing among the segments or the answers")
    print(f"\nmean annual loss {loss:.0f} EUR (95 % interval {low:.0f} to {high:.0f})")
    print_falls(float(table["falls_per_year"].sum()), sites)


if __name__ == "__main__":
    main()
