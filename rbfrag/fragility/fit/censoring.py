"""Outcomes that are not known: weights that stand in for them, bounds of scores, shares.

The model of a slumping block may end before the block fails, when strong shaking takes it off its
back plane. The scale of the record at which it ends is known, so that the critical scale is
censored there: the block is known to stand weaker shaking, and nothing is known of stronger.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.fit.scores import CLIP, ScoredBlocks
from rbfrag.solver.results import FloatArray

Mask = NDArray[np.bool_]

LEAST_FOLLOWED = 0.2
"""Blocks are judged under shaking that at least this share of the model's runs would reach."""

FEWEST_OF_A_BLOCK = 30
"""Blocks with fewer rows share the curve of all such blocks."""

NODES = 13
"""Nodes of the curves of unknown shares."""

MOST_CLASSES = 3
"""Classes of strength, each with its curve."""


def censoring_weights(
    critical: FloatArray, observed: Mask, strength: FloatArray, block: FloatArray
) -> FloatArray:
    """Return weights of outcomes such that those known stand for those not known, shape (n, m).

    An outcome that is known counts 1/G: G is the share of a block's runs whose model would still
    hold at the shaking that decides it, of its failing or, where it stands, of the outcome
    (inverse probability of censoring: Graf, Schmoor, Sauerbrei & Schumacher 1999, Statistics in
    Medicine 18, 2529-2545). G is the product-limit estimate of each block (Kaplan & Meier 1958,
    JASA 53, 457-481), in which a failing is what ends the observation of the model's end. Weight 0:
    not known, or G at the shaking of the outcome below 0.2.

    That is right where the model's end tells nothing of the critical scale beyond strength and
    shaking; :func:`score_bounds` needs no such assumption.

    Args:
        critical: k/PGA at which a block fails, for censored rows the least at which it is known to
            stand, shape (n,).
        observed: False for censored rows, shape (n,).
        strength: k/PGA of the outcomes, shape (n, m).
        block: a number that is the same for the rows of one block, shape (n,).
    """
    weights = np.zeros(strength.shape)
    blocks, number, rows = np.unique(block, return_inverse=True, return_counts=True)
    number = np.where(rows[number] < FEWEST_OF_A_BLOCK, blocks.size, number)
    with np.errstate(divide="ignore"):
        critical_shaking, shaking = 1.0 / critical, 1.0 / strength
    for one in np.unique(number):
        own = number == one
        # failing goes before the model's end where both are at one shaking
        order = np.lexsort((~observed[own], critical_shaking[own]))
        at = critical_shaking[own][order]
        left = at.size - np.arange(at.size)
        ends = np.where(observed[own][order], 1.0, 1.0 - 1.0 / left)
        holding = np.append(1.0, np.cumprod(ends))
        of_failing = holding[np.searchsorted(at, critical_shaking[own], side="left")][:, None]
        of_shaking = holding[np.searchsorted(at, shaking[own], side="left")]
        reached = shaking[own] >= critical_shaking[own][:, None]
        fails, stands = reached & observed[own][:, None], ~reached & (shaking[own] > 0.0)
        with np.errstate(divide="ignore"):
            counts = np.where(fails, 1.0 / of_failing, np.where(stands, 1.0 / of_shaking, 0.0))
        weights[own] = np.where(of_shaking >= LEAST_FOLLOWED, counts, 0.0)
    return weights


def score_bounds(
    judged: ScoredBlocks, probability: FloatArray, chosen: Mask
) -> tuple[float, float]:
    """Return the mean log loss of all outcomes, those not known counted as suits best and worst.

    Args:
        judged: outcomes, of which some are known.
        probability: of each, shape (n, m).
        chosen: which outcomes count, same shape.
    """
    p = np.clip(probability, CLIP, 1.0 - CLIP)
    losses = -np.log(p), -np.log1p(-p)
    known = np.where(judged.failed > 0.5, *losses)
    ends = (np.where(judged.known, known, pick(*losses)) for pick in (np.minimum, np.maximum))
    low, high = (float(end[chosen].mean()) for end in ends)
    return low, high


def unknown_shares(
    variable: str, ratio: FloatArray, strength: FloatArray, known: Mask
) -> dict[str, Any]:
    """Return curves of the share of outcomes that are not known, JSON-able.

    Args:
        variable: what the curves run over: the name of a strength over the shaking.
        ratio: its values, above 0, shape (n, m).
        strength: of the blocks, shape (n,).
        known: where the outcome is known, shape (n, m).

    Returns:
        ``variable``; ``edges``, the strengths that part the classes; ``first`` and ``step`` of the
        logarithm of the variable at the nodes; ``shares`` by class and node, of the outcomes
        nearest to the node (of its neighbour towards weaker shaking where there are none).
    """
    some = np.unique(strength)
    classes = min(MOST_CLASSES, some.size)
    at = [some.size * k // classes for k in range(1, classes)]
    edges = [float(np.sqrt(some[i - 1] * some[i])) for i in at]
    number = np.searchsorted(edges, strength)
    log = np.log(ratio)
    first, last = float(log.min()), float(log.max())
    step = (last - first) / (NODES - 1) or 1.0
    node = np.rint((log - first) / step).astype(np.intp)
    cell = (number[:, None] * NODES + node).ravel()
    size = classes * NODES
    total = np.bincount(cell, minlength=size)
    unknown = np.bincount(cell, ~known.ravel(), minlength=size)
    shares = np.divide(unknown, total, out=np.full(size, np.nan), where=total > 0)
    table = shares.reshape(classes, NODES)
    for j in range(NODES - 1, -1, -1):
        beyond = table[:, j + 1] if j + 1 < NODES else np.zeros(classes)
        table[:, j] = np.where(np.isfinite(table[:, j]), table[:, j], beyond)
    return {
        "variable": variable,
        "edges": edges,
        "first": first,
        "step": step,
        "shares": np.round(table, 4).tolist(),
    }
