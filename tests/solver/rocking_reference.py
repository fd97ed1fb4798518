"""An independent integrator of the free-standing block, to judge rbfrag's by.

scipy's DOP853 at rtol 1e-12 on (theta, theta'), restarted at every sample, lift-off, turn and
impact. It shares nothing with rbfrag.solver: geometry, restitution and rest come from the formulas
of Housner (1963) and of docs/theory/rocking.md, events are located by integrating anew to each
trial time, and the free motion after the record is integrated, not taken from its energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

G = 9.80665
RTOL, ATOL = 1e-12, 1e-16
PAST_BALANCE = 1.4
IMPACTS_AFTER = 3

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class FreeStandingBlock:
    """A parallelogram on its base; sides: 1 the toe, -1 the heel."""

    c: dict[int, float]
    p2: dict[int, float]
    e: dict[int, float]

    @property
    def rest_speed(self) -> float:
        return 1e-6 * math.sqrt(min(self.p2.values())) * min(self.c.values())


def parallelogram(
    a1_deg: float, a3_deg: float, r3_m: float, beta_deg: float, restitution: float | None
) -> FreeStandingBlock:
    a1, a3, beta = (math.radians(angle) for angle in (a1_deg, a3_deg, beta_deg))
    r1_m = r3_m * math.cos(a3) / math.cos(a1)
    expected = (r1_m**2 + r3_m**2) / 6.0
    about = {1: expected + r3_m**2, -1: expected + r1_m**2}
    retained = expected + r1_m * r3_m * math.cos(a3 - a1)
    return FreeStandingBlock(
        c={1: a3 - beta, -1: beta - a1},
        p2={1: G * r3_m / about[1], -1: G * r1_m / about[-1]},
        e={
            side: retained / about[-side] if restitution is None else restitution
            for side in (1, -1)
        },
    )


@dataclass(frozen=True)
class ReferenceRocking:
    """End of a run: sense of overturning (0: none), peaks by side [rad], impact times [s]."""

    toppled: int
    peak: dict[int, float]
    impact_s: list[float]
    impacts_to_peak: int


class _Arc:
    """Motion about one corner inside one interval, time counted from its start."""

    def __init__(
        self, block: FreeStandingBlock, side: int, h: float, k: ArrayLike, w: ArrayLike
    ) -> None:
        (k0, k1), (w0, w1) = np.asarray(k), np.asarray(w)
        self.k0, self.dk, self.w0, self.dw = side * k0, side * (k1 - k0) / h, w0, (w1 - w0) / h
        self.c, self.p2 = block.c[side], block.p2[side]

    def slope(self, t: float, y: Vector) -> Vector:
        x = self.c - y[0]
        excited = (self.k0 + self.dk * t) * math.cos(x) - (self.w0 + self.dw * t) * math.sin(x)
        return np.array([y[1], self.p2 * excited])

    def to(self, t: float, y: Vector, end: float) -> Vector:
        if end <= t:
            return y
        solver = DOP853(self.slope, t, y, end, rtol=RTOL, atol=ATOL, first_step=end - t)
        while solver.status == "running":
            solver.step()
        return solver.y

    def root(self, t: float, y: Vector, low: float, high: float, component: int) -> float:
        return float(brentq(lambda s: self.to(t, y, s)[component], low, high, xtol=1e-16))


class _Run:
    def __init__(self, block: FreeStandingBlock) -> None:
        self.block = block
        self.side = 0
        self.y = np.zeros(2)
        self.peak = {1: 0.0, -1: 0.0}
        self.impact_s: list[float] = []
        self.ratio, self.impacts_to_peak = 0.0, 0

    def note(self, theta: float) -> None:
        self.peak[self.side] = max(self.peak[self.side], theta)
        ratio = theta / self.block.c[self.side]
        if ratio > self.ratio:
            self.ratio, self.impacts_to_peak = ratio, len(self.impact_s)

    def cross(self, start_s: float, h: float, k: ArrayLike, w: ArrayLike) -> bool:
        """Go to the end of an interval; whether the block lies overturned there."""
        t = 0.0
        while t < h:
            if self.side == 0:
                t = self._rest(t, h, np.asarray(k), np.asarray(w))
                if self.side == 0:
                    return False
            t = self._arc(start_s, t, h, _Arc(self.block, self.side, h, k, w))
            if self.side and self.y[0] > self.block.c[self.side] + PAST_BALANCE:
                return True
        return False

    def _rest(self, t: float, h: float, k: Vector, w: Vector) -> float:
        first = math.inf
        for side in (1, -1):
            g = side * k - w * math.tan(self.block.c[side])
            now = g[0] + (g[1] - g[0]) * t / h
            at = t if now > 0.0 else h * -g[0] / (g[1] - g[0]) if g[1] > 0.0 else math.inf
            if at < first:
                first, self.side = at, side
        self.y = np.zeros(2)
        return first

    def _arc(self, start_s: float, t: float, h: float, arc: _Arc) -> float:
        """Go on to the next impact or the end; return when."""
        last = arc.to(t, self.y, h)
        greatest = max(abs(arc.slope(t, self.y)[1]), abs(arc.slope(h, last)[1]))
        # without a turn on the way, its end tells whether it comes down
        slowest = min(abs(self.y[1]), abs(last[1]))
        if self.y[1] * last[1] > 0.0 and slowest > 2.0 * greatest * (h - t) and last[0] > 0.0:
            self.y = last
            return h
        # turns are looked for between many places: an arc may be far shorter than an interval
        positions = t + (h - t) * np.concatenate(
            [0.5 ** np.arange(30, 3, -1), np.arange(1, 13) / 12]
        )
        before_t, before = t, self.y
        for s in positions:
            local = arc.to(before_t, before, s)
            if before[1] > 0.0 > local[1] or (before[1] == 0.0 > local[1] and before[0] > 0.0):
                turn = arc.root(before_t, before, before_t, s, 1) if before[1] else before_t
                top = arc.to(before_t, before, turn)
                if top[0] > 0.0:
                    self.note(float(top[0]))
                    if local[0] <= 0.0:
                        return self._hit(start_s, *self._landing(arc, turn, top, s))
            if local[0] <= 0.0 and local[1] < 0.0:
                if before[0] <= 0.0:
                    return self._hit(start_s, s, local)
                return self._hit(start_s, *self._landing(arc, before_t, before, s))
            before_t, before = s, local
        self.y = before
        return h

    @staticmethod
    def _landing(arc: _Arc, t: float, y: Vector, by: float) -> tuple[float, Vector]:
        at = arc.root(t, y, t, by, 0)
        return at, arc.to(t, y, at)

    def _hit(self, start_s: float, t: float, y: Vector) -> float:
        self.impact_s.append(start_s + t)
        speed = -y[1] * self.block.e[self.side]
        self.side = -self.side if speed >= self.block.rest_speed else 0
        self.y = np.array([0.0, speed if self.side else 0.0])
        return t


def integrate(
    time_s: ArrayLike,
    k_h: ArrayLike,
    w: ArrayLike,
    block: FreeStandingBlock,
    *,
    most_impacts: int = 10**9,
) -> ReferenceRocking:
    """Run a block over nodes (time, k_h, 1 + k_v) and the rest after them.

    Args:
        time_s: node times [s], each once.
        k_h: driving acceleration [g].
        w: 1 + k_v, above 0.
        block: the block.
        most_impacts: impacts after which nothing more is of interest.
    """
    time, k, up = np.asarray(time_s), np.asarray(k_h), np.asarray(w)
    limits = {side: math.tan(block.c[side]) for side in (1, -1)}
    run = _Run(block)

    def end(toppled: int) -> ReferenceRocking:
        return ReferenceRocking(toppled, run.peak, run.impact_s, run.impacts_to_peak)

    for i in range(time.size - 1):
        ends = slice(i, i + 2)
        if run.side == 0 and all((s * k[ends] <= up[ends] * limits[s]).all() for s in (1, -1)):
            continue
        if run.cross(time[i], time[i + 1] - time[i], k[ends], up[ends]):
            return end(run.side)
        if len(run.impact_s) > most_impacts:
            return end(0)
    before, start_s, step_s = len(run.impact_s), time[-1], 0.1 / math.sqrt(max(block.p2.values()))
    while run.side and len(run.impact_s) < before + IMPACTS_AFTER:
        if run.cross(start_s, step_s, (0.0, 0.0), (1.0, 1.0)):
            return end(run.side)
        start_s += step_s
    return end(0)
