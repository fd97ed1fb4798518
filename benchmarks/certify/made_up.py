"""Made-up motions that are hard on a proof: noise, plateaus, ties, jumps, bad ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rbfrag.motions.ground_motion import GroundMotion


def noise(rng: np.random.Generator) -> GroundMotion:
    """Enveloped noise with a slow swell."""
    npts = int(rng.integers(200, 900))
    t = np.arange(npts) * 0.01
    fast = np.convolve(rng.standard_normal(npts), np.hanning(int(rng.integers(5, 30))), "same")
    slow = np.sin(2.0 * np.pi * t / rng.uniform(0.5, 2.0) + rng.uniform(0.0, 6.0))
    samples = np.hanning(npts) * (fast / np.abs(fast).max() + rng.uniform(0.0, 1.0) * slow)
    return GroundMotion(samples * (rng.uniform(0.1, 0.8) / np.abs(samples).max()), 0.01)


def plateaus(rng: np.random.Generator) -> GroundMotion:
    """Few distinct levels, each held for a while."""
    levels = rng.integers(-4, 5, 60) / 10.0
    return GroundMotion(np.repeat(levels, rng.integers(1, 12, 60)), 0.02)


def ties(rng: np.random.Generator) -> GroundMotion:
    """Noise rounded so coarsely that peaks tie and crossings fall on samples."""
    return GroundMotion(np.round(noise(rng).acceleration_g, 2), 0.01)


def jumps(rng: np.random.Generator) -> GroundMotion:
    """Rectangular pulses: two nodes at one time."""
    edges = np.sort(rng.uniform(0.0, 6.0, 14))
    levels = rng.uniform(-0.5, 0.5, 13)
    return GroundMotion.from_nodes(np.repeat(edges, 2)[1:-1], np.repeat(levels, 2))


def bad_ends(rng: np.random.Generator) -> GroundMotion:
    """Above most thresholds at the first sample, and not at rest at the last."""
    samples = noise(rng).acceleration_g
    first = int(rng.integers(0, samples.size // 2))
    cut = samples[first : first + int(rng.integers(10, 120))]
    return GroundMotion(cut + rng.uniform(0.05, 0.3), 0.01)


MAKERS: dict[str, Callable[[np.random.Generator], GroundMotion]] = {
    "noise": noise,
    "plateaus": plateaus,
    "ties": ties,
    "jumps": jumps,
    "bad ends": bad_ends,
}


def vertical_of(motion: GroundMotion, rng: np.random.Generator) -> GroundMotion:
    """Return a vertical motion at the same nodes with 1 + k_v > 0."""
    up = np.resize(noise(rng).acceleration_g, motion.npts)
    if motion.node_time_s is None:
        return GroundMotion(up, motion.dt_s)
    return GroundMotion.from_nodes(motion.node_time_s, up)
