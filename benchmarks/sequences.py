"""What a first shock leaves for the second: the tables of docs/howto/sequences.md.

    rbfrag motions add FOLDER --metadata FOLDER/MANIFEST.csv --db sequences.db
    python -m benchmarks.sequences --db sequences.db --write

The campaigns are run, or resumed, in the database: sliding with four drawn first motions for each
second one, slumping with two.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.page import ROOT, parser, write_table
from rbfrag.campaign.simulate import simulate
from rbfrag.exchange.database_tables import read_table
from rbfrag.fragility.conditional import ConditionalShare

HOWTO = ROOT / "docs" / "howto" / "sequences.md"
DRAWS = {"sliding": 4, "slumping": 2}
SHOWN = {"sliding": 0.15, "slumping": None}
"""The limit of each kind that the page shows; the others are kept among the results."""

LEAST_RAD = np.radians(0.05)
SHARES = (0.0, 0.01, 0.1, 0.25, 0.5, 1.0)


def main() -> None:
    """Run the campaigns and print, or write, their tables."""
    options = parser(__doc__)
    options.add_argument("--db", type=Path, required=True, help="database with the motions")
    chosen = options.parse_args()
    tables = {}
    for kind, draws in DRAWS.items():
        summary = simulate(chosen.db, kind=kind, sequence=True, draws=draws, jobs=1)
        assert summary.sequence is not None
        rows = summary.sequence.conditional
        tables[f"{kind}-all"] = conditional_table(rows)
        tables[kind] = conditional_table(
            (row for row in rows if _limit(row) == SHOWN[kind]), short=True
        )
    tables["geometry"] = geometry_table(read_table("shock_pair", db=chosen.db))
    for name, text in tables.items():
        print(f"\n{name}\n\n{text}")
        if chosen.write:
            write_table(HOWTO, name, text)


def _limit(row: ConditionalShare) -> float | None:
    return row.rotation_deg if row.displacement_m is None else row.displacement_m


def conditional_table(rows: Iterable[ConditionalShare], *, short: bool = False) -> str:
    """Return the conditional fragility in Markdown.

    Args:
        rows: the classes.
        short: without the limit, and without second shocks whose PGA is below the yield, in which
            no block moves but for one that its rotation has made weaker.
    """
    names = ["state left by the first", "PGA/yield of the second", "blocks", "earthquakes",
             "of one station", "P", "P of the intact block", "ratio"]  # fmt: skip
    table = [names if short else ["limit", *names]]
    for row in rows:
        if short and row.pga_over_yield_to == 1.0:
            continue
        limit = "past recovery" if _limit(row) is None else f"{_limit(row):g}"
        limit += "" if row.displacement_m is None else " m"
        limit += "" if row.rotation_deg is None else "°"
        most = row.pga_over_yield_to
        cells = [
            f"{row.state_from:.0%} to {row.state_to:.0%}" if row.state_to else "none",
            f"{row.pga_over_yield_from:g} to {most:g}" if most else "over 4",
            *map(str, (row.blocks, row.earthquakes, row.of_station)),
            f"{row.probability:.3f} ({row.ci_low:.2f}-{row.ci_high:.2f})",
            f"{row.intact_probability:.3f} ({row.intact_ci_low:.2f}-{row.intact_ci_high:.2f})",
            "-" if row.ratio is None else f"{row.ratio:.2f}",
        ]
        table.append(cells if short else [limit, *cells])
    lines = [f"| {' | '.join(cells)} |" for cells in table]
    return "\n".join([lines[0], "| --- " * len(table[0]) + "|", *lines[1:]])


def geometry_table(pairs: pd.DataFrame) -> str:
    """Return what the second shock adds to a block that moved, over what it does to an intact one.

    Of blocks that come to rest in both, and that it moves by 0.05° at least, or slides.
    """
    slides = pairs[(pairs.kind == "sliding") & (pairs.second_outcome == "stable")]
    sums = slides.first_displacement_m + slides.intact_displacement_m
    off = float((slides.second_displacement_m - sums).abs().max())
    slumps = pairs[
        (pairs.kind == "slumping")
        & (pairs.second_outcome == "stable")
        & (pairs.intact_outcome == "stable")
        & (pairs.intact_rotation_rad > LEAST_RAD)
    ]
    ratio_left = slumps.first_rotation_rad / slumps.critical_rad
    ratio = (slumps.second_rotation_rad - slumps.first_rotation_rad) / slumps.intact_rotation_rad
    lines = [
        "| rotation that the first leaves, of the one without strength | slumps | ratio, 10 % | "
        "median | 90 % |",
        "| --- " * 5 + "|",
    ]
    for low, high in pairwise(SHARES):
        in_class = ratio[(ratio_left > low) & (ratio_left <= high)]
        ends = " | ".join(f"{value:.2f}" for value in np.percentile(in_class, [10, 50, 90]))
        lines.append(f"| {low:.0%} to {high:.0%} | {len(in_class)} | {ends} |")
    return "\n".join(
        [*lines, "", f"Of {len(slides)} slides the sum differs by {off:.1g} m at most."]
    )


if __name__ == "__main__":
    main()
