"""Part `combinations`: certified searches on real records: width, certificate, time."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.certify.recordings import Combination
from rbfrag.solver.search.certified import keeps_order


def study(combinations: Sequence[Combination]) -> dict[str, Any]:
    """Search every combination once.

    Returns:
        Counts by what came out, greatest width of a bracket, processor time of a whole
        `critical` call [ms], names of combinations that should have been certified.
    """
    combinations[0].search()  # compiles
    counts = {"found": 0, "below_limit": 0, "no_motion": 0, "outside_model": 0}
    certified = ordered = slivers = 0
    missed: list[str] = []
    rejected: list[str] = []
    widths: list[float] = []
    seconds: list[float] = []
    for combination in combinations:
        started = time.process_time()
        result = combination.search()
        seconds.append(time.process_time() - started)
        counts[result.status] += 1
        if result.status == "outside_model":
            continue
        certified += result.certified
        slivers += bool(result.undecided)
        if keeps_order(combination.excited()):
            ordered += 1
            if not result.certified:
                missed.append(combination.name)
        elif not result.certified:
            rejected.append(combination.name)
        if result.upper is not None and result.lower is not None:
            widths.append((result.upper - result.lower) / result.upper)
    median, ninety, ninety_nine, greatest = np.quantile(seconds, (0.5, 0.9, 0.99, 1.0)) * 1e3
    return {
        "combinations": len(combinations),
        **counts,
        "certified": certified,
        "order_kept_by_the_record": ordered,
        "of_these_not_certified": missed,
        "order_not_kept_and_not_certified": rejected,
        "certified_with_slivers": slivers,
        "widest_bracket": max(widths, default=0.0),
        "ms_median": float(median),
        "ms_90": float(ninety),
        "ms_99": float(ninety_nine),
        "ms_greatest": float(greatest),
    }
