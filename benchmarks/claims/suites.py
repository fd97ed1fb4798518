"""Whether it matters from which suite motions come:  python -m benchmarks.claims.suites

The dissertation compares sets of pulses, of broadband motions and of motions that match a spectrum.
Labels here are those of the records' lists: near fault (M >= 6, within 10 km of the rupture: where
pulses are), the far-field set of FEMA P-695, motions that were selected for the hazard of three
sites, and others.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from sqlalchemy import text

from benchmarks.claims.claim import FloatArray, cluster_interval
from benchmarks.claims.records import Points, line, motion_set
from benchmarks.page import ROOT, markdown, parser, report
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.queries import combination_table
from rbfrag.plots import canvas

PAGE = ROOT / "docs" / "evidence" / "claims.md"
FIGURE = ROOT / "docs" / "figures" / "suites.svg"
NEAR = "near fault"
SUITES = (NEAR, "P-695 far field", "selected for a site", "others")


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE))
    options.add_argument("--lists", nargs="+", required=True, type=Path, help="MANIFEST.csv files")
    chosen = options.parse_args(arguments)
    with opened_database(chosen.db, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection)
        files = connection.execute(text("select id, source_file from motion")).all()
    of_file = labels(chosen.lists)
    suite = {int(motion): of_file[Path(file).name] for motion, file in files}
    (claim,) = motion_set(table, suite, seed=1)
    points = Points(table)
    intercept, slope = line(points.ln_x["pgv"], points.ln_y)
    residual = points.ln_y - intercept - slope * points.ln_x["pgv"]
    label = np.array([suite[int(motion)] for motion in points.motion_id])
    rows, drawn = [], {}
    for name in SUITES:
        of_label = residual[label == name]
        value, low, high = cluster_interval(
            points.event[label == name],
            lambda i, of_label=of_label: float(of_label[i].mean()),
            seed=1,
        )  # type: ignore[misc]
        drawn[name] = (of_label, value, low, high)
        motions = len(set(points.motion_id[label == name].tolist()))
        events = len(set(points.event[label == name].tolist()))
        rows.append([
            name, str(motions), str(events), f"{value:+.3f} ({low:+.3f} to {high:+.3f})",
            f"{of_label.std():.2f}",
        ])  # fmt: skip
    headers = ["suite", "motions", "earthquakes", "mean of ln y off the line on PGV", "scatter"]
    note = (
        f"{100 * claim.value:.1f} % of the variance; {claim.statistic.rpartition(';')[2].strip()}"
    )
    report("suites", f"{markdown((headers, rows))}\n\n{note}", write=chosen.write, page=PAGE)
    if chosen.write:
        plot(drawn, FIGURE)


def labels(lists: Sequence[Path]) -> Mapping[str, str]:
    """Return the suite of each file, by its name."""
    labels_of_motions = {}
    for path in lists:
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                distance = row.get("rjb_km") or "inf"
                near = float(distance) <= 10.0 and float(row["magnitude"] or 0.0) >= 6.0
                if near or row.get("set") == "geer_chihshang_2022_acc":
                    suite = NEAR
                elif row.get("set") == "fema_p695_far_field":
                    suite = SUITES[1]
                elif "/gmRecords/" in row["source_path"]:
                    suite = SUITES[2]
                else:
                    suite = SUITES[3]
                labels_of_motions[Path(row["file"]).name] = suite
    return labels_of_motions


@canvas.in_own_style
def plot(drawn: Mapping[str, tuple[FloatArray, float, float, float]], path: Path) -> canvas.Picture:
    """Draw how critical blocks of each suite lie about one line on PGV."""
    figure = canvas.new_figure(6.4, 3.2)
    axes = figure.add_subplot()
    for i, (name, (residual, value, low, high)) in enumerate(reversed(drawn.items())):
        q = np.quantile(residual, (0.025, 0.25, 0.75, 0.975))
        label = ("central 95 %", "central half", "mean, with its 95 % interval")
        axes.plot(q[[0, 3]], [i, i], color="#9a9a9a", lw=2, label=None if i else label[0])
        axes.plot(q[[1, 2]], [i, i], color="#9a9a9a", lw=9, label=None if i else label[1])
        axes.errorbar(value, i, xerr=[[value - low], [high - value]], fmt="o", ms=5, capsize=4,
                      color=canvas.RED, label=None if i else label[2])  # fmt: skip
        axes.annotate(name, (-1.45, i), va="center", fontsize=9)
    axes.axvline(0.0, color="black", lw=0.8)
    axes.set_xlim(-1.5, 0.8)
    axes.set_ylim(-0.6, len(drawn) - 0.4)
    axes.set_yticks([])
    axes.set_xlabel("ln of critical $y$, off the line on PGV of all motions")
    canvas.legend_below(figure, 3)
    return canvas.save_figure(figure, path)


if __name__ == "__main__":
    main()
