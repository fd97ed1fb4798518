"""Part `accuracy`: peak rotations, outcomes and error estimates against numbers of 32 digits."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.certify.recordings import Recording
from benchmarks.extended.toppling import truth
from rbfrag.bench.peers import STRENGTHS
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import DEFAULT_P2, POLARITIES
from rbfrag.solver.toppling_run import OUTCOMES, simulate


def study(
    records: Sequence[Recording],
    strengths: int,
    rng: np.random.Generator,
    seconds: float = math.inf,
) -> dict[str, Any]:
    """Run every record, both polarities, every p², and so many k_r/PGA drawn in each.

    Args:
        records: records; their verticals are not used.
        strengths: k_r/PGA drawn evenly in the logarithm, one in each of so many equal parts.
        rng: draws.
        seconds: processor time after which the study ends with what it has.
    """
    runs = never = stays = wrong = undetermined = moved_otherwise = 0
    names: list[str] = []
    relative: list[float] = []
    of_estimate: list[float] = []
    absolute: list[float] = []
    low, high = np.log(STRENGTHS)
    edges = np.linspace(low, high, strengths + 1)
    started = time.process_time()
    for recording in records:
        if time.process_time() - started > seconds:
            break
        for polarity in POLARITIES:
            excited = excitation(recording.motion, None, polarity)
            for p2 in DEFAULT_P2:
                for kr in (excited.pga_g * np.exp(rng.uniform(edges[:-1], edges[1:]))).tolist():
                    if excited.max_q <= kr:
                        never += 1
                        continue
                    run = simulate(excited, p2=p2, kr=kr)
                    true = truth(excited, p2=p2, kr=kr)
                    runs += 1
                    mine = OUTCOMES[run.outcome].value
                    name = f"{recording.name} {polarity} p2={p2:g} kr={kr!r}"
                    if mine == "undetermined":
                        undetermined += 1
                        names.append(f"{name}: undetermined")
                    elif mine != true.outcome:
                        wrong += 1
                        names.append(f"{name}: {mine}, not {true.outcome}")
                    moved_otherwise += run.samples_moved != true.intervals_moved
                    if mine != "stable" or true.outcome != "stable":
                        continue
                    stays += 1
                    error = abs((run.peak_rad - true.peak_rad) - true.peak_low_rad)
                    absolute.append(error)
                    relative.append(error / true.peak_rad)
                    of_estimate.append(error / run.error_rad)
                    if relative[-1] > 1e-9:
                        names.append(f"{name}: peak {true.peak_rad:.3g} off by {relative[-1]:.1e}")
    above = np.array(of_estimate) > 1.0
    return {
        "records": len(records),
        "runs": runs,
        "never_lift": never,
        "stay": stays,
        "wrong_outcomes": wrong,
        "undetermined": undetermined,
        "intervals_moved_other_than_the_reference": moved_otherwise,
        "peak_error_relative": _spread(relative),
        "peak_error_rad": _spread(absolute),
        "error_over_estimate": _spread(of_estimate),
        "estimates_that_are_no_bound": int(above.sum()),
        "remarks": names,
    }


def _spread(values: Sequence[float]) -> dict[str, float]:
    quantiles = np.quantile(np.array(values), (0.5, 0.9, 0.999, 1.0)).tolist()
    return dict(zip(("median", "90 %", "99.9 %", "greatest"), quantiles, strict=True))
