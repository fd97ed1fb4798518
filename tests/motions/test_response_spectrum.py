"""Spectral accelerations against an integrator of differential equations and in closed form."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.response_spectrum import DAMPING, PERIODS_S, spectral_accelerations


def spectral_acceleration(a: np.ndarray, h: np.ndarray, period_s: float) -> float:
    """Return the spectral acceleration at one period."""
    (ordinate,) = spectral_accelerations(a, h, [period_s])
    return ordinate


def integrated(a: np.ndarray, h: np.ndarray, period_s: float) -> float:
    """Return ω² max|u| with DOP853, its extremes by event location, one period after the record."""
    omega = 2.0 * math.pi / period_s
    state, greatest = np.zeros(2), 0.0
    for a0, a1, length in [*zip(a[:-1], a[1:], h, strict=True), (0.0, 0.0, period_s)]:
        if length == 0.0:
            continue

        def slope(t: float, u: np.ndarray, a0: float = a0, rate: float = (a1 - a0) / length):
            return [u[1], -2.0 * DAMPING * omega * u[1] - omega**2 * u[0] - a0 - rate * t]

        solution = solve_ivp(
            slope, (0.0, length), state, "DOP853", rtol=1e-12, atol=1e-14, events=lambda t, u: u[1]
        )
        state = solution.y[:, -1]
        greatest = max([greatest, abs(state[0]), *(abs(u[0]) for u in solution.y_events[0])])
    return omega**2 * greatest


@pytest.mark.parametrize("period_s", PERIODS_S.values())
@pytest.mark.parametrize("dt_s", [0.005, 0.02, 0.3])
def test_equal_steps_against_an_integrator(period_s: float, dt_s: float) -> None:
    a = np.random.default_rng(1).normal(size=50) * np.linspace(0.1, 1.0, 50)
    h = np.full(49, dt_s)
    assert spectral_acceleration(a, h, period_s) == pytest.approx(
        integrated(a, h, period_s), rel=1e-8
    )


@pytest.mark.parametrize("period_s", [0.3, 3.0])
def test_unequal_steps_and_jumps_against_an_integrator(period_s: float) -> None:
    rng = np.random.default_rng(2)
    h = rng.uniform(0.0, 1.0, 40) * (rng.uniform(size=40) > 0.2)
    motion = GroundMotion.from_nodes([0.0, *np.cumsum(h)], rng.normal(size=41))
    name = {period: name for name, period in PERIODS_S.items()}[period_s]
    truth = integrated(motion.acceleration_g, motion.interval_s, period_s)
    assert motion.spectral_accelerations[name] == pytest.approx(truth, rel=1e-8)


def test_the_maximum_after_the_record() -> None:
    # an impulse of 1/50 of the period: u = v exp(-ζ ω t) sin(ω_d t)/ω_d afterwards
    period_s, length_s = 3.0, 0.06
    omega = 2.0 * math.pi / period_s
    damped = omega * math.sqrt(1.0 - DAMPING**2)
    a, h = np.array([1.0, 1.0]), np.array([length_s])
    turning = math.atan2(damped, DAMPING * omega) / damped
    largest = math.exp(-DAMPING * omega * turning) * math.sin(damped * turning) / damped
    spectral = spectral_acceleration(a, h, period_s)
    # the impulse is centred: what is left is of second order in its length
    assert spectral == pytest.approx(omega**2 * length_s * largest, rel=5e-3)
    assert spectral == pytest.approx(integrated(a, h, period_s), rel=1e-8)


def test_a_constant_acceleration_that_lasts_almost_for_ever() -> None:
    overshoot = 1.0 + math.exp(-math.pi * DAMPING / math.sqrt(1.0 - DAMPING**2))
    for length_s in (100.0, 1e6, 1e99):
        spectral = spectral_acceleration(np.array([0.4, 0.4]), np.array([length_s]), 0.3)
        assert spectral == pytest.approx(0.4 * overshoot, rel=1e-11)


def test_the_maximum_lies_between_samples() -> None:
    # a resonant sine sampled at a ninth of the period peaks between its samples
    period_s = 0.3
    steps = np.full(60, period_s / 9.0)
    a = np.sin(2.0 * math.pi * np.arange(61) / 9.0)
    fine = np.interp(np.linspace(0.0, 60.0, 6001), np.arange(61.0), a)
    refined = spectral_acceleration(fine, np.full(6000, period_s / 900.0), period_s)
    assert spectral_acceleration(a, steps, period_s) == pytest.approx(refined, rel=1e-11)


def test_scale_polarity_and_rest() -> None:
    a = np.random.default_rng(3).normal(size=300)
    a[[0, -1]] = 0.0
    h = np.full(299, 0.01)
    once = spectral_acceleration(a, h, 1.0)
    assert spectral_acceleration(-2.0 * a, h, 1.0) == pytest.approx(2.0 * once, rel=1e-12)
    padded = np.concatenate([np.zeros(100), a, np.zeros(500)])
    longer = spectral_acceleration(padded, np.full(899, 0.01), 1.0)
    assert longer == pytest.approx(once, rel=1e-12)
    assert spectral_acceleration(1e-200 * a, h, 1.0) == pytest.approx(1e-200 * once, rel=1e-12)
    assert set(GroundMotion(np.zeros(5), 0.01).spectral_accelerations.values()) == {0.0}
    assert set(GroundMotion([0.3], 0.01).spectral_accelerations.values()) == {0.0}


def test_a_record_against_the_recursion_of_nigam_and_jennings() -> None:
    # Nigam & Jennings (1969), sampled on a refinement of the record, which bounds it from below
    rng = np.random.default_rng(4)
    a = np.convolve(rng.normal(size=2000), np.hanning(9), "same") * np.hanning(2000)
    dt, period_s, parts = 0.01, 0.5, 50
    omega = 2.0 * math.pi / period_s
    matrix = np.array([[0.0, 1.0], [-(omega**2), -2.0 * DAMPING * omega]])
    step = dt / parts
    # the state, the acceleration and its slope, advanced exactly by one matrix exponential
    extended = np.zeros((4, 4))
    extended[:2, :2], extended[1, 2], extended[2, 3] = matrix, -1.0, 1.0
    advance = expm(extended * step)
    state, greatest = np.zeros(4), 0.0
    for a0, a1 in pairwise(a):
        state[2:] = a0, (a1 - a0) / dt
        for _ in range(parts):
            state = advance @ state
            greatest = max(greatest, abs(state[0]))
    sampled = omega**2 * greatest
    spectral = spectral_acceleration(a, np.full(1999, dt), period_s)
    assert 0.0 <= spectral / sampled - 1.0 < 1e-5
