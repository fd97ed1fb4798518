"""Borders between a k_r that topples and one that does not: of single blocks at rest, by false
position, and K_up and K_low, beyond which all blocks do the same.

No block with k_r > K_up topples, because no excursion from rest of one does. Every block with
k_r < K_low topples.

K_low holds whatever the earlier motion of a block. With x = theta'/p + 2 sin(psi/2), the motion
obeys ::

    x' = -p cos(psi/2) x + p k_h cos(psi) - p k_v sin(psi)

so that x is bounded from below by the excitation alone, without regard to when a block began to
rock. A block that leaves |psi| <= psi_m, tan(psi_m) the greatest of k_r and of what is to pull it
back, has toppled; within, cos(psi), cos(psi/2) and sin(psi) have bounds. Since theta >= 0, no block
that has not toppled falls back faster than theta'/p = x - 2 sin(theta_c/2). In a stretch of q > K a
motion that starts from theta = 0 with that rate, and is carried on below 0 until it turns, bounds
every block with k_r <= K from below from there on: those that impact meanwhile start again at once.
If a block at rest there topples, all do.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel, within
from rbfrag.solver.integrator.excursion import (
    IMPACT,
    NO_IMPACT,
    TOPPLED,
    TRUSTED,
    Excursion,
    excursion_from_rest,
    integrate_excursion,
)
from rbfrag.solver.integrator.state import Place, State, at_rest
from rbfrag.solver.integrator.toppling_kernel import next_lifting_node
from rbfrag.solver.results import FloatArray
from rbfrag.solver.search.renewal import (
    ExcursionTable,
    add_work,
    all_known,
    begin,
    fails_after,
    next_start,
)


@inner_kernel
def linear_distance(excitation: BlockExcitation, start: Place, excursion: Excursion) -> float:
    """Return the distance in k_r of an excursion from the border, by the linear model: > 0 if it
    toppled.

    The linear model says what becomes of the state at the end of the excursion under the remaining
    excitation; referred back to its start, that is a distance in k_r. Good for a secant;
    nothing is concluded from its size.
    """
    time_s, interval_s, remaining = excitation.time_s, excitation.interval_s, excitation.remaining
    i, tau = excursion.place
    psi = math.atan2(excursion.state.sin, excursion.state.cos)
    end_s = time_s[i]
    to_come = remaining[i]
    if tau > 0.0:
        end_s += tau * interval_s[i]
        to_come += (remaining[i + 1] - to_come) * tau
    start_s = time_s[start.interval]
    if start.fraction > 0.0:
        start_s += start.fraction * interval_s[start.interval]
    # a difference of states grows as exp(p t) in the linear model: seen from the start it is that
    # much smaller
    faded = math.exp(-excitation.p * (end_s - start_s))
    distance: float = (excursion.state.rate + to_come - psi) * faded
    # the sign is that of the outcome, even where the estimate rounds to the other side
    if excursion.event == TOPPLED:
        return max(distance, 1e-300)
    return min(distance, -1e-300)


@inner_kernel
def follow(
    excitation: BlockExcitation, kr: float, node: int, table: ExcursionTable, work: np.void
) -> float:
    """Follow a block at rest at a node; return its distance from toppling, > 0 if it topples.

    Args:
        kr: rocking acceleration coefficient.
        table: excursions from rest of a k_r <= kr: where none is left that fails, the run ends.
        work: counts what it costs.
    """
    # invariant: the block rests at `place`; what it did before has no influence on what follows
    n = excitation.q.size
    # a block that is never lifted is as far from toppling as it is strong
    best = -kr
    place = Place(node, 0.0)
    # an interval holds a few impacts at most: an end for a chatter that rounding keeps up
    for _ in range(4 * n + 16):
        start = next_start(excitation, kr, place)
        if start.interval >= n or not fails_after(excitation, table, start.interval):
            break
        # one block alone is no bound of others: the order of motions is not asked about
        excursion = excursion_from_rest(excitation, kr, start, TRUSTED)
        work["steps"] += excursion.steps
        distance = linear_distance(excitation, start, excursion)
        if excursion.event == TOPPLED:
            best = distance
            break
        best = max(best, distance)
        if excursion.event != IMPACT:
            break
        # renewal: after an impact it depends on the past through its next start alone
        place = excursion.place
    work["trajectories"] += 1
    return best


@bare_kernel
def first_change(
    excitation: BlockExcitation,
    kr: FloatArray,
    first: int,
    topples: bool,
    table: ExcursionTable,
    work: np.void,
) -> int:
    """Return the index of the first block from `first` on whose outcome differs from that of the
    others.

    Args:
        kr: rocking acceleration coefficients of blocks at rest when the record begins, shape (m,).
        first: number of the first block to look at.
        topples: what the others do.
        table: as for `follow`.
        work: counts what it costs.

    Returns:
        The number, m where there is none.
    """
    for j in range(first, kr.size):
        if (follow(excitation, kr[j], 0, table, work) > 0.0) != topples:
            return j
    return kr.size


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


NOTHING_FAILS, BORDER, AT_THE_TOP = 0, 1, 2


@within
def distance_of_stretches(
    excitation: BlockExcitation, kr: float, margin: float, first: int, stop: int, work: np.void
) -> float:
    """Return the distance in k_r from toppling of the excursions from rest that begin in [first,
    stop).

    Positive if one topples. The size is the linear model's estimate of the distance in k_r:
    good for a secant, and nothing is concluded from it.
    """
    q = excitation.q
    n = q.size
    best = -math.inf
    node = next_lifting_node(q, excitation.block_max_q, first, stop, kr)
    # a stretch that has begun before `first` is that of its first node
    while node > 0 and node < stop and q[node - 1] > kr:
        node -= 1
    while node < stop:
        start = next_start(excitation, kr, Place(max(node - 1, 0), 0.0))
        if start.interval >= n:
            break
        # less by the margin: what does not topple here is safe in spite of the errors of steps
        excursion = excursion_from_rest(excitation, kr * (1.0 - margin), start, TRUSTED)
        work["steps"] += excursion.steps
        work["trajectories"] += 1
        best = max(best, linear_distance(excitation, start, excursion))
        while node < n and q[node] > kr:
            node += 1
        node = next_lifting_node(q, excitation.block_max_q, node, stop, kr)
    if math.isinf(best):  # nothing starts there
        best = -kr
    return best


@inner_kernel
def border_of_stretches(
    excitation: BlockExcitation,
    bottom: float,
    guess: float,
    top: float,
    margin: float,
    width: float,
    first: int,
    stop: int,
    work: np.void,
) -> tuple[float, bool]:
    """Find the k_r below which an excursion from rest that begins in [first, stop) topples.

    Returns:
        The least k_r known not to fail (`top` where all do), and whether any fails.
    """
    # By the lemma "order" a block of larger k_r starts later in a stretch and accelerates less: its
    # fresh excursion topples only if those of smaller k_r do, and there is one border

    # neither end has been looked at: the guess is near the root, its sides are found from there
    b = Border(bottom, top, True, math.inf, -math.inf, 0, 0, top - bottom)
    reach = 0.004
    k = guess
    while b.high - b.low > width * b.high:
        b = narrowed(b, k, distance_of_stretches(excitation, k, margin, first, stop, work))
        # below the least k_r of interest nothing is asked
        if k <= bottom and b.high == k:
            return bottom, False
        if not math.isinf(b.at_low) and not math.isinf(b.at_high):
            b, k = next_trial(b, width)
            continue
        # one side only so far: go on to the other, further each time
        reach *= 4.0
        k = b.low * (1.0 + reach) if math.isinf(b.at_high) else b.high * (1.0 - reach)
        if k >= top:
            k = 0.5 * (b.low + top)
        k = max(k, bottom)
    return b.high, not math.isinf(b.at_low)


@bare_kernel
def upper_bound(
    excitation: BlockExcitation,
    bottom: float,
    top: float,
    margin: float,
    width: float,
    check: bool,
    table: ExcursionTable,
    work: np.void,
) -> tuple[int, float]:
    """Find K_up between two k_r.

    Args:
        bottom: least k_r of interest.
        top: greatest q of the record.
        margin: the excursions are integrated with k_r (1 - margin).
        width: relative width to which K_up is bisected.
        check: check D >= 0; where it fails the answer is `top`.
        table: the excursion table, filled again.
        work: counts what it costs.

    Returns:
        NOTHING_FAILS (no excursion from rest at `bottom` topples), BORDER or AT_THE_TOP, and K_up.
    """
    q = excitation.q
    n = q.size
    # K_up is the largest k_r for which the fresh excursion of some stretch of q > k_r topples. By
    # the lemma "lift" every start lies behind the fresh one of its stretch, so that no block above
    # K_up topples. In the linear model K_up is the maximum of the remaining excitation

    # an excursion that topples at the top itself leaves no bound below it
    begin(table, top, margin, top, check, 0, n)
    failing = all_known(excitation, table)
    add_work(table, work)
    if failing > 0:
        return AT_THE_TOP, top
    high = bottom
    some_topple = False
    guess = excitation.remaining_max
    first = excitation.remaining_max_node
    if guess > bottom and q[first] > bottom:
        # the stretch that decides in the linear model is the one to begin with
        stop = first + 1
        while stop < n and q[stop] > bottom:
            stop += 1
        high, some_topple = border_of_stretches(
            excitation, bottom, min(guess, top), top, margin, width, first, stop, work
        )
        if not some_topple:
            high = bottom
    while True:
        # no other stretch may fail at `high`
        begin(table, high, margin, top, check, 0, n)
        failing = all_known(excitation, table)
        add_work(table, work)
        if failing == 0:
            return BORDER if some_topple else NOTHING_FAILS, high
        if high >= top:
            return AT_THE_TOP, top
        # the bound is not that of the first stretch: the largest of those that fail here, all
        # looked at together, since each of them is monotone in k_r
        some_topple = True
        first = n
        stop = 0
        for k in range(table.about["known"]):
            stretch = table.stretches[k]
            if stretch["fails"]:
                first = min(first, stretch["first"])
                stop = max(stop, stretch["end"])
        before = high
        high, _ = border_of_stretches(
            excitation, high, high * 1.001, top, margin, width, first, stop, work
        )
        if high <= before:  # it is the order of motions that is lost
            return AT_THE_TOP, top


RATIOS = (0.99, 0.96, 0.92, 0.86, 0.78, 0.68, 0.55, 0.4)
"""Ratios to the linear model's estimate of K_low that are tried in turn."""


