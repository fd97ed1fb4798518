"""March down through k_r: one verdict after another, each for all blocks of an interval."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.integrator.compiled import bare_kernel, within
from rbfrag.solver.search.borders import border, follow
from rbfrag.solver.search.envelopes import ALL_SAFE, ALL_TOPPLE, NO_ORDER, SPLIT, Decision, decide
from rbfrag.solver.search.renewal import ExcursionTable, add_work, begin, excursion_table, last_rest

SAFE, TOPPLES, UNKNOWN, ORDERLESS = 0, 1, 2, 3

BORDER = 1e-11
"""Relative width to which a border between two single blocks is closed in on."""

TO_BRACKET, TO_ISLAND, TO_BOTTOM = 0, 1, 2

INTERVAL = np.dtype(
    [("low", np.float64), ("high", np.float64), ("verdict", np.int64), ("point", np.float64)]
)
"""Ends of an interval of k_r; SAFE, TOPPLES, UNKNOWN or ORDERLESS; a k_r of an UNKNOWN interval
whose block topples, or NaN."""

STATE = np.dtype(
    [
        # what has no verdict yet lies below `high`; the verdict above; intervals so far
        ("high", np.float64),
        ("above", np.int64),
        ("count", np.int64),
        # width to try next; width after the last verdict that met no border; whether the last
        # width was halved; part of the way to a border that is tried at once
        ("width", np.float64),
        ("steady", np.float64),
        ("halved", np.bool_),
        ("part", np.float64),
        # a border known by two blocks: above `border_high` all do as `above`, the block at
        # `border_point` does not
        ("border_high", np.float64),
        ("border_low", np.float64),
        ("border_point", np.float64),
        # whether a block that topples is known; width of the toppling interval being passed
        ("found", np.bool_),
        ("island", np.float64),
        # node of rest from which on the fine table counts; what that table gave; how much wider
        # than the interval its distance from the k_r of its table must be before a new one is made
        ("window", np.int64),
        ("fine_rest", np.int64),
        ("fine_failing", np.int64),
        ("patience", np.float64),
    ],
    align=True,
)
"""What a march carries from one interval to the next."""


class Settings(NamedTuple):
    """Settings of a march.

    Args:
        top: k_r to start from.
        bottom: k_r to stop at.
        margin: relative margin on k_r of the bounding trajectories.
        depth: relative width below which an interval is left undecided.
        least: the same, as a width of k_r itself.
        order_depth: the relative one where the order of motions is lost.
        first_step: relative width of the first interval.
        check: check D >= 0 on the way.
        goal: TO_BRACKET, TO_ISLAND (to the end of the first interval that is proven to topple
            and as wide as the resolution) or TO_BOTTOM.
        resolution: width of k_r of the islands that count for TO_ISLAND.
        inside: blocks below `top` topple, it is not K_up.
        budget: integration steps after which the march is given up.
    """

    top: float
    bottom: float
    margin: float
    depth: float
    least: float
    order_depth: float
    first_step: float
    check: bool
    goal: int
    resolution: float
    inside: bool
    budget: int


class March(NamedTuple):
    """State of a march.

    Args:
        coarse: excursions from rest over the whole record, at one k_r.
        fine: those over the part of it that the coarse ones leave open, at a greater k_r.
        state: of dtype STATE.
        intervals: of dtype INTERVAL, by falling k_r; filled.
    """

    settings: Settings
    coarse: ExcursionTable
    fine: ExcursionTable
    state: np.void
    intervals: NDArray[np.void]


def new_march(settings: Settings, n: int, intervals: NDArray[np.void]) -> March:
    """Return a march over a record of n nodes that has not begun."""
    state = np.zeros(1, dtype=STATE)[0]
    return March(settings, excursion_table(n), excursion_table(n), state, intervals)


@bare_kernel
def march(excitation: BlockExcitation, m: March, work: np.void) -> None:
    """Give verdicts from the top downwards until the goal or the bottom is reached.

    Args:
        m: the march; its state and its intervals are filled.
        work: counts what it costs.
    """
    # Invariant: every k_r from settings.top down to state["high"] has a verdict or is stored as
    # undecided. The next interval is up to twice as wide after a verdict and half as wide without
    # one: how wide an interval can be decided depends on the distance of its blocks from a border
    state, settings = m.state, m.settings
    begin_march(excitation, m, work)
    while (
        state["high"] > settings.bottom
        and work["steps"] < settings.budget
        and state["count"] < m.intervals.size - 1
        and not at_goal(m)
    ):
        high = state["high"]
        if high == state["border_high"] and state["border_low"] < high:
            pass_border(m)
            continue
        low = next_low(m)
        # D needs excursions of a k_r no greater than any of the interval, and near it to say much
        renew_coarse(excitation, m, low, work)
        decision = decision_on(excitation, m, low, work)
        # a split at a given k_r gets its verdict without another table
        inside = low < decision.split_at < high
        if decision.verdict == SPLIT and not inside and refined(excitation, m, low, work):
            continue
        least = max(settings.depth * high, settings.least)
        if decision.verdict == NO_ORDER:
            # narrower intervals do not bring the order back
            least = max(least, settings.order_depth * high)
        if decision.verdict == ALL_SAFE or decision.verdict == ALL_TOPPLE:
            widen(m, low)
            record(m, low, SAFE if decision.verdict == ALL_SAFE else TOPPLES, math.nan)
        elif inside:
            state["width"] = high - decision.split_at  # B
        elif high - low > least:
            # without a border to be blamed the interval was too wide
            if decision.verdict != SPLIT or not border_between(excitation, m, low, work):
                state["width"] = 0.5 * (high - low)
                state["halved"] = True
                state["part"] *= 0.5
        else:
            leave_open(excitation, m, low, decision.verdict, work)
    add_work(m.coarse, work)
    add_work(m.fine, work)


@within
def at_goal(m: March) -> bool:
    """Return whether the march has reached its goal."""
    settings = m.settings
    return m.state["found"] and (
        settings.goal == TO_BRACKET
        or (settings.goal == TO_ISLAND and m.state["island"] > settings.resolution)
    )


@within
def begin_march(excitation: BlockExcitation, m: March, work: np.void) -> None:
    """Start a march at its top; where that is K_up, test whether it is itself a border."""
    state, settings = m.state, m.settings
    top = settings.top
    state["high"] = top
    state["above"] = TOPPLES if settings.inside else SAFE
    state["width"] = settings.first_step * top
    state["steady"] = state["width"]
    state["part"] = 0.6
    state["border_high"] = top
    state["border_low"] = top
    state["border_point"] = top
    state["found"] = settings.inside
    state["fine_rest"] = -1
    state["fine_failing"] = -1
    state["patience"] = 2.0
    # no k_r has a table yet
    m.coarse.about["kr"] = math.inf
    m.fine.about["kr"] = math.inf
    if not settings.inside:
        # K_up is often the critical value itself, where the excursion that decides is not preceded
        # by another
        point = top * (1.0 - settings.depth)
        if follow(excitation, point, 0, m.coarse, work) > 0.0:
            state["border_point"] = point
            clear = max(0.25 * settings.depth, 2.0 * settings.margin) * top
            state["border_low"] = point - clear


@within
def pass_border(m: March) -> None:
    """Leave the narrow interval around a border undecided, and go on below it."""
    state = m.state
    # blocks within the margins of a border have no verdict; they are fewer than the depth allows
    row = m.intervals[state["count"]]
    row["high"] = state["high"]
    row["low"] = state["border_low"]
    row["verdict"] = UNKNOWN
    row["point"] = state["border_point"] if state["above"] == SAFE else math.nan
    state["count"] += 1
    state["above"] = TOPPLES if state["above"] == SAFE else SAFE
    state["high"] = state["border_low"]
    state["width"] = min(state["steady"], 0.2 * state["high"])
    state["found"] = state["found"] or state["above"] == TOPPLES


@within
def next_low(m: March) -> float:
    """Choose the lower end of the next interval."""
    state, settings = m.state, m.settings
    high, border_high = state["high"], state["border_high"]
    least = max(settings.depth * high, settings.least)
    low: float = max(high - state["width"], settings.bottom)
    # no sliver is left above the bottom
    if low < settings.bottom + 0.1 * least:
        low = settings.bottom
    if low < border_high < high:
        # towards a border a part of the way is tried: all of it at once seldom works
        low = border_high
        if high - low > 3.0 * least:
            low = high - state["part"] * (high - low)
    return low


@within
def renew_coarse(excitation: BlockExcitation, m: March, low: float, work: np.void) -> None:
    """Restart the coarse table where its k_r, or the range checked for D, has been passed."""
    settings = m.settings
    high = m.state["high"]
    about = m.coarse.about
    if low < about["kr"] or (settings.check and high > about["kr_other"]):
        add_work(m.coarse, work)
        # some way below the interval, so that the table holds for the next ones, too
        kr = max(settings.bottom, low - 0.5 * (high - low) - 0.1 * high)
        other = high * (1.0 + settings.margin)
        n = excitation.q.size
        begin(m.coarse, kr, settings.margin, other, settings.check, 0, n)
        # rest in the coarse table is rest in the fine one, of a greater k_r: that one begins there
        m.fine.about["kr"] = math.inf
        m.state["window"] = last_rest(excitation, m.coarse, 0, 0, 0).node


@within
def decision_on(excitation: BlockExcitation, m: March, low: float, work: np.void) -> Decision:
    """Apply the rules to the next interval, with the table whose k_r is nearest below."""
    settings = m.settings
    fine = low >= m.fine.about["kr"]
    return decide(
        excitation, low, m.state["high"], settings.margin, settings.check,
        m.fine if fine else m.coarse, m.state["window"] if fine else 0, work,
    )  # fmt: skip


@within
def refined(excitation: BlockExcitation, m: March, low: float, work: np.void) -> bool:
    """Rebuild the fine table closer to an undecided interval, if that may help."""
    state, settings = m.state, m.settings
    width = state["high"] - low
    coarse_kr = m.coarse.about["kr"]
    kr = m.fine.about["kr"] if low >= m.fine.about["kr"] else coarse_kr
    # as near as the interval is wide, the table is not what stands in the way
    if low - kr <= state["patience"] * width:
        return False
    add_work(m.fine, work)
    window = state["window"]
    begin(
        m.fine, max(low - 0.5 * width, coarse_kr), settings.margin, m.coarse.about["kr_other"],
        settings.check, window, excitation.q.size,
    )  # fmt: skip
    renewal = last_rest(excitation, m.fine, window, window, window)
    gained = renewal.node != state["fine_rest"] or renewal.failing != state["fine_failing"]
    # a table that taught nothing is not made again soon
    state["patience"] = 2.0 if gained else state["patience"] * 8.0
    state["fine_rest"] = renewal.node
    state["fine_failing"] = renewal.failing
    return True


@within
def border_between(excitation: BlockExcitation, m: March, low: float, work: np.void) -> bool:
    """Test whether a border is the reason for a missing verdict; verdicts can extend up to it."""
    state, settings = m.state, m.settings
    high = state["high"]
    if low <= state["border_high"] < high:
        return False  # it is known
    # it is there if the block at the lower end does otherwise than those above
    distance = follow(excitation, low, state["window"], m.coarse, work)
    if (distance > 0.0) != (state["above"] == SAFE):
        return False
    width = max(BORDER, 0.1 * settings.least / high)
    point, border_high = border(
        excitation, low, distance, high, width, state["window"], m.coarse, work
    )
    # the bounding trajectories of both sides are clear of it by their margins
    least = max(settings.depth * high, settings.least)
    clear = max(0.25 * least, 2.0 * settings.margin * high)
    state["border_point"] = point
    state["border_low"] = max(point - clear, low)
    state["border_high"] = min(border_high + clear, high)
    state["width"] = high - state["border_high"]
    state["part"] = 0.6
    return True


@within
def widen(m: March, low: float) -> None:
    """Choose the width after a verdict."""
    state = m.state
    # soon after a width that was too much the next one is tried with care
    factor = 1.3 if state["halved"] else 2.0
    state["width"] = min(factor * (state["high"] - low), 0.2 * low)
    state["halved"] = False
    state["part"] = min(1.3 * state["part"], 0.9)
    if not (state["border_high"] < state["high"]):
        state["steady"] = state["width"]


@within
def leave_open(
    excitation: BlockExcitation, m: March, low: float, verdict: int, work: np.void
) -> None:
    """Leave an interval undecided whose width has reached the minimum."""
    state = m.state
    state["width"] = state["high"] - low
    point = math.nan
    # a single block may topple even so, and is then the answer
    if not state["found"] and follow(excitation, low, state["window"], m.coarse, work) > 0.0:
        point = low
    record(m, low, ORDERLESS if verdict == NO_ORDER else UNKNOWN, point)


@within
def record(m: March, low: float, verdict: int, point: float) -> None:
    """Store the verdict of the next interval, and pass it."""
    state = m.state
    count = state["count"]
    high = state["high"]
    # neighbours with one verdict are one interval; what is undecided keeps its own point
    if count > 0 and m.intervals[count - 1]["verdict"] == verdict and verdict != UNKNOWN:
        m.intervals[count - 1]["low"] = low
    else:
        row = m.intervals[count]
        row["high"] = high
        row["low"] = low
        row["verdict"] = verdict
        row["point"] = point
        state["count"] = count + 1
    if verdict == TOPPLES:
        state["island"] += high - low
        state["above"] = TOPPLES
    elif verdict == SAFE:
        state["island"] = 0.0
        state["above"] = SAFE
    state["found"] = state["found"] or verdict == TOPPLES or not math.isnan(point)
    state["high"] = low
