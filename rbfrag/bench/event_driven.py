"""What general ODE solvers with event location need: equation, events, and the loop over them.

The solver is started at a lift-off and stopped at the re-seat (theta falls through zero) or
where toppling is inevitable; the peak (theta' falls through zero) is recorded on the way.
Rest between excursions is skipped by arithmetic, the motion after the record is decided in
closed form: solvers are asked for nothing that rbfrag's own kernel does not do either.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.bench.cases import Case
from rbfrag.bench.free_motion import STABLE, TOPPLED, Answer, free_motion

MOST_EXCURSIONS = 100_000

GRACE = 1e-3
"""Part of an interval after a start in which no re-seat is looked for: theta is zero there."""


class Excursion(NamedTuple):
    """How one excursion ended: at time [s], with (theta, theta'), peaks on the way."""

    ended: str
    time_s: float
    theta: float
    rate: float
    peaks: tuple[float, ...]


class Problem:
    """One case as scalar Python functions, made as cheap as plain Python allows."""

    def __init__(self, case: Case) -> None:
        self.k: list[float] = case.drive.k_h.tolist()
        self.dt = float(case.drive.interval_s[0])
        self.end_s = self.dt * (len(self.k) - 1)
        self.p2, self.kr, self.p = case.p2, case.kr, math.sqrt(case.p2)
        self.theta_c = math.atan(case.kr)
        # Below this angle to balance nothing in the record brings the block back.
        self.border = self.theta_c - math.atan(min(float(case.drive.q.min()), 0.0))
        self._lifts = np.flatnonzero(case.drive.k_h > case.kr)
        k, inverse, last = self.k, 1.0 / self.dt, len(self.k) - 2
        p2, theta_c, sin, cos = self.p2, self.theta_c, math.sin, math.cos

        def acceleration(t: float, theta: float) -> float:
            position = t * inverse
            i = int(position)
            if i > last:
                i = last
            a = k[i]
            x = theta_c - theta
            slope: float = p2 * ((a + (k[i + 1] - a) * (position - i)) * cos(x) - sin(x))
            return slope

        self.acceleration: Callable[[float, float], float] = acceleration

    def next_lift(self, t: float) -> float | None:
        """First time from t [s] on at which the threshold is exceeded."""
        i = min(int(t / self.dt), len(self.k) - 2)
        now = self.k[i] + (self.k[i + 1] - self.k[i]) * (t / self.dt - i)
        if now > self.kr:
            return t
        later = self._lifts[np.searchsorted(self._lifts, i + 1) :]
        if not later.size or t >= self.end_s:
            return None
        j = int(later[0])
        low, high = self.k[j - 1], self.k[j]
        return max(t, self.dt * (j - 1 + (self.kr - low) / (high - low)))


def run_through(case: Case, excursion: Callable[[Problem, float], Excursion]) -> Answer:
    """Run a case, one excursion after the other."""
    problem = Problem(case)
    t: float | None = problem.next_lift(0.0)
    peak = 0.0
    for _ in range(MOST_EXCURSIONS):
        if t is None or t >= problem.end_s:
            return Answer(STABLE, peak)
        done = excursion(problem, t)
        peak = max(peak, *done.peaks, 0.0)
        if done.ended == "toppled":
            return Answer(TOPPLED, math.nan)
        if done.ended == "record":
            if done.theta <= 0.0 and done.rate <= 0.0:
                return Answer(STABLE, peak)
            return free_motion(done.theta, done.rate, problem.p, problem.theta_c, peak)
        if done.ended == "failed":
            return Answer("failed", math.nan)
        # a re-seat found where it started would be found again for ever
        t = problem.next_lift(max(done.time_s, t + GRACE * problem.dt))
    return Answer("failed", math.nan)


def peaks_of(states: NDArray[np.float64] | list[list[float]]) -> tuple[float, ...]:
    """Return the rotations of recorded peak states, shape (n, 2)."""
    return tuple(float(state[0]) for state in states)
