"""Part `islands`: maps against brute force, on combinations that have islands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.certify.recordings import MAP_DEPTH, Combination
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.integrator.toppling_kernel import STABLE, TOPPLED
from rbfrag.solver.toppling_run import runner

WIDE = 1e-6
"""Least width of k_r/PGA of an island that makes a combination one with islands."""


def safe_islands(result: CriticalResult) -> list[float]:
    """Return the widths of the safe islands below the critical value, in k_r/PGA.

    From the first to the last block known to be safe between two that topple.
    """
    widths: list[float] = []
    first: float | None = None
    last = 0.0
    seen_toppling = False
    for low, high, outcome in zip(
        result.intervals.k_lo.tolist(), result.intervals.k_hi.tolist(), result.intervals.outcome,
        strict=True,
    ):  # fmt: skip
        if outcome == "topples":
            if seen_toppling and first is not None and last - first > WIDE:
                widths.append(last - first)
            seen_toppling = True
            first = None
        elif outcome == "safe":
            first = low if first is None else first
            last = high
    return widths


def study(combinations: Sequence[Combination], limit: int, values: int) -> dict[str, Any]:
    """Map combinations until `wanted` with islands are found, and run `values` blocks in each.

    Half of the blocks are spread evenly in k_r, half in its logarithm.
    """
    looked = mapped = blocks = islands = undetermined = uncertified = higher = 0
    wrong: list[str] = []
    narrowest = np.inf
    for combination in combinations:
        if mapped == limit:
            break
        looked += 1
        result = combination.search(full_map=True, map_depth=MAP_DEPTH)
        gaps = safe_islands(result)
        if not gaps:
            continue
        mapped += 1
        islands += len(gaps)
        uncertified += not result.certified
        narrowest = min(narrowest, *gaps)
        outcome_of_interval = np.array(result.intervals.outcome)
        excited = combination.excited()
        run = runner(excited, p2=combination.p2)
        bottom = result.search_limit
        top = excited.max_q / excited.pga_g
        half = values // 2
        ratios = np.concatenate(
            [np.linspace(bottom, top, half), np.geomspace(bottom, top, values - half)]
        )
        outcomes = np.array([run(r * excited.pga_g).outcome for r in ratios.tolist()])
        blocks += ratios.size
        at = np.minimum(
            np.searchsorted(result.intervals.k_hi, ratios), outcome_of_interval.size - 1
        )
        undetermined += int(((outcomes != STABLE) & (outcomes != TOPPLED)).sum())
        bad = (outcome_of_interval[at] == "safe") & (outcomes == TOPPLED)
        bad |= (outcome_of_interval[at] == "topples") & (outcomes == STABLE)
        wrong += [
            f"{combination.name}: k_r/PGA {ratio!r} is not {outcome}"
            for ratio, outcome in zip(
                ratios[bad].tolist(), outcome_of_interval[at][bad].tolist(), strict=True
            )
        ]
        topples = ratios[outcomes == TOPPLED]
        # what brute force alone would have called the critical value
        higher += bool(result.lower > topples.max(initial=0.0) * (1.0 + 1e-3))
    return {
        "searched": looked,
        "with_islands": mapped,
        "safe_islands": islands,
        "narrowest_safe_island": narrowest,
        "not_certified": uncertified,
        "blocks": blocks,
        "undetermined": undetermined,
        "contradictions": wrong,
        "critical_value_missed_by_brute_force": higher,
    }
