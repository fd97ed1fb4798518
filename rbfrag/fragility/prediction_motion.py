"""What a prediction reads of a motion that is known itself."""

from __future__ import annotations

import math
from typing import Literal

from rbfrag.fragility.measures import SPECTRAL
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.toppling_spectrum import toppling_spectrum


def measures_of(
    motion: GroundMotion,
    p2: float | None,
    polarity: Literal["forward", "reverse"],
    *,
    spectrum: bool = False,
) -> dict[str, float]:
    """Return the measures of a motion by the names of :func:`rbfrag.predict`, and X(p).

    Args:
        motion: the accelerogram.
        p2: frequency parameter p² of the block [1/s²]; None where the block has none that a
            toppling spectrum is drawn for.
        polarity: how the motion points at the slope.
        spectrum: spectral accelerations too.
    """
    measures: dict[str, float] = {"pga_g": motion.pga_g, "pgv_m_s": motion.pgv_m_s}
    measures["pgd_m"] = motion.pgd_m
    if motion.tm_s is not None:
        measures["tm_s"] = motion.tm_s
    if spectrum:
        spectral = motion.spectral_accelerations
        measures |= {name: spectral[name] for name in SPECTRAL.values()}
    if p2 is not None:
        # a p2 that cannot be used is refused by the prediction
        drawn = p2 if math.isfinite(p2) and p2 > 0.0 else 1.0
        measures["xp_m_s"] = float(toppling_spectrum(motion, drawn, polarity))
    return measures
