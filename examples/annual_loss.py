"""Mean annual loss of a road under rock faces, with its interval.

    python examples/annual_loss.py [DATABASE]

Reads segments.csv (numbers of blocks, their size and strength, the cost of a fall) and one hazard
curve a site, all made up for this example. DATABASE holds a fragility model on PGV; without it
the default is used, as everywhere in rbfrag.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

import rbfrag

HERE = Path(__file__).parent


def annual_loss(segments: pd.DataFrame, db: str | None) -> pd.DataFrame:
    """Return segments with falls and loss a year, and the ends of their 95 % intervals."""
    parts = []
    for curve_file, some in segments.groupby("curve", sort=False):
        (curve,) = rbfrag.read_hazard_curves(HERE / str(curve_file))
        found = rbfrag.hazard(curve, some["p2_1_s2"], some["kr"], component="geometric_mean", db=db)
        for text in found.warnings:
            print(f"{curve_file}: {text}", file=sys.stderr)
        parts.append(
            some.assign(
                falls_per_year=some["blocks"] * found.annual_rate,
                falls_low=some["blocks"] * found.ci_low,
                falls_high=some["blocks"] * found.ci_high,
            )
        )
    table = pd.concat(parts)
    for end in ("per_year", "low", "high"):
        table[f"loss_{end}_eur"] = table[f"falls_{end}"] * table["cost_per_block_eur"]
    return table


def main() -> None:
    """Print the table and the sums."""
    table = annual_loss(pd.read_csv(HERE / "segments.csv"), *(sys.argv[1:] or [None]))
    shown = ["segment", "blocks", "falls_per_year", "loss_per_year_eur", "loss_low_eur",
             "loss_high_eur"]  # fmt: skip
    print(table[shown].to_string(index=False, float_format=lambda value: f"{value:.4g}"))
    # the parameters of the model are common to all segments, so the ends add up
    loss, low, high = (table[f"loss_{end}_eur"].sum() for end in ("per_year", "low", "high"))
    print(f"\nmean annual loss {loss:.0f} EUR (95 % interval {low:.0f} to {high:.0f})")
    falls = table["falls_per_year"].sum()
    print(f"probability of a fall on the road in 50 years {100 * -np.expm1(-50 * falls):.2g} %")


if __name__ == "__main__":
    main()