@bare_kernel
def least_rate(excitation: BlockExcitation, top: float, bound: FloatArray) -> None:
    """Fill a lower bound of x at every node, at most 0, for all blocks with k_r <= top."""
    k_h, w, q = excitation.k_h, excitation.w, excitation.q
    pull = top
    for i in range(q.size):
        pull = max(pull, -q[i])
    c_m = 1.0 / math.sqrt(1.0 + pull * pull)
    s_m = pull * c_m
    c_half = math.sqrt(0.5 * (1.0 + c_m))
    # a block at rest has x > 0; at the slowest decay, cos(psi/2) = c_half, a bound below zero holds
    x = 0.0
    bound[0] = 0.0
    for i in range(excitation.interval_s.size):
        ph = excitation.p * excitation.interval_s[i]
        # k_h cos(psi) at its least is concave in k_h: the trapezoid is below its integral
        f0 = k_h[i] * (c_m if k_h[i] > 0.0 else 1.0) - abs(1.0 - w[i]) * s_m
        f1 = k_h[i + 1] * (c_m if k_h[i + 1] > 0.0 else 1.0) - abs(1.0 - w[i + 1]) * s_m
        gain = ph * (0.5 * (f0 + f1) - ph * max(abs(f0), abs(f1)))
        x = x * math.exp(-c_half * ph) + gain
        # a block may also begin to rock inside the interval, with x > 0
        x = min(x, ph * min(min(f0, f1), 0.0))
        bound[i + 1] = x


