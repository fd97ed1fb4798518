"""Toppling and safe islands below the critical value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.certified import CertifiedMap
from rbfrag.solver.march import SAFE, TOPPLES
from rbfrag.solver.results import OutcomeIntervals
from rbfrag.solver.scan import BlockScan

FloatArray = NDArray[np.float64]

PROBES = 160
"""Single blocks looked at below the critical one, equally spaced in ln k_r."""

WORDS = {SAFE: "safe", TOPPLES: "topples"}


class Islands(NamedTuple):
    """What lies below the critical value; lengths and values in k_r.

    `resolved` is None where no toppling interval is as wide as the resolution.
    """

    width: float
    resolved: float | None
    reentrant: bool


def outcome_intervals(
    found: CertifiedMap, pga_g: float, max_q: float, bottom: float | None = None
) -> OutcomeIntervals:
    """Return the map over k_r/PGA, rising, up to the k_r that no drive exceeds.

    Args:
        found: verdicts in k_r, falling.
        pga_g: PGA [g].
        max_q: greatest k_h/(1 + k_v).
        bottom: k_r down to which the map reaches, undecided where the search was given up
            above it; None for where the search ended.
    """
    low = found.low[::-1]
    high = found.high[::-1]
    words = [WORDS.get(int(v), "undecided") for v in found.verdict[::-1]]
    edges = [*low.tolist(), *high.tolist()[-1:]] or [found.k_up]
    if bottom is not None and edges[0] > bottom:
        edges.insert(0, bottom)
        words.insert(0, "undecided")
    top = max(max_q, found.k_up)
    if top > found.k_up:
        edges.append(top)
        words.append("safe")
    kept_edges = edges[:1]
    kept_words: list[str] = []
    for word, edge in zip(words, edges[1:], strict=True):
        if kept_words and kept_words[-1] == word:
            kept_edges[-1] = edge
        else:
            kept_words.append(word)
            kept_edges.append(edge)
    ratio = np.array(kept_edges) / pga_g
    # ends one rounding apart may fall together in the quotient, and such an interval is none
    wide = ratio[1:] > ratio[:-1]
    return OutcomeIntervals(
        k_lo=ratio[:-1][wide],
        k_hi=ratio[1:][wide],
        outcome=tuple(word for word, kept in zip(kept_words, wide, strict=True) if kept),  # type: ignore[misc]
    )


def islands_of_map(
    found: CertifiedMap, scan: BlockScan, lower: float, resolution: float
) -> Islands:
    """Read the islands off a full map.

    Undecided slivers count to the interval above them; the lower end of the deciding island,
    which lies in one, is closed in on by single blocks. A safe gap narrower than the resolution
    does not end a toppling island for `resolved`, nor make the set reentrant.

    Args:
        found: the map, in k_r.
        scan: the blocks.
        lower: greatest k_r that topples.
        resolution: width of k_r below which islands are ignored.
    """
    width: float | None = None
    resolved: float | None = None
    reentrant = False
    island_top = lower
    gap_top: float | None = None
    bottom = lower
    for low, high, verdict in zip(
        found.low.tolist(), found.high.tolist(), found.verdict.tolist(), strict=True
    ):
        if high > lower and low >= lower:
            continue
        if verdict == SAFE:
            if gap_top is None:
                gap_top = high
            if width is None:
                width = lower - scan.border(min(bottom, lower), high)[0]
            if gap_top - low > resolution:
                reentrant = True
        elif verdict == TOPPLES:
            if gap_top is not None and gap_top - high > resolution:
                island_top = high
            gap_top = None
            bottom = low
            if resolved is None and island_top - bottom >= resolution:
                resolved = island_top
    if width is None:
        width = lower - found.reached
        if resolved is None and width >= resolution:
            resolved = lower
    return Islands(width, resolved, reentrant)


def islands_by_blocks(scan: BlockScan, lower: float, bottom: float, resolution: float) -> Islands:
    """Look for islands below the critical value by single blocks: a finding, not a proof.

    Args:
        scan: the blocks.
        lower: greatest k_r that topples.
        bottom: least k_r of interest.
        resolution: width of k_r below which islands are ignored.
    """
    if lower <= bottom:
        return Islands(0.0, lower, False)
    kr = np.geomspace(lower, bottom, PROBES)
    kr[0] = lower
    kr[-1] = bottom
    # the island of the critical value itself may be narrower than the spacing
    near = lower - resolution * np.array([0.0, 0.25, 1.0])
    kr = np.concatenate([near[near > kr[1]], kr[1:]])
    width: float | None = None
    resolved: float | None = None
    reentrant = False
    top = lower
    start = 0
    while start < kr.size and (resolved is None or not reentrant):
        stays = scan.first(kr[start:], topples=False)
        floor = bottom
        if stays is not None:
            stays += start
            floor, _ = scan.border(float(kr[stays - 1]), float(kr[stays]))
        if width is None:
            width = lower - floor
        if resolved is None and top - floor >= resolution:
            resolved = top
        if stays is None:
            break
        again = scan.first(kr[stays:], topples=True)
        safe_from = bottom
        if again is not None:
            again += stays
            top, safe_from = scan.border(float(kr[again]), float(kr[again - 1]))
        reentrant = reentrant or floor - safe_from > resolution
        if again is None:
            break
        start = again
    return Islands(lower - bottom if width is None else width, resolved, reentrant)
