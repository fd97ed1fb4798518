"""The certified search: verdicts for whole intervals of k_r, from K_up downwards."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.block_excitation import Ground, block_excitation
from rbfrag.solver.results import MAP_DEPTH, RESOLUTION
from rbfrag.solver.search.lower_bound import all_topple_below
from rbfrag.solver.search.march import (
    ORDERLESS,
    SAFE,
    TO_BOTTOM,
    TO_BRACKET,
    TO_ISLAND,
    TOPPLES,
    march,
)
from rbfrag.solver.search.upper_bound import AT_THE_TOP, NOTHING_FAILS, upper_bound

FloatArray = NDArray[np.float64]

MARGIN = 1e-10
"""Relative margin on k_r of the enclosing motions: above the error of their steps."""

MAP_MARGIN = 1e-6
"""The same in a map of a depth from 100 times as much on, where spans are longer: above the error
of those."""

MAP_SPAN_PH = 0.04
"""Greatest p·T of a span there."""

DEPTH = 1e-9
"""Relative width of an interval that is left undecided."""

ORDERLESS_DEPTH = 1e-3
"""The same where the order of motions is lost, which no narrower interval brings back."""

FIRST_STEP = 1e-3
"""Relative width of the first interval below K_up."""

STEP_BUDGET = 12_000_000
"""Integration steps after which a search is given up: some tenths of a second."""

MAP_STEPS = 1_500_000
"""Integration steps of a map after which it no longer waits for a wide island, and after which it
is given up: the rest of it is undecided."""

MAX_INTERVALS = 20_000


@dataclass(frozen=True, eq=False)
class CertifiedMap:
    """Intervals with verdicts, in k_r, by falling k_r; what the search could prove.

    Args:
        k_up: nothing at or above it topples.
        low: lower ends of the intervals, shape (n,); the first one ends at `k_up`.
        high: upper ends, shape (n,).
        verdict: SAFE, TOPPLES, UNKNOWN or ORDERLESS of `rbfrag.solver.search.march`, shape (n,).
        point: a k_r of an undecided interval whose block topples, or NaN, shape (n,).
        reached: k_r down to which verdicts were given.
        complete: False when the step budget ended the search early.
        runs: motions integrated.
        steps: integration steps taken.
    """

    k_up: float
    low: FloatArray
    high: FloatArray
    verdict: NDArray[np.int64]
    point: FloatArray
    reached: float
    complete: bool
    runs: int
    steps: int

    @property
    def order_lost(self) -> bool:
        """Whether D < 0 was met."""
        return bool((self.verdict == ORDERLESS).any())

    @property
    def undecided(self) -> NDArray[np.bool_]:
        """Which intervals have no verdict."""
        without: NDArray[np.bool_] = (self.verdict != SAFE) & (self.verdict != TOPPLES)
        return without


def keeps_order(drive: Excitation, linear: bool) -> bool:
    """Return whether D >= 0 in every state short of the verdict, by the record alone.

    D = k_h sin(phi) + (1 + k_v) cos(phi) can only be negative where q = k_h/(1 + k_v) and
    tan(phi) have opposite signs and a product below -1. A block with tan(phi) > 0 has a k_r
    that q exceeded before; one beyond its balance point with tan(phi) < 0 has not toppled only
    if q is yet to fall below tan(phi). Either way a value of q is followed by one of the
    opposite sign, positive first.
    """
    if linear:
        return True
    highest = np.maximum.accumulate(np.maximum(drive.q, 0.0))
    return bool((highest * -drive.q).max() <= 1.0)


def surely_topples_below(g: Ground, drive: Excitation, bottom: float, top: float) -> float:
    """Return a k_r below which every block topples, `bottom` where none is known."""
    if g.linear or not keeps_order(drive, False):
        return bottom
    return float(all_topple_below(g, bottom, top, MARGIN)[0])


def certified_map(
    drive: Excitation,
    *,
    p2: float,
    linear: bool,
    bottom: float,
    full: bool,
    map_depth: float = MAP_DEPTH,
) -> CertifiedMap:
    """Give verdicts from K_up down to the first toppling block, or to `bottom`.

    Args:
        drive: the excitation; 1 + k_v > 0 throughout.
        p2: frequency parameter p² [1/s²].
        linear: the linear model.
        bottom: least k_r of interest.
        full: go on to `bottom`.
        map_depth: width of k_r/PGA that may be left undecided below the first toppling interval
            as wide as RESOLUTION.
    """
    check = not keeps_order(drive, linear)
    g = block_excitation(drive, p2=p2, linear=linear)
    code, _, k_up, runs, steps = upper_bound(g, bottom, drive.max_q, MARGIN, 0.1 * DEPTH, check)
    if code == AT_THE_TOP:
        k_up = drive.max_q
    if code == NOTHING_FAILS:
        nothing = np.empty(0)
        none = np.empty(0, dtype=np.int64)
        return CertifiedMap(bottom, nothing, nothing, none, nothing, bottom, True, runs, steps)
    low, high, point = (np.empty(MAX_INTERVALS) for _ in range(3))
    verdict = np.empty(MAX_INTERVALS, dtype=np.int64)
    count, reached, made_runs, made_steps = march(
        g, k_up, bottom, MARGIN, DEPTH, 0.0, ORDERLESS_DEPTH, FIRST_STEP, check,
        TO_BRACKET, 0.0, False, STEP_BUDGET, low, high, verdict, point,
    )  # fmt: skip
    runs += made_runs
    steps += made_steps
    if full and reached > bottom and made_steps < STEP_BUDGET:
        more, reached, made_runs, made_steps = march(
            g, reached, bottom, MARGIN, DEPTH, 0.0, ORDERLESS_DEPTH, FIRST_STEP, check,
            TO_ISLAND, RESOLUTION * drive.pga_g, True, MAP_STEPS,
            low[count:], high[count:], verdict[count:], point[count:],
        )  # fmt: skip
        count += more
        runs += made_runs
        steps += made_steps
        floor = surely_topples_below(g, drive, bottom, reached)
        if floor < reached:
            margin = MARGIN
            if map_depth >= 100.0 * MAP_MARGIN:
                margin = MAP_MARGIN
                g = block_excitation(drive, p2=p2, linear=linear, span_ph=MAP_SPAN_PH)
            more, reached, made_runs, made_steps = march(
                g, reached, floor, margin, DEPTH, map_depth * drive.pga_g,
                ORDERLESS_DEPTH, FIRST_STEP, check, TO_BOTTOM, 0.0, True, MAP_STEPS,
                low[count:], high[count:], verdict[count:], point[count:],
            )  # fmt: skip
            count += more
            runs += made_runs
            steps += made_steps
        if bottom < floor >= reached:
            low[count], high[count] = bottom, reached
            verdict[count], point[count] = TOPPLES, math.nan
            count, reached = count + 1, bottom
    done = full or not bool(((verdict[:count] == TOPPLES) | np.isfinite(point[:count])).any())
    return CertifiedMap(
        k_up=k_up,
        low=low[:count].copy(),
        high=high[:count].copy(),
        verdict=verdict[:count].copy(),
        point=point[:count].copy(),
        reached=reached,
        complete=not done or reached <= bottom,
        runs=runs,
        steps=steps,
    )


def bracket_of(found: CertifiedMap) -> tuple[float, float, float] | None:
    """Return the greatest k_r known to topple, the least known safe above it, and the undecided
    length above that; None where nothing topples."""
    safe_from = found.k_up
    undecided = 0.0
    for low, high, verdict, point in zip(
        found.low.tolist(), found.high.tolist(), found.verdict.tolist(), found.point.tolist(),
        strict=True,
    ):  # fmt: skip
        if verdict == SAFE:
            safe_from = low
            continue
        topples = high if verdict == TOPPLES else point
        if math.isnan(topples):
            undecided += high - low
            continue
        if safe_from - topples > BRACKET_WIDTH * safe_from:
            safe_from = high
        else:
            # the slivers inside the bracket are its own width
            undecided -= sum(
                h - b
                for b, h, v in zip(found.low, found.high, found.verdict, strict=True)
                if v != SAFE and v != TOPPLES and high <= b and h <= safe_from
            )
        return topples, safe_from, max(undecided, 0.0)
    return None


BRACKET_WIDTH = 1e-6
"""Greatest relative width of a bracket."""
