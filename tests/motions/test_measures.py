"""All stored measures against closed forms of a sine, and of a recording against plain sums."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motion
from rbfrag.motions.response_spectrum import HOUSNER_PERIODS_S
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S

G = 9.80665


def test_a_sine_in_closed_form() -> None:
    amplitude, omega, cycles = 0.3, 2.0 * math.pi / 0.5, 13
    length = cycles * 0.5
    t = np.linspace(0.0, length, 26001)
    m = GroundMotion(amplitude * np.sin(omega * t), t[1]).measures
    assert m.cav_m_s == pytest.approx(2.0 / math.pi * amplitude * G * length, rel=1e-5)
    assert m.arias_m_s == pytest.approx(math.pi / 4.0 * G * amplitude**2 * length, rel=1e-5)
    assert m.pgv_m_s == pytest.approx(2.0 * amplitude * G / omega, rel=1e-5)
    assert m.pgd_m == pytest.approx(amplitude * G / omega * length, rel=1e-5)

    def reached(fraction: float) -> float:
        def energy(time: float) -> float:
            return time - math.sin(2.0 * omega * time) / (2.0 * omega) - fraction * length

        return float(brentq(energy, 0.0, length))

    for end, duration in ((0.75, m.d5_75_s), (0.95, m.d5_95_s)):
        assert duration == pytest.approx(reached(end) - reached(0.05), rel=1e-5)


def psv(
    a_g: NDArray[np.float64], dt: float, periods: NDArray[np.float64], fine: int = 20
) -> NDArray[np.float64]:
    """PSV [m/s] by Newmark's average acceleration of all oscillators at once."""
    omega, h = 2.0 * math.pi / periods, dt / fine
    rest = int(periods.max() / dt)
    a = np.interp(np.arange((a_g.size + rest) * fine) / fine, np.arange(a_g.size), a_g, right=0.0)
    u, v, acc = np.zeros_like(omega), np.zeros_like(omega), np.full_like(omega, -a[0])
    stiffness = 4.0 / h**2 + 0.2 * omega / h + omega**2
    largest = np.zeros_like(omega)
    for load in -a[1:]:
        new = (
            load + 4.0 / h**2 * u + 4.0 / h * v + acc + 0.1 * omega * (2.0 / h * u + v)
        ) / stiffness
        acc = 4.0 / h**2 * (new - u) - 4.0 / h * v - acc
        v, u = 2.0 / h * (new - u) - v, new
        largest = np.maximum(largest, np.abs(u))
    result: NDArray[np.float64] = omega * largest * G
    return result


def test_a_recording_by_hand(formats_dir: Path) -> None:
    motion = read_motion(formats_dir / "records" / "afad_0118_E.asc")
    peak = int(np.argmax(np.abs(motion.acceleration_g)))
    a, dt = motion.acceleration_g[max(0, peak - 800) : peak + 800], motion.dt_s
    assert dt is not None
    record = GroundMotion(a, dt)
    m = record.measures
    fine = np.interp(np.arange((a.size - 1) * 50 + 1) / 50.0, np.arange(a.size), a)
    assert m.cav_m_s == pytest.approx(G * np.trapezoid(np.abs(fine), dx=dt / 50.0), rel=1e-4)
    energy = np.cumsum(fine**2) * dt / 50.0
    assert m.arias_m_s == pytest.approx(math.pi / 2.0 * G * energy[-1], rel=1e-4)
    times = [np.searchsorted(energy, part * energy[-1]) * dt / 50.0 for part in (0.05, 0.75, 0.95)]
    assert m.d5_75_s == pytest.approx(times[1] - times[0], abs=2e-3)
    assert m.d5_95_s == pytest.approx(times[2] - times[0], abs=2e-3)
    periods = np.array([*HOUSNER_PERIODS_S, 5.0])
    independent = psv(a, dt, periods)
    housner = np.trapezoid(independent[:-1], periods[:-1])
    assert record.housner_m == pytest.approx(housner, rel=1e-3)
    sa_g = dict(zip(SPECTRUM_PERIODS_S, record.spectrum_g, strict=True))
    for period, velocity in zip(periods.tolist(), independent.tolist(), strict=True):
        if period in sa_g:
            truth = velocity * 2.0 * math.pi / period / G
            assert sa_g[period] == pytest.approx(truth, rel=2e-3)


def test_the_housner_intensity_grows_with_the_motion_and_hardly_with_the_steps() -> None:
    rng = np.random.default_rng(1)
    motion = GroundMotion(np.convolve(rng.normal(size=800), np.hanning(15), "same"), 0.01)
    assert motion.scaled(2.0).housner_m == pytest.approx(2.0 * motion.housner_m, rel=1e-12)
    periods = np.linspace(0.1, 2.5, 193)
    psv_m_s = [motion.spectral_acceleration(t) * G * t / (2.0 * math.pi) for t in periods.tolist()]
    assert motion.housner_m == pytest.approx(np.trapezoid(psv_m_s, periods), rel=5e-3)
