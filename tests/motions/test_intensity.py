"""Intensity measures against closed forms and an independent integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.intensity import displacement_m, mean_period, velocity_m_s

G = 9.80665

FloatArray = NDArray[np.float64]

amplitudes = st.floats(-3.0, 3.0).map(lambda x: round(x, 6))
samples = arrays(np.float64, st.integers(1, 30), elements=amplitudes)


def fine_history(motion: GroundMotion, parts: int) -> tuple[FloatArray, FloatArray]:
    """Velocity and displacement at `parts` points of every interval, summed in plain loops.

    Each short piece is integrated by Gauss quadrature of the interpolated record, which
    shares no formula with the code under test.
    """
    points, weights = np.polynomial.legendre.leggauss(3)
    points, weights = 0.5 * (points + 1.0), 0.5 * weights
    v = d = 0.0
    vs, ds = [v], [d]
    for a0, a1, h in zip(
        motion.acceleration_g[:-1], motion.acceleration_g[1:], motion.interval_s, strict=True
    ):
        piece = h / parts
        for part in range(parts):
            at = (part + points) / parts
            a = G * (a0 + (a1 - a0) * at)
            # d = ∫∫a: the remaining time of the piece weighs each acceleration
            d += v * piece + piece * float(np.sum(weights * a * (1.0 - points))) * piece
            v += piece * float(np.sum(weights * a))
            vs.append(v)
            ds.append(d)
    return np.array(vs), np.array(ds)


def test_rectangular_pulse_with_jumps() -> None:
    m = GroundMotion.from_nodes([0, 0, 0.5, 0.5], [0, 0.4, 0.4, 0]).measures
    assert m.pga_g == 0.4
    assert m.pgv_m_s == pytest.approx(0.4 * G * 0.5, rel=1e-15)
    assert m.pgd_m == pytest.approx(0.5 * 0.4 * G * 0.25, rel=1e-15)
    assert m.final_velocity_m_s == pytest.approx(0.4 * G * 0.5, rel=1e-15)
    assert m.final_displacement_m == pytest.approx(0.5 * 0.4 * G * 0.25, rel=1e-15)
    assert m.tm_s is None


def test_triangular_pulse() -> None:
    m = GroundMotion.from_nodes([0, 1, 2], [0, 0.3, 0]).measures
    assert m.pgv_m_s == pytest.approx(0.3 * G, rel=1e-15)
    assert m.pgd_m == pytest.approx(0.3 * G, rel=1e-15)


def test_rectangular_cycle_ends_at_rest() -> None:
    m = GroundMotion.from_nodes([0, 0, 1, 1, 2, 2], [0, 0.2, 0.2, -0.2, -0.2, 0]).measures
    assert m.pgv_m_s == pytest.approx(0.2 * G, rel=1e-15)
    assert m.final_velocity_m_s == pytest.approx(0.0, abs=1e-15)
    assert m.final_displacement_m == pytest.approx(0.2 * G, rel=1e-15)


def test_velocity_is_extreme_inside_an_interval_where_acceleration_vanishes() -> None:
    # From +1 to -3 in 1 s: zero at 1/4 s, v = ½·1·¼ = 1/8 there, -1 at the end, 0 at the start.
    m = GroundMotion([1.0, -3.0], 1.0).measures
    assert m.pgv_m_s == pytest.approx(G, rel=1e-15)
    # +3 to -1: the velocity at 3/4 s, 9/8, is above the 1 of the last sample.
    m = GroundMotion([3.0, -1.0], 1.0).measures
    assert m.pgv_m_s == pytest.approx(9 / 8 * G, rel=1e-15)
    assert m.final_velocity_m_s == pytest.approx(G, rel=1e-15)


def test_displacement_is_extreme_inside_an_interval_where_velocity_vanishes() -> None:
    # a = 1 - 3t over 1 s: v = t - 1.5 t², zero at 2/3; d = t²/2 - t³/2 = 2/27 there, 0 at 1 s.
    m = GroundMotion([1.0, -2.0], 1.0).measures
    assert m.pgd_m == pytest.approx(2 / 27 * G, rel=1e-14)
    assert m.final_displacement_m == pytest.approx(0.0, abs=1e-15)


def test_velocity_that_vanishes_twice_inside_one_interval() -> None:
    # v0 = 1/6 g, a from -1 to +1: v = 1/6 - t + t² is zero at ½ ± √(1/12), d is extreme at both.
    lead = math.sqrt(1.0 / 3.0)
    m = GroundMotion.from_nodes([0, lead, lead, lead + 1], [0, lead, -1, 1])
    v0, d0 = 0.5 * lead**2, lead**3 / 6
    assert v0 == pytest.approx(1 / 6)
    at = 0.5 - math.sqrt(1 / 12)
    top = d0 + v0 * at - at**2 / 2 + at**3 / 3
    assert top > d0 + v0 - 1 / 2 + 1 / 3
    assert m.pgd_m == pytest.approx(top * G, rel=1e-13)


@settings(max_examples=60)
@given(samples, st.data())
def test_measures_are_the_extremes_of_an_independent_integration(
    a: FloatArray, data: st.DataObject
) -> None:
    steps = data.draw(
        arrays(
            np.float64,
            a.size - 1,
            elements=st.one_of(st.just(0.0), st.floats(0.001, 0.5).map(lambda x: round(x, 4))),
        )
    )
    motion = GroundMotion.from_nodes(np.concatenate([[0.0], np.cumsum(steps)]), a)
    v, d = fine_history(motion, parts=40)
    m = motion.measures
    assert m.pga_g == np.max(np.abs(a))
    for peak, points, rate in ((m.pgv_m_s, v, m.pga_g * G), (m.pgd_m, d, m.pgv_m_s)):
        largest = float(np.max(np.abs(points)))
        # The grid misses an extreme by at most one piece of the steepest change.
        assert largest - 1e-10 <= peak <= largest + rate * 0.5 / 40 + 1e-10
    assert m.final_velocity_m_s == pytest.approx(v[-1], abs=1e-10)
    assert m.final_displacement_m == pytest.approx(d[-1], abs=1e-10)


@settings(max_examples=40)
@given(samples)
def test_histories_pass_through_the_independent_integration(a: FloatArray) -> None:
    motion = GroundMotion(a, 0.02)
    v, d = fine_history(motion, parts=1)
    np.testing.assert_allclose(velocity_m_s(a, motion.interval_s), v, atol=1e-12)
    np.testing.assert_allclose(displacement_m(a, motion.interval_s), d, atol=1e-12)


@settings(max_examples=60)
@given(samples, st.integers(-300, 300))
def test_scaling_by_a_power_of_two_scales_every_measure_exactly(a: FloatArray, power: int) -> None:
    motion = GroundMotion(np.where(np.abs(a) < 1e-3, 0.0, a), 0.01)
    scaled = motion.scaled(2.0**power)
    for name in ("pga_g", "pgv_m_s", "pgd_m", "final_velocity_m_s", "final_displacement_m"):
        was, now = getattr(motion.measures, name), getattr(scaled.measures, name)
        assert now == pytest.approx(was * 2.0**power, rel=1e-12, abs=0.0)
    if motion.tm_s is None:
        assert scaled.tm_s is None
    else:
        assert scaled.tm_s == pytest.approx(motion.tm_s, rel=1e-12)


@settings(max_examples=40)
@given(samples)
def test_reversed_polarity_keeps_peaks_and_turns_final_values(a: FloatArray) -> None:
    m, r = GroundMotion(a, 0.01).measures, GroundMotion(-a, 0.01).measures
    assert (m.pga_g, m.pgv_m_s, m.pgd_m, m.tm_s) == (r.pga_g, r.pgv_m_s, r.pgd_m, r.tm_s)
    assert m.final_velocity_m_s == -r.final_velocity_m_s
    assert m.final_displacement_m == -r.final_displacement_m


@pytest.mark.parametrize("frequency_hz", [0.25, 0.5, 1.0, 7.0, 19.95, 20.0])
def test_mean_period_of_a_sine_is_its_period_up_to_both_band_edges(frequency_hz: float) -> None:
    # 20 s at 0.005 s: every frequency above is a line of the transform, the edges included.
    a = np.sin(2 * math.pi * frequency_hz * np.arange(4000) * 0.005)
    assert mean_period(a, 0.005) == pytest.approx(1.0 / frequency_hz, rel=1e-9)


@pytest.mark.parametrize("dt_s", [0.001, 0.0025, 0.004, 0.005, 0.01, 0.02, 0.025])
def test_band_edges_are_inside_for_every_usual_interval(dt_s: float) -> None:
    n = round(20.0 / dt_s)
    t = np.arange(n) * dt_s
    for frequency_hz in (0.25, 20.0):
        a = np.cos(2 * math.pi * frequency_hz * t)
        assert mean_period(a, dt_s) == pytest.approx(1.0 / frequency_hz, rel=1e-9)


def test_power_outside_the_band_does_not_move_the_mean_period() -> None:
    # The trap: the sum over all frequencies would be drawn to the long-period and fast waves.
    t = np.arange(4000) * 0.005
    inside = np.sin(2 * math.pi * 2.0 * t)
    outside = 5 * np.sin(2 * math.pi * 0.2 * t) + 5 * np.sin(2 * math.pi * 20.05 * t) + 3.0
    assert mean_period(inside + outside, 0.005) == pytest.approx(0.5, rel=1e-9)


def test_mean_period_weighs_by_squared_amplitude() -> None:
    t = np.arange(4000) * 0.005
    a = 3.0 * np.sin(2 * math.pi * 1.0 * t) + 4.0 * np.cos(2 * math.pi * 5.0 * t)
    assert mean_period(a, 0.005) == pytest.approx((9 * 1.0 + 16 * 0.2) / 25, rel=1e-9)


@pytest.mark.parametrize(("n", "dt_s"), [(300, 0.01), (5001, 0.005), (7, 0.02), (1501, 0.02)])
def test_mean_period_equals_a_plain_fourier_sum(n: int, dt_s: float) -> None:
    a = np.random.default_rng(n).standard_normal(n)
    # Padded to a step of 0.05 Hz when shorter than 20 s, and not at all otherwise.
    nfft = max(n, round(20.0 / dt_s))
    up = down = 0.0
    for k in range(nfft):
        f = k / (nfft * dt_s)
        if 0.25 - 1e-9 <= f <= 20.0 + 1e-9:
            c = np.sum(a * np.exp(-2j * math.pi * k * np.arange(n) / nfft))
            up += abs(c) ** 2 / f
            down += abs(c) ** 2
    assert mean_period(a, dt_s) == pytest.approx(up / down, rel=1e-9)


def test_coarse_record_uses_the_band_that_exists() -> None:
    t = np.arange(400) * 0.05
    assert mean_period(np.sin(2 * math.pi * 2.0 * t), 0.05) == pytest.approx(0.5, rel=1e-9)


def test_no_mean_period_without_power_in_the_band() -> None:
    assert GroundMotion(np.zeros(50), 0.01).tm_s is None
    assert GroundMotion(np.ones(4000), 0.005).tm_s is None
    assert GroundMotion([0.1, 0.2, 0.1], 5.0).tm_s is None
    assert GroundMotion.from_nodes([0, 1, 2], [0, 1, 0]).tm_s is None


def test_absurdly_short_interval_answers_without_a_transform_of_gigabytes() -> None:
    # A spike much shorter than the band's waves is white: Tm is the mean of 1/f over the lines.
    lines = np.arange(5, 401) * 0.05
    assert mean_period(np.array([0.0, 1.0, 0.5]), 1e-9) == pytest.approx(np.mean(1 / lines))


def test_short_interval_equals_a_plain_fourier_sum() -> None:
    a = np.random.default_rng(3).standard_normal(200) + 0.2
    dt = 20.0 / (1 << 23)
    lines = np.arange(5, 401) * 0.05
    c = np.exp(-2j * math.pi * np.outer(lines, np.arange(200) * dt)) @ a
    power = np.abs(c) ** 2
    assert mean_period(a, dt) == pytest.approx(np.sum(power / lines) / np.sum(power), rel=1e-9)


def test_one_sample_and_zero_record() -> None:
    m = GroundMotion([0.3], 0.01).measures
    assert (m.pga_g, m.pgv_m_s, m.pgd_m) == (0.3, 0.0, 0.0)
    m = GroundMotion(np.zeros(9), 0.01).measures
    assert (m.pga_g, m.pgv_m_s, m.pgd_m, m.tm_s, m.final_velocity_m_s) == (0, 0, 0, None, 0)


def test_a_record_beyond_floating_point_is_rejected_in_words() -> None:
    with pytest.raises(InputError, match=r"PGA 1e\+308 g lasting 200 s .*check units"):
        _ = GroundMotion([1e308, 1e308, 1e308], 100.0).measures


def test_an_absurd_interval_has_no_mean_period() -> None:
    assert mean_period(np.array([0.0, 1.0, -1.0, 0.0]), 1e-320) is None


def test_cav_arias_and_duration_in_closed_form() -> None:
    # a rectangle: CAV = a g T, Arias = π/2 a² g T, from 5 to 95 % of the time
    m = GroundMotion.from_nodes([0, 0, 2, 2], [0, 0.3, 0.3, 0]).measures
    assert m.cav_m_s == pytest.approx(0.3 * G * 2.0, rel=1e-14)
    assert m.arias_m_s == pytest.approx(0.5 * math.pi * 0.09 * G * 2.0, rel=1e-14)
    assert m.d5_95_s == pytest.approx(1.8, rel=1e-12)
    # one line from -1 to 1 g in 2 s: a² = t² about its middle, |a| two triangles
    m = GroundMotion([-1.0, 1.0], 2.0).measures
    assert m.cav_m_s == pytest.approx(G, rel=1e-14)
    assert m.arias_m_s == pytest.approx(0.5 * math.pi * G * 2.0 / 3.0, rel=1e-14)
    assert m.d5_95_s == pytest.approx(2.0 * 0.9 ** (1.0 / 3.0), rel=1e-12)


def test_cav_arias_and_duration_of_a_finer_sampling_are_the_same() -> None:
    a = np.random.default_rng(5).normal(size=200)
    fine = np.interp(np.arange(199 * 16 + 1) / 16.0, np.arange(200.0), a)
    coarse, finer = GroundMotion(a, 0.01).measures, GroundMotion(fine, 0.01 / 16.0).measures
    for name in ("cav_m_s", "arias_m_s", "d5_95_s"):
        assert getattr(coarse, name) == pytest.approx(getattr(finer, name), rel=1e-12)
    rest = GroundMotion(np.zeros(9), 0.01).measures
    assert (rest.cav_m_s, rest.arias_m_s, rest.d5_95_s) == (0.0, 0.0, None)
