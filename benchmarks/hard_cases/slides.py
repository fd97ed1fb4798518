"""Sliding blocks beside a slider in rational numbers.

Level and dipping bases, with and without vertical motion, down the base alone and both ways, under
pulses, chirps, coarse steps and noise; some within 1e-9 of their yield. The slider cuts the cubics
of the sample intervals at the roots of their velocity and keeps 60 digits.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from benchmarks.hard_cases import Row
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.respond import respond
from rbfrag.solver.results import FloatArray, Outcome

COUNT = 60
SEED = 1915

GRAVITY = Fraction(9.80665)
DIGITS = 10**60


Pair = tuple[Fraction, Fraction]
"""Values at both ends of an interval."""


@dataclass(frozen=True, eq=False)
class Slide:
    """A block of a yield acceleration on a base that dips, and its motion."""

    motion: GroundMotion
    vertical: GroundMotion | None
    ky: float
    beta_deg: float
    two_way: bool


def rounded(value: Fraction) -> Fraction:
    return Fraction(round(value * DIGITS), DIGITS)


def root_of(value: Fraction) -> Fraction:
    """Square root of a number that is not below zero."""
    return Fraction(math.isqrt(int(value * DIGITS * DIGITS)), DIGITS)


def sine_cosine(angle: Fraction) -> Pair:
    sine, cosine, term = Fraction(0), Fraction(0), Fraction(1)
    for n in range(60):
        if n % 2:
            sine += term if n % 4 == 1 else -term
        else:
            cosine += term if n % 4 == 0 else -term
        term = rounded(term * angle / (n + 1))
    return sine, cosine


class Slider:
    """A sliding block in rational numbers.

    Down the base s'' = g f (k_h - k_y w) with f = cos(phi - beta)/cos(phi), up it
    s'' = g f_up (k_h + k_up w); k_y = tan(phi - beta), k_up = tan(phi + beta).
    """

    def __init__(self, slide: Slide) -> None:
        ky = Fraction(slide.ky)
        sine, cosine = sine_cosine(Fraction(math.radians(slide.beta_deg)))
        tan_beta = sine / cosine
        friction = (ky + tan_beta) / (1 - ky * tan_beta)  # tan(phi) of phi = atan(k_y) + beta
        self.strengths = {1: ky}
        # cos(phi - beta)/cos(phi) = cos(beta) + tan(phi) sin(beta), and likewise up the base
        self.factors = {1: GRAVITY * (cosine + friction * sine)}
        if slide.two_way:
            self.strengths[-1] = (friction + tan_beta) / (1 - friction * tan_beta)
            self.factors[-1] = GRAVITY * (cosine - friction * sine)
        self.v = self.s = self.peak = Fraction(0)
        self.sense = 0

    def pull(self, sense: int, k_h: Fraction, w: Fraction) -> Fraction:
        """Acceleration of a block that moves down (1) or up (-1) the base."""
        return self.factors[sense] * (k_h - sense * self.strengths[sense] * w)

    def interval(self, h: Fraction, k_h: Pair, w: Pair) -> None:
        """Go on through an interval in which the accelerations are straight."""
        at = Fraction(0)
        while at < h:
            if not self.sense:
                at = self.start(h, at, k_h, w)
                continue
            begin, end = (self.pull(self.sense, k, lift) for k, lift in zip(k_h, w, strict=True))
            slope = (end - begin) / h
            a = begin + slope * at
            length = h - at
            stop = self.first_standstill(a, slope)
            if stop is not None and stop <= length:
                length = stop
            self.s = rounded(self.s + length * (self.v + length * (a / 2 + length * slope / 6)))
            self.v = rounded(self.v + length * (a + length * slope / 2))
            if stop is not None and stop <= length:
                self.v, self.sense = Fraction(0), 0
            self.peak = max(self.peak, self.s)
            at = rounded(at + length)

    def start(
        self,
        h: Fraction,
        at: Fraction,
        k_h: Pair,
        w: Pair,
    ) -> Fraction:
        """Time in the interval at which a block at rest starts, or its end."""
        first = h
        for sense in self.strengths:
            begin, end = (sense * self.pull(sense, k, lift) for k, lift in zip(k_h, w, strict=True))
            slope = (end - begin) / h
            excess = begin + slope * at
            # at the root of its own standstill rounding must not start it again
            if excess > Fraction(1, 10**40):
                self.sense = sense
                return at
            if slope > 0 and end > 0:
                begins = max(at, rounded(-begin / slope))
                if begins < first:
                    first, self.sense = begins, sense
        return first

    def first_standstill(self, a: Fraction, slope: Fraction) -> Fraction | None:
        """First time after now at which v + a t + slope t²/2 is zero."""
        v, a, slope = (self.sense * value for value in (self.v, a, slope))
        if v == 0:
            return rounded(-2 * a / slope) if slope < 0 < a else None
        if slope == 0:
            return rounded(-v / a) if a < 0 else None
        inside = a * a - 2 * slope * v
        if inside < 0:
            return None
        root = root_of(inside)
        # the smaller one that is above zero, without cancellation
        q = -(a + root) if a > 0 else -(a - root)
        times = [t for t in (q / slope, 2 * v / q if q else Fraction(0)) if t > 0]
        return rounded(min(times)) if times else None


def exact(slide: Slide) -> tuple[Fraction, Fraction]:
    """Greatest displacement, and the one that is left [m]."""
    slider = Slider(slide)
    motion = slide.motion
    time_s = [Fraction(value) for value in motion.time_s.tolist()]
    k_h = [Fraction(value) for value in motion.acceleration_g.tolist()]
    up = slide.vertical
    w = [Fraction(1)] * len(k_h)
    if up is not None:
        w = [1 + Fraction(value) for value in up.acceleration_g.tolist()]
    for i in range(len(time_s) - 1):
        slider.interval(time_s[i + 1] - time_s[i], (k_h[i], k_h[i + 1]), (w[i], w[i + 1]))
    # the ground is at rest after the record
    while slider.sense:
        slider.interval(Fraction(10), (Fraction(0),) * 2, (Fraction(1),) * 2)
    return slider.peak, slider.s


def of_last_digits(slide: Slide) -> float:
    """What two units of the last digit of the yield are worth [m]: it becomes an angle and back."""
    step = 2.0 * math.ulp(slide.ky)
    ends = [exact(replace(slide, ky=slide.ky + shift)) for shift in (-step, step)]
    return float(max(abs(a - b) for a, b in zip(*ends, strict=True)))


def random_motion(random: np.random.Generator, number: int) -> FloatArray:
    """Pulses, a chirp, coarse steps or noise, in turn [g]."""
    time_s = np.linspace(0.0, 4.0, 401)
    peak_g = random.uniform(0.2, 1.5)
    kind = number % 4
    if kind == 0:
        phase = np.pi * (time_s - random.uniform(0.0, 1.0)) / random.uniform(0.1, 1.0)
        return peak_g * np.where((phase > 0.0) & (phase < 3.0 * np.pi), np.sin(phase), 0.0)
    if kind == 1:
        return peak_g * np.sin(2.0 * np.pi * (0.5 + random.uniform(0.5, 3.0) * time_s) * time_s)
    if kind == 2:
        return peak_g * np.repeat(random.choice([-1.0, -0.3, 0.0, 0.5, 1.0], 41), 10)[:401]
    noise = np.convolve(random.normal(size=405), np.ones(5), mode="valid")
    return peak_g * noise / np.abs(noise).max()


def slides() -> list[Slide]:
    """The cases."""
    random = np.random.default_rng(SEED)
    drawn = []
    for number in range(COUNT):
        dt_s = float(random.choice([0.005, 0.01, 0.02]))
        k_h = random_motion(random, number)
        vertical = GroundMotion(random.uniform(-0.4, 0.4, k_h.size), dt_s) if number % 3 else None
        two_way = number % 5 == 0
        beta_deg = 0.0 if number % 2 else float(random.uniform(-10.0, 25.0))
        ky = float(random.uniform(0.05, 0.9)) * float(k_h.max())
        if number % 10 == 7 and vertical is None:  # all but its PGA
            ky = float(k_h.max()) * (1.0 - 1e-9)
        # phi = atan(ky) + beta must be an angle of friction, and hold the block up the base
        ky = min(ky, 0.8) if beta_deg or two_way else ky
        ky = max(ky, math.tan(math.radians(max(-beta_deg, 0.0) + 1.0)))
        drawn.append(Slide(GroundMotion(k_h, dt_s), vertical, ky, beta_deg, two_way))
    return drawn


def rows() -> list[Row]:
    """Run the cases."""
    wrong = within = undecided = 0
    for number, slide in enumerate(slides()):
        answer = respond(
            slide.motion, vertical=slide.vertical, ky=slide.ky, beta_deg=slide.beta_deg,
            two_way=slide.two_way,
        )  # fmt: skip
        ours = (answer.peak_displacement_m, answer.displacement_m)
        if answer.outcome is not Outcome.STABLE or None in ours or answer.error_estimate is None:
            undecided += 1
            print(f"slide {number}: {answer.outcome}", file=sys.stderr)
            continue
        theirs = exact(slide)
        off = max(abs(float(Fraction(a or 0.0) - b)) for a, b in zip(ours, theirs, strict=True))
        if off <= answer.error_estimate or off <= answer.error_estimate + of_last_digits(slide):
            within += 1
            continue
        wrong += 1
        print(
            f"slide {number}: {ours} m, {float(theirs[0])!r} and {float(theirs[1])!r} m are exact; "
            f"off by {off:.1e}, error estimate {answer.error_estimate:.1e}",
            file=sys.stderr,
        )
    return [Row("slides, one and both ways", "slider in rational numbers", COUNT, wrong, within,
                undecided)]  # fmt: skip


if __name__ == "__main__":
    print(*rows(), sep="\n")
