"""Analytic pulses: areas, peaks and key points are exact."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.pulses import (
    half_sine,
    rectangular,
    rectangular_cycle,
    reversal_pulse,
    sine_cycle,
    triangle,
)

G = 9.80665


def test_rectangle() -> None:
    pulse = rectangular(0.4, 0.3)
    assert pulse.pga_g == 0.4
    assert pulse.pgv_m_s == pytest.approx(0.4 * G * 0.3, rel=1e-15)
    assert pulse.pgd_m == pytest.approx(0.5 * 0.4 * G * 0.09, rel=1e-15)
    assert pulse.duration_s == 0.3


def test_triangle() -> None:
    pulse = triangle(-0.4, 0.3)
    assert pulse.pga_g == 0.4
    assert pulse.measures.final_velocity_m_s == pytest.approx(-0.5 * 0.4 * G * 0.3, rel=1e-15)


def test_rectangular_cycle_ends_at_rest() -> None:
    pulse = rectangular_cycle(0.4, 0.3)
    assert pulse.pgv_m_s == pytest.approx(0.4 * G * 0.3, rel=1e-15)
    assert pulse.measures.final_velocity_m_s == 0.0
    assert pulse.pgd_m == pytest.approx(0.4 * G * 0.09, rel=1e-14)
    assert pulse.duration_s == 0.6


@given(
    amplitude_g=st.floats(-3.0, 3.0),
    duration_s=st.floats(0.05, 5.0),
    dt_s=st.floats(0.001, 0.05),
)
def test_half_sine_key_points(amplitude_g: float, duration_s: float, dt_s: float) -> None:
    pulse = half_sine(amplitude_g, duration_s, dt_s)
    samples = pulse.acceleration_g
    assert pulse.dt_s is not None
    assert pulse.dt_s <= dt_s * (1.0 + 1e-12)
    assert pulse.duration_s == pytest.approx(duration_s, rel=1e-12)
    assert samples[0] == samples[-1] == 0.0
    assert samples[samples.size // 2] == amplitude_g
    assert pulse.pga_g == abs(amplitude_g)
    exact = amplitude_g * np.sin(math.pi * pulse.time_s / duration_s)
    np.testing.assert_allclose(samples, exact, rtol=0, atol=1e-12)


@pytest.mark.parametrize("ratio", [0.0, 0.35, 1.0, 1.25])
def test_reversal_pulse(ratio: float) -> None:
    pulse = reversal_pulse(1.0, ratio, 0.5, 0.001)
    quarter = (pulse.npts - 1) // 4
    samples = pulse.acceleration_g
    assert samples[[0, 2 * quarter, 4 * quarter]].tolist() == [0.0, 0.0, 0.0]
    assert samples[[quarter, 3 * quarter]].tolist() == [1.0, -ratio]
    assert pulse.duration_s == pytest.approx(0.5, rel=1e-14)
    lobe = G * 0.5 / math.pi
    assert pulse.measures.final_velocity_m_s == pytest.approx((1.0 - ratio) * lobe, abs=5e-5)


def test_sine_cycle_is_the_full_reversal() -> None:
    cycle = sine_cycle(0.7, 0.4, 0.003)
    exact = 0.7 * np.sin(2.0 * math.pi * cycle.time_s / 0.4)
    np.testing.assert_allclose(cycle.acceleration_g, exact, rtol=0, atol=1e-14)
    assert cycle.measures.final_velocity_m_s == pytest.approx(0.0, abs=1e-15)
    assert cycle.pga_g == 0.7


def test_dt_that_fits_is_kept() -> None:
    assert half_sine(1.0, 0.1, 0.005).dt_s == 0.005
    assert sine_cycle(1.0, 1.0, 0.005).dt_s == 0.005
    assert half_sine(1.0, 0.1, 0.03).dt_s == pytest.approx(0.025)


@pytest.mark.parametrize(
    ("make", "values", "word"),
    [
        (rectangular, (math.nan, 1.0), "nan"),
        (rectangular, (1.0, 0.0), "0.0"),
        (triangle, (1.0, -2.0), "-2.0"),
        (rectangular_cycle, (1.0, math.inf), "inf"),
        (half_sine, (1.0, 1.0, 0.0), "0.0"),
        (sine_cycle, (1.0, -1.0, 0.01), "-1.0"),
        (reversal_pulse, (1.0, -0.5, 1.0, 0.01), "-0.5"),
        (reversal_pulse, (1.0, math.nan, 1.0, 0.01), "nan"),
    ],
)
def test_bad_values(
    make: Callable[..., GroundMotion], values: tuple[float, ...], word: str
) -> None:
    with pytest.raises(InputError, match=word):
        make(*values)
