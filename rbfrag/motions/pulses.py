"""Analytic pulses: ground motions whose toppling has a closed form.

Rectangles and triangles are given by nodes and are exact. Sines are sampled, with samples
at every zero crossing and every peak; between them they are straight lines.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion

MOST_SAMPLES = 50_000_000


def rectangular(amplitude_g: float, duration_s: float) -> GroundMotion:
    """Return one rectangular lobe, exact: jumps at both ends.

    Args:
        amplitude_g: acceleration [g].
        duration_s: length of the lobe [s].
    """
    a, length = _finite("amplitude", amplitude_g), _positive("duration", duration_s)
    return GroundMotion.from_nodes(
        (0.0, 0.0, length, length), (0.0, a, a, 0.0), event="rectangular pulse"
    )


def rectangular_cycle(amplitude_g: float, lobe_duration_s: float) -> GroundMotion:
    """Return a full rectangular cycle, exact: one lobe at +A, one at −A.

    Args:
        amplitude_g: acceleration of the first lobe [g].
        lobe_duration_s: length of each lobe, half the period [s].
    """
    a, lobe = _finite("amplitude", amplitude_g), _positive("lobe duration", lobe_duration_s)
    return GroundMotion.from_nodes(
        (0.0, 0.0, lobe, lobe, 2.0 * lobe, 2.0 * lobe),
        (0.0, a, a, -a, -a, 0.0),
        event="rectangular cycle",
    )


def triangle(amplitude_g: float, duration_s: float) -> GroundMotion:
    """Return one symmetric triangular lobe, exact.

    Args:
        amplitude_g: acceleration at the apex [g].
        duration_s: length of the lobe [s].
    """
    a, length = _finite("amplitude", amplitude_g), _positive("duration", duration_s)
    return GroundMotion.from_nodes(
        (0.0, 0.5 * length, length), (0.0, a, 0.0), event="triangular pulse"
    )


def half_sine(amplitude_g: float, duration_s: float, dt_s: float) -> GroundMotion:
    """Return one half-sine lobe, a(t) = A sin(πt/duration), sampled.

    Args:
        amplitude_g: acceleration at the peak [g].
        duration_s: length of the lobe [s].
        dt_s: longest sampling interval [s]; shortened where that is needed for the lobe to
            hold a whole, even number of intervals.
    """
    a = _finite("amplitude", amplitude_g)
    lobe, interval = _sine_lobe(duration_s, dt_s)
    return GroundMotion(a * lobe, interval, event="half-sine pulse")


def sine_cycle(amplitude_g: float, period_s: float, dt_s: float) -> GroundMotion:
    """Return one full cycle of a sine, a(t) = A sin(2πt/T), sampled.

    Args:
        amplitude_g: acceleration at the peaks [g].
        period_s: period T [s].
        dt_s: longest sampling interval [s], as for :func:`half_sine`.
    """
    return _two_lobes(amplitude_g, 1.0, period_s, dt_s, "sine cycle")


def reversal_pulse(amplitude_g: float, ratio: float, period_s: float, dt_s: float) -> GroundMotion:
    """Return two half-sine lobes of duration T/2 each, of amplitudes A and −rA, sampled.

    Args:
        amplitude_g: acceleration A at the first peak [g].
        ratio: r >= 0, size of the second lobe over that of the first.
        period_s: period T, the length of both lobes together [s].
        dt_s: longest sampling interval [s], as for :func:`half_sine`.
    """
    r = _finite("ratio", ratio)
    if r < 0.0:
        raise InputError(f"the ratio must not be negative, and is {ratio:g}: it sets the size only")
    return _two_lobes(amplitude_g, r, period_s, dt_s, "reversal pulse")


def _two_lobes(
    amplitude_g: float, ratio: float, period_s: float, dt_s: float, name: str
) -> GroundMotion:
    a = _finite("amplitude", amplitude_g)
    lobe, interval = _sine_lobe(0.5 * _positive("period", period_s), dt_s)
    return GroundMotion(np.concatenate([a * lobe, (-ratio * a) * lobe[1:]]), interval, event=name)


def _sine_lobe(duration_s: float, dt_s: float) -> tuple[NDArray[np.float64], float]:
    duration, dt = _positive("duration", duration_s), _positive("dt", dt_s)
    if not duration / dt <= MOST_SAMPLES:
        raise InputError(
            f"a lobe of {duration:g} s sampled at {dt:g} s has more than {MOST_SAMPLES} samples: "
            "give a longer dt"
        )
    half = max(1, round(0.5 * duration / dt))
    interval = dt
    if not math.isclose(2 * half * dt, duration, rel_tol=1e-12):
        half = math.ceil(0.5 * duration / dt)
        interval = 0.5 * duration / half
    rising = np.sin((0.5 * math.pi / half) * np.arange(half))
    # mirrored, so that the lobe is symmetric and its ends and peak are exact
    return np.concatenate([rising, [1.0], rising[::-1]]), interval


def _finite(what: str, value: float) -> float:
    if not math.isfinite(value):
        raise InputError(f"the {what} of a pulse must be a finite number, not {value}")
    return float(value)


def _positive(what: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"the {what} of a pulse must be a positive number of seconds, not {value}")
    return float(value)
