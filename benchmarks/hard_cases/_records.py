"""Made-up records that are hard on a search: chirps, beats, pulses, coarse steps, long steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rbfrag.motions.ground_motion import GroundMotion

FloatArray = NDArray[np.float64]


def _scaled(samples: FloatArray, rng: np.random.Generator) -> FloatArray:
    most = float(np.abs(samples).max())
    return samples * (rng.uniform(0.15, 1.2) / most) if most > 0.0 else samples


def chirp(rng: np.random.Generator, npts: int) -> FloatArray:
    """A sweep up or down, which rocks blocks of every size at some time."""
    t = np.linspace(0.0, 1.0, npts)
    f0, f1 = np.exp(rng.uniform(np.log(2.0), np.log(40.0), 2))
    return np.hanning(npts) ** rng.uniform(0.0, 1.0) * np.sin(
        2.0 * np.pi * (f0 * t + 0.5 * (f1 - f0) * t * t) + rng.uniform(0.0, 6.0)
    )


def beat(rng: np.random.Generator, npts: int) -> FloatArray:
    """Two near frequencies: the block is rocked up, let down and rocked up again."""
    t = np.linspace(0.0, 1.0, npts)
    f = float(np.exp(rng.uniform(np.log(6.0), np.log(40.0))))
    df = rng.uniform(0.5, 4.0)
    a, b = rng.uniform(0.0, 6.0, 2)
    return np.asarray(np.sin(2.0 * np.pi * f * t + a) + np.sin(2.0 * np.pi * (f + df) * t + b))


def pulses(rng: np.random.Generator, npts: int) -> FloatArray:
    """Random half waves of either sense, some of which overlap."""
    samples = np.zeros(npts)
    for _ in range(int(rng.integers(3, 14))):
        width = int(rng.integers(4, max(npts // 6, 5)))
        start = int(rng.integers(0, max(npts - width, 1)))
        samples[start : start + width] += rng.uniform(-1.0, 1.0) * np.hanning(width)
    return samples


def coarse(rng: np.random.Generator, npts: int) -> FloatArray:
    """Noise of a few levels, so that plateaus equal thresholds."""
    smooth = np.convolve(rng.standard_normal(npts), np.hanning(int(rng.integers(4, 20))), "same")
    return np.asarray(np.round(smooth / np.abs(smooth).max() * rng.integers(3, 9)))


def noise(rng: np.random.Generator, npts: int) -> FloatArray:
    """Enveloped noise."""
    fast = np.convolve(rng.standard_normal(npts), np.hanning(int(rng.integers(3, 25))), "same")
    return np.asarray(np.hanning(npts) * fast)


SHAPES: dict[str, Callable[[np.random.Generator, int], FloatArray]] = {
    "chirp": chirp,
    "beat": beat,
    "pulses": pulses,
    "coarse": coarse,
    "noise": noise,
}


def made_up(rng: np.random.Generator) -> tuple[GroundMotion, float]:
    """Return a motion and a p² [1/s²]; p times the step is up to the solver's limit of a step."""
    shape = list(SHAPES.values())[int(rng.integers(len(SHAPES)))]
    npts = int(rng.integers(120, 700))
    samples = _scaled(shape(rng, npts), rng)
    p2 = float(np.exp(rng.uniform(np.log(0.1), np.log(30.0))))
    # from a step that is nothing to the block to one that is as long as the solver takes at once
    ph = float(np.exp(rng.uniform(np.log(0.0005), np.log(0.1))))
    return GroundMotion(samples, ph / p2**0.5), p2


def vertical_of(
    motion: GroundMotion, rng: np.random.Generator, most_g: float = 1.0
) -> GroundMotion:
    """Return a vertical motion at the same samples, up to nearly `most_g` downwards."""
    shape = list(SHAPES.values())[int(rng.integers(len(SHAPES)))]
    up = shape(rng, motion.npts)
    least = float(up.min())
    if least < 0.0:
        up = up * (most_g * rng.uniform(0.3, 0.98) / -least)
    return GroundMotion(up, motion.dt_s)
