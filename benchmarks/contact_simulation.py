"""Slumping and confined toppling beside a free block on springs:

    python -m benchmarks.contact_simulation --records FOLDER [--write]

The cases, and the simulation, are those of tests/physics/test_against_penalty.py; here all of
them make tables and figures.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.page import ROOT, parser, report
from rbfrag.bench.cases import RECORDS_VARIABLE
from rbfrag.bench.tables import markdown
from rbfrag.motions.recognise import read_motions
from rbfrag.plots.canvas import new_figure, save_figure
from rbfrag.solver.results import Outcome, Response
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

PAGES = {
    "slumping": ROOT / "docs" / "theory" / "slumping.md",
    "confined_toppling": ROOT / "docs" / "theory" / "confined-toppling.md",
}

FIGURES = ROOT / "docs" / "figures"

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
    chosen = parser(__doc__).parse_args(arguments)
    root = Path(chosen.records or os.environ.get(RECORDS_VARIABLE, "."))
    for kind, page in PAGES.items():
        pulses, real = (SLUMPS, REAL_SLUMPS) if kind == "slumping" else (CONFINED, REAL_CONFINED)
        cells, drawn = [], []
        for name, case in pulses.items():
            answer, free = both(case, half_sines(case.lobes), DT_S)
            cells.append(row(name, case, answer, free))
            drawn.append((name, answer, free))
        for record, case in real.items():
            if not (root / record).is_file():
                continue
            motion = read_motions(root / record)[0]
            assert motion.dt_s is not None
            answer, free = both(case, motion.acceleration_g, motion.dt_s)
            name = Path(record).name
            cells.append(row(name, case, answer, free))
            drawn.append((name, answer, free))
        headers = [
            "motion", "α1, α3, β, φ1, φ2 [deg]", "r3 [m]", "peak θ [rad]", "peak, simulated",
            "greatest difference over peak",
        ]  # fmt: skip
        report(kind, markdown((headers, cells)), write=chosen.write, page=page)
        if chosen.write:
            draw([item for item in drawn if item[0] in SHOWN[kind]], kind)


def end_s(case: Case, answer: Response) -> float:
    """Return the time up to which the model claims the motion of two contacts."""
    if answer.mode_changes:
        return answer.mode_changes[0].time_s
    if answer.outcome is not Outcome.STABLE:
        assert answer.stopped_s is not None
        return answer.stopped_s
    return case.until


def row(name: str, case: Case, answer: Response, free: Simulated) -> list[str]:
    sign = 1.0 if answer.kind == "slumping" else -1.0
    here = free.time_s <= end_s(case, answer)
    assert answer.history is not None
    shown = answer.history.time_s <= end_s(case, answer)
    peak = float(answer.history.theta_rad[shown].max())
    simulated = float((sign * free.turned_rad)[here].max())
    angles = (case.alpha1, case.alpha3, case.beta, case.phi, case.back)
    return [
        name,
        ", ".join(f"{angle:g}" for angle in angles),
        f"{case.r3:g}",
        f"{peak:.6f}",
        f"{simulated:.6f}",
        f"{deviation(answer, free, end_s(case, answer), sign) / peak:.1e}",
    ]


def draw(drawn: list[tuple[str, Response, Simulated]], kind: str) -> None:
    figure = new_figure(width_in=8.0, height_in=5.2)
    for axes, (name, answer, free) in zip(figure.subplots(2, 2).flat, drawn, strict=True):
        sign = 1.0 if answer.kind == "slumping" else -1.0
        history = answer.history
        assert history is not None
        assert answer.started_s is not None
        assert answer.stopped_s is not None
        last = min(answer.stopped_s + 0.15, float(free.time_s[-1]))
        here = free.time_s <= last
        axes.plot(
            free.time_s[here], 1e3 * sign * free.turned_rad[here], color="#c44e52", lw=3.0,
            alpha=0.45, label="free block on springs",
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
