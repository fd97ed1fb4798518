"""Polarity: the sign of a record that drives a block forward."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError

FloatArray = NDArray[np.float64]

Polarity = Literal["forward", "reverse"]
POLARITIES: tuple[Polarity, Polarity] = ("forward", "reverse")


def driving_acceleration_g(acceleration_g: FloatArray, polarity: Polarity) -> FloatArray:
    """Return the acceleration that drives forward rotation, k_h(t) = a(t) or −a(t) [g].

    Args:
        acceleration_g: samples [g], shape (n,).
        polarity: ``forward`` (positive samples drive forward) or ``reverse``.
    """
    if polarity not in POLARITIES:
        raise InputError(f"polarity must be 'forward' or 'reverse', not {polarity!r}")
    sign = 1.0 if polarity == "forward" else -1.0
    # + 0.0 turns the -0.0 of a reversed zero sample into 0.0
    driving: FloatArray = sign * acceleration_g + 0.0
    return driving
