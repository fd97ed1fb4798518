"""One toppling block in ball arithmetic: the outcome that is said is proven.

Every number is a ball (python-flint's `arb`): a midpoint and a radius that holds all rounding.
Samples, intervals, p² and k_r are taken as the exact rationals that the doubles are. On each
interval the excitation is a straight line, and the solution is expanded in a Taylor series whose
remainder is the next coefficient, bounded over the whole step (Lagrange; R. E. Moore, Interval
Analysis, 1966) by the recurrence of the coefficients with all terms positive. Nothing is shared
with rbfrag.solver but the arrays of the excitation.

Events. *Start*: k_h = w k_r is linear in time, its root a rational number. *Impact*: the rotation
is positive on all of a step, or falls through zero inside a ball of time; the run goes on from
there for every time in that ball. *No impact* is needed while k_h >= w k_r after a start (lemma
"lift" of docs/theory/critical.md), so that the first instants, in which the rotation is too small
to be told from zero, need no test. *Past recovery*: theta' > 0, 0 > phi > -90°, and tan phi is
less than every later q, rest included. Then theta'' = p² w cos(phi) (q - tan phi) > 0 until
phi = -90°: the block does not come back. *After the record* (k_h = 0, w = 1) energy decides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from flint import arb, arb_poly, ctx, fmpq
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation

FloatArray = NDArray[np.float64]

BITS = (192, 384, 768)
"""Precisions tried in turn until the outcome is enclosed."""

PH_MAX = 0.25
"""Greatest p·h of one step."""

MOST_DEGREE = 120

HALVINGS = 400
"""Times a part of a step is halved in search of an impact, before it is said to be a touch."""

TOPPLED, STABLE, NOT_ENCLOSED = "toppled", "stable", "not enclosed"


class NotEnclosedError(ArithmeticError):
    """A comparison that the balls do not decide."""


@dataclass(frozen=True)
class Enclosure:
    """What is proven of one run.

    Args:
        outcome: ``toppled``, ``stable`` or ``not enclosed``.
        reason: what the balls did not decide, where nothing is enclosed.
        decided_by: event that decides: ``past recovery``, ``last impact``, ``energy`` or ``rest``.
        decided_s: time of that event [s].
        width: width of the enclosure of what decides: of the rotation [rad] for ``past recovery``
            and ``energy``, of the time [s] for ``last impact``; zero where the block never starts.
        impacts_s: times of all impacts [s], each with the width of its enclosure.
        steps: Taylor steps taken.
        bits: precision that was needed.
    """

    outcome: str
    reason: str = ""
    decided_by: str = ""
    decided_s: float = math.nan
    width: float = math.nan
    impacts_s: tuple[tuple[float, float], ...] = ()
    steps: int = 0
    bits: int = 0


def enclose(
    excited: Excitation, *, p2: float, kr: float, bits: tuple[int, ...] = BITS
) -> Enclosure:
    """Run one block over one excitation and say what is proven of it.

    Args:
        excited: the excitation, with 1 + k_v > 0 throughout.
        p2: frequency parameter p² [1/s²], taken as exact.
        kr: rocking acceleration coefficient, taken as exact, > 0.
        bits: precisions to try in turn.

    Raises:
        ValueError: 1 + k_v <= 0 somewhere, or a k_r or p² that is not positive.
    """
    if not (kr > 0.0 and p2 > 0.0):
        raise ValueError(f"k_r = {kr!r} and p2 = {p2!r} must be positive")
    if not (excited.w > 0.0).all():
        raise ValueError("1 + k_v must be positive throughout")
    reason = ""
    for precision in bits:
        with ctx.workprec(precision):
            try:
                return _enclosed(Block(excited, p2, exact(kr)))
            except NotEnclosedError as error:
                reason = str(error)
    return Enclosure(NOT_ENCLOSED, reason=reason, bits=bits[-1])


def _enclosed(block: Block) -> Enclosure:
    """Follow excursion after excursion."""
    times = block.excited.time_s
    impacts: list[tuple[float, float]] = []
    place: Place | None = Place(0, arb(0))
    while (place := block.next_start(place)) is not None:
        trajectory = block.integrate(place, arb(0), arb(0), lifted=True)
        place = trajectory.place
        at_s = float(times[place.interval]) + float(place.at.mid())
        if trajectory.event == IMPACT:
            impacts.append((at_s, width(place.at)))
            continue
        outcome = STABLE if trajectory.event == RETURNS else TOPPLED
        event = "past recovery" if trajectory.event == LOST else "energy"
        return Enclosure(
            outcome, "", event, at_s, width(trajectory.theta), tuple(impacts), block.steps, ctx.prec
        )
    if not impacts:
        return Enclosure(STABLE, "", "rest", float(times[-1]), 0.0, (), block.steps, ctx.prec)
    time_s, width_s = impacts[-1]
    return Enclosure(
        STABLE, "", "last impact", time_s, width_s, tuple(impacts), block.steps, ctx.prec
    )


def least_later_q(excited: Excitation) -> FloatArray:
    """A number below every q from each node to the end, and not above 0; shape (n,)."""
    below = np.minimum(np.nextafter(excited.k_h / excited.w, -np.inf), 0.0)
    least: FloatArray = np.minimum.accumulate(below[::-1])[::-1]
    return least


def exact(value: float) -> fmpq:
    """The rational number that a double is."""
    return fmpq(*float(value).as_integer_ratio())


class Place(NamedTuple):
    """An instant: time since the beginning of an interval, a ball where it is that of an impact."""

    interval: int
    at: arb


class Trajectory(NamedTuple):
    """How an excursion ended.

    Args:
        event: IMPACT, STOPPED, LOST (past recovery), or, by energy, TOPPLES or RETURNS.
        place: where, the end of the record for what is decided by energy.
        theta: rotation there.
        rate: its rate.
    """

    event: str
    place: Place
    theta: arb
    rate: arb


IMPACT, LOST, TOPPLES, RETURNS, STOPPED = "impact", "lost", "topples", "returns", "stopped"


class Block:
    """One block under one excitation. Balls have the precision of flint's context at each call.

    Args:
        excited: the excitation, with 1 + k_v > 0.
        p2: frequency parameter p² [1/s²].
        kr: rocking acceleration coefficient, a rational number.
    """

    def __init__(self, excited: Excitation, p2: float, kr: fmpq) -> None:
        self.excited = excited
        self.kr = kr
        self.p2 = arb(float(p2))
        self.p = math.sqrt(p2)
        self.theta_c = arb(kr).atan()
        self.least = least_later_q(excited)
        self.steps = 0
        # the sign of k_h - w k_r is known from doubles where rounding cannot change it
        product = excited.w * float(arb(kr))
        self.excess = excited.k_h - product
        self.sure = np.abs(self.excess) > 1e-14 * (np.abs(excited.k_h) + product)

    def sign(self, node: int) -> int:
        """Sign of k_h - w k_r at a node."""
        value = float(self.excess[node]) if self.sure[node] else self._exact_excess(node)
        return (value > 0) - (value < 0)

    def _exact_excess(self, node: int) -> fmpq:
        return exact(self.excited.k_h[node]) - exact(self.excited.w[node]) * self.kr

    def next_start(self, place: Place) -> Place | None:
        """First instant from a place on at which q > k_r; None where there is none."""
        last = self.excited.k_h.size - 1
        i, at = place
        if i < last and not at.is_zero():
            sign = self.sign_at(place)
            if sign > 0:
                return place
            crossing = self._rise(i)
            if crossing is not None:
                return crossing
            i += 1
        while i < last:
            if self.excited.interval_s[i] > 0.0:
                if self.sign(i) > 0:
                    return Place(i, arb(0))
                crossing = self._rise(i)
                if crossing is not None:
                    return crossing
            i += 1
        return None

    def sign_at(self, place: Place) -> int:
        """Sign of k_h - w k_r inside an interval.

        Raises:
            NotEnclosedError: the ball of time holds a crossing.
        """
        i, at = place
        if at.is_zero():
            return self.sign(i)
        g0, g1 = self._exact_excess(i), self._exact_excess(i + 1)
        g = arb(g0) + arb((g1 - g0) / exact(self.excited.interval_s[i])) * at
        if g > 0:
            return 1
        if g < 0:
            return -1
        raise NotEnclosedError("whether an impact comes before q crosses k_r")

    def _rise(self, i: int) -> Place | None:
        """Where q rises through k_r in an interval."""
        if self.sign(i) > 0 or self.sign(i + 1) <= 0:
            return None
        g0, g1 = self._exact_excess(i), self._exact_excess(i + 1)
        return Place(i, arb(g0 / (g0 - g1) * exact(self.excited.interval_s[i])))

    def integrate(
        self,
        place: Place,
        theta: arb,
        rate: arb,
        *,
        lifted: bool,
        stop: Place | None = None,
    ) -> Trajectory:
        """Carry one excursion to its impact, its loss, the end of the record, or a place.

        Args:
            place: where it begins.
            theta: rotation there.
            rate: its rate.
            lifted: theta >= 0, theta' >= 0 and q >= k_r there: no impact while q >= k_r (lift).
            stop: where to stop.
        """
        excited = self.excited
        self.theta, self.rate = theta, rate
        first, begin = place
        last = excited.k_h.size - 1
        for i in range(first, last):
            at = begin if i == first else arb(0)
            if stop is not None and stop.interval == i and stop.at.is_zero():
                return Trajectory(STOPPED, stop, self.theta, self.rate)
            if excited.interval_s[i] == 0.0:
                continue
            stops = stop is not None and stop.interval == i
            length = exact(excited.interval_s[i])
            limit = stop.at if stops and stop is not None else arb(length)
            line = self._line(i, length)
            g0, g1 = self.sign(i), self.sign(i + 1)
            if at.is_zero() and (g0 < 0 or (g0 == 0 and g1 < 0)):
                lifted = False
            if lifted:
                # k_h >= w k_r as far as the downward crossing, or to the end: no impact until then
                target = limit
                if g0 > 0 and g1 < 0:
                    a, b = self._exact_excess(i), self._exact_excess(i + 1)
                    crossing = arb(a / (a - b) * length)
                    if crossing < limit:
                        target, lifted = crossing, False
                    elif not crossing >= limit:
                        raise NotEnclosedError("whether a block is lifted at an impact of another")
                self._integrate(line, at, target)
                at = target
            if not lifted:
                landing = self._integrate(line, at, limit, look=True)
                if landing is not None:
                    return Trajectory(IMPACT, Place(i, landing), self.theta, self.rate)
            if stops and stop is not None:
                return Trajectory(STOPPED, stop, self.theta, self.rate)
            if self._past_recovery(self.least[i + 1]):
                return Trajectory(LOST, Place(i + 1, arb(0)), self.theta, self.rate)
        end = Place(last, arb(0))
        if stop is not None and stop.interval >= last:
            return Trajectory(STOPPED, end, self.theta, self.rate)
        event = TOPPLES if self._topples_by_energy() else RETURNS
        return Trajectory(event, end, self.theta, self.rate)

    def _line(self, i: int, length: fmpq) -> _Line:
        excited = self.excited
        a0, a1 = exact(excited.k_h[i]), exact(excited.k_h[i + 1])
        w0, w1 = exact(excited.w[i]), exact(excited.w[i + 1])
        return _Line(*(arb(x) for x in (a0, (a1 - a0) / length, w0, (w1 - w0) / length)))

    def _integrate(self, line: _Line, at: arb, target: arb, *, look: bool = False) -> arb | None:
        """Carry the motion on to `target`; with `look`, return where an impact ends it."""
        span = target - at
        if span.is_zero():
            return None
        pieces = max(1, math.ceil(float(span.upper()) * self.p / PH_MAX))
        h = span / pieces
        for _ in range(pieces):
            self.steps += 1
            rates, path = self._series(line, at, h)
            if look:
                landing = self._landing(rates, path, h)
                if landing is not None:
                    return at + landing
            self.theta, self.rate = path(h), rates(h)
            at = at + h
        return None

    def _series(self, line: _Line, at: arb, h: arb) -> tuple[arb_poly, arb_poly]:
        """Polynomials in time of theta' and theta that hold the solution on all of [0, h]."""
        reach = arb(0).union(h)
        a, w = line.a + line.da * at, line.w + line.dw * at
        # |theta''| <= p² (|k_h| + |w|): a bound of theta' over the step, and of what follows
        excited = _most(self.p2 * (abs(a + line.da * reach) + abs(w + line.dw * reach)))
        slope = _most(self.p2 * (abs(line.da) + abs(line.dw)))
        h_most = _most(h)
        degree, remainder = _remainder(
            _most(abs(self.rate)) + excited * h_most,
            excited,
            slope,
            h_most,
            2.0 ** (-0.9 * ctx.prec),
        )
        rates = self._coefficients(a, w, line, degree)
        rates[degree] = arb(0, remainder)
        path = [self.theta] + [rates[k] / (k + 1) for k in range(degree + 1)]
        return arb_poly(rates), arb_poly(path)

    def _coefficients(self, a: arb, w: arb, line: _Line, degree: int) -> list[arb]:
        """Taylor coefficients of theta' from the present state; the last one is zero."""
        sine, cosine = (self.theta_c - self.theta).sin_cos()
        u, s, c = [self.rate], [sine], [cosine]
        for k in range(degree - 1):
            excited = a * c[k] - w * s[k]
            if k:
                excited += line.da * c[k - 1] - line.dw * s[k - 1]
            u.append(self.p2 * excited / (k + 1))
            if k == degree - 2:
                break
            sum_s = sum_c = arb(0)
            for j in range(k + 1):
                sum_s += u[j] * c[k - j]
                sum_c += u[j] * s[k - j]
            s.append(-sum_s / (k + 1))
            c.append(sum_c / (k + 1))
        return [*u, arb(0)]

    def _landing(self, rates: arb_poly, path: arb_poly, h: arb) -> arb | None:
        """The first time in the step at which theta falls through zero; None if it stays above."""
        end = h.upper()
        if self.theta - end * abs(rates(arb(0).union(end))).upper() > 0:
            return None
        parts = [(arb(0), end)]
        for _ in range(HALVINGS):
            if not parts:
                return None
            low, high = parts.pop()
            middle = ((low + high) / 2).mid()
            slope = rates(low.union(high))
            if path(middle) + slope * (low.union(high) - middle) > 0:
                continue
            if slope > 0 and path(low) > 0:
                continue
            if slope < 0:
                if path(high) > 0:
                    continue
                if path(high) < 0 and path(low) > 0:
                    root = _root(rates, path, low, high)
                    if not root < h:
                        raise NotEnclosedError("whether an impact comes before the sample")
                    return root
            parts += [(middle, high), (low, middle)]
        raise NotEnclosedError("whether a touch is an impact")

    def _past_recovery(self, least_q: float) -> bool:
        """Whether theta' > 0, 0 > phi > -90° and tan phi < every later q are certain."""
        if not (self.rate > 0 and self.theta > self.theta_c):
            return False
        sine, cosine = (self.theta_c - self.theta).sin_cos()
        upright = self.theta - self.theta_c < arb.pi() / 2
        return bool(upright and cosine > 0 and sine < cosine * arb(least_q))

    def _topples_by_energy(self) -> bool:
        """Whether the block topples after the record; (theta'/p)²/2 + cos(phi) is kept."""
        phi = self.theta_c - self.theta
        beyond = self.rate * self.rate / (2 * self.p2) + phi.cos() - 1
        if not abs(phi) < arb.pi():
            raise NotEnclosedError("where the block is after the record")
        # with more energy than upright it goes on the way it goes, with less it stays on its side
        if self.rate > 0 and (beyond > 0 or phi < 0):
            return True
        if self.rate < 0 and (beyond > 0 or phi > 0):
            return False
        if beyond < 0 and (phi < 0 or phi > 0):
            return bool(phi < 0)
        raise NotEnclosedError("whether the energy suffices after the record")


