"""Motions to run blocks under."""

from __future__ import annotations

import numpy as np

from rbfrag.motions.ground_motion import GroundMotion


def noise(seed: int, npts: int = 600, pga_g: float = 0.5, dt_s: float = 0.01) -> GroundMotion:
    rng = np.random.default_rng(seed)
    samples = np.convolve(rng.standard_normal(npts + 20), np.hanning(12), "same")[10:-10]
    return GroundMotion(samples * (pga_g / np.abs(samples).max()), dt_s)
