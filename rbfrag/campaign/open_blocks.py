"""Blocks of the grid that fits look at, where the map of a search does not say what they do.

What a map leaves open is harder to decide than the rest and more often safe: fits that went without
would be too sure of toppling. So these blocks are run for themselves, and those below the search
limit too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.results import CriticalResult

FloatArray = NDArray[np.float64]


def open_blocks(found: CriticalResult, kr_over_pga: FloatArray) -> list[float]:
    """Return the blocks below the critical value that the map leaves undecided, by rising k_r/PGA.

    Where nothing topples down to the search limit, those below the limit.

    Args:
        found: the search with its map.
        kr_over_pga: blocks that are asked about, shape (n,).
    """
    if found.status not in ("found", "below_limit") or not found.intervals.k_lo.size:
        return []
    top = found.search_limit if found.lower is None else found.lower
    blocks = kr_over_pga[(kr_over_pga > 0.0) & (kr_over_pga < top)]
    at = np.searchsorted(found.intervals.k_lo, blocks, side="right") - 1
    decided = np.array([word != "undecided" for word in found.intervals.outcome])
    inside = (at >= 0) & (blocks <= found.intervals.k_hi[at])
    return sorted(set(blocks[~(inside & decided[at])].tolist()))
