"""Borders between a k_r that topples and one that does not, by false position."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel
from rbfrag.solver.search.from_rest import follow
from rbfrag.solver.search.renewal import ExcursionTable


class Border(NamedTuple):
    """Two k_r, of which one topples and the other does not.

    Args:
        low: the smaller.
        high: the greater.
        low_topples: whether it is the smaller that topples.
        at_low: distance of the smaller from toppling; infinite where it is not known.
        at_high: the same of the greater.
        side: 1 if the last block was put in the place of the smaller, -1 of the greater, 0 for
            none yet.
        tries: blocks since the width was last looked at.
        gauge: width at that time.
    """

    low: float
    high: float
    low_topples: bool
    at_low: float
    at_high: float
    side: int
    tries: int
    gauge: float


@inner_kernel
def narrowed(b: Border, k: float, distance: float) -> Border:
    """Replace the end of a bracket that has the same outcome as a new block (Illinois method).

    The distance of an end that stays for the second time is halved, so that the next root is drawn
    to it and the bracket closes from both sides.
    """
    # the sign alone decides; the size only chooses where to look next
    if (distance > 0.0) == b.low_topples:
        at_high = 0.5 * b.at_high if b.side > 0 else b.at_high
        return Border(k, b.high, b.low_topples, distance, at_high, 1, b.tries, b.gauge)
    at_low = 0.5 * b.at_low if b.side < 0 else b.at_low
    return Border(b.low, k, b.low_topples, at_low, distance, -1, b.tries, b.gauge)


@inner_kernel
def next_trial(b: Border, width: float) -> tuple[Border, float]:
    """Choose the next k_r inside a bracket that is to close to a relative width."""
    tries = b.tries + 1
    gauge = b.gauge
    # an end whose distance is unknown gives no chord
    halve = math.isinf(b.at_high)
    if tries == 3:
        # bisection where false position has not taken three bits in as many tries
        halve = halve or b.high - b.low > 0.125 * gauge
        gauge = b.high - b.low
        tries = 0
    if halve:
        k = 0.5 * (b.low + b.high)
    else:
        # a little beyond the root as seen from the side of the last one, so that where the root is
        # right to the width the bracket closes at once; inside the ends by as much
        edge = 0.25 * width * b.high
        root = (b.low * b.at_high - b.high * b.at_low) / (b.at_high - b.at_low)
        k = min(max(root + (edge if b.side > 0 else -edge), b.low + edge), b.high - edge)
    return Border(b.low, b.high, b.low_topples, b.at_low, b.at_high, b.side, tries, gauge), k


@bare_kernel
def border(
    excitation: BlockExcitation,
    low: float,
    at_low: float,
    high: float,
    width: float,
    rest: int,
    table: ExcursionTable,
    work: np.void,
) -> tuple[float, float]:
    """Find a border between two k_r of which one topples and the other does not.

    Args:
        low: the smaller k_r.
        at_low: its distance from toppling, > 0 if it topples.
        high: the greater k_r, which does otherwise.
        width: relative width to end with.
        rest: node at which blocks are at rest.
        table: as for `follow`.
        work: counts what it costs.

    Returns:
        A k_r that does as `low` and a greater one that does as `high`.
    """
    # Invariant: one of b.low and b.high topples and the other does not. False position on the
    # distance by the linear model needs few runs; where it stalls, `next_trial` bisects

    # only the outcome of `high` is known: the first block is the middle one
    topples = at_low > 0.0
    at_high = -math.inf if topples else math.inf
    b = Border(low, high, topples, at_low, at_high, 0, 0, high - low)
    k = 0.5 * (low + high)
    while b.high - b.low > width * b.high:
        b = narrowed(b, k, follow(excitation, k, rest, table, work))
        b, k = next_trial(b, width)
    return b.low, b.high
