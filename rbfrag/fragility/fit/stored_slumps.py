"""The yield acceleration of stored blocks that slump."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError, InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.mechanism import shaken_mechanism


def slump_yields(blocks: Sequence[str]) -> NDArray[np.float64]:
    """Return k_s of blocks as they are stored, shape (n,).

    Args:
        blocks: JSON text of each, from :func:`rbfrag.db.queries.stored_blocks`.

    Raises:
        FitError: a text that describes no block that slumps.
    """
    return np.array([_yield_g(block) for block in blocks], dtype=np.float64)


@cache
def _yield_g(block: str) -> float:
    try:
        stated = json.loads(block)
        shape = Block.from_fractures(stated["s1_m"], stated["s2_m"], stated["gamma_deg"])
        return shaken_mechanism(
            shape, kind="slumping", beta_deg=stated["beta_deg"], phi_deg=stated["phi_deg"]
        ).yield_g
    except (ValueError, KeyError, InputError) as error:
        raise FitError(
            f"a stored block is none that slumps ({error}): run  rbfrag db check"
        ) from None
