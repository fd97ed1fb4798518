"""Part `borders`: outcomes close to critical against numbers of 32 digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.certify.recordings import MAP_DEPTH, Combination
from benchmarks.extended.toppling import truth
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.toppling_run import OUTCOMES, runner

DISTANCES = tuple(10.0**-n for n in range(3, 14))
"""Relative distances from critical. Nothing is promised below 1e-10."""

PROMISED = 1e-10

OF_ONE_MAP = 2
"""Borders of islands taken besides the critical value."""

BISECTED = 1e-17
"""Relative width to which a border is bisected, in pairs of doubles."""

Pair = tuple[float, float]


def border(excited: Excitation, p2: float, topples: float, stays: float) -> Pair | None:
    """Bisect between two k_r with the reference alone; the k_r is a pair, None if they agree.

    The ends come from the search; they are moved apart until the reference itself finds one
    that topples and one that stays, so that its border owes nothing to the solver.
    """
    middle = 0.5 * (topples + stays)
    span = stays - topples
    for widened in (1.0, 10.0, 100.0):
        low, high = -0.5 * span * widened, 0.5 * span * widened
        if _topples(excited, p2, middle, low) and not _topples(excited, p2, middle, high):
            break
    else:
        return None
    while abs(high - low) > BISECTED * middle:
        offset = 0.5 * (low + high)
        if _topples(excited, p2, middle, offset):
            low = offset
        else:
            high = offset
    return middle, 0.5 * (low + high)


def _topples(excited: Excitation, p2: float, kr: float, offset: float) -> bool:
    high = kr + offset
    low = offset - (high - kr)
    return truth(excited, p2=p2, kr=(high, low)).outcome == "toppled"


def study(combinations: Sequence[Combination], rng: np.random.Generator) -> dict[str, Any]:
    """Compare outcomes on both sides of critical values and of borders of islands."""
    table = {d: {"same": 0, "undetermined": 0, "other": 0} for d in DISTANCES}
    wrong: list[str] = []
    borders = 0
    deviations: list[float] = []
    for combination in combinations:
        result = combination.search(full_map=True, map_depth=MAP_DEPTH)
        if result.status != "found" or result.lower is None or result.upper is None:
            continue
        # without certificate the upper end is K_up; above the lower one there is a border, too
        upper = result.upper if result.certified else result.lower * (1.0 + 1e-9)
        excited = combination.excited()
        pairs = [(result.lower * excited.pga_g, upper * excited.pga_g)]
        outcomes = result.intervals.outcome
        for m in rng.permutation(max(len(outcomes) - 2, 0)).tolist():
            if len(pairs) > OF_ONE_MAP:
                break
            ends = {outcomes[m], outcomes[m + 2]}
            if outcomes[m + 1] == "undecided" and ends == {"safe", "topples"}:
                low = float(result.intervals.k_lo[m + 1]) * excited.pga_g
                high = float(result.intervals.k_hi[m + 1]) * excited.pga_g
                pairs.append((low, high) if outcomes[m] == "topples" else (high, low))
        run = runner(excited, p2=combination.p2)
        for topples, stays in pairs:
            critical_kr = border(excited, combination.p2, topples, stays)
            if critical_kr is None:
                wrong.append(f"{combination.name}: the reference sees no border at {topples!r}")
                continue
            borders += 1
            if topples == pairs[0][0]:
                deviations.append(abs(topples - critical_kr[0]) / topples)
            for distance in DISTANCES:
                for side in (-1.0, 1.0):
                    kr = critical_kr[0] * (1.0 + side * distance)
                    mine = OUTCOMES[run(kr).outcome].value
                    true = truth(excited, p2=combination.p2, kr=kr).outcome
                    if mine == true:
                        table[distance]["same"] += 1
                    elif mine == "undetermined":
                        table[distance]["undetermined"] += 1
                    else:
                        table[distance]["other"] += 1
                    if mine != true and (distance >= PROMISED or mine != "undetermined"):
                        wrong.append(
                            f"{combination.name}: k_r {kr!r} {mine}, not {true} ({distance:g})"
                        )
    return {
        "combinations": len(combinations),
        "borders": borders,
        "by_distance": {f"{d:.0e}": row for d, row in table.items()},
        "critical_value_off_relative": max(deviations, default=0.0),
        "wrong": wrong,
    }
