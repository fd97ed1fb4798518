"""The reference of 32 digits is what it says."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from benchmarks.extended import double_double as dd
from benchmarks.extended.toppling import truth
from benchmarks.reference import reference
from rbfrag.bench.peers import BenchCase
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from tests.solver.reference import integrate
from tests.synthetic import shaking

DIGITS = Fraction(1, 10**30)

Pair = tuple[float, float]


def exact(a: Pair) -> Fraction:
    return Fraction(a[0]) + Fraction(a[1])


def pair(value: Fraction) -> Pair:
    high = float(value)
    return high, float(value - Fraction(high))


def off(a: Pair, value: Fraction) -> Fraction:
    return abs(exact(a) - value) / abs(value)


@pytest.mark.parametrize("seed", range(40))
def test_arithmetic_against_exact_fractions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = (
        pair(Fraction(int(rng.integers(1, 10**18)), int(rng.integers(1, 10**18)))) for _ in range(2)
    )
    assert off(dd.add(x, y), exact(x) + exact(y)) < DIGITS
    assert off(dd.mul(x, y), exact(x) * exact(y)) < DIGITS
    assert off(dd.div(x, y), exact(x) / exact(y)) < DIGITS
    squared = dd.root(x)
    assert off(dd.mul(squared, squared), exact(x)) < DIGITS
    near = pair(exact(x) * (1 + Fraction(1, 2**60)))
    # what two numbers differ by from their 19th digit on is kept
    assert off(dd.sub(near, x), exact(near) - exact(x)) < DIGITS * 2**70


def series(x: Fraction, first: int) -> Fraction:
    """sin x (first = 1) or 1 - cos x (first = 2), to 40 digits and more."""
    total, term = Fraction(0), x**first / math.factorial(first)
    for n in range(first, 80, 2):
        total += term
        term *= -(x**2) / ((n + 1) * (n + 2))
    return total


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.1, 0.7, 1.5, -0.4, 3.0, -6.0])
def test_sine_cosine_and_their_inverses(angle: float) -> None:
    sine, versine = dd.sine_versine((angle, 0.0))
    assert off(sine, series(Fraction(angle), 1)) < 10 * DIGITS
    assert off(versine, series(Fraction(angle), 2)) < 10 * DIGITS
    if abs(angle) < 1.5:
        tangent = dd.div(sine, dd.sub((1.0, 0.0), versine))
        assert off(dd.arctangent(tangent), Fraction(angle)) < 10 * DIGITS
        assert off(dd.arcsine(sine), Fraction(angle)) < 10 * DIGITS


def record(seed: int) -> GroundMotion:
    return GroundMotion(shaking(seed, npts=500), 0.02)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("p2", [30.0, 3.0, 0.3])
def test_shorter_steps_change_nothing(seed: int, p2: float) -> None:
    excited = excitation(record(seed), record(seed + 7))
    for kr in (0.05, 0.12, 0.2):
        first = truth(excited, p2=p2, kr=kr)
        other = truth(excited, p2=p2, kr=kr, ph_max=0.006 * p2**0.5, smallest=1e-36)
        assert other.steps > first.steps
        assert (first.outcome, first.intervals_moved) == (other.outcome, other.intervals_moved)
        if first.outcome == "stable":
            change = (first.peak_rad - other.peak_rad) + (first.peak_low_rad - other.peak_low_rad)
            assert abs(change) < 1e-27 * first.peak_rad


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("p2", [30.0, 1.0])
def test_it_agrees_with_two_other_integrators(seed: int, p2: float) -> None:
    motion = record(seed)
    excited = excitation(motion)
    for kr in (0.08, 0.15, 0.24):
        mine = truth(excited, p2=p2, kr=kr)
        plain = integrate(excited.time_s, excited.k_h, None, p2=p2, kr=kr)
        longer = reference(BenchCase(motion, "forward", excited, p2, kr))
        assert mine.outcome == plain.outcome == longer.outcome
        assert mine.intervals_moved == plain.intervals_moved
        if mine.outcome == "stable":
            assert plain.peak_rad == pytest.approx(mine.peak_rad, rel=1e-11)
            assert longer.peak_rad == pytest.approx(mine.peak_rad, rel=1e-15, abs=0.0)


def test_energy_between_jumps_is_kept_to_30_digits() -> None:
    # a constant excitation, then none: the peak is that of the energy at the end of it, and
    # one that goes on at the same level past a repeated node changes nothing
    kr = 0.3
    once = GroundMotion.from_nodes([0.0, 0.0, 0.4, 0.4, 3.0], [0.0, 0.5, 0.5, 0.0, 0.0])
    cut = GroundMotion.from_nodes(
        [0.0, 0.0, 0.1, 0.1, 0.4, 0.4, 3.0], [0.0, 0.5, 0.5, 0.5, 0.5, 0.0, 0.0]
    )
    short = GroundMotion.from_nodes([0.0, 0.0, 0.4, 0.4], [0.0, 0.5, 0.5, 0.0])
    full, other, closed = (truth(excitation(m), p2=4.0, kr=kr) for m in (once, cut, short))
    assert full.outcome == "stable"
    for run in (other, closed):
        change = (run.peak_rad - full.peak_rad) + (run.peak_low_rad - full.peak_low_rad)
        # 0.4 - 0.1 is not 0.3 in doubles: the cut record lasts some 1e-17 s longer
        assert abs(change) < (1e-15 if run is other else 1e-29)
