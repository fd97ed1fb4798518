"""SUNDIALS' CVODE with Python callbacks, the dissertation's method, on the cases of `rbfrag bench`.

scikit-sundae comes with the extra `bench` alone and is used where it is installed.
"""

from __future__ import annotations

import importlib
from importlib.util import find_spec
from typing import Any

from rbfrag.bench.peers import (
    ATOL_PARTS,
    GRACE,
    BenchCase,
    PeerAnswer,
    PeerExcursion,
    PeerProblem,
    run_through,
)

CVODE_PACKAGE = "sksundae"
CVODE_INSTALL = "scikit-sundae"

MOST_STEPS = 1_000_000
"""Of CVODE in one excursion."""


def cvode_is_installed() -> bool:
    """Return whether CVODE is available."""
    return find_spec(CVODE_PACKAGE) is not None


def cvode_run(case: BenchCase, rtol: float) -> PeerAnswer:
    """Run one case with CVODE."""
    cvode = importlib.import_module(f"{CVODE_PACKAGE}.cvode").CVODE
    return run_through(case, lambda problem, t: _cvode_excursion(cvode, problem, t, rtol))


def _cvode_excursion(cvode: Any, problem: PeerProblem, start: float, rtol: float) -> PeerExcursion:
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
        slope, method="Adams", rtol=rtol, atol=[absolute, absolute * problem.p], eventsfn=events,
        num_events=3, max_num_steps=MOST_STEPS,
    )  # fmt: skip
    # A third time asks for output there alone: storing every step would slow CVODE down.
    end = problem.end_s
    solution = solver.solve([start, 0.5 * (start + end), end], [0.0, 0.0])
    if solution.status < 0:
        return PeerExcursion("failed", start, 0.0, 0.0, ())
    ended, peaks = "record", []
    if solution.i_events is not None:
        for which, state in zip(solution.i_events, solution.y_events, strict=True):
            if which[2]:
                peaks.append(float(state[0]))
            if which[0]:
                ended = "impact"
            elif which[1]:
                ended = "toppled"
    return PeerExcursion(
        ended, float(solution.t[-1]), float(solution.y[-1, 0]), float(solution.y[-1, 1]),
        tuple(peaks),
    )  # fmt: skip
