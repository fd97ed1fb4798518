"""scipy's solve_ivp with events."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rbfrag.bench.cases import Case
from rbfrag.bench.event_driven import GRACE, Excursion, Problem, peaks_of, run_through
from rbfrag.bench.free_motion import Answer

Vector = NDArray[np.float64]
Solver = Literal["RK45", "DOP853", "LSODA"]

ATOL_PARTS = 1e-3
"""Absolute tolerance over (relative tolerance x critical angle)."""


def solve_ivp_run(case: Case, solver: Solver, rtol: float) -> Answer:
    """Run one case."""
    return run_through(case, lambda problem, t: _excursion(problem, t, solver, rtol))


class _Event:
    """An event function with the attributes that scipy reads."""

    def __init__(self, problem: Problem, start: float, kind: str) -> None:
        self.kind, self.border = kind, problem.border
        self.grace_s = start + GRACE * problem.dt
        self.terminal = kind != "peak"
        self.direction = 1.0 if kind == "toppled" else -1.0

    def __call__(self, t: float, y: Vector) -> float:
        if self.kind == "peak":
            return float(y[1])
        if self.kind == "toppled":
            return float(y[0]) - self.border
        return float(y[0]) if t > self.grace_s else 1.0


def _excursion(problem: Problem, start: float, solver: Solver, rtol: float) -> Excursion:
    from scipy.integrate import solve_ivp

    acceleration = problem.acceleration
    absolute = ATOL_PARTS * rtol * problem.theta_c
    events = [_Event(problem, start, kind) for kind in ("re-seat", "toppled", "peak")]
    try:
        solution = solve_ivp(
            lambda t, y: (y[1], acceleration(t, y[0])),
            (start, problem.end_s),
            (0.0, 0.0),
            method=solver,
            rtol=rtol,
            atol=[absolute, absolute * problem.p],
            events=events,
        )
    except ValueError:  # its interpolant and its step disagree about the sign of an event
        return Excursion("failed", start, 0.0, 0.0, ())
    if solution.status < 0 or solution.t_events is None or solution.y_events is None:
        return Excursion("failed", start, 0.0, 0.0, ())
    ended = "record"
    if solution.status == 1:
        ended = "re-seat" if len(solution.t_events[0]) else "toppled"
    return Excursion(
        ended,
        float(solution.t[-1]),
        float(solution.y[0, -1]),
        float(solution.y[1, -1]),
        peaks_of(solution.y_events[2]),
    )
