"""SUNDIALS CVODE with events through Python callbacks: the dissertation's method.

scikit-sundae comes with the extra `bench` alone; it is used where it is installed.
"""

from __future__ import annotations

import importlib
from importlib.util import find_spec
from typing import Any, Literal

from rbfrag.bench.cases import Case
from rbfrag.bench.event_driven import GRACE, Excursion, Problem, run_through
from rbfrag.bench.free_motion import Answer

PACKAGE = "sksundae"
INSTALL = "scikit-sundae"

Formula = Literal["Adams", "BDF"]

ATOL_PARTS = 1e-3
"""Absolute tolerance over (relative tolerance x critical angle)."""

MOST_STEPS = 1_000_000


def is_installed() -> bool:
    """Tell whether CVODE can be run here."""
    return find_spec(PACKAGE) is not None


def cvode_run(case: Case, rtol: float, formula: Formula = "Adams") -> Answer:
    """Run one case."""
    cvode = importlib.import_module(f"{PACKAGE}.cvode").CVODE
    return run_through(case, lambda problem, t: _excursion(cvode, problem, t, rtol, formula))


def _excursion(
    cvode: Any, problem: Problem, start: float, rtol: float, formula: Formula
) -> Excursion:
    acceleration, border = problem.acceleration, problem.border
    grace_s = start + GRACE * problem.dt

    def slope(t: float, y: Any, yp: Any) -> None:
        theta, rate = y.tolist()
        yp[0] = rate
        yp[1] = acceleration(t, theta)

    def events(t: float, y: Any, g: Any) -> None:
        theta, rate = y.tolist()
        g[0] = theta if t > grace_s else 1.0
        g[1] = theta - border
        g[2] = rate

    events.terminal = [True, True, False]  # type: ignore[attr-defined]
    events.direction = [-1, 1, -1]  # type: ignore[attr-defined]
    absolute = ATOL_PARTS * rtol * problem.theta_c
    solver = cvode(
        slope,
        method=formula,
        rtol=rtol,
        atol=[absolute, absolute * problem.p],
        eventsfn=events,
        num_events=3,
        max_num_steps=MOST_STEPS,
    )
    # A third time asks for output there alone: storing every step would slow CVODE down.
    end = problem.end_s
    solution = solver.solve([start, 0.5 * (start + end), end], [0.0, 0.0])
    if solution.status < 0:
        return Excursion("failed", start, 0.0, 0.0, ())
    ended, peaks = "record", []
    if solution.i_events is not None:
        for which, state in zip(solution.i_events, solution.y_events, strict=True):
            if which[2]:
                peaks.append(float(state[0]))
            if which[0]:
                ended = "re-seat"
            elif which[1]:
                ended = "toppled"
    return Excursion(
        ended, float(solution.t[-1]), float(solution.y[-1, 0]), float(solution.y[-1, 1]),
        tuple(peaks),
    )  # fmt: skip