@dataclass(frozen=True)
class _Line:
    """k_h and w over an interval: value at its start and slope in time."""

    a: arb
    da: arb
    w: arb
    dw: arb


def _root(rates: arb_poly, path: arb_poly, low: arb, high: arb) -> arb:
    """Enclose the root of a falling `path` in [low, high] by Newton's interval method."""
    ball = low.union(high)
    for _ in range(60):
        middle = ball.mid()
        smaller = (middle - path(middle) / rates(ball)).intersection(ball)
        if not smaller.rad() < ball.rad() * 0.9:
            return smaller
        ball = smaller
    return ball


def _remainder(
    rate: float, excited: float, slope: float, h: float, enough: float
) -> tuple[int, float]:
    """Degree of a step, and a bound of that coefficient of theta' anywhere in the step.

    The recurrence of the coefficients with every term positive, and sine and cosine at 1.

    Args:
        rate: bound of |theta'| over the step.
        excited: bound of p² (|k_h| + |w|).
        slope: bound of p² (|k_h'| + |w'|).
        h: length of the step.
        enough: the degree is reached where the term of theta is below this.
    """
    u, s = [rate], [1.0]
    power = h
    for k in range(MOST_DEGREE):
        u.append((excited * s[k] + (slope * s[k - 1] if k else 0.0)) / (k + 1))
        s.append(sum(u[j] * s[k - j] for j in range(k + 1)) / (k + 1))
        power *= h
        if k > 3 and u[-1] * power < enough:
            break
    # sums of positive terms in doubles: what they round off is far below this
    return len(u) - 1, u[-1] * (1.0 + 1e-9)


def _most(ball: arb) -> float:
    """A double that no number of the ball exceeds."""
    return math.nextafter(float(ball.upper()), math.inf)


def width(ball: arb) -> float:
    return 2.0 * float(ball.rad())
