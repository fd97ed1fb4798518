"""The linearised block against its closed forms (section 6 of the theory; Gibson, 4.20).

They prove the event finder and the bound by excursions from rest, which
`tests.physics.linear_block` shares with the product.

c = critical angle over the amplitude, f = p times the duration of one lobe.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.block_excitation import remaining_excitation
from tests.physics import linear_block
from tests.physics.pulses import rectangle, rectangular_cycle, sine_lobes, triangle
from tests.solver import reference
from tests.synthetic import shaking

F = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
AMPLITUDE_G = 0.37
P2 = 7.3
P = math.sqrt(P2)


def critical_ratio(motion: GroundMotion) -> float:
    """Critical angle over the amplitude."""
    result = linear_block.critical_angle(motion, p2=P2)
    assert result is not None
    return result / excitation(motion).pga_g


def half_sine(f: float) -> float:
    x = math.pi / f
    return math.sin(
        brentq(
            lambda s: x * math.sin(s) - math.cos(s) - math.exp(-(math.pi - s) / x),
            0.0,
            0.5 * math.pi,
            xtol=1e-15,
        )
    )


def full_sine(f: float) -> float:
    x = math.pi / f
    return math.sin(
        brentq(
            lambda s: x * math.sin(s) - math.cos(s) + math.exp(-(2.0 * math.pi - s) / x),
            0.0,
            0.5 * math.pi,
            xtol=1e-15,
        )
    )


EXACT: dict[str, tuple[Callable[[float, float], GroundMotion], Callable[[float], float]]] = {
    "rectangle": (rectangle, lambda f: -math.expm1(-f)),
    "triangle": (triangle, lambda f: 1.0 - 2.0 / f * math.log(2.0 - math.exp(-0.5 * f))),
    "rectangular cycle (4.20a)": (rectangular_cycle, lambda f: math.expm1(-f) ** 2),
}


@pytest.mark.parametrize("f", F)
@pytest.mark.parametrize("name", EXACT)
def test_pulse_of_straight_lines(name: str, f: float) -> None:
    make, closed_form = EXACT[name]
    pulse = make(f / P, AMPLITUDE_G)
    assert critical_ratio(pulse) == pytest.approx(closed_form(f), rel=1e-9)
    # the search begins at the same value, by one recursion over the record
    greatest, _ = remaining_excitation(
        pulse.interval_s, pulse.acceleration_g, P, np.empty(pulse.npts)
    )
    assert greatest / AMPLITUDE_G == pytest.approx(closed_form(f), rel=1e-12)


@pytest.mark.parametrize("f", F)
def test_half_sine_sampled(f: float) -> None:
    result = critical_ratio(sine_lobes(f / P, (AMPLITUDE_G,), 2000))
    assert result == pytest.approx(half_sine(f), rel=1e-6)


@pytest.mark.parametrize("f", F)
def test_one_cycle_sine_sampled(f: float) -> None:
    result = critical_ratio(sine_lobes(f / P, (AMPLITUDE_G, -AMPLITUDE_G), 3000))
    assert result == pytest.approx(full_sine(f), rel=1e-6)


@pytest.mark.parametrize(
    ("f", "sine", "triangular"),
    [
        (0.1, 0.06062997, 0.04762805),
        (0.5, 0.25448280, 0.20066664),
        (1.0, 0.42299562, 0.33640687),
        (2.0, 0.62812122, 0.51011987),
        (5.0, 0.86223461, 0.73950454),
    ],
)
def test_published_table(f: float, sine: float, triangular: float) -> None:
    assert half_sine(f) == pytest.approx(sine, abs=6e-9)
    result = critical_ratio(triangle(f / P, AMPLITUDE_G))
    assert result == pytest.approx(triangular, abs=6e-9)


def test_error_of_a_sampled_pulse_falls_with_the_square_of_the_interval() -> None:
    errors = []
    for samples in (50, 100, 200, 400):
        result = critical_ratio(sine_lobes(1.0 / P, (AMPLITUDE_G,), samples))
        errors.append(abs(result / half_sine(1.0) - 1.0))
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    assert orders == pytest.approx([2.0] * 3, abs=0.1)


@pytest.mark.parametrize("f", F)
def test_peak_of_the_rectangular_cycle_at_its_critical_value(f: float) -> None:
    # (4.20b). Just above the critical angle the block hangs near upright for a while, so the
    # peak differs from the limit by the distance's own amount times exp(2f).
    e = math.exp(f)
    limit = 1.0 + (e * e - math.sqrt(1.0 - 2.0 * e + 2.0 * e**3)) / (e - 1.0) ** 2
    distance = 1e-10
    run = linear_block.respond(
        rectangular_cycle(f / P, AMPLITUDE_G),
        p2=P2,
        kr=AMPLITUDE_G * math.expm1(-f) ** 2 * (1.0 + distance),
    )
    assert not run.toppled
    assert run.peak_theta_n == pytest.approx(limit, rel=1e-9 + 10.0 * distance * e * e)


@pytest.mark.parametrize("amplitude_g", [1e-4, 0.05, 3.0])
def test_linear_critical_ratio_does_not_depend_on_the_amplitude(amplitude_g: float) -> None:
    result = critical_ratio(triangle(1.3 / P, amplitude_g))
    expected = critical_ratio(triangle(1.3 / P, 1.0))
    assert result == pytest.approx(expected, rel=1e-11)


def test_responses_scale_with_the_amplitude() -> None:
    motion = GroundMotion(shaking(2), 0.02)
    kr = 0.8 * float(motion.acceleration_g.max())
    single = linear_block.respond(motion, p2=5.0, kr=kr)
    other = linear_block.respond(motion.scaled(0.01), p2=5.0, kr=0.01 * kr)
    assert 0.0 < single.peak_theta_n < 1.0
    assert other.peak_theta_n == pytest.approx(single.peak_theta_n, rel=1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_runs_agree_with_the_reference_integrator(seed: int) -> None:
    motion = GroundMotion(shaking(seed), 0.02)
    excited = excitation(motion)
    toppled = 0
    for share in (0.15, 0.3, 0.6, 0.9):
        kr = share * excited.max_q
        result = linear_block.respond(motion, p2=20.0, kr=kr)
        truth = reference.integrate(excited.time_s, excited.k_h, None, p2=20.0, kr=kr, linear=True)
        assert result.toppled == (truth.outcome == "toppled")
        toppled += result.toppled
        if truth.peak_rad is not None:
            assert result.peak_theta_n == pytest.approx(truth.peak_rad / kr, rel=1e-7, abs=1e-10)
    assert toppled < 4
