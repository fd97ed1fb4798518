"""The fates of the blocks of a rock mass as columns of the block table."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.rockmasses.response import ShakenMass
from rbfrag.rockmasses.shaking import FATES
from rbfrag.rockmasses.table import block_columns


def fate_columns(shaken: ShakenMass) -> dict[str, NDArray[Any]]:
    """Return the columns of the block table, one row a realisation and scale.

    Args:
        shaken: the fates of the blocks.
    """
    columns = block_columns(shaken.made)
    reason = columns.pop("reason")
    scales = np.array(shaken.shaking.scales)
    m, n = shaken.code.shape
    names = np.array([*FATES, ""], dtype=object)
    return {
        **{name: np.tile(values, m) for name, values in columns.items()},
        "scale": np.repeat(scales, n),
        "pga_g": np.repeat(shaken.pga_g, n),
        "fate": names[shaken.code.reshape(-1)],
        "displacement_m": shaken.displacement_m.reshape(-1),
        "rotation_deg": np.degrees(shaken.rotation_rad.reshape(-1)),
        "reason": np.tile(reason, m),
    }
