"""Yields, slumping and confined toppling beside a free block on springs:

    python -m benchmarks.contact_simulation --records FOLDER [--write] [--only yields|motions]

The cases, and the simulation, are those of tests/physics/test_against_penalty.py and
test_table_3_2.py; here all of them make tables and figures. The yields are also held against limit
analysis.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.page import RECORDS_VARIABLE, ROOT, markdown, parser, report
from rbfrag.motions.readers import read_motions
from rbfrag.plots.canvas import (
    MODE_COLOURS,
    legend_below,
    light_grid,
    mode_title,
    new_figure,
    save_figure,
)
from rbfrag.solver.results import Outcome, Response
from rbfrag.solver.stability.modes import MODES
from rbfrag.solver.stability.single import Stability
from tests.physics.penalty import Simulated
from tests.physics.test_against_penalty import (
    CONFINED,
    DT_S,
    REAL_SLUMPS,
    SLUMPS,
    Case,
    both,
    deviation,
    half_sines,
)
from tests.physics.test_table_3_2 import MOST_G, TABLE_3_2

PAGES = {
    "slumping": ROOT / "docs" / "theory" / "slumping.md",
    "confined_toppling": ROOT / "docs" / "theory" / "confined-toppling.md",
}

VERIFICATION = ROOT / "docs" / "evidence" / "verification.md"

FIGURES = ROOT / "docs" / "figures"

AT_ONCE_G = 0.02
"""Acceleration by which a block without strength has moved."""

BEHIND_G = 0.05
"""Distance from the end of a ramp within which a block that starts has not gone far enough."""

REAL_CONFINED = {
    f"peer_at2_opensees/{name}": Case(-60, 20, 1, 15, 35, 35, (), until=38.0)
    for name in ("CHY028-N.AT2", "CHY080-N.AT2")
}

SHOWN = {
    "slumping": ("two pulses", "partly reversed", "Rinaldi228.AT2", "RSN77_SFERN_PUL164.AT2"),
    "confined_toppling": ("pulse", "steep wedge", "vertical", "CHY080-N.AT2"),
}
"""Cases of the figures."""


def main(arguments: Sequence[str] | None = None) -> None:
    understood = parser(__doc__)
    understood.add_argument("--only", choices=("yields", "motions"), help="one part of it")
    chosen = understood.parse_args(arguments)
    if chosen.only != "motions":
        yields(write=chosen.write)
    if chosen.only == "yields":
        return
    root = Path(chosen.records or os.environ.get(RECORDS_VARIABLE, "."))
    for kind, page in PAGES.items():
        pulses, real = (SLUMPS, REAL_SLUMPS) if kind == "slumping" else (CONFINED, REAL_CONFINED)
        cells, drawn = [], []
        for name, case in pulses.items():
            answer, simulated = both(case, half_sines(case.lobes), DT_S)
            cells.append(row(name, case, answer, simulated))
            drawn.append((name, answer, simulated))
        for record, case in real.items():
            if not (root / record).is_file():
                continue
            motion = read_motions(root / record)[0]
            assert motion.dt_s is not None
            answer, simulated = both(case, motion.acceleration_g, motion.dt_s)
            name = Path(record).name
            cells.append(row(name, case, answer, simulated))
            drawn.append((name, answer, simulated))
        headers = [
            "motion", "α1, α3, β, φ1, φ2 [deg]", "r3 [m]", "peak θ [rad]", "peak, simulated",
            "greatest difference over peak",
        ]  # fmt: skip
        report(kind, markdown((headers, cells)), write=chosen.write, page=page)
        if chosen.write:
            draw([item for item in drawn if item[0] in SHOWN[kind]], kind)


class Compared(NamedTuple):
    """The yields of one model of Table 3.2 [g]: by the formulas and by the two checks.

    Args:
        by_formulas: mode, state and yield by the formulas.
        decided: whether statics alone has one answer.
        limit_g: the greatest k that contact forces can hold.
        ramp_g: k on a slow ramp at which a block on springs starts to move; None up to `MOST_G`.
    """

    by_formulas: Stability
    decided: bool
    limit_g: float
    ramp_g: float | None

    @property
    def finite(self) -> bool:
        """Whether the formulas give a yield."""
        return math.isfinite(self.by_formulas.yield_acceleration)


def yields(*, write: bool) -> None:
    """Compare the yields of the 1,632 models of Table 3.2, as Figs. 3.24 and 3.25 do."""
    compared = [
        Compared(model.stability, model.decided, model.limit_g(), model.ramp_g())
        for model in TABLE_3_2
    ]
    rows = []
    for mode in MODES:
        of_mode = [comparison for comparison in compared if comparison.by_formulas.mode == mode]
        limit = np.abs([difference for _, difference in limit_differences(of_mode)])
        ramp = np.abs([difference for _, difference in ramp_differences(of_mode)])
        silent = [comparison for comparison in of_mode if comparison.ramp_g is None]
        weak = [
            comparison for comparison in of_mode if comparison.by_formulas.yield_acceleration <= 0.0
        ]
        at_once = [
            comparison
            for comparison in weak
            if comparison.ramp_g is not None and comparison.ramp_g < AT_ONCE_G
        ]
        beyond = [
            comparison
            for comparison in silent
            if comparison.by_formulas.yield_acceleration > MOST_G - BEHIND_G
        ]
        rows.append(
            [
                mode.replace("_", " "),
                str(len(of_mode)),
                f"{limit.size}: {limit.max():.0e}" if limit.size else "none",
                str(sum(comparison.finite and not comparison.decided for comparison in of_mode)),
                f"{ramp.size}: {np.median(ramp):.4f}, {ramp.max():.4f}",
                f"{len(beyond)} of {len(silent)}",
                f"{len(at_once)} of {len(weak)}",
            ]
        )
    headers = [
        "mode", "models", "limit analysis, one answer: greatest difference [g]",
        "planes may hold more", "springs: median, greatest difference [g]",
        f"at rest up to {MOST_G} g, as they should", "no strength: move at once",
    ]  # fmt: skip
    report("yields", markdown((headers, rows)), write=write, page=VERIFICATION)
    if write:
        draw_yields(compared)


def limit_differences(compared: Sequence[Compared]) -> list[tuple[float, float]]:
    """Return yields and their differences from limit analysis where it has one answer [g]."""
    return [
        (
            comparison.by_formulas.yield_acceleration,
            comparison.by_formulas.yield_acceleration - comparison.limit_g,
        )
        for comparison in compared
        if comparison.finite and comparison.decided
    ]


def ramp_differences(compared: Sequence[Compared]) -> list[tuple[float, float]]:
    """Return yields of blocks that rest and their differences from the springs' [g]."""
    return [
        (
            comparison.by_formulas.yield_acceleration,
            comparison.by_formulas.yield_acceleration - comparison.ramp_g,
        )
        for comparison in compared
        if comparison.finite
        and comparison.by_formulas.yield_acceleration > 0.0
        and comparison.ramp_g is not None
    ]


