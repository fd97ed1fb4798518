"""A toppling spectrum as scripts read it: a dictionary of plain values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.toppling_spectrum import toppling_spectrum


def as_dict(
    motion: str, ground: GroundMotion, p2: Sequence[float], polarity: Polarity
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract.

    Args:
        motion: the motion as it was asked for.
        ground: the motion itself.
        p2: frequency parameters [1/s²].
        polarity: forward or reverse.

    Raises:
        InputError: a p² that cannot be used.
    """
    return {
        "motion": motion,
        "name": ground.label,
        "polarity": polarity,
        "pgv_m_s": ground.pgv_m_s,
        "p2": list(p2),
        "x_m_s": toppling_spectrum(ground, p2, polarity).tolist(),
        "warnings": [
            *ground.remarks,
            *(flag.sentence for flag in quality_flags(ground)),
        ],
    }
