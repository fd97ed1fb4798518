"""One toppling block in ball arithmetic: the outcome that is said is proven.

Every number is a ball (python-flint's `arb`): a midpoint and a radius that holds all rounding.
Samples, intervals, p² and k_r are taken as the exact rationals that the doubles are. On each
interval the excitation is a straight line, and the solution is expanded in a Taylor series whose
remainder is the next coefficient over a box that holds the whole step (Lagrange; R. E. Moore,
Interval Analysis, 1966). Nothing is shared with rbfrag.solver but the arrays of the excitation.

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
from dataclasses import dataclass, field

import numpy as np
from flint import arb, arb_poly, ctx, fmpq
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation

FloatArray = NDArray[np.float64]

BITS = (192, 384, 768)
"""Precisions tried in turn until the outcome is enclosed."""

PH_MAX = 0.25
"""Greatest p·h of one step."""

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
        decided_by: the event that decides: ``past recovery``, ``last impact``, ``energy``, ``rest``.
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
    drive: Excitation,
    *,
    p2: float,
    kr: float,
    first: int = 0,
    one_excursion: bool = False,
    bits: tuple[int, ...] = BITS,
) -> Enclosure:
    """Run one block over one excitation and say what is proven of it.

    Args:
        drive: the excitation, with 1 + k_v > 0 throughout.
        p2: frequency parameter p² [1/s²], taken as exact.
        kr: rocking acceleration coefficient, taken as exact, > 0.
        first: node at which the block is at rest and from which it is looked at.
        one_excursion: end at the first impact.
        bits: precisions to try in turn.

    Raises:
        ValueError: 1 + k_v <= 0 somewhere, or a k_r or p² that is not positive.
    """
    if not (kr > 0.0 and p2 > 0.0):
        raise ValueError(f"k_r = {kr!r} and p2 = {p2!r} must be positive")
    if not (drive.w > 0.0).all():
        raise ValueError("1 + k_v must be positive throughout")
    reason = ""
    for precision in bits:
        with ctx.workprec(precision):
            run = _Run(drive, p2, kr)
            try:
                return run.go(first, one_excursion)
            except NotEnclosedError as error:
                reason = f"{error} at {run.now_s:.3f} s"
    return Enclosure(NOT_ENCLOSED, reason=reason, bits=bits[-1])


def least_later_q(drive: Excitation) -> FloatArray:
    """A number below every q from each node to the end, and not above 0; shape (n,)."""
    below = np.minimum(np.nextafter(drive.k_h / drive.w, -np.inf), 0.0)
    least: FloatArray = np.minimum.accumulate(below[::-1])[::-1]
    return least


def exact(value: float) -> fmpq:
    """The rational number that a double is."""
    return fmpq(*float(value).as_integer_ratio())


@dataclass(eq=False)
class _Run:
    """The state of a run; angles and times are balls, node values exact."""

    drive: Excitation
    p2_given: float
    kr_given: float
    impacts: list[tuple[float, float]] = field(default_factory=list)
    steps: int = 0
    now_s: float = 0.0

    def __post_init__(self) -> None:
        self.p2 = arb(self.p2_given)
        self.p = math.sqrt(self.p2_given)
        self.kr = exact(self.kr_given)
        self.theta_c = arb(self.kr).atan()
        self.least = least_later_q(self.drive)
        self.moving = False
        self.lifted = False
        self.theta = self.rate = arb(0)
        # what rounding cannot change the sign of is known from doubles
        product = self.drive.w * self.kr_given
        self.excess = self.drive.k_h - product
        self.sure = np.abs(self.excess) > 1e-14 * (np.abs(self.drive.k_h) + product)

    def above(self, node: int) -> fmpq | float:
        """k_h - w k_r at a node: its sign is right, and where it is a rational so is its value."""
        if self.sure[node]:
            return float(self.excess[node])
        return self.exact_excess(node)

    def exact_excess(self, node: int) -> fmpq:
        return exact(self.drive.k_h[node]) - exact(self.drive.w[node]) * self.kr

    def go(self, first: int, one_excursion: bool) -> Enclosure:
        drive = self.drive
        last = drive.k_h.size - 1
        for i in range(first, last):
            self.now_s = float(drive.time_s[i])
            if drive.interval_s[i] == 0.0:
                continue
            if not self.moving and self.above(i) <= 0 and self.above(i + 1) <= 0:
                continue
            self.cross(i, one_excursion)
            if not self.moving:
                if one_excursion and self.impacts:
                    break
            elif self.past_recovery(self.least[i + 1]):
                return self.end(TOPPLED, "past recovery", drive.time_s[i + 1], self.theta)
        self.now_s = float(drive.time_s[-1])
        if self.moving:
            outcome = TOPPLED if self.topples_by_energy() else STABLE
            return self.end(outcome, "energy", self.now_s, self.theta)
        if not self.impacts:
            return self.end(STABLE, "rest", self.now_s, arb(0))
        time_s, width = self.impacts[-1]
        return Enclosure(
            STABLE, "", "last impact", time_s, width, tuple(self.impacts), self.steps, ctx.prec
        )

    def end(self, outcome: str, event: str, time_s: float, ball: arb) -> Enclosure:
        return Enclosure(
            outcome, "", event, float(time_s), _width(ball), tuple(self.impacts), self.steps,
            ctx.prec,
        )  # fmt: skip

    def cross(self, i: int, one_excursion: bool) -> None:
        """Carry the run over interval i, of positive length."""
        drive = self.drive
        length = exact(drive.interval_s[i])
        a0, a1 = exact(drive.k_h[i]), exact(drive.k_h[i + 1])
        w0, w1 = exact(drive.w[i]), exact(drive.w[i + 1])
        g0, g1 = a0 - w0 * self.kr, a1 - w1 * self.kr
        line = _Line(*(arb(x) for x in (a0, (a1 - a0) / length, w0, (w1 - w0) / length)))
        crossing = g0 / (g0 - g1) * length if (g0 > 0) != (g1 > 0) else None
        whole = arb(length)
        at = arb(0)
        if g0 < 0 or (g0 == 0 and g1 < 0):
            self.lifted = False
        while True:
            if not self.moving:
                start = self.start(at, g0, g1, length, crossing)
                if start is None:
                    return
                at = start
                self.moving = self.lifted = True
                self.theta = self.rate = arb(0)
            if self.lifted:
                # k_h >= w k_r up to the downward crossing, or to the end: no impact until then
                target = whole if g1 >= 0 or crossing is None else arb(crossing)
                self.integrate(line, at, target)
                at = target
                if g1 >= 0:
                    return
                self.lifted = False
            landing = self.integrate(line, at, whole, look=True)
            if landing is None:
                return
            at = landing
            self.impacts.append((float(drive.time_s[i]) + float(at.mid()), _width(at)))
            self.moving = False
            if one_excursion:
                return

    def start(
        self, at: arb, g0: fmpq, g1: fmpq, length: fmpq, crossing: fmpq | None
    ) -> arb | None:
        """When a block that rests from `at` on starts in this interval; None if it does not."""
        if at.is_zero():
            if g0 > 0:
                return at
        else:
            g = arb(g0) + arb((g1 - g0) / length) * at
            if g > 0:
                return at
            if not g < 0:
                raise NotEnclosedError("whether an impact comes before q falls below k_r")
        if g1 > 0 and crossing is not None:
            return arb(crossing)
        return None

    def integrate(self, line: _Line, at: arb, target: arb, *, look: bool = False) -> arb | None:
        """Carry the motion from `at` to `target`; with `look`, return where it ends by an impact."""
        span = target - at
        if span.is_zero():
            return None
        pieces = max(1, math.ceil(float(span.upper()) * self.p / PH_MAX))
        h = span / pieces
        for _ in range(pieces):
            self.steps += 1
            rates, path = self.series(line, at, h)
            if look:
                landing = self.landing(rates, path, h)
                if landing is not None:
                    return at + landing
            self.theta, self.rate = path(h), rates(h)
            at = at + h
        return None

    def series(self, line: _Line, at: arb, h: arb) -> tuple[arb_poly, arb_poly]:
        """Polynomials in time of theta' and theta that hold the solution on all of [0, h]."""
        a, w = line.a + line.da * at, line.w + line.dw * at
        reach = arb(0).union(h)
        a_box, w_box = a + line.da * reach, w + line.dw * reach
        # |theta''| <= p² (|k_h| + |w|): boxes that hold theta' and theta over the step
        bound = self.p2 * (abs(a_box) + abs(w_box))
        h_most = h.upper()
        slack = (bound * h_most).upper()
        rate_box = self.rate + arb(0, slack)
        theta_box = self.theta + self.rate * reach + arb(0, (slack * h_most / 2).upper())
        size = float(h_most) * (math.sqrt(float(bound.upper())) + float(abs(self.rate).upper()))
        degree = _degree(size, ctx.prec)
        rates = self.coefficients(self.theta, self.rate, a, w, line, degree)
        # only the last coefficient over the box is used, as the remainder
        boxed = self.coefficients(theta_box, rate_box, a_box, w_box, line, degree)
        rates[degree] = boxed[degree]
        path = [self.theta] + [rates[k] / (k + 1) for k in range(degree + 1)]
        return arb_poly(rates), arb_poly(path)

    def coefficients(
        self, theta: arb, rate: arb, a: arb, w: arb, line: _Line, degree: int
    ) -> list[arb]:
        """Taylor coefficients of theta' from a state and an excitation."""
        sine, cosine = (self.theta_c - theta).sin_cos()
        u, s, c = [rate], [sine], [cosine]
        for k in range(degree):
            drive = a * c[k] - w * s[k]
            if k:
                drive += line.da * c[k - 1] - line.dw * s[k - 1]
            sum_s = sum_c = arb(0)
            for j in range(k + 1):
                sum_s += u[j] * c[k - j]
                sum_c += u[j] * s[k - j]
            u.append(self.p2 * drive / (k + 1))
            s.append(-sum_s / (k + 1))
            c.append(sum_c / (k + 1))
        return u

    def landing(self, rates: arb_poly, path: arb_poly, h: arb) -> arb | None:
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

    def past_recovery(self, least_q: float) -> bool:
        """Whether theta' > 0, 0 > phi > -90° and tan phi < every later q are certain."""
        if not (self.rate > 0 and self.theta > self.theta_c):
            return False
        sine, cosine = (self.theta_c - self.theta).sin_cos()
        upright = self.theta - self.theta_c < arb.pi() / 2
        return bool(upright and cosine > 0 and sine < cosine * arb(least_q))

    def topples_by_energy(self) -> bool:
        """Whether the block topples after the record; (theta'/p)²/2 + cos(phi) is kept."""
        phi = self.theta_c - self.theta
        beyond = self.rate * self.rate / (2 * self.p2) + phi.cos() - 1
        if not abs(phi) < arb.pi():
            raise NotEnclosedError("where the block is after the record")
        if phi > 0 and (beyond < 0 or self.rate < 0):
            return False
        if phi < 0 and beyond > 0 and self.rate < 0:
            return False
        if (beyond > 0 or phi < 0) and self.rate > 0:
            return True
        if phi < 0 and beyond < 0:
            return True
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


def _degree(size: float, bits: int) -> int:
    """Degree at which size^n/n! is below what the precision can hold."""
    wanted = -0.9 * bits * math.log(2.0)
    log_size = math.log(max(size, 1e-300))
    degree = 4
    while degree < 120 and degree * log_size - math.lgamma(degree + 1.0) > wanted:
        degree += 1
    return degree


def _width(ball: arb) -> float:
    return 2.0 * float(ball.rad())
