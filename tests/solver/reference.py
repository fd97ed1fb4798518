"""An independent integrator of the toppling block, to judge rbfrag's by.

scipy's DOP853 at rtol 1e-12 on (theta, theta'), restarted at every sample and every event.
It shares nothing with rbfrag.solver: sines and cosines are called, steps are the method's
own, events are located by integrating anew to each trial time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

FloatArray = NDArray[np.float64]
Vector = NDArray[np.float64]

RTOL = 1e-12
ATOL = 1e-17
TIME_XTOL = 1e-15


@dataclass(frozen=True)
class ReferenceRun:
    """End of a run; the peak is None where the block topples."""

    outcome: str
    peak_rad: float | None
    intervals_moved: int
    started_s: float | None


class _Interval:
    """The equation of motion inside one interval, time counted from its start."""

    def __init__(
        self, p2: float, theta_c: float, linear: bool, h: float, k: Vector, w: Vector
    ) -> None:
        self.p2, self.theta_c, self.linear, self.h = p2, theta_c, linear, h
        self.k, self.w = k, w
        self.dk, self.dw = (k[1] - k[0]) / h, (w[1] - w[0]) / h

    def slope(self, t: float, y: Vector) -> Vector:
        k, w = self.k[0] + self.dk * t, self.w[0] + self.dw * t
        x = self.theta_c - y[0]
        excited = k - w * x if self.linear else k * math.cos(x) - w * math.sin(x)
        return np.array([y[1], self.p2 * excited])

    def steps(self, t: float, y: Vector, end: float) -> list[tuple[float, Vector]]:
        """Points that the method itself lands on, the start left out."""
        solver = DOP853(self.slope, t, y, end, rtol=RTOL, atol=ATOL, first_step=end - t)
        points = []
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                raise RuntimeError(f"the reference integrator failed at {t}")
            points.append((solver.t, solver.y.copy()))
        return points

    def at(self, t: float, y: Vector, end: float) -> Vector:
        return self.steps(t, y, end)[-1][1] if end > t else y

    def root(
        self, t: float, y: Vector, low: float, high: float, component: int
    ) -> tuple[float, Vector]:
        """Time in [low, high] at which a component vanishes, motion starting at (t, y)."""

        def f(s: float) -> float:
            return float(self.at(t, y, s)[component])

        if f(high) == 0.0:
            return high, self.at(t, y, high)
        s = brentq(f, low, high, xtol=TIME_XTOL * max(1.0, self.h), rtol=1e-15)
        return s, self.at(t, y, s)


def integrate(
    time_s: ArrayLike,
    k_h: ArrayLike,
    k_v: ArrayLike | None,
    *,
    p2: float,
    kr: float,
    linear: bool = False,
) -> ReferenceRun:
    """Run a block over nodes (time, k_h, k_v); repeated times are jumps.

    Args:
        time_s: node times [s].
        k_h: driving acceleration [g].
        k_v: vertical acceleration [g], or None.
        p2: frequency parameter [1/s²].
        kr: rocking acceleration coefficient (linear: critical angle).
        linear: the linear model.
    """
    time = np.asarray(time_s, dtype=float)
    k = np.asarray(k_h, dtype=float)
    w = np.ones_like(k) if k_v is None else 1.0 + np.asarray(k_v, dtype=float)
    if np.any(w <= 0.0):
        return ReferenceRun("jump", None, 0, None)
    theta_c = kr if linear else math.atan(kr)
    least_q = np.minimum(np.minimum.accumulate((k / w)[::-1])[::-1], 0.0)
    y: Vector | None = None
    peak = 0.0
    moved = 0
    started: float | None = None

    def note(angle: float) -> None:
        nonlocal peak
        peak = max(peak, angle)

    for i in range(time.size - 1):
        h = time[i + 1] - time[i]
        if h == 0.0:
            continue
        g = (k[i] - w[i] * kr, k[i + 1] - w[i + 1] * kr)
        if y is None and g[0] <= 0.0 and g[1] <= 0.0:
            continue
        moved += 1
        motion = _Interval(p2, theta_c, linear, h, k[i : i + 2], w[i : i + 2])
        t = 0.0
        if y is None and g[0] <= 0.0:
            t = h * -g[0] / (g[1] - g[0])
        if y is None:
            y = np.zeros(2)
            started = time[i] + t if started is None else started
        # x is counted through, never wrapped: past 90 degrees the tangent alone would turn
        border = least_q[i] if linear else math.atan(least_q[i])
        while y is not None and t < h:
            y, t, past = _to_event(motion, t, y, border, note)
            if past:
                return ReferenceRun("toppled", None, moved, started)
            if y is None and t < h:  # had an impact at t
                now = g[0] + (g[1] - g[0]) * t / h
                if now <= 0.0:
                    if g[1] <= 0.0:
                        break
                    t = max(t, h * -g[0] / (g[1] - g[0]))
                y = np.zeros(2)
        border = least_q[i + 1] if linear else math.atan(least_q[i + 1])
        if y is not None and y[1] > 0.0 and theta_c - y[0] < border:
            return ReferenceRun("toppled", None, moved, started)
    if y is None:
        return ReferenceRun("stable", peak, moved, started)
    return _after_the_record(y, p2, theta_c, linear, peak, moved, started)


def _to_event(
    motion: _Interval, t: float, y: Vector, border: float, note: Callable[[float], None]
) -> tuple[Vector | None, float, bool]:
    """Integrate to the next event: (state, None when had an impact; time; irrecoverable?)."""
    for point_t, point_y in motion.steps(t, y, motion.h):
        turns = _turning_points(motion, t, y, point_t, point_y)
        for end_t, end_y in [*turns, (point_t, point_y)]:
            if end_y[0] > y[0]:
                if end_t < point_t:
                    note(float(end_y[0]))
            elif end_y[0] <= 0.0:
                if y[0] <= 0.0:
                    return None, end_t, False
                return None, motion.root(t, y, t, end_t, 0)[0], False
            t, y = end_t, end_y
        if y[1] > 0.0 and motion.theta_c - y[0] < border:
            return y, t, True
    return y, motion.h, False


def _turning_points(
    motion: _Interval, t: float, y: Vector, end_t: float, end_y: Vector
) -> list[tuple[float, Vector]]:
    """Where theta' changes sign inside one step, found by looking at many places."""
    greatest = max(abs(motion.slope(t, y)[1]), abs(motion.slope(end_t, end_y)[1]))
    if min(abs(y[1]), abs(end_y[1])) > 2.0 * greatest * (end_t - t) and y[1] * end_y[1] > 0.0:
        return []
    parts = np.arange(1, 17) / 16.0
    if y[1] == 0.0:  # the first excursion after a start from rest may be very short
        parts = np.concatenate([0.5 ** np.arange(36, 4, -1), parts])
    turns = []
    before_t, before = t, float(y[1])
    for s in t + parts * (end_t - t):
        now = float(motion.at(t, y, s)[1])
        if before * now < 0.0:
            turns.append(motion.root(t, y, before_t, s, 1))
        if now != 0.0:
            before_t, before = s, now
    return turns


def _after_the_record(
    y: Vector,
    p2: float,
    theta_c: float,
    linear: bool,
    peak: float,
    moved: int,
    started: float | None,
) -> ReferenceRun:
    """Free motion with the ground at rest: the energy above the upright position decides."""
    x, rate = theta_c - float(y[0]), float(y[1])
    potential = 0.5 * p2 * x * x if linear else 2.0 * p2 * math.sin(0.5 * x) ** 2
    energy = 0.5 * rate * rate - potential
    topples = (rate > 0.0 and energy > 0.0) if x > 0.0 else not (rate < 0.0 and energy > 0.0)
    if topples:
        return ReferenceRun("toppled", None, moved, started)
    if rate > 0.0:
        remaining = -2.0 * energy / p2  # = x_top² or 4 sin²(x_top/2)
        x_top = math.sqrt(remaining) if linear else 2.0 * math.asin(0.5 * math.sqrt(remaining))
        peak = max(peak, theta_c - x_top)
    return ReferenceRun("stable", peak, moved, started)
