"""Pulse whose toppling has a closed form, as a substitute for records."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion

PULSE = "reversal pulse"
"""Begin of the event of analytic pulses, by which fits tell them from recorded earthquakes."""

MOST_SAMPLES = 50_000_000


def reversal_pulse(amplitude_g: float, ratio: float, period_s: float, dt_s: float) -> GroundMotion:
    """Return two half-sine lobes of duration T/2 each, of amplitudes A and −rA, sampled.

    There are samples at every zero crossing and every peak; between them are straight lines.

    Args:
        amplitude_g: acceleration A at the first peak [g].
        ratio: r >= 0, size of the second lobe over that of the first.
        period_s: period T, the length of both lobes together [s].
        dt_s: longest sampling interval [s]; shortened where that is needed for a lobe to hold a
            whole, even number of intervals.
    """
    a, r = _finite("amplitude", amplitude_g), _finite("ratio", ratio)
    if r < 0.0:
        raise InputError(f"the ratio must not be negative, and is {ratio:g}: it sets the size only")
    lobe, interval = _sine_lobe(0.5 * _positive("period", period_s), dt_s)
    samples = np.concatenate([a * lobe, (-r * a) * lobe[1:]])
    return GroundMotion(samples, interval, event=PULSE)


def _sine_lobe(duration_s: float, dt_s: float) -> tuple[NDArray[np.float64], float]:
    duration, dt = _positive("duration", duration_s), _positive("dt", dt_s)
    if not duration / dt <= MOST_SAMPLES:
        raise InputError(
            f"a pulse of {duration:g} s sampled at {dt:g} s has more than {MOST_SAMPLES} samples: "
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


def _finite(description: str, value: float) -> float:
    if not math.isfinite(value):
        raise InputError(f"the {description} of a pulse must be a finite number, not {value}")
    return float(value)


def _positive(description: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(
            f"the {description} of a pulse must be a positive number of seconds, not {value}"
        )
    return float(value)
