"""Failure modes of the blocks of a rock mass: number of blocks and yield accelerations by mode."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.solver.results import FloatArray
from rbfrag.solver.stability.modes import MODES, STABLE, STATES, ModeName, StateName

QUANTILES = (0.05, 0.16, 0.5, 0.84, 0.95)
"""Quantiles of the yield acceleration that are reported."""

_SIGNIFICANT = 3.0
"""A mode leads where its count exceeds the other's by so many standard errors."""

_SLOPE_BLOCKS = 400


@dataclass(frozen=True)
class StateCount:
    """States and yield accelerations of a set of blocks.

    Args:
        states: number of blocks by state.
        yield_quantiles_g: yield acceleration of the stable ones at :data:`QUANTILES` [g];
            empty if there are none.
    """

    states: dict[StateName, int]
    yield_quantiles_g: dict[float, float]


@dataclass(frozen=True)
class ModeCount(StateCount):
    """Blocks of one mode.

    Args:
        share_error: standard error of the share from the finite number of realisations.
        drained: the same blocks, in whichever mode, where their water drains as they start to
            move; None without water.
    """

    mode: ModeName
    count: int
    share: float
    share_error: float
    drained: StateCount | None


@dataclass(frozen=True)
class EqualCounts:
    """PGA at which equally many blocks of two modes have reached yield.

    Args:
        below: the mode with more blocks of lower yield below this PGA.
        above: the mode with more of them above it.
        pga_g: peak ground acceleration [g].
        standard_error_g: its standard error from the finite number of realisations [g].
        count: number of blocks of either mode with a yield below it.
    """

    below: ModeName
    above: ModeName
    pga_g: float
    standard_error_g: float
    count: float


def mode_counts(realisations: Realisations) -> dict[ModeName, ModeCount]:
    """Return the blocks by mode, in the order of the mode codes."""
    drained = realisations.drained
    counts: dict[ModeName, ModeCount] = {}
    for mode in MODES:
        of_mode = realisations.of_mode(mode)
        count = int(np.count_nonzero(of_mode))
        share = count / realisations.n_blocks
        counts[mode] = ModeCount(
            mode=mode,
            count=count,
            share=share,
            share_error=math.sqrt(share * (1.0 - share) / realisations.n_blocks),
            drained=None if drained is None else _state_count(drained, of_mode),
            **vars(_state_count(realisations, of_mode)),
        )
    return counts


def _state_count(realisations: Realisations, chosen: NDArray[np.bool_]) -> StateCount:
    """Return the states and yield accelerations of blocks, shape (n,)."""
    stability = realisations.stability
    by_state = np.bincount(stability.state_code[chosen], minlength=len(STATES)).tolist()
    stable = stability.yield_acceleration[chosen & (stability.state_code == STABLE)]
    values = np.quantile(stable, QUANTILES).tolist() if stable.size else []
    return StateCount(
        dict(zip(STATES, by_state, strict=True)), dict(zip(QUANTILES, values, strict=False))
    )


def sorted_yields(realisations: Realisations, mode: ModeName) -> FloatArray:
    """Return the sorted yield accelerations of a mode [g]; blocks unstable at rest count as 0.

    Locked blocks, which no horizontal acceleration moves, are left out.
    """
    k = realisations.stability.yield_acceleration[realisations.of_mode(mode)]
    return np.sort(np.maximum(k[k < math.inf], 0.0))


def cumulative_counts(
    realisations: Realisations, mode: ModeName, pga_g: FloatArray
) -> NDArray[np.int64]:
    """Return the number of blocks of a mode with a yield acceleration of at most PGA.

    These are counts of blocks, not shares of their mode: the curves of two modes may be compared.

    Args:
        pga_g: accelerations [g], shape (m,).
    """
    return np.searchsorted(sorted_yields(realisations, mode), pga_g, side="right").astype(np.int64)


def crossings(realisations: Realisations) -> list[EqualCounts]:
    """Return the PGA at which the cumulative counts of two modes cross, in increasing order.

    A crossing lies between two ranges of PGA in which one mode and then the other leads by more
    than three standard errors of the difference; closer races are chance. Its own standard error
    is that of the difference of the counts, over the slope of the difference.
    """
    yields = {mode: sorted_yields(realisations, mode) for mode in MODES}
    all_crossings = [
        crossing
        for first, second in combinations(MODES, 2)
        if yields[first].size and yields[second].size
        for crossing in _between(first, yields[first], second, yields[second])
    ]
    return sorted(all_crossings, key=lambda crossing: crossing.pga_g)


def _between(first: ModeName, a: FloatArray, second: ModeName, b: FloatArray) -> list[EqualCounts]:
    k = np.unique(np.concatenate([a, b]))
    count_a = np.searchsorted(a, k, side="right")
    count_b = np.searchsorted(b, k, side="right")
    lead = count_a - count_b
    clear = np.flatnonzero(np.abs(lead) > _SIGNIFICANT * np.sqrt(count_a + count_b))
    turns = np.flatnonzero(np.diff(np.sign(lead[clear])))
    result = []
    for i in turns:
        start, end = int(clear[i]), int(clear[i + 1])
        before = np.sign(lead[start])
        # Between the two, chance lets the difference change sign more than once.
        steps = np.arange(start + 1, end + 1)
        turned = steps[np.sign(lead[steps]) != np.sign(lead[steps - 1])]
        middle = int(turned[turned.size // 2])
        result.append(
            EqualCounts(
                below=first if before > 0 else second,
                above=second if before > 0 else first,
                pga_g=float(k[middle]),
                standard_error_g=_error(k, count_a + count_b, lead, middle),
                count=0.5 * float(count_a[middle] + count_b[middle]),
            )
        )
    return result


def _error(k: FloatArray, total: NDArray[np.int64], lead: NDArray[np.int64], at: int) -> float:
    """Return the standard error of a crossing: standard error of the difference over its slope."""
    half = max(1, min(_SLOPE_BLOCKS, k.size // 10))
    low, high = max(at - half, 0), min(at + half, k.size - 1)
    slope = abs(float(lead[high] - lead[low])) / float(k[high] - k[low])
    return math.sqrt(float(total[at])) / slope if slope > 0.0 else math.inf
