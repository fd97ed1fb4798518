"""The strongest block seen to topple where nothing is proven: many single blocks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.integrator.single_run import TOPPLED
from rbfrag.solver.results import FloatArray

FIRST_RUNS = 3000
"""Blocks that are run first, equally spaced in ln k_r over all that has no verdict."""

ROUNDS = 4
"""How often the peaks of theta_n among the blocks that stay are looked at more closely."""

PEAKS = 60
"""Peaks of theta_n that a round looks at, the highest first."""

BETWEEN = 8
"""Blocks on either side of such a peak; blocks that a border is closed in on by at a time."""

BORDER = 1e-9
"""Relative width to which the border above the strongest block is closed in on."""


class Seen(NamedTuple):
    """What single blocks have shown.

    Args:
        kr: greatest k_r seen to topple; None where none was.
        runs: number of blocks.
    """

    kr: float | None
    runs: int


def strongest_seen(
    excitation: Excitation, p2: float, low: FloatArray, high: FloatArray, known: float | None
) -> Seen:
    """Return the strongest block seen to topple among those without a verdict.

    An island between two blocks is betrayed by a peak of the rotation of blocks beside it, so that
    runs are spent about peaks rather than everywhere alike.

    Args:
        p2: frequency parameter p² [1/s²].
        low: lower ends of the intervals of k_r without a verdict, shape (n,).
        high: their upper ends, shape (n,).
        known: a k_r that topples; None for none.
    """
    runs = 0
    kr, theta_n = np.empty(0), np.empty(0)
    best = known
    trials = _spread(low, high, FIRST_RUNS)
    for _ in range(ROUNDS + 1):
        if best is not None:
            trials = trials[trials > best]
        if trials.size == 0:
            break
        ends = simulate_many(excitation, p2=p2, kr=trials)
        runs += trials.size
        toppled = trials[ends.outcome == TOPPLED]
        if toppled.size:
            best = max(float(toppled.max()), best or 0.0)
        # what is neither known to stay nor to topple counts as near to toppling
        peak = np.where(np.isfinite(ends.theta_n), ends.theta_n, 1.0)
        order = np.argsort(np.concatenate([kr, trials]))
        kr = np.concatenate([kr, trials])[order]
        theta_n = np.concatenate([theta_n, peak])[order]
        if best is not None:
            theta_n, kr = theta_n[kr > best], kr[kr > best]
        trials = _about_peaks(kr, theta_n)
    if best is None:
        return Seen(None, runs)
    # the border above: the next block that stays, or the end of what has no verdict
    above = float(kr[0]) if kr.size else max(best, float(high.max(initial=best)))
    while above - best > BORDER * above:
        trials = np.linspace(best, above, 2 * BETWEEN + 2)[1:-1]
        toppled = trials[simulate_many(excitation, p2=p2, kr=trials).outcome == TOPPLED]
        runs += trials.size
        width = above - best
        if toppled.size:
            best = float(toppled[-1])
        above = min(best + width / (2 * BETWEEN + 1), above)
    return Seen(best, runs)


def _spread(low: FloatArray, high: FloatArray, number: int) -> FloatArray:
    """Return points of intervals, equally spaced in ln k_r, at least one in each of the widest."""
    widest = np.argsort(low - high, kind="stable")[:number]
    low, width = low[widest], np.log(high[widest] / low[widest])
    each = np.maximum(np.ceil(number * width / width.sum()), 1.0).astype(np.int64)
    of = np.repeat(np.arange(each.size), each)
    place = np.arange(of.size) - np.repeat(np.cumsum(each) - each, each)
    points: FloatArray = low[of] * np.exp(width[of] * (place + 0.5) / each[of])
    return points


def _about_peaks(kr: FloatArray, theta_n: FloatArray) -> FloatArray:
    """Return points on both sides of the highest local peaks of theta_n over k_r, rising."""
    if kr.size < 3:
        return np.empty(0)
    inner = theta_n[1:-1]
    peaks = 1 + np.flatnonzero((inner >= theta_n[:-2]) & (inner >= theta_n[2:]))
    peaks = peaks[np.argsort(-theta_n[peaks], kind="stable")[:PEAKS]]
    part = np.arange(1, BETWEEN + 1) / (BETWEEN + 1)
    below = kr[peaks - 1][:, None] + (kr[peaks] - kr[peaks - 1])[:, None] * part
    above = kr[peaks][:, None] + (kr[peaks + 1] - kr[peaks])[:, None] * part
    points: FloatArray = np.unique(np.concatenate([below.ravel(), above.ravel()]))
    return points
