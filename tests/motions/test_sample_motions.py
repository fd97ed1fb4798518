"""Analytic pulses: areas, peaks and key points are exact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.motions.sample_motions import reversal_pulse

G = 9.80665


@given(
    amplitude_g=st.floats(-3.0, 3.0),
    period_s=st.floats(0.1, 10.0),
    dt_s=st.floats(0.001, 0.05),
)
def test_a_full_reversal_is_a_cycle_of_a_sine(
    amplitude_g: float, period_s: float, dt_s: float
) -> None:
    pulse = reversal_pulse(amplitude_g, 1.0, period_s, dt_s)
    samples = pulse.acceleration_g
    assert pulse.dt_s is not None
    assert pulse.dt_s <= dt_s * (1.0 + 1e-12)
    assert pulse.duration_s == pytest.approx(period_s, rel=1e-12)
    assert pulse.pga_g == abs(amplitude_g)
    exact = amplitude_g * np.sin(2.0 * math.pi * pulse.time_s / period_s)
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


def test_dt_that_fits_is_kept() -> None:
    assert reversal_pulse(1.0, 0.0, 0.2, 0.005).dt_s == 0.005
    assert reversal_pulse(1.0, 0.0, 0.2, 0.03).dt_s == pytest.approx(0.025)


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ((math.inf, 1.0, 1.0, 0.01), "inf"),
        ((1.0, -0.5, 1.0, 0.01), "-0.5"),
        ((1.0, math.nan, 1.0, 0.01), "nan"),
        ((1.0, 1.0, -1.0, 0.01), "-1.0"),
        ((1.0, 1.0, 1.0, 0.0), "0.0"),
        ((1.0, 1.0, 1.0, 1e-9), "samples"),
    ],
)
def test_bad_values(values: tuple[float, ...], word: str) -> None:
    with pytest.raises(InputError, match=word):
        reversal_pulse(*values)
