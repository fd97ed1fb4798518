"""Part `digits`: what rounding the record itself does to the critical value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.certify.recordings import Combination

ROUNDED_TO_G = 1e-6
"""To about this the samples of published records are rounded [g]."""


def study(combinations: Sequence[Combination]) -> dict[str, Any]:
    """Round the samples of every record and search again."""
    exact: list[float] = []
    resolved: list[float] = []
    for combination in combinations:
        motion = combination.recording.motion
        at_digits = np.round(motion.acceleration_g / ROUNDED_TO_G) * ROUNDED_TO_G
        rounded = replace(motion, acceleration_g=at_digits)
        first, second = (
            combination.search(samples, full_map=True) for samples in (motion, rounded)
        )
        if first.kr is not None and second.kr is not None:
            exact.append(abs(first.kr - second.kr) / motion.pga_g)
        a, b = first.kr_over_pga_resolved, second.kr_over_pga_resolved
        if a is not None and b is not None:
            resolved.append(abs(a - b * second.pga_g / motion.pga_g))
    return {
        "combinations": len(exact),
        "rounded_to_g": ROUNDED_TO_G,
        "change_of_kr_over_pga_median": float(np.median(exact)),
        "change_of_kr_over_pga_90": float(np.quantile(exact, 0.9)),
        "change_of_kr_over_pga_greatest": max(exact),
        "resolved_value_median": float(np.median(resolved)),
        "resolved_value_greatest": max(resolved),
    }
