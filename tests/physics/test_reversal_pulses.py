"""Non-linear reference values of section 6 of the theory: pulses with a reversal.

Gravity cancels: the published values are ratios, or are given in g.
"""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2 as G
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.results import Outcome
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import respond
from tests.physics.linear_block import critical_angle
from tests.physics.pulses import rectangular_cycle, sine_lobes

SAMPLES = 500


def reversal(r: float) -> GroundMotion:
    """Half-sine lobes of 1 g and -r g, 0.25 s each."""
    return sine_lobes(0.25, (1.0, -r) if r else (1.0,), SAMPLES)


def critical_of(motion: GroundMotion, p2: float) -> CriticalResult:
    result = critical(motion, p2=p2)
    assert result.status == "found"
    assert result.kr_over_pga is not None
    assert result.upper is not None
    # the proof covers max(q) max(-q) <= 1, here up to r = 1
    peaks = float(motion.acceleration_g.max() * -motion.acceleration_g.min())
    assert result.certified or peaks > 1.0
    # without a proof the upper end is that of what can rise at all
    assert result.upper - result.kr_over_pga < 1e-9 or not result.certified
    return result


def boundary_peak(r: float) -> float:
    """Peak over the critical angle of the weakest block that stays."""
    result = critical_of(reversal(r), 2.0)
    assert result.upper is not None
    run = respond(reversal(r), p2=2.0, kr=result.upper * result.pga_g * (1.0 + 1e-12))
    assert run.outcome is Outcome.STABLE
    assert run.peak_theta_n is not None
    return run.peak_theta_n


@pytest.mark.parametrize(
    ("r", "kr"), [(0.0, 0.19071), (0.35, 0.14338), (0.65, 0.10305), (1.0, 0.05636), (1.25, 0.02328)]
)
def test_critical_kr_of_reversal_pulses(r: float, kr: float) -> None:
    assert critical_of(reversal(r), 2.0).kr == pytest.approx(kr, abs=6e-6)


def test_a_block_can_pass_its_critical_angle_and_come_back() -> None:
    assert boundary_peak(1.0) == pytest.approx(1.264, abs=6e-4)


def test_reversal_that_brings_back_a_block_from_beyond_its_critical_angle() -> None:
    # without a strong reversal the border is the upright position itself
    assert boundary_peak(0.88) == pytest.approx(1.0, abs=1e-4)
    assert boundary_peak(0.88) <= 1.0
    assert boundary_peak(0.90) > 1.0


def test_the_linear_critical_angle_lies_above_except_at_r_1_25() -> None:
    for r in (0.0, 0.35, 0.65, 1.0):
        linear = critical_angle(reversal(r), p2=2.0)
        kr = critical_of(reversal(r), 2.0).kr
        assert linear is not None
        assert kr is not None
        assert 0.0 < math.tan(linear) / kr - 1.0 < 0.18
        assert 0.0 < linear / math.atan(kr) - 1.0 < 0.016 + 1e-3
    assert critical_angle(reversal(1.25), p2=2.0) == pytest.approx(0.02316, abs=6e-6)


@pytest.mark.parametrize(
    ("p2", "theta_c", "tan_ratio", "kr_over_pga"),
    [
        (1.0, 0.0236, 0.0236, 0.0235),
        (4.6, 0.0903, 0.0906, 0.0898),
        (21.5, 0.2897, 0.2981, 0.2852),
        (100.0, 0.6579, 0.7728, 0.6570),
    ],
)
def test_rectangular_full_cycle_of_1_g(
    p2: float, theta_c: float, tan_ratio: float, kr_over_pga: float
) -> None:
    # (4.21): lobes of 1/6 s

    wave = rectangular_cycle(1.0 / 6.0, 1.0)
    linear = critical_angle(wave, p2=p2)
    assert linear == pytest.approx(theta_c, abs=6e-5)
    assert linear is not None
    assert math.tan(linear) == pytest.approx(tan_ratio, abs=6e-5)
    assert critical_of(wave, p2).kr_over_pga == pytest.approx(kr_over_pga, abs=6e-5)


@pytest.mark.parametrize("velocity_m_s", [0.05, 0.5, 2.0, 5.0])
@pytest.mark.parametrize("p2", [0.3, 3.0, 30.0])
def test_impulse_limit(velocity_m_s: float, p2: float, monkeypatch: pytest.MonkeyPatch) -> None:
    # an impulse has a PGA that no record has
    monkeypatch.setattr("rbfrag.solver.excitation.PGA_MOST_G", math.inf)
    # k_r g/p = V cos(theta_c/2) for a velocity step
    duration = 1e-5 / math.sqrt(p2)
    amplitude = velocity_m_s / G / duration
    pulse = GroundMotion.from_nodes([0.0, 0.0, duration, duration], [0.0, amplitude, amplitude, 0])
    result = critical(pulse, p2=p2, search_limit=1e-9)
    assert result.kr is not None
    assert result.y_m_s is not None
    half_angle = 0.5 * math.atan(result.kr)
    assert result.y_m_s == pytest.approx(velocity_m_s * math.cos(half_angle), rel=2e-4)


@settings(max_examples=40)
@given(
    st.lists(st.floats(-1.0, 1.0, width=32), min_size=2, max_size=25),
    st.sampled_from([0.1, 1.0, 10.0, 100.0]),
    st.sampled_from([0.01, 0.05, 0.3]),
)
def test_linear_toppling_velocity_is_at_most_twice_pgv(
    samples: list[float], p2: float, dt_s: float
) -> None:
    motion = GroundMotion([*samples, 0.0], dt_s)  # type: ignore[arg-type]
    theta_c = critical_angle(motion, p2=p2, limit=0.01) if motion.pga_g else None
    if theta_c is not None:
        assert theta_c * G / math.sqrt(p2) <= 2.0 * motion.pgv_m_s * (1.0 + 1e-9)
