"""Rule D: instants at which every block of a range is known to be at rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import Ground
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.excursion import IMPACT, IN_AIR, integrate_excursion, rest_state
from rbfrag.solver.integrator.single_run import next_lifting_node
from rbfrag.solver.search.rises import next_start

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST, END, COVER, FAILS = 0, 1, 2, 3
_COUNT, _NEXT, _STOP, _FAILING, _LAST_END, _STEPS, _CHECK = range(7)
_KR, _AHEAD, _OTHER = range(3)


class Starts(NamedTuple):
    """Excursions from rest of one k_r, each made when asked for, and no further than asked.

    Every excursion of a block with a larger k_r starts in a stretch of q above this one and is
    behind the one from rest, so it is over when that is, and topples only if that does.

    Args:
        stretches: first node of each stretch, node after its last, first node at which the
            excursion is over (n for never), and whether it fails; shape (4, n).
        at: how many are known, where to look for the next and where to stop, how many fail and
            the node after the last that does, steps taken, whether D >= 0 is checked.
        levels: k_r of the stretches, of the excursions, and the largest that conclusions are
            drawn for.
    """

    stretches: IntArray
    at: IntArray
    levels: FloatArray


@kernel
def no_starts(n: int) -> Starts:
    """Make room for the stretches of a record of n nodes; none is known, and none is to come."""
    return Starts(np.empty((4, n), dtype=np.int64), np.zeros(7, dtype=np.int64), np.zeros(3))


@kernel
def begin(
    starts: Starts,
    kr: float,
    k_upper: float,
    kr_other: float,
    check: bool,
    first: int,
    stop: int,
) -> None:
    """Begin anew at another k_r.

    Args:
        starts: the room for the stretches.
        kr: the stretches are those of q > kr.
        k_upper: k_r that the excursions are integrated with, <= kr.
        kr_other: the largest k_r that conclusions are drawn for.
        check: check D >= 0.
        first: look at stretches from this node on ...
        stop: ... that begin before this one.
    """
    starts.at[:] = 0
    starts.at[_NEXT] = first
    starts.at[_STOP] = stop
    starts.at[_CHECK] = 1 if check else 0
    starts.levels[_KR] = kr
    starts.levels[_AHEAD] = k_upper
    starts.levels[_OTHER] = kr_other


@kernel
def one_more(g: Ground, starts: Starts) -> bool:
    """Fly the excursion from the start of the next stretch; False where there is none."""
    at, levels, stretches = starts.at, starts.levels, starts.stretches
    q = g.q
    n = q.size
    kr = levels[_KR]
    node = next_lifting_node(q, g.block_max_q, at[_NEXT], at[_STOP], kr)
    if node >= at[_STOP]:
        at[_NEXT] = node
        return False
    end = node
    while end < n and q[end] > kr:
        end += 1
    i, tau = next_start(g.k_h, g.w, q, g.block_max_q, kr, max(node - 1, 0), 0.0)
    cover = n
    fails = False
    if i < n:
        s0, c0 = rest_state(levels[_AHEAD], g.linear)
        event, there, fraction, _, _, _, _, made = integrate_excursion(
            g, levels[_AHEAD], i, tau, 0.0, 0.0, s0, c0, True, n - 1, 0.0, True, at[_CHECK],
            levels[_OTHER],
        )  # fmt: skip
        at[_STEPS] += made
        if event == IMPACT:
            cover = there + 1 if fraction > 0.0 else there
        else:
            fails = event != IN_AIR
    k = at[_COUNT]
    stretches[FIRST, k] = node
    stretches[END, k] = end
    stretches[COVER, k] = cover
    stretches[FAILS, k] = 1 if fails else 0
    at[_COUNT] = k + 1
    at[_NEXT] = end
    if fails:
        at[_FAILING] += 1
        at[_LAST_END] = end
    return True


@kernel
def all_known(g: Ground, starts: Starts) -> tuple[int, int]:
    """Fly all that are left; return the number of stretches, and of those that fail."""
    while one_more(g, starts):
        pass
    return starts.at[_COUNT], starts.at[_FAILING]


@kernel
def work_of(starts: Starts) -> tuple[int, int]:
    """Return how many excursions were integrated so far, and in how many steps."""
    return starts.at[_COUNT], starts.at[_STEPS]


@kernel
def fails_after(g: Ground, starts: Starts, node: int) -> bool:
    """Return whether any stretch that ends after a node fails."""
    while starts.at[_LAST_END] <= node:
        if not one_more(g, starts):
            return False
    return True


@kernel
def last_rest(g: Ground, starts: Starts, ib: int, rest_from: int, at_rest: int) -> tuple[int, int]:
    """Find the last instant of rest before the first failing stretch that is still to come.

    Args:
        g: the excitation of a block.
        starts: the excursions from rest.
        ib: interval of the first impact: stretches that end before it are past.
        rest_from: node by which the present excursions are over; larger than any for never.
        at_rest: node at which all are known to be at rest; -1 for none.

    Returns:
        Node (-1 where none is known) and number of the failing stretch (-1: none to come).
    """
    stretches = starts.stretches
    found = at_rest
    covered = rest_from
    k = 0
    while k < starts.at[_COUNT] or one_more(g, starts):
        if stretches[END, k] > ib:
            if stretches[FIRST, k] - 1 >= covered:
                found = stretches[FIRST, k] - 1
            if stretches[FAILS, k] == 1:
                return found, k
            covered = max(covered, stretches[COVER, k])
        k += 1
    return found, -1
