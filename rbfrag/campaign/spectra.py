"""The toppling spectra that belong to a campaign: which are missing, and their computation."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

from rbfrag.db.spectra import SpectrumKey
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import POLARITIES, Polarity
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.solver.results import FloatArray


@dataclass(frozen=True, eq=False)
class SpectrumPart:
    """X(p) of one motion and polarity.

    Args:
        polarity: ``forward`` or ``reverse``.
        p2: frequency parameters [1/s²].
        x_m_s: X(p) at each of them [m/s].
    """

    polarity: Polarity
    p2: tuple[float, ...]
    x_m_s: FloatArray


def missing_sizes(
    known: Container[SpectrumKey], motion_id: int, p2: Sequence[float]
) -> dict[Polarity, tuple[float, ...]]:
    """Return the p² [1/s²] at which X(p) of a motion is not stored, by polarity.

    Args:
        known: what is stored.
        motion_id: the motion.
        p2: frequency parameters asked for [1/s²].
    """
    missing: dict[Polarity, tuple[float, ...]] = {}
    for polarity in POLARITIES:
        sizes = tuple(each for each in map(float, p2) if (motion_id, polarity, each) not in known)
        if sizes:
            missing[polarity] = sizes
    return missing


def spectrum_parts(
    motion: GroundMotion, sizes: Mapping[Polarity, Sequence[float]]
) -> tuple[SpectrumPart, ...]:
    """Compute X(p) of one motion.

    Args:
        motion: the horizontal motion.
        sizes: frequency parameters [1/s²] by polarity.
    """
    return tuple(
        SpectrumPart(polarity, tuple(p2), toppling_spectrum(motion, list(p2), polarity))
        for polarity, p2 in sizes.items()
    )
