"""Toppling spectrum and PGV beside critical values:  python -m benchmarks.spectrum_and_pgv"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.claims.claim import IntArray, agreement_with_reference, cluster_interval
from benchmarks.page import ROOT, markdown, parser, report
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion
from rbfrag.db.queries import combination_table
from rbfrag.motions.toppling_spectrum import toppling_spectrum

PAGE = ROOT / "docs" / "theory" / "toppling-spectrum.md"


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--db", required=True, help="database with critical values")
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args(arguments)
    with opened_database(chosen.db, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection)
        motions = {int(i): load_motion(connection, int(i)) for i in np.unique(table.motion_id)}
    x = np.array(
        [
            toppling_spectrum(motions[int(motion)], float(p2), polarity)
            for motion, p2, polarity in zip(table.motion_id, table.p2, table.polarity, strict=True)
        ]
    )
    is_found = (table.status == "found") & (x > 0.0)
    event, p2 = table.event_id[is_found].astype(str), table.p2[is_found]
    ln_y = np.log(table.y_m_s[is_found])
    to_x, to_pgv = ln_y - np.log(x[is_found]), ln_y - np.log(table.pgv_m_s[is_found])
    rows = []
    for words, in_class in [
        *((f"{size:g}", p2 == size) for size in sorted(set(p2), reverse=True)),
        ("all", np.ones(p2.size, dtype=bool)),
    ]:

        def gain(i: IntArray, in_class: np.ndarray = in_class) -> float:
            return float(np.std(to_pgv[in_class][i]) - np.std(to_x[in_class][i]))

        value, low, high = cluster_interval(
            event[in_class], gain, seed=chosen.seed, replications=500
        )
        rows.append(
            [
                words,
                str(int(in_class.sum())),
                f"{np.exp(np.median(to_pgv[in_class])):.3f}",
                f"{np.exp(np.median(to_x[in_class])):.3f}",
                f"{np.std(to_pgv[in_class]):.3f}",
                f"{np.std(to_x[in_class]):.3f}",
                f"{value:.3f} ({low:.3f} … {high:.3f})",
                f"{100.0 * np.mean(to_x[in_class] > np.log(0.99)):.0f} %",
            ]
        )
    headers = [
        "p² [1/s²]", "n", "median y/PGV", "median y/X", "sd of ln(y/PGV)", "sd of ln(y/X)",
        "difference (95 %)", "y within 1 % of X",
    ]  # fmt: skip
    about = (
        f"{int(is_found.sum())} critical values of {len(motions)} motions, "
        f"{len(set(event))} earthquakes; intervals draw whole earthquakes, seed {chosen.seed}. "
        f"{agreement_with_reference(chosen.db)}"
    )
    report(
        "spectrum-and-pgv", f"{markdown((headers, rows))}\n\n{about}", write=chosen.write, page=PAGE
    )


if __name__ == "__main__":
    main()