def draw_yields(compared: Sequence[Compared]) -> None:
    """Draw both differences against the yield."""
    figure = new_figure(width_in=7.6, height_in=5.8)
    above, below = figure.subplots(2, 1, sharex=True)
    for mode in MODES:
        of_mode = [comparison for comparison in compared if comparison.by_formulas.mode == mode]
        for axes, pairs, scale in (
            (above, limit_differences(of_mode), 1e15),
            (below, ramp_differences(of_mode), 1.0),
        ):
            k, difference = np.array(pairs).reshape(-1, 2).T
            axes.scatter(
                k, scale * difference, s=13, alpha=0.55, linewidths=0.0, color=MODE_COLOURS[mode],
                label=mode_title(mode) if axes is below else None,
            )  # fmt: skip
    below.axhspan(-0.02, 0.02, color="#ececec", zorder=0, label="0.02 g, the dissertation's")
    for axes in (above, below):
        axes.axhline(0.0, color="black", lw=0.6)
        light_grid(axes)
    above.set_ylabel("less limit analysis [$10^{-15}$ g]")
    above.set_title("Yield acceleration by the formulas", fontsize=10)
    below.set_ylabel("less that of a block\non springs, slow ramp [g]")
    below.set_ylim(-0.025, 0.025)
    below.set_xlabel("yield acceleration by the formulas [g]")
    below.set_xlim(right=MOST_G)
    legend_below(figure, 3)
    save_figure(figure, FIGURES / "yield-differences.svg")


