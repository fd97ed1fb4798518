"""Time of one run against its error, for every method:  python -m benchmarks.work_precision"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from functools import partial

from benchmarks.cvode import CVODE_INSTALL, cvode_is_installed, cvode_run
from benchmarks.page import FIGURE, find_records, markdown, parser, report, write_csv
from benchmarks.reference import reference
from benchmarks.rocking_peer import rocking_methods, rocking_reference
from rbfrag.bench.peers import choose_cases
from rbfrag.bench.work_precision import (
    BenchMethod,
    WorkPrecision,
    general_methods,
    measure,
    taylor_run,
    work_precision_table,
)
from rbfrag.plots import canvas
from rbfrag.plots.canvas import write_near
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX

UNSPLIT = math.inf


def methods() -> tuple[BenchMethod, ...]:
    """Return every available method."""
    settings = tuple(
        BenchMethod(
            "rbfrag, unsplit" if ph_max == UNSPLIT else f"rbfrag, p·h ≤ {ph_max:g}",
            f"order {order}",
            partial(taylor_run, order=order, ph_max=ph_max),
            of_use=(order, ph_max) == (ORDER, PH_MAX),
        )
        for ph_max in (UNSPLIT, PH_MAX, PH_MAX / 3.0)
        for order in (4, 5, 6, ORDER)
    )
    tolerances = (1e-6, 1e-8, 1e-10) if cvode_is_installed() else ()
    cvode = tuple(
        BenchMethod("CVODE in Python", f"rtol {rtol:.0e}", partial(cvode_run, rtol=rtol))
        for rtol in tolerances
    )
    return (*settings, *general_methods(), *cvode)


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--cases", type=int, default=24)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only", nargs="+", help="methods whose name holds one of these words")
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    cases = choose_cases(records, chosen.cases, seed=chosen.seed)
    rows = measure(
        cases,
        [
            method
            for method in methods()
            if method.of_use
            or not chosen.only
            or any(word in f"{method.family}, {method.setting}" for word in chosen.only)
        ],
        judge=reference,
        seed=chosen.seed,
        on_case=lambda number, total: print(f"{number}/{total}", file=sys.stderr),
    )
    if not cvode_is_installed():
        print(f"not installed: {CVODE_INSTALL}", file=sys.stderr)
    rocking = measure(cases, rocking_methods(), judge=rocking_reference, seed=chosen.seed)
    if chosen.out is not None:
        write_csv(rocking, chosen.out / "work-precision-rocking.csv")
        write_csv(rows, chosen.out / "work-precision.csv")
        plot_work_precision(rows, chosen.out / "work-precision.png")
    if chosen.write:
        plot_work_precision(rows, FIGURE)
    about = f"{len(cases)} runs under {records.source}, seed {chosen.seed}."
    for name, measured in (("work-precision", rows), ("work-precision-rocking", rocking)):
        table = markdown(work_precision_table(measured))
        report(name, f"{table}\n\n{about}", write=chosen.write)


ROUNDING = 1e-16
"""Errors below are drawn here: nothing smaller can be told apart."""

OURS = ("#08306b", "#2171b5", "#6baed6")
PEERS = ("#7f7f7f", "#e08214", "#b35806", "#8c6d31", "#c44e52", "#7b3294")
MARKERS = ("s", "D", "^", "v", "P", "X")


@canvas.in_own_style
def plot_work_precision(points: Sequence[WorkPrecision], path: canvas.Out) -> canvas.Picture:
    """Draw time against error, a marker per method and setting, and write it to `path`.

    The marker is at the median error, a thin bar reaches to the worst. Open markers had
    wrong outcomes, which no error tells of.

    Args:
        points: measured methods; those of a family in the order of their settings.
    """
    figure = canvas.new_figure(width_in=8.0, height_in=5.4)
    axes = figure.subplots()
    families = list(dict.fromkeys(point.family for point in points))
    ours = peers = 0
    for family in families:
        if family.startswith("rbfrag"):
            color, marker = OURS[ours % len(OURS)], "o"
            ours += 1
        else:
            color = PEERS[peers % len(PEERS)]
            marker = MARKERS[peers % len(MARKERS)]
            peers += 1
        line = [p for p in points if p.family == family and p.error_median is not None]
        error = [max(p.error_median or 0.0, ROUNDING) for p in line]
        worst = [max(p.error_worst or 0.0, ROUNDING) for p in line]
        time_s = [p.time_s for p in line]
        axes.plot(error, time_s, color=color, lw=1.0, zorder=2)
        axes.hlines(time_s, error, worst, color=color, lw=0.8, alpha=0.4, zorder=1)
        axes.scatter(
            error, time_s, marker=marker, s=30, edgecolors=color, zorder=3, label=family,
            c=["white" if p.wrong else color for p in line],
        )  # fmt: skip
        for p, x, y in zip(line, error, time_s, strict=True):
            label = p.setting.removeprefix("order ").removeprefix("rtol ")
            write_near(axes, label, (x, y), (4, 4), fontsize=6.5, color=color)
            if p.of_use:
                axes.scatter([x], [y], s=150, facecolors="none", edgecolors="black", zorder=4)
                write_near(axes, "as used", (x, y), (0, -15), fontsize=8)
    canvas.logarithmic(axes)
    axes.invert_xaxis()
    axes.set_xlabel("relative error of the peak rotation: median (marker) to worst (bar)")
    axes.set_ylabel("median time of one run [s]")
    canvas.light_grid(axes)
    axes.legend(fontsize=7.5, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return canvas.save_figure(figure, path)


if __name__ == "__main__":
    main()
