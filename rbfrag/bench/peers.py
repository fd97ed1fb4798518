"""Cases of the benchmark and the methods on them: forward Euler, and scipy's solve_ivp.

A case is a recorded motion with a block from a seeded random choice. A general ODE solver is
started at a lift-off and stopped at the impact (theta falls through zero) or where toppling is
inevitable; the peak (theta' falls through zero) is recorded on the way. Rest between excursions is
skipped by arithmetic, the motion after the record is determined in closed form: solvers do not have
to do anything that rbfrag's kernel does not do either.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from rbfrag.motions.sample_motions import reversal_pulse, sample_folder
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.results import DEFAULT_P2, POLARITIES, FloatArray, Polarity

STRENGTHS = (0.03, 0.95)
"""Range of k_r/PGA that blocks are drawn from, evenly in the logarithm."""


@dataclass(frozen=True, eq=False)
class Records:
    """Motions to measure on, and a sentence on their origin."""

    motions: tuple[GroundMotion, ...]
    source: str


@dataclass(frozen=True, eq=False)
class BenchCase:
    """One block under one motion; no vertical motion, equally spaced samples."""

    motion: GroundMotion
    polarity: Polarity
    excitation: Excitation
    p2: float
    kr: float


def find_records(path: str | os.PathLike[str] | None = None) -> Records:
    """Return the horizontal motions to measure on.

    Args:
        path: accelerogram file or folder; None for the sample records of rbfrag[samples], or
            analytic pulses where these are not installed.
    """
    if path is not None:
        if not Path(path).exists():
            raise InputError(f"no folder {path}: give a folder with records", fields=("records",))
        motions = _read(Path(path))
        if not motions:
            raise InputError(f"no horizontal accelerogram in {path}: give another folder")
        return Records(motions, f"{len(motions)} horizontal records")
    samples = sample_folder()
    if samples is not None:
        motions = _read(samples)
        return Records(motions, f"{len(motions)} sample records of rbfrag[samples]")
    pulses = tuple(
        reversal_pulse(0.4, ratio, period_s, 0.005)
        for period_s in (0.2, 0.5, 1.0, 2.0)
        for ratio in (0.35, 0.65, 1.0)
    )
    return Records(pulses, f"{len(pulses)} analytic pulses (no records are installed)")


def _read(root: Path) -> tuple[GroundMotion, ...]:
    """Read all readable files, each accelerogram once, in an order that never changes."""
    files = sorted(p for p in root.rglob("*") if p.is_file()) if root.is_dir() else [root]
    by_samples: dict[str, GroundMotion] = {}
    for file in files:
        try:
            motions = read_motions(file)
        except (MotionFileError, InputError):
            continue  # manifests, read-mes and formats without a reader lie next to the records
        for motion in motions:
            is_valid = motion.is_vertical is not True and motion.npts > 1
            if is_valid and motion.node_time_s is None and motion.acceleration_g.any():
                by_samples.setdefault(motion.sha256, motion)
    return tuple(by_samples.values())


def choose_cases(records: Records, number: int, *, seed: int = 1) -> tuple[BenchCase, ...]:
    """Draw blocks that lift off: motions in turn, polarity, p² and k_r/PGA at random.

    Args:
        records: motions to draw from.
        number: number of cases.
        seed: the same seed draws the same cases.
    """
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(records.motions))
    cases: list[BenchCase] = []
    for turn in range(50 * number):
        if len(cases) == number:
            break
        motion = records.motions[order[turn % order.size]]
        polarity = POLARITIES[int(rng.integers(2))]
        p2 = float(rng.choice(DEFAULT_P2))
        low, high = np.log(STRENGTHS)
        excited = excitation(motion, None, polarity)
        kr = float(np.exp(rng.uniform(low, high))) * excited.pga_g
        if excited.max_q > kr:
            cases.append(BenchCase(motion, polarity, excited, p2, kr))
    if not cases:
        raise InputError("no drawn block lifts off under these records: give other records")
    return tuple(cases)


Real = float | np.longdouble
Solver = Literal["RK45", "DOP853", "LSODA"]

STABLE, TOPPLED = "stable", "toppled"

MOST_EXCURSIONS = 100_000

GRACE = 1e-3
"""Part of an interval after a start without search for an impact: theta is zero there."""

ATOL_PARTS = 1e-3
"""Absolute tolerance over (relative tolerance x critical angle)."""


class PeerAnswer(NamedTuple):
    """Outcome and peak rotation [rad]; the peak is NaN unless the block remains stable."""

    outcome: str
    peak_rad: float


def free_motion(theta: Real, rate: Real, p: Real, theta_c: Real, peak: Real) -> PeerAnswer:
    """Determine by energy the outcome of a moving block after the end of the ground motion.

    Args:
        theta: rotation at the end of the record [rad].
        rate: rotation rate [rad/s].
        p: frequency parameter [1/s].
        theta_c: critical angle [rad].
        peak: maximum rotation so far [rad].
    """
    x, v = theta_c - theta, rate / p
    half = 2 * np.sin(np.abs(x) / 2)
    if v > half if x > 0 else v > -half:
        return PeerAnswer(TOPPLED, math.nan)
    if v > 0:
        top = theta_c - 2 * np.arcsin(np.sqrt((half - v) * (half + v)) / 2)
        peak = max(peak, top)
    return PeerAnswer(STABLE, float(peak))


def euler(case: BenchCase, parts: int) -> PeerAnswer:
    """Run one case with `parts` Euler steps per sampling interval."""
    excited = case.excitation
    p, theta_c = math.sqrt(case.p2), math.atan(case.kr)
    border = math.atan(min(float(excited.q.min()), 0.0))
    topples, theta, rate, peak = _march(
        excited.k_h, float(excited.interval_s[0]), case.kr, case.p2, theta_c, border, parts
    )
    if topples:
        return PeerAnswer(TOPPLED, math.nan)
    if theta <= 0.0 and rate <= 0.0:
        return PeerAnswer(STABLE, peak)
    return free_motion(theta, rate, p, theta_c, peak)


@kernel
def _march(
    k_h: FloatArray, dt: float, kr: float, p2: float, theta_c: float, border: float, parts: int
) -> tuple[bool, float, float, float]:
    theta = 0.0
    rate = 0.0
    peak = 0.0
    h = dt / parts
    for i in range(k_h.size - 1):
        for j in range(parts):
            k = k_h[i] + (k_h[i + 1] - k_h[i]) * j / parts
            if theta <= 0.0 and rate <= 0.0 and k <= kr:
                continue
            x = theta_c - theta
            slope = p2 * (k * math.cos(x) - math.sin(x))
            theta += h * rate
            rate += h * slope
            if theta < 0.0 or (theta == 0.0 and rate <= 0.0):
                theta = 0.0
                rate = 0.0
            elif theta > peak:
                peak = theta
            if rate > 0.0 and theta_c - theta < border:
                return True, theta, rate, peak
    return False, theta, rate, peak


class PeerExcursion(NamedTuple):
    """End of one excursion: time [s], (theta, theta') and peaks on the way."""

    ended: str
    time_s: float
    theta: float
    rate: float
    peaks: tuple[float, ...]


class PeerProblem:
    """One case as scalar Python functions, optimised for speed."""

    def __init__(self, case: BenchCase) -> None:
        self.k: list[float] = case.excitation.k_h.tolist()
        self.dt = float(case.excitation.interval_s[0])
        self.end_s = self.dt * (len(self.k) - 1)
        self.p2, self.kr, self.p = case.p2, case.kr, math.sqrt(case.p2)
        self.theta_c = math.atan(case.kr)
        # Below this angle to balance nothing in the record brings the block back.
        self.border = self.theta_c - math.atan(min(float(case.excitation.q.min()), 0.0))
        self._lifts = np.flatnonzero(case.excitation.k_h > case.kr)
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
        """Return the first time from t [s] on at which the threshold is exceeded."""
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


def run_through(
    case: BenchCase, excursion: Callable[[PeerProblem, float], PeerExcursion]
) -> PeerAnswer:
    """Run a case, excursion by excursion."""
    problem = PeerProblem(case)
    t: float | None = problem.next_lift(0.0)
    peak = 0.0
    for _ in range(MOST_EXCURSIONS):
        if t is None or t >= problem.end_s:
            return PeerAnswer(STABLE, peak)
        result = excursion(problem, t)
        peak = max(peak, *result.peaks, 0.0)
        if result.ended == "toppled":
            return PeerAnswer(TOPPLED, math.nan)
        if result.ended == "record":
            if result.theta <= 0.0 and result.rate <= 0.0:
                return PeerAnswer(STABLE, peak)
            return free_motion(result.theta, result.rate, problem.p, problem.theta_c, peak)
        if result.ended == "failed":
            return PeerAnswer("failed", math.nan)
        # an impact found where it started would be found again for ever
        t = problem.next_lift(max(result.time_s, t + GRACE * problem.dt))
    return PeerAnswer("failed", math.nan)


def scipy_run(case: BenchCase, solver: Solver, rtol: float) -> PeerAnswer:
    """Run one case with a method of scipy."""
    return run_through(case, lambda problem, t: _scipy_excursion(problem, t, solver, rtol))


class _Event:
    """An event function with the attributes required by scipy."""

    def __init__(self, problem: PeerProblem, start: float, kind: str) -> None:
        self.kind, self.border = kind, problem.border
        self.grace_s = start + GRACE * problem.dt
        self.terminal = kind != "peak"
        self.direction = 1.0 if kind == "toppled" else -1.0

    def __call__(self, t: float, y: FloatArray) -> float:
        if self.kind == "peak":
            return float(y[1])
        if self.kind == "toppled":
            return float(y[0]) - self.border
        return float(y[0]) if t > self.grace_s else 1.0


def _scipy_excursion(
    problem: PeerProblem, start: float, solver: Solver, rtol: float
) -> PeerExcursion:
    from scipy.integrate import solve_ivp

    acceleration = problem.acceleration
    absolute = ATOL_PARTS * rtol * problem.theta_c
    events = [_Event(problem, start, kind) for kind in ("impact", "toppled", "peak")]
    try:
        solution = solve_ivp(
            lambda t, y: (y[1], acceleration(t, y[0])), (start, problem.end_s), (0.0, 0.0),
            method=solver, rtol=rtol, atol=[absolute, absolute * problem.p], events=events,
        )  # fmt: skip
    except ValueError:  # its interpolant and its step disagree about the sign of an event
        return PeerExcursion("failed", start, 0.0, 0.0, ())
    if solution.status < 0 or solution.t_events is None or solution.y_events is None:
        return PeerExcursion("failed", start, 0.0, 0.0, ())
    ended = "record"
    if solution.status == 1:
        ended = "impact" if len(solution.t_events[0]) else "toppled"
    theta, rate = solution.y[:, -1].tolist()
    peaks = tuple(float(state[0]) for state in solution.y_events[2])
    return PeerExcursion(ended, float(solution.t[-1]), theta, rate, peaks)
