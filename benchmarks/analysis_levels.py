"""Time and error of an answer, by level:  python -m benchmarks.analysis_levels --records FOLDER

Outcomes are those of the built-in data set, each block followed in time: toppling, k_r >= 0.02,
y/PGV 0.1 to 4. Times are of this machine, under the records of a folder.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.held_out import scored_blocks
from benchmarks.page import ROOT, markdown, parser, report
from rbfrag.bench.work_precision import seconds
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.fit.data import read_source
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import array_answer
from rbfrag.motions.readers import read_motions
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots import canvas
from rbfrag.question.question import predict
from rbfrag.solver.respond import respond

PAGE = ROOT / "docs" / "theory" / "levels-of-analysis.md"
FIGURE = ROOT / "docs" / "figures" / "analysis-levels.svg"
SPECTRUM = ("sa(0.3)", "sa(1)", "sa(3)")
LEVELS: dict[str, tuple[str, tuple[str, ...]]] = {
    "PGV": ("toppling-pgv", ("pgv_m_s",)),
    "PGV, PGA, SA(0.3, 1, 3)": ("toppling-pgv_pga", ("pgv_m_s", "pga_g", *SPECTRUM)),
    "record": ("record-xp", ("xp_m_s", "pga_g")),
}
"""Models by what they are given."""

MOTIONS, REPEATS = 40, 5
P2 = (10.0, 1.0)


def main(arguments: Sequence[str] | None = None) -> None:
    chosen = parser(__doc__).parse_args(arguments)
    with opened_database(REFERENCE, read_only=True) as engine, engine.connect() as connection:
        measures, outcome = scored_blocks(read_source(connection))
    failed = outcome > 0.5
    y_m_s = measures["kr"] * STANDARD_GRAVITY_M_S2 / np.sqrt(measures["p2"])
    by_mechanics = (measures["kr"] >= measures["pga_g"]) | (y_m_s >= 2.0 * measures["pgv_m_s"])
    by_bound = by_mechanics | (y_m_s >= measures["xp_m_s"])
    wrong: dict[str, tuple[NDArray[np.bool_], float]] = {
        "by mechanics": (by_mechanics, 0.0), "by the spectrum bound": (by_bound, 0.0)
    }  # fmt: skip
    rows, many = [], {}
    cost = times(chosen.records)
    for name, (ruled, _) in wrong.items():
        rows.append([name, cost[name], 1.0 - ruled.mean(), float((failed & ruled).sum()), None])
    for name, (model_name, inputs) in LEVELS.items():
        model = find_model(model_name, inputs)
        values = {key: measures[key] for key in ("p2", "kr", *inputs)}
        start = time.process_time()
        p = array_answer(model, values, interval=False).probability
        many[f"model, {name}"] = (time.process_time() - start) / failed.size
        is_finite = np.isfinite(p)
        off = (p > 0.5) != failed
        brier = float(np.mean((p - failed)[is_finite] ** 2))
        rows.append([f"model, {name}", cost[name], 0.0, float(off[is_finite].mean()), brier])
    rows.append(["followed in time", cost["followed in time"], 0.0, 0.0, 0.0])
    shown = [
        [
            str(name), seconds(float(took)), seconds(many[name]) if name in many else "",
            f"{100 * float(remaining):.0f} %",
            f"{wrong_here:.0f} blocks" if brier is None else f"{100 * float(wrong_here):.1f} %",
            "" if brier is None else f"{brier:.3f}",
        ]
        for name, took, remaining, wrong_here, brier in rows
    ]  # fmt: skip
    headers = [
        "how", "time of one answer", "of one of many", "undecided", "on the wrong side",
        "Brier score",
    ]  # fmt: skip
    about = f"{failed.size:,} blocks, of which {failed.mean():.0%} topple."
    report("levels", f"{markdown((headers, shown))}\n\n{about}", write=chosen.write, page=PAGE)
    if chosen.write:
        plot(rows, FIGURE)


def times(records: str) -> dict[str, float]:
    """Return the time of one answer of each level of analysis [s]; motions are read before."""
    files = sorted(path for path in Path(records).rglob("*.AT2"))
    motions = [read_motions(path)[0] for path in files[:: max(1, len(files) // MOTIONS)]]
    cases = [(m, p2, 0.6 * m.pgv_m_s * p2**0.5 / STANDARD_GRAVITY_M_S2)
             for m in motions for p2 in P2]  # fmt: skip
    spectrum = {0.3: 0.9, 1.0: 0.3, 3.0: 0.1}
    record = find_model("record-xp", ("xp_m_s", "pga_g"))
    seconds = {
        "by mechanics": _time(lambda: predict(3.0, 0.6, pgv_m_s=0.5, pga_g=0.5)),
        "PGV": _time(lambda: predict(3.0, 0.1, pgv_m_s=0.5)),
        "PGV, PGA, SA(0.3, 1, 3)": _time(
            lambda: predict(3.0, 0.1, pgv_m_s=0.5, pga_g=0.5, sa_g=spectrum)
        ),
    }
    bound = _seconds_each(lambda m, p2, _: toppling_spectrum(m, p2, "forward"), cases)
    return seconds | {
        "by the spectrum bound": bound, "record": _seconds_each(
            lambda m, p2, kr: predict(p2, kr, motion=m, polarity="forward", model=record), cases
        ),
        "followed in time": _seconds_each(lambda m, p2, kr: respond(m, p2=p2, kr=kr), cases),
    }  # fmt: skip


def _time(work: Callable[[], object], number: int = 300) -> float:
    work()
    start = time.process_time()
    for _ in range(number):
        work()
    return (time.process_time() - start) / number


def _seconds_each(
    work: Callable[..., object], cases: Sequence[tuple[object, float, float]]
) -> float:
    """Return the median time over cases, the least of several runs of each [s]."""
    took = []
    for case in cases:
        work(*case)
        runs = []
        for _ in range(REPEATS):
            start = time.process_time()
            work(*case)
            runs.append(time.process_time() - start)
        took.append(min(runs))
    return float(np.median(took))


@canvas.in_own_style
def plot(rows: Sequence[Sequence[object]], path: Path) -> canvas.Picture:
    """Draw time of an answer and fractions undecided or on the wrong side, by level of analysis."""
    figure = canvas.new_figure(8.4, 3.0)
    cost, error = figure.subplots(1, 2, sharey=True)
    cost.set_xscale("log")
    for i, (_, took, remaining, wrong, brier) in enumerate(reversed(rows)):
        open_left = brier is None
        share = 100.0 * float(remaining if open_left else wrong)  # type: ignore[arg-type]
        face = "white" if open_left else canvas.RED
        cost.plot(1e6 * float(took), i, "o", ms=7, color="#333333")  # type: ignore[arg-type]
        error.plot(share, i, "o", ms=7, mec=canvas.RED, mfc=face)
        words = f"{share:.2g} %" + (" open, none wrong" if open_left else "")
        error.annotate(words, (share, i), xytext=(9, 0), textcoords="offset points",
                       fontsize=8.5, va="center")  # fmt: skip
    cost.set_yticks(range(len(rows)), [str(row[0]) for row in reversed(rows)], fontsize=8.5)
    cost.set_xlim(20.0, 5000.0)
    cost.set_ylim(-0.6, len(rows) - 0.4)
    error.set_xlim(-4.0, 125.0)
    cost.set_xlabel("time of one answer [µs]")
    error.set_xlabel("blocks on the wrong side, or open [%]")
    canvas.light_grid(cost, error)
    return canvas.save_figure(figure, path)


if __name__ == "__main__":
    main()
