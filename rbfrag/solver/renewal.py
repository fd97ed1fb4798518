"""Rule D: instants at which every block of a range is known to be at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.compiled import kernel
from rbfrag.solver.flight import IN_AIR, RESEATED, fly, rest_state
from rbfrag.solver.ground import Ground
from rbfrag.solver.rises import next_start
from rbfrag.solver.toppling import next_lifting_node

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST, END, COVER, FAILS = 0, 1, 2, 3


@kernel
def fresh_starts(
    g: Ground,
    kr: float,
    k_ahead: float,
    kr_other: float,
    check: bool,
    first: int,
    stop: int,
    stretches: IntArray,
) -> tuple[int, int, int]:
    """Fly one excursion from the start of every stretch of q > kr.

    Every excursion of a block with a larger k_r starts in one of these stretches and is
    behind the fresh one, so it is over when that is, and topples only if that does.

    Args:
        g: the ground under a block.
        kr: the stretches are those of q > kr.
        k_ahead: k_r that the excursions are flown with, <= kr.
        kr_other: the largest k_r that conclusions are drawn for.
        check: check D >= 0.
        first: look at stretches from this node on ...
        stop: ... that begin before this one.
        stretches: filled with first node, node after the last, first node at which the
            excursion is over (n for never), and whether it fails; shape (4, m).

    Returns:
        Number of stretches, of those that fail, steps taken.
    """
    k_h = g.k_h
    w = g.w
    q = g.q
    block_max_q = g.block_max_q
    linear = g.linear
    n = q.size
    count = 0
    failing = 0
    steps = 0
    s0, c0 = rest_state(k_ahead, linear)
    node = next_lifting_node(q, block_max_q, first, stop, kr)
    while node < stop:
        end = node
        while end < n and q[end] > kr:
            end += 1
        i, tau = next_start(k_h, w, q, block_max_q, kr, max(node - 1, 0), 0.0)
        cover = n
        fails = False
        if i < n:
            event, at, fraction, _, _, _, _, made = fly(
                g,
                k_ahead,
                i,
                tau,
                0.0,
                0.0,
                s0,
                c0,
                True,
                n - 1,
                0.0,
                True,
                1 if check else 0,
                kr_other,
            )
            steps += made
            if event == RESEATED:
                cover = at + 1 if fraction > 0.0 else at
            else:
                fails = event != IN_AIR
        stretches[FIRST, count] = node
        stretches[END, count] = end
        stretches[COVER, count] = cover
        stretches[FAILS, count] = 1 if fails else 0
        failing += 1 if fails else 0
        count += 1
        node = next_lifting_node(q, block_max_q, end, stop, kr)
    return count, failing, steps


@kernel
def last_rest(
    stretches: IntArray, count: int, ib: int, rest_from: int, at_rest: int
) -> tuple[int, int]:
    """Find the last instant of rest before the first failing stretch that is still to come.

    Args:
        stretches: of :func:`fresh_starts`.
        count: their number.
        ib: interval of the first re-seat: stretches that end before it are past.
        rest_from: node by which the present excursions are over; larger than any for never.
        at_rest: node at which all are known to be at rest; -1 for none.

    Returns:
        Node (-1 where none is known) and number of the failing stretch (-1: none to come).
    """
    found = at_rest
    covered = rest_from
    for k in range(count):
        if stretches[END, k] <= ib:
            continue
        if stretches[FIRST, k] - 1 >= covered:
            found = stretches[FIRST, k] - 1
        if stretches[FAILS, k] == 1:
            return found, k
        covered = max(covered, stretches[COVER, k])
    return found, -1


@kernel
def last_failing_end(stretches: IntArray, count: int) -> int:
    """Node after the last stretch whose fresh excursion fails; 0 for none."""
    end = 0
    for k in range(count):
        if stretches[FAILS, k] == 1:
            end = max(end, stretches[END, k])
    return end
