"""Intensity measures of an accelerogram, as supplied: no detrending, no filter.

The record is piecewise linear between its samples. Its velocity and displacement are then
known exactly, and so are their extremes, which lie inside intervals: velocity is extreme
where the acceleration vanishes, displacement where the velocity does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

TM_BAND_HZ = (0.25, 20.0)
"""Frequencies that the mean period is taken over, ends included."""

TM_FREQUENCY_STEP_HZ = 0.05
"""Widest step between the frequencies of the mean period; shorter records are padded."""


@dataclass(frozen=True)
class IntensityMeasures:
    """The intensity measures of one component.

    Args:
        pga_g: peak ground acceleration max|a| [g].
        pgv_m_s: peak ground velocity, the extreme of the exact integral [m/s].
        pgd_m: peak ground displacement, the extreme of the exact double integral [m].
        tm_s: mean period [s]; None where it is not defined.
        final_velocity_m_s: velocity at the end of the record [m/s]; a sign of quality.
        final_displacement_m: displacement at the end of the record [m].
    """

    pga_g: float
    pgv_m_s: float
    pgd_m: float
    tm_s: float | None
    final_velocity_m_s: float
    final_displacement_m: float


def intensity_measures(
    acceleration_g: FloatArray, interval_s: FloatArray, dt_s: float | None
) -> IntensityMeasures:
    """Return all intensity measures of one component, from rest over the whole record.

    Args:
        acceleration_g: samples [g], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,); zero for a jump.
        dt_s: sampling interval [s]; None where samples are not equally spaced, and the
            mean period is not defined.
    """
    a = acceleration_g * STANDARD_GRAVITY_M_S2
    v = velocity_m_s(acceleration_g, interval_s)
    d = displacement_m(acceleration_g, interval_s)
    return IntensityMeasures(
        pga_g=float(np.abs(acceleration_g).max()),
        pgv_m_s=_peak(v, _velocity_extremes(a, v, interval_s)),
        pgd_m=_peak(d, _displacement_extremes(a, v, d, interval_s)),
        tm_s=None if dt_s is None else mean_period(acceleration_g, dt_s),
        final_velocity_m_s=float(v[-1]),
        final_displacement_m=float(d[-1]),
    )


def velocity_m_s(acceleration_g: FloatArray, interval_s: FloatArray) -> FloatArray:
    """Return the velocity at the samples [m/s], from rest; the trapezoid is exact here.

    Args:
        acceleration_g: samples [g], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,).
    """
    a = acceleration_g * STANDARD_GRAVITY_M_S2
    return _running_sum(0.5 * (a[:-1] + a[1:]) * interval_s)


def displacement_m(acceleration_g: FloatArray, interval_s: FloatArray) -> FloatArray:
    """Return the displacement at the samples [m], from rest, exact for linear pieces.

    Args:
        acceleration_g: samples [g], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,).
    """
    a = acceleration_g * STANDARD_GRAVITY_M_S2
    v = velocity_m_s(acceleration_g, interval_s)
    return _running_sum(v[:-1] * interval_s + (2.0 * a[:-1] + a[1:]) * interval_s**2 / 6.0)


def mean_period(acceleration_g: FloatArray, dt_s: float) -> float | None:
    """Return the mean period Tm [s]; None where the band holds no power.

    Tm = sum(C²/f)/sum(C²) over 0.25 <= f <= 20 Hz, C the Fourier amplitudes of the
    acceleration, frequency step <= 0.05 Hz, no taper (Rathje, Abrahamson & Bray 1998,
    "Simplified frequency content estimates of earthquake ground motions").

    Args:
        acceleration_g: equally spaced samples [g], shape (n,).
        dt_s: sampling interval [s].
    """
    # rounded first: 1/(0.05*0.005) is 4000.0000000000005 in binary
    n_fft = max(acceleration_g.size, math.ceil(round(1.0 / (TM_FREQUENCY_STEP_HZ * dt_s), 6)))
    frequency = np.arange(n_fft // 2 + 1) / (n_fft * dt_s)
    # a band edge that is a frequency of the transform must not be lost to its last bit
    slack = 1e-9
    inside = (frequency >= TM_BAND_HZ[0] * (1.0 - slack)) & (
        frequency <= TM_BAND_HZ[1] * (1.0 + slack)
    )
    power = np.abs(np.fft.rfft(acceleration_g, n_fft)[inside]) ** 2
    total = float(power.sum())
    if not total > 0.0:
        return None
    return float((power / frequency[inside]).sum() / total)


def _velocity_extremes(a: FloatArray, v: FloatArray, interval_s: FloatArray) -> FloatArray:
    """Velocity where the acceleration vanishes inside an interval."""
    a0, a1 = a[:-1], a[1:]
    crossing = a0 * a1 < 0.0
    a0, a1 = a0[crossing], a1[crossing]
    # the triangle between the sample and the crossing
    return v[:-1][crossing] + 0.5 * a0 * interval_s[crossing] * a0 / (a0 - a1)


def _displacement_extremes(
    a: FloatArray, v: FloatArray, d: FloatArray, interval_s: FloatArray
) -> FloatArray:
    """Displacement where the velocity vanishes inside an interval."""
    h = interval_s
    slope = (a[1:] - a[:-1]) * h
    # velocity over the interval: v0 + b tau + slope tau²/2
    v0, b, half = v[:-1], a[:-1] * h, 0.5 * slope
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - 4.0 * half * v0)
        # the form without cancellation gives one root, their product the other
        k = -0.5 * (b + np.copysign(root, b))
        candidates = np.stack([k / half, v0 / k])
    inside = (candidates > 0.0) & (candidates < 1.0)
    tau = np.where(inside, candidates, 0.0)
    return (d[:-1] + v0 * h * tau + h * (b * tau**2 / 2.0 + slope * tau**3 / 6.0)).ravel()


def _running_sum(steps: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(steps)])


def _peak(at_samples: FloatArray, inside: FloatArray) -> float:
    return float(max(np.abs(at_samples).max(), np.abs(inside).max(initial=0.0)))