@inner_kernel
def topples_from_any_state(
    excitation: BlockExcitation, kr: float, margin: float, node: int, bound: FloatArray
) -> bool:
    """Return whether all blocks with k_r <= kr topple by the shaking after a node."""
    last = excitation.q.size - 1
    k_lower = kr * (1.0 + margin)
    if excitation.q[node] <= k_lower:
        return False
    state = at_rest(k_lower)
    # the fastest fall of a block that has not toppled, from theta = 0
    rate = bound[node] - math.sqrt(2.0 * (1.0 - state.cos)) * (1.0 + margin)
    place = Place(node, 0.0)
    state = State(0.0, rate, state.sin, state.cos)
    while state.rate < 0.0:
        i = place.interval
        if i >= last or excitation.q[i + 1] <= k_lower:
            return False
        excursion = integrate_excursion(
            excitation, k_lower, place, state, False, Place(i + 1, 0.0), NO_IMPACT
        )
        place = Place(excursion.place.interval, 0.0)
        state = excursion.state
    # those that closed their contact meanwhile started again at once: from rest, at the latest here
    return (
        place.interval < last
        and excursion_from_rest(excitation, k_lower, place, TRUSTED).event == TOPPLED
    )


@bare_kernel
def all_topple_below(
    excitation: BlockExcitation, bottom: float, top: float, margin: float, bound: FloatArray
) -> float:
    """Return K_low between two k_r; `bottom` if none is found.

    Args:
        excitation: the excitation of a block; D >= 0 throughout.
        bottom: least k_r of interest.
        top: greatest k_r of interest.
        margin: relative margin on k_r.
        bound: work array, shape (n,).
    """
    least_rate(excitation, top, bound)
    # in the linear model a state topples if theta'/p + remaining excitation > theta_c - theta
    best = bottom
    node = -1
    for i in range(excitation.q.size - 1):
        guess = min(min(0.5 * (excitation.remaining[i] + bound[i]), excitation.q[i]), top)
        if guess > best:
            best = guess
            node = i
    if node < 0:
        return bottom
    for ratio in RATIOS:
        kr = ratio * best
        if kr <= bottom:
            break
        if topples_from_any_state(excitation, kr, margin, node, bound):
            return kr
    return bottom
