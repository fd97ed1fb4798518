"""Strongest block found to topple by many single runs, where nothing is proven."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.integrator.toppling_kernel import TOPPLED
from rbfrag.solver.results import RESOLUTION, FloatArray, IntArray

FIRST_RUNS = 3000
"""Blocks that are run first, equally spaced in ln k_r over all that has no verdict."""

DENSE_RUNS = 8000
"""Blocks that are run then, equally spaced over what has no verdict above the strongest of them."""

ROUNDS = 4
"""How often gaps that may hide an island are looked into more closely: to 1e-8 of k_r and below."""

GAPS = 2000
"""Gaps that a round looks into, the highest first."""

BETWEEN = 8
"""Blocks within such a gap; on either side where a border is closed in on."""

JUMP = 0.02
"""Change of theta_n over a gap, beyond four times that at the slopes beside it, that is a jump."""

BORDER = 1e-9
"""Relative width to which the border above the strongest block is closed in on."""


class Seen(NamedTuple):
    """Findings from single blocks.

    Args:
        kr: greatest k_r seen to topple; None where none was.
        upper: k_r from which on no block was seen to topple, and no gap between blocks may hide one
            that does; None where no block was seen to topple.
        gaps: gaps left between `kr` and `upper` that may hide an island.
        runs: number of blocks.
    """

    kr: float | None
    upper: float | None
    gaps: int
    runs: int


def strongest_seen(
    excitation: Excitation, p2: float, low: FloatArray, high: FloatArray, toppling_kr: float | None
) -> Seen:
    """Return the strongest block found to topple among those without a verdict.

    An island between two blocks is betrayed by the rotation of the blocks beside it. Gaps towards
    which theta_n rises ever more steeply from both sides, and jumps, are divided until they are
    none, or narrower than what matters of a recorded motion.

    Args:
        p2: frequency parameter p² [1/s²].
        low: lower ends of the intervals of k_r without a verdict, shape (n,).
        high: their upper ends, shape (n,).
        toppling_kr: a k_r that topples; None for none.
    """
    # invariant: kr is sorted, theta_n holds the normalised peaks of these blocks, and `best` is the
    # strongest block seen to topple; only what lies above it is of interest from then on
    runs, gaps = 0, np.empty(0, dtype=np.int64)
    kr, theta_n = np.empty(0), np.empty(0)
    best = toppling_kr
    trials = _spread(low, high, FIRST_RUNS)
    for round_number in range(ROUNDS + 2):
        if best is not None:
            trials = trials[trials > best]
        if trials.size:
            ends = simulate_many(excitation, p2=p2, kr=trials)
            runs += trials.size
            toppled = trials[ends.outcome == TOPPLED]
            if toppled.size:
                best = max(float(toppled.max()), best or 0.0)
            # what is neither known to stay nor to topple counts as near to toppling
            peak = np.where(np.isfinite(ends.theta_n), ends.theta_n, 1.0)
            kr, first = np.unique(np.concatenate([kr, trials]), return_index=True)
            theta_n = np.concatenate([theta_n, peak])[first]
        if best is not None:
            theta_n, kr = theta_n[kr > best], kr[kr > best]
        if round_number == 0:
            above = high > (best or 0.0)
            trials = _spread(np.maximum(low, best or 0.0)[above], high[above], DENSE_RUNS)
            continue
        gaps = _gaps(kr, theta_n)
        if round_number <= ROUNDS:
            part = np.arange(1, BETWEEN + 1) / (BETWEEN + 1)
            chosen = gaps[-GAPS:]
            trials = (kr[chosen, None] + (kr[chosen + 1] - kr[chosen])[:, None] * part).ravel()
    if best is None:
        return Seen(None, None, gaps.size, runs)
    # the border above: the next block that stays, or the end of what has no verdict
    above_k = float(kr[0]) if kr.size else max(best, float(high.max(initial=best)))
    upper = float(kr[gaps[-1] + 1]) if gaps.size else None
    while above_k - best > BORDER * above_k:
        trials = np.linspace(best, above_k, 2 * BETWEEN + 2)[1:-1]
        toppled = trials[simulate_many(excitation, p2=p2, kr=trials).outcome == TOPPLED]
        runs += trials.size
        width = above_k - best
        if toppled.size:
            best = float(toppled[-1])
        above_k = min(best + width / (2 * BETWEEN + 1), above_k)
    return Seen(best, max(above_k, upper or 0.0), gaps.size, runs)


def _gaps(kr: FloatArray, theta_n: FloatArray) -> IntArray:
    """Return the gaps above blocks i that may contain an island, by rising k_r.

    Towards a block that topples the peak rotation falls short of balance by the square root of the
    distance in k_r, so that it rises ever more steeply: a cusp, where a peak without an island is
    round. A gap narrower than `RESOLUTION` of its k_r does not matter.
    """
    if kr.size < 6:
        return np.empty(0, dtype=np.int64)
    width = np.diff(kr)
    slope = np.diff(theta_n) / width
    # of the gaps 2 to n - 3: the two slopes before each from below, and from above
    below, further_below = slope[1:-3], slope[:-4]
    above, further_above = -slope[3:-1], -slope[4:]
    cusp = (below > 0.0) & (above > 0.0) & (below > further_below) & (above > further_above)
    inner = slice(2, -2)
    change = np.abs(theta_n[3:-2] - theta_n[2:-3])
    expected = 4.0 * np.maximum(np.abs(below), np.abs(above)) * width[inner]
    hides = (cusp | (change > JUMP + expected)) & (width[inner] > RESOLUTION * kr[3:-2])
    return 2 + np.flatnonzero(hides)


def _spread(low: FloatArray, high: FloatArray, number: int) -> FloatArray:
    """Return points of intervals, equally spaced in ln k_r, at least one in each of the widest."""
    widest = np.argsort(low - high, kind="stable")[:number]
    low, width = low[widest], np.log(high[widest] / low[widest])
    counts = np.maximum(np.ceil(number * width / width.sum()), 1.0).astype(np.int64)
    of = np.repeat(np.arange(counts.size), counts)
    place = np.arange(of.size) - np.repeat(np.cumsum(counts) - counts, counts)
    points: FloatArray = low[of] * np.exp(width[of] * (place + 0.5) / counts[of])
    return points
