"""Predicted probabilities beside the shares that toppled, in bins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.fit.judgement import Outcomes

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

EDGES = np.array([0.0, 0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0])
"""Edges of the bins of predicted probability."""

REPLICATIONS = 500
FEWEST_BLOCKS = 20


@dataclass(frozen=True, eq=False)
class CalibrationBins:
    """What a model predicted for earthquakes it had not seen, and what happened.

    Args:
        predicted: mean predicted probability of each bin, shape (m,).
        observed: share that toppled, shape (m,).
        low: lower end of its 95 % interval, whole earthquakes drawn with replacement.
        high: upper end of it.
        blocks: number of blocks in the bin.
        events: number of earthquakes they are from.
    """

    predicted: FloatArray
    observed: FloatArray
    low: FloatArray
    high: FloatArray
    blocks: NDArray[np.intp]
    events: int


def calibration_bins(
    data: FitData, seen: Outcomes, held_out: FloatArray, *, seed: int = 0
) -> CalibrationBins:
    """Sort the blocks of known outcome by the probability that held-out fits gave them.

    Args:
        data: the points of the fit.
        seen: outcomes of the blocks of each point, shape (n, 25).
        held_out: probabilities by fits without the earthquake concerned, same shape.
        seed: of the draws.

    Bins with fewer than 20 blocks are left out.
    """
    event = np.repeat(data.event, held_out.shape[1]).reshape(held_out.shape)[seen.known]
    p, toppled = held_out[seen.known], seen.toppled[seen.known]
    finite = np.isfinite(p)
    event, p, toppled = event[finite], p[finite], toppled[finite]
    number = np.clip(np.searchsorted(EDGES, p, side="right") - 1, 0, EDGES.size - 2)
    events, which = np.unique(event, return_inverse=True)
    shape = (events.size, EDGES.size - 1)
    cell = which * shape[1] + number

    def table(weights: FloatArray | None) -> FloatArray:
        return (
            np.bincount(cell, weights, minlength=shape[0] * shape[1]).reshape(shape).astype(float)
        )

    count, failed, expected = table(None), table(toppled), table(p)

    def share(chosen: IntArray) -> FloatArray:
        total = count[chosen].sum(axis=0)
        none = np.full(total.shape, np.nan)
        found: FloatArray = np.divide(failed[chosen].sum(axis=0), total, out=none, where=total > 0)
        return found

    rng = np.random.default_rng(seed)
    drawn = np.array(
        [share(rng.integers(events.size, size=events.size)) for _ in range(REPLICATIONS)]
    )
    total = count.sum(axis=0)
    kept = total >= FEWEST_BLOCKS
    low, high = np.nanquantile(drawn[:, kept], (0.025, 0.975), axis=0)
    return CalibrationBins(
        predicted=expected.sum(axis=0)[kept] / total[kept],
        observed=failed.sum(axis=0)[kept] / total[kept],
        low=low,
        high=high,
        blocks=total[kept].astype(np.intp),
        events=int(events.size),
    )