def end_s(case: Case, answer: Response) -> float:
    """Return the time up to which the model claims the motion of two contacts."""
    if answer.mode_changes:
        return answer.mode_changes[0].time_s
    if answer.outcome is not Outcome.STABLE:
        assert answer.stopped_s is not None
        return answer.stopped_s
    return case.until


def row(name: str, case: Case, answer: Response, on_springs: Simulated) -> list[str]:
    sign = 1.0 if answer.kind == "slumping" else -1.0
    is_compared = on_springs.time_s <= end_s(case, answer)
    assert answer.history is not None
    shown = answer.history.time_s <= end_s(case, answer)
    peak = float(answer.history.theta_rad[shown].max())
    simulated = float((sign * on_springs.turned_rad)[is_compared].max())
    angles = (case.alpha1, case.alpha3, case.beta, case.phi, case.back)
    return [
        name,
        ", ".join(f"{angle:g}" for angle in angles),
        f"{case.r3:g}",
        f"{peak:.6f}",
        f"{simulated:.6f}",
        f"{deviation(answer, on_springs, end_s(case, answer), sign) / peak:.1e}",
    ]


def draw(drawn: list[tuple[str, Response, Simulated]], kind: str) -> None:
    figure = new_figure(width_in=8.0, height_in=5.2)
    for axes, (name, answer, simulated) in zip(figure.subplots(2, 2).flat, drawn, strict=True):
        sign = 1.0 if answer.kind == "slumping" else -1.0
        history = answer.history
        assert history is not None
        assert answer.started_s is not None
        assert answer.stopped_s is not None
        last = min(answer.stopped_s + 0.15, float(simulated.time_s[-1]))
        is_compared = simulated.time_s <= last
        axes.plot(
            simulated.time_s[is_compared], 1e3 * sign * simulated.turned_rad[is_compared],
            color="#c44e52", lw=3.0, alpha=0.45, label="free block on springs",
        )  # fmt: skip
        ours = history.time_s <= min(last, answer.stopped_s)
        axes.plot(
            history.time_s[ours], 1e3 * history.theta_rad[ours], color="black", lw=1.0,
            label="rbfrag",
        )  # fmt: skip
        for change in answer.mode_changes:
            axes.axvline(change.time_s, color="#7f7f7f", lw=0.8, ls=":")
        axes.set_xlim(max(0.0, answer.started_s - 0.1), last)
        axes.set_title(name, fontsize=9)
        axes.set_ylabel(r"$\theta$ [mrad]")
        axes.set_xlabel("time [s]")
        axes.grid(visible=True, lw=0.3, alpha=0.6)
        top = float(1e3 * np.abs(history.theta_rad[ours]).max())
        axes.set_ylim(-0.05 * top, 1.15 * top)
    figure.axes[0].legend(fontsize=8, loc="lower right" if kind == "slumping" else "upper left")
    if kind != "slumping":
        figure.axes[0].set_ylim(top=1.6 * figure.axes[0].get_ylim()[1])
    save_figure(figure, FIGURES / f"{kind.replace('_', '-')}-verification.svg")


if __name__ == "__main__":
    main()
