"""Toppling and safe islands below the critical value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rbfrag.solver.integrator.block_excitation import BlockExcitation
from rbfrag.solver.results import OutcomeIntervals
from rbfrag.solver.search.borders import border
from rbfrag.solver.search.certified import CertifiedMap
from rbfrag.solver.search.from_rest import first_change
from rbfrag.solver.search.march import SAFE, TOPPLES
from rbfrag.solver.search.renewal import excursion_table, no_work

PROBES = 12
"""Single blocks looked at below the critical one, equally spaced in ln k_r."""

BORDER = 1e-9
"""Relative width to which the floor of an island is closed in on."""

OUTCOMES = {SAFE: "safe", TOPPLES: "topples"}


class Islands(NamedTuple):
    """Islands below the critical value; lengths and values in k_r.

    `resolved` is None where no toppling interval is as wide as the resolution.
    """

    width: float
    resolved: float | None
    reentrant: bool


def outcome_intervals(
    certified: CertifiedMap, pga_g: float, max_q: float, bottom: float | None = None
) -> OutcomeIntervals:
    """Return the map over k_r/PGA, rising, up to the k_r that q never exceeds.

    Args:
        certified: verdicts in k_r, falling.
        pga_g: PGA [g].
        max_q: greatest k_h/(1 + k_v).
        bottom: k_r down to which the map reaches, undecided where the search was given up
            above it; None for where the search ended.
    """
    # a partition: `edges` has one element more than `outcomes`, and outcome i holds between edges
    # i and i + 1. Above max q no block uplifts, and above K_up none topples: both are safe
    low = certified.low[::-1]
    high = certified.high[::-1]
    outcomes = [OUTCOMES.get(int(v), "undecided") for v in certified.verdict[::-1]]
    edges = [*low.tolist(), *high.tolist()[-1:]] or [certified.k_up]
    if bottom is not None and edges[0] > bottom:
        edges.insert(0, bottom)
        outcomes.insert(0, "undecided")
    top = max(max_q, certified.k_up)
    if top > certified.k_up:
        edges.append(top)
        outcomes.append("safe")
    kept_edges = edges[:1]
    kept_outcomes: list[str] = []
    for outcome, edge in zip(outcomes, edges[1:], strict=True):
        if kept_outcomes and kept_outcomes[-1] == outcome:
            kept_edges[-1] = edge
        else:
            kept_outcomes.append(outcome)
            kept_edges.append(edge)
    ratio = np.array(kept_edges) / pga_g
    # ends one rounding apart may fall together in the quotient, and such an interval is none
    wide = ratio[1:] > ratio[:-1]
    return OutcomeIntervals(
        k_lo=ratio[:-1][wide],
        k_hi=ratio[1:][wide],
        outcome=tuple(name for name, is_wide in zip(kept_outcomes, wide, strict=True) if is_wide),  # type: ignore[misc]
    )


def islands_of_map(
    certified: CertifiedMap, block: BlockExcitation, lower: float, resolution: float
) -> tuple[Islands, int]:
    """Return the islands of a full map.

    Undecided slivers count to the interval above them; the lower end of the deciding island,
    which lies in one, is closed in on by single blocks. A safe gap narrower than the resolution
    does not end a toppling island for `resolved`, nor make the set reentrant.

    Args:
        certified: the map, in k_r.
        block: the excitation of the blocks.
        lower: greatest k_r that topples.
        resolution: width of k_r below which islands are ignored.

    Returns:
        What was read, and the number of blocks.
    """
    # down through the map; island_top is the top of the toppling island being passed, gap_top that
    # of the safe gap (None inside an island). Gaps up to the resolution are bridged for `resolved`
    work = no_work()
    width: float | None = None
    resolved: float | None = None
    reentrant = False
    island_top = lower
    gap_top: float | None = None
    bottom = lower
    for low, high, verdict in zip(
        certified.low.tolist(), certified.high.tolist(), certified.verdict.tolist(), strict=True
    ):
        # what lies above the answer is no island below it
        if high > lower and low >= lower:
            continue
        if verdict == SAFE:
            if gap_top is None:
                gap_top = high
            if width is None:
                # the island of the answer ends in the sliver between the two verdicts
                _, floor = border(block, high, -1.0, bottom, BORDER, 0, excursion_table(0), work)
                width = lower - floor
            if gap_top - low > resolution:
                reentrant = True
        elif verdict == TOPPLES:
            if gap_top is not None and gap_top - high > resolution:
                island_top = high
            gap_top = None
            bottom = low
            if resolved is None and island_top - bottom >= resolution:
                resolved = island_top
    # no safe interval below: it reaches down to the end of the map
    if width is None:
        width = lower - certified.reached
        if resolved is None and width >= resolution:
            resolved = lower
    return Islands(width, resolved, reentrant), int(work["trajectories"])


def islands_by_blocks(
    block: BlockExcitation, lower: float, floor: float, bottom: float, resolution: float
) -> tuple[Islands, int]:
    """Search for islands below the critical value by single blocks: evidence, not a proof.

    Args:
        block: the excitation of the blocks.
        lower: greatest k_r that topples.
        floor: least k_r to look at; every one below it topples, or is below `bottom`.
        bottom: least k_r of interest.
        resolution: width of k_r below which islands are ignored.

    Returns:
        What was found, and the number of blocks.
    """
    # every block below the answer topples: one island, as wide as it can be
    if lower <= floor:
        return Islands(lower - bottom, lower, False), 0
    kr = np.geomspace(lower, floor, PROBES)
    # the island of the critical value itself may be narrower than the spacing
    near = lower - resolution * np.array([0.25, 1.0])
    kr = np.concatenate([[lower], near[near > kr[1]], kr[1:]])
    nothing_known = excursion_table(0)
    work = no_work()
    at = 1
    inside = True  # of an island
    edges = [lower]  # tops and floors of islands in turn
    resolved: float | None = None
    reentrant = False
    while resolved is None or not reentrant:
        turn = first_change(block, kr, at, inside, nothing_known, work)
        # all the rest do the same, down to the limit
        if turn == kr.size:
            edge = bottom
            if not inside:
                break
        else:
            low_side, high_side = border(
                block, float(kr[turn]), -1.0 if inside else 1.0, float(kr[turn - 1]), BORDER,
                0, nothing_known, work,
            )  # fmt: skip
            edge = high_side if inside else low_side
        if inside and resolved is None and edges[-1] - edge >= resolution:
            resolved = edges[-1]
        if not inside:
            reentrant = reentrant or edges[-1] - edge > resolution
        edges.append(edge)
        if turn == kr.size:
            break
        if inside and resolved is not None and floor > bottom and edge - kr[turn] > resolution:
            reentrant = True  # the lowest block is known to topple
        inside = not inside
        at = turn + 1
    return Islands(lower - edges[1], resolved, reentrant), int(work["trajectories"])
