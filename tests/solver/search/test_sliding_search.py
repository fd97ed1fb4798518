"""Sliding displacements and critical strengths, against closed forms and inequalities."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.critical import critical
from rbfrag.solver.models.sliding import KY_OVER_PGA, THRESHOLDS_M, sliding_displacements
from rbfrag.solver.respond import respond
from tests.synthetic import shaking as samples


def pulse(amplitude_g: float, duration_s: float) -> GroundMotion:
    return GroundMotion.from_nodes(
        np.array([0.0, 0.0, duration_s, duration_s, duration_s + 5.0]),
        np.array([0.0, amplitude_g, amplitude_g, 0.0, 0.0]),
    )


def pair(seed: int) -> tuple[GroundMotion, GroundMotion]:
    up = samples(seed + 1)
    return GroundMotion(samples(seed), 0.02), GroundMotion(0.5 * up / np.abs(up).max(), 0.02)


@pytest.mark.parametrize("threshold_m", THRESHOLDS_M)
@pytest.mark.parametrize(("amplitude_g", "duration_s"), [(0.5, 0.8), (1.2, 0.4)])
def test_the_strength_of_a_rectangular_pulse_is_the_closed_form(
    threshold_m: float, amplitude_g: float, duration_s: float
) -> None:
    # D = A g T²/2 (A/k_y - 1)
    result = critical(pulse(amplitude_g, duration_s), displacement_m=threshold_m)
    excited = amplitude_g * STANDARD_GRAVITY_M_S2 * duration_s**2
    expected = 1.0 / (1.0 + 2.0 * threshold_m / excited)
    assert result.status == "found"
    assert result.kr_over_pga == pytest.approx(expected, abs=1.1e-9)
    assert result.lower is not None
    assert result.upper is not None
    assert result.lower <= expected + 1e-12
    assert result.upper >= expected - 1e-12
    assert result.upper - result.lower <= 1e-9


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), with_vertical=st.booleans())
def test_displacement_falls_with_strength_and_is_convex(seed: int, with_vertical: bool) -> None:
    motion, up = pair(seed)
    strengths = np.linspace(0.02, 1.0, 40)
    slid = sliding_displacements(motion, strengths.tolist(), vertical=up if with_vertical else None)
    tiny = 1e-12 * slid[0]
    assert np.all(np.diff(slid) <= tiny)
    assert np.all(np.diff(slid, 2) >= -tiny)
    # at k_y = PGA rounding of the product may leave a sample above it by one unit
    assert slid[-1] <= tiny or with_vertical


@pytest.mark.parametrize("with_vertical", [False, True])
@pytest.mark.parametrize(("beta_deg", "ky"), [(15.0, 0.06), (30.0, 0.1), (-10.0, 0.2)])
def test_one_level_curve_serves_every_dip(with_vertical: bool, beta_deg: float, ky: float) -> None:
    motion, up = pair(5)
    vertical = up if with_vertical else None
    phi = math.radians(beta_deg) + math.atan(ky)
    factor = math.cos(math.atan(ky)) / math.cos(phi)
    level = sliding_displacements(motion, [ky / motion.pga_g], vertical=vertical)[0]
    inclined = respond(motion, ky=ky, beta_deg=beta_deg, vertical=vertical)
    assert level > 0.0
    assert inclined.displacement_m == pytest.approx(factor * level, rel=1e-9)


@pytest.mark.parametrize("with_vertical", [False, True])
def test_the_bracket_lies_between_strengths_that_do_and_do_not_slide_so_far(
    with_vertical: bool,
) -> None:
    motion, up = pair(11)
    vertical = up if with_vertical else None
    result = critical(motion, displacement_m=0.01, vertical=vertical, polarity="reverse")
    assert result.status == "found"
    assert result.lower is not None
    assert result.upper is not None
    ends = [result.lower, result.upper]
    far, near = sliding_displacements(motion, ends, vertical=vertical, polarity="reverse")
    assert far > 0.01 >= near


def test_displacement_scales_with_record_and_strength() -> None:
    motion, _ = pair(2)
    assert motion.dt_s is not None
    double = GroundMotion(2.0 * motion.acceleration_g, motion.dt_s)
    single, two = sliding_displacements(motion), sliding_displacements(double)
    np.testing.assert_allclose(two, 2.0 * single, rtol=1e-9, atol=1e-15)


def test_no_distance_at_all_is_the_strength_that_first_moves() -> None:
    motion, _ = pair(7)
    for polarity, sign in (("forward", 1.0), ("reverse", -1.0)):
        result = critical(motion, displacement_m=0.0, polarity=polarity)  # type: ignore[arg-type]
        most = float(np.max(sign * motion.acceleration_g))
        assert result.kr_over_pga == most / motion.pga_g
        assert result.n_runs == 0


def test_what_never_slides_so_far_says_so() -> None:
    weak = GroundMotion(1e-3 * np.hanning(50), 0.01)
    assert critical(weak, displacement_m=0.3).status == "below_limit"
    away = GroundMotion(-np.hanning(50), 0.01)
    assert critical(away, displacement_m=0.01).status == "no_motion"
    still = GroundMotion(np.zeros(50), 0.01)
    assert critical(still, displacement_m=0.01).status == "no_motion"
    thrown = GroundMotion(-2.0 * np.hanning(50), 0.01)
    motion = GroundMotion(np.hanning(50), 0.01)
    result = critical(motion, displacement_m=0.01, vertical=thrown)
    assert result.status == "outside_model"
    assert np.isnan(sliding_displacements(motion, [0.1], vertical=thrown)).all()


def test_impossible_numbers_are_rejected() -> None:
    motion, _ = pair(1)
    with pytest.raises(InputError, match="ky_over_pga"):
        sliding_displacements(motion, [0.1, 0.0])
    with pytest.raises(InputError, match="displacement_m"):
        critical(motion, displacement_m=-0.1)
    with pytest.raises(InputError, match="PGA"):
        sliding_displacements(GroundMotion(np.zeros(10), 0.01), KY_OVER_PGA)
