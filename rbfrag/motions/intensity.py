"""Intensity measures of a record that is linear between its samples.

Velocity and displacement are the exact integrals of that record, started from rest, with
no detrending: PGV and PGD are the extremes of those integrals, inside intervals as well as
at samples, so they do not depend on where the samples happen to lie.

Every function takes the samples `acceleration_g` [g], shape (n,), n >= 1, and the lengths
`interval_s` of the intervals between them [s], shape (n - 1,), >= 0; a zero is a jump.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.polarity import FloatArray
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

TM_BAND_HZ = (0.25, 20.0)
"""Frequencies that the mean period uses, both edges included [Hz]."""

TM_FREQUENCY_STEP_HZ = 0.05
"""Largest frequency step of the mean period [Hz]; zeros lengthen a shorter record to it."""

_EDGE_TOLERANCE = 1e-9
_BISECTIONS = 60
_LONGEST_ZERO_FILLED_FFT = 1 << 22


@dataclass(frozen=True)
class IntensityMeasures:
    """Intensity measures of one motion.

    Args:
        pga_g: peak ground acceleration, max|a| over both signs [g].
        pgv_m_s: peak ground velocity, extreme of the exact integral [m/s].
        pgd_m: peak ground displacement, extreme of the exact double integral [m].
        tm_s: mean period [s]; None where :func:`mean_period` is not defined.
        final_velocity_m_s: velocity at the last sample [m/s]; a quality sign, 0 for rest.
        final_displacement_m: displacement at the last sample [m].
        cav_m_s: cumulative absolute velocity, ∫|a| dt [m/s].
        arias_m_s: Arias intensity, π/(2 g) ∫a² dt [m/s].
        d5_75_s: significant duration, from 5 to 75 % of ∫a² dt [s]; None where that is zero.
        d5_95_s: likewise from 5 to 95 %.
    """

    pga_g: float
    pgv_m_s: float
    pgd_m: float
    tm_s: float | None
    final_velocity_m_s: float
    final_displacement_m: float
    cav_m_s: float
    arias_m_s: float
    d5_75_s: float | None
    d5_95_s: float | None


def intensity_measures(
    acceleration_g: FloatArray, interval_s: FloatArray, dt_s: float | None
) -> IntensityMeasures:
    """Return all intensity measures of a piecewise-linear record.

    Args:
        dt_s: the sampling interval [s], or None for samples that are not equally spaced
            (then there is no mean period).
    """
    scaled, scale = _scaled(acceleration_g)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        velocity = velocity_m_s(scaled, interval_s)
        displacement = displacement_m(scaled, interval_s)
        inner_velocity = _velocity_extremes(scaled, interval_s, velocity)
        inner_displacement = _displacement_extremes(scaled, interval_s, velocity, displacement)
        energy = running_energy(scaled, interval_s)
    measures = IntensityMeasures(
        pga_g=float(np.max(np.abs(acceleration_g))),
        pgv_m_s=scale * _largest(velocity, inner_velocity),
        pgd_m=scale * _largest(displacement, inner_displacement),
        tm_s=None if dt_s is None else mean_period(acceleration_g, dt_s),
        final_velocity_m_s=scale * float(velocity[-1]),
        final_displacement_m=scale * float(displacement[-1]),
        cav_m_s=scale * cumulative_absolute_velocity(scaled, interval_s),
        arias_m_s=scale * scale * 0.5 * math.pi * STANDARD_GRAVITY_M_S2 * float(energy[-1]),
        d5_75_s=significant_duration(scaled, interval_s, energy, 0.75),
        d5_95_s=significant_duration(scaled, interval_s, energy, 0.95),
    )
    if not all(map(math.isfinite, (measures.pgv_m_s, measures.pgd_m, measures.arias_m_s))):
        raise InputError(
            f"the velocity, displacement or intensity of a motion with PGA {measures.pga_g:g} g "
            f"lasting {float(np.sum(interval_s)):g} s is too large to compute: check units and "
            "time step"
        )
    return measures


def velocity_m_s(acceleration_g: FloatArray, interval_s: FloatArray) -> FloatArray:
    """Return the ground velocity at each sample, from rest [m/s], shape (n,).

    The trapezoidal sum, which is exact for a piecewise-linear record.
    """
    steps = (0.5 * STANDARD_GRAVITY_M_S2) * interval_s * (acceleration_g[:-1] + acceleration_g[1:])
    return _running_sum(steps)


def displacement_m(acceleration_g: FloatArray, interval_s: FloatArray) -> FloatArray:
    """Return the ground displacement at each sample, from rest [m], shape (n,).

    Exact for a piecewise-linear record: an interval adds v dt + (2 a0 + a1) dt²/6.
    """
    velocity = velocity_m_s(acceleration_g, interval_s)
    bend = (STANDARD_GRAVITY_M_S2 / 6.0) * interval_s * interval_s
    steps = velocity[:-1] * interval_s + bend * (2.0 * acceleration_g[:-1] + acceleration_g[1:])
    return _running_sum(steps)


def cumulative_absolute_velocity(acceleration_g: FloatArray, interval_s: FloatArray) -> float:
    """Return CAV = ∫|a| dt [m/s], exact for a piecewise-linear record (EPRI 1988, NP-5930)."""
    a0, a1 = acceleration_g[:-1], acceleration_g[1:]
    total = np.abs(a0) + np.abs(a1)
    # an interval that crosses zero holds two triangles of heights |a0|, |a1|
    crossing = np.sign(a0) * np.sign(a1) < 0.0
    squares = np.divide(a0 * a0 + a1 * a1, total, out=np.zeros_like(total), where=crossing)
    return 0.5 * STANDARD_GRAVITY_M_S2 * float(interval_s @ np.where(crossing, squares, total))


def running_energy(acceleration_g: FloatArray, interval_s: FloatArray) -> FloatArray:
    """Return ∫a² dt from the first sample to each [g²·s], shape (n,), exact."""
    a0, a1 = acceleration_g[:-1], acceleration_g[1:]
    return _running_sum(interval_s * (a0 * a0 + a0 * a1 + a1 * a1) / 3.0)


def significant_duration(
    acceleration_g: FloatArray, interval_s: FloatArray, energy: FloatArray, end: float
) -> float | None:
    """Return D5-95 or D5-75 [s], the time in which ∫a² dt grows from 5 % to a fraction of its end.

    (Trifunac & Brady 1975, Bull. Seism. Soc. Am. 65(3), 581-626; for 75 % Somerville et al. 1997,
    Seism. Res. Lett. 68(1), 199-222), exact for a piecewise-linear record.

    Args:
        energy: ∫a² dt of :func:`running_energy` [g²·s], shape (n,).
        end: fraction at which the duration ends: 0.95 or 0.75.

    Returns:
        The duration, or None where the ground never moves.
    """
    total = float(energy[-1])
    if not 0.0 < total < math.inf:
        return None
    times = _running_sum(interval_s)
    reached = []
    for share in (0.05, end):
        threshold = share * total
        # the interval that ends above what is wanted and began at or below it
        at = int(np.searchsorted(energy, threshold, side="right")) - 1
        a0, slope = float(acceleration_g[at]), float(acceleration_g[at + 1] - acceleration_g[at])
        low, high = 0.0, 1.0
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            a = a0 + middle * slope
            part = float(interval_s[at]) * middle * (a0 * a0 + a0 * a + a * a) / 3.0
            low, high = (middle, high) if energy[at] + part < threshold else (low, middle)
        reached.append(float(times[at]) + high * float(interval_s[at]))
    return reached[1] - reached[0]


def mean_period(acceleration_g: FloatArray, dt_s: float) -> float | None:
    """Return the mean period T_m [s] of an equally spaced record.

    T_m = Σ C_i²/f_i / Σ C_i², with C_i the Fourier amplitudes of the acceleration at
    0.25 Hz <= f_i <= 20 Hz; nfft = max(n, ceil(1 / (0.05 dt))), no taper, no further padding
    (Rathje, Abrahamson & Bray 1998, J. Geotech. Geoenviron. Eng. 124(2), 150-159).

    Args:
        acceleration_g: samples, shape (n,); the unit does not matter.
        dt_s: sampling interval [s]. Above 0.025 s the band ends at the Nyquist frequency.

    Returns:
        The mean period, or None where the record has no power in the band.
    """
    scaled, _ = _scaled(acceleration_g)
    fine_enough = _ceil(1.0 / TM_FREQUENCY_STEP_HZ / dt_s)
    nfft = max(float(scaled.size), fine_enough)
    window_s = nfft * dt_s
    if not math.isfinite(window_s):
        return None
    lowest, highest = TM_BAND_HZ
    first = _ceil(lowest * window_s)
    last = min(-_ceil(-highest * window_s), nfft // 2)
    if last < first:
        return None
    numbers = np.arange(first, last + 1.0)
    if nfft > max(scaled.size, _LONGEST_ZERO_FILLED_FFT):
        power = _power_by_direct_sum(scaled, numbers / nfft)
    else:
        spectrum = np.fft.rfft(scaled, int(nfft))[int(first) : int(last) + 1]
        power = np.square(spectrum.real) + np.square(spectrum.imag)
    total = float(np.sum(power))
    # A constant or zero record leaves only the rounding of the transform in the band.
    if not total > (1e-15 * float(np.sum(np.abs(scaled)))) ** 2:
        return None
    return float(np.sum(power / numbers)) * window_s / total


def _power_by_direct_sum(samples: FloatArray, cycles_per_sample: FloatArray) -> FloatArray:
    # An extremely short interval would pad the transform to gigabytes for some 400 frequencies.
    index = np.arange(samples.size, dtype=np.float64)
    power = np.empty(cycles_per_sample.size)
    for i, cycles in enumerate(cycles_per_sample):
        phase = (2.0 * math.pi) * cycles * index
        real, imaginary = np.dot(samples, np.cos(phase)), np.dot(samples, np.sin(phase))
        power[i] = real * real + imaginary * imaginary
    return power


def _scaled(acceleration_g: FloatArray) -> tuple[FloatArray, float]:
    # By a power of two, hence exactly: squares then neither overflow nor vanish.
    exponent = math.frexp(float(np.max(np.abs(acceleration_g))))[1]
    if abs(exponent) < 64:
        return acceleration_g, 1.0
    return np.ldexp(acceleration_g, -exponent), math.ldexp(1.0, min(exponent, 1023))


def _ceil(x: float) -> float:
    # 1/(0.05*dt) and the band edges are whole numbers for usual dt, up to rounding.
    if not math.isfinite(x):
        return x
    nearest = round(x)
    if abs(x - nearest) <= _EDGE_TOLERANCE * max(1.0, abs(x)):
        return float(nearest)
    return float(math.ceil(x))


def _running_sum(steps: FloatArray) -> FloatArray:
    total = np.zeros(steps.size + 1)
    np.cumsum(steps, out=total[1:])
    return total


def _largest(*values: FloatArray) -> float:
    return max((float(np.max(np.abs(v))) for v in values if v.size), default=0.0)


def _velocity_extremes(a: FloatArray, h: FloatArray, v: FloatArray) -> FloatArray:
    # v is extreme where a = 0: at the fraction a0/(a0-a1) of an interval that a crosses.
    inside = np.flatnonzero((np.sign(a[:-1]) * np.sign(a[1:]) < 0.0) & (h > 0.0))
    a0, a1 = a[inside], a[inside + 1]
    fraction = a0 / (a0 - a1)
    return v[inside] + (0.5 * STANDARD_GRAVITY_M_S2) * h[inside] * a0 * fraction


def _displacement_extremes(
    a: FloatArray, h: FloatArray, v: FloatArray, d: FloatArray
) -> FloatArray:
    # d is extreme where v = C + B s + A s² = 0, s the fraction of the interval, v in g h.
    inside = np.flatnonzero(h > 0.0)
    a0, a1, length = a[inside], a[inside + 1], h[inside]
    curvature = 0.5 * (a1 - a0)
    start = v[inside] / (STANDARD_GRAVITY_M_S2 * length)
    discriminant = a0 * a0 - 4.0 * curvature * start
    real = discriminant >= 0.0
    inside, a0, a1, length = inside[real], a0[real], a1[real], length[real]
    curvature, start = curvature[real], start[real]
    # The form without cancellation: q/A and C/q.
    q = -0.5 * (a0 + np.copysign(np.sqrt(discriminant[real]), a0))
    extremes = []
    for numerator, denominator in ((q, curvature), (start, q)):
        root = np.divide(numerator, denominator, out=np.full(q.size, -1.0), where=denominator != 0)
        ok = (root > 0.0) & (root < 1.0)
        s, at, step = root[ok], inside[ok], length[ok]
        bend = STANDARD_GRAVITY_M_S2 * step * step * s * s
        extremes.append(
            d[at] + v[at] * step * s + bend * (0.5 * a0[ok] + (a1[ok] - a0[ok]) * s / 6.0)
        )
    return np.concatenate(extremes)
