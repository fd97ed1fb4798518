"""The linear model against its closed forms (section 6 of the theory; Gibson, 4.20).

c = critical angle over the amplitude, f = p times the duration of one lobe.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest
from scipy.optimize import brentq

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.results import CriticalResult, Outcome
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import respond
from tests.physics.pulses import rectangle, rectangular_cycle, sine_lobes, triangle

F = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
AMPLITUDE_G = 0.37
P2 = 7.3
P = math.sqrt(P2)


def critical_angle(motion: GroundMotion) -> CriticalResult:
    result = critical(motion, p2=P2, linear=True, search_limit=1e-3)
    assert result.status == "found"
    return result


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
    result = critical_angle(make(f / P, AMPLITUDE_G))
    assert result.kr_over_pga == pytest.approx(closed_form(f), rel=1e-9)
    assert result.certified


@pytest.mark.parametrize("f", F)
def test_half_sine_sampled(f: float) -> None:
    result = critical_angle(sine_lobes(f / P, (AMPLITUDE_G,), 2000))
    assert result.kr_over_pga == pytest.approx(half_sine(f), rel=1e-6)


@pytest.mark.parametrize("f", F)
def test_one_cycle_sine_sampled(f: float) -> None:
    result = critical_angle(sine_lobes(f / P, (AMPLITUDE_G, -AMPLITUDE_G), 3000))
    assert result.kr_over_pga == pytest.approx(full_sine(f), rel=1e-6)


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
    found = critical_angle(triangle(f / P, AMPLITUDE_G)).kr_over_pga
    assert found == pytest.approx(triangular, abs=6e-9)


def test_error_of_a_sampled_pulse_falls_with_the_square_of_the_interval() -> None:
    errors = []
    for samples in (50, 100, 200, 400):
        found = critical_angle(sine_lobes(1.0 / P, (AMPLITUDE_G,), samples)).kr_over_pga
        assert found is not None
        errors.append(abs(found / half_sine(1.0) - 1.0))
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    assert orders == pytest.approx([2.0] * 3, abs=0.1)


@pytest.mark.parametrize("f", F)
def test_peak_of_the_rectangular_cycle_at_its_critical_value(f: float) -> None:
    # (4.20b). Just above the critical angle the block hangs near upright for a while, so the
    # peak differs from the limit by the distance's own amount times exp(2f).
    e = math.exp(f)
    limit = 1.0 + (e * e - math.sqrt(1.0 - 2.0 * e + 2.0 * e**3)) / (e - 1.0) ** 2
    distance = 1e-10
    run = respond(
        rectangular_cycle(f / P, AMPLITUDE_G),
        p2=P2,
        kr=AMPLITUDE_G * math.expm1(-f) ** 2 * (1.0 + distance),
        linear=True,
    )
    assert run.outcome is Outcome.STABLE
    assert run.peak_theta_n == pytest.approx(limit, rel=1e-9 + 10.0 * distance * e * e)


@pytest.mark.parametrize("amplitude_g", [1e-4, 0.05, 3.0])
def test_linear_critical_ratio_does_not_depend_on_the_amplitude(amplitude_g: float) -> None:
    found = critical_angle(triangle(1.3 / P, amplitude_g)).kr_over_pga
    expected = critical_angle(triangle(1.3 / P, 1.0)).kr_over_pga
    assert found == pytest.approx(expected, rel=1e-11)
