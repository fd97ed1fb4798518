"""Part `intervals`: random intervals with a verdict, ten blocks run in each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from benchmarks.certify.checking import Count, inner_values, verdict_on
from benchmarks.certify.made_up import MAKERS, vertical_of
from benchmarks.certify.recordings import MAP_DEPTH, Combination
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import Polarity
from rbfrag.solver.search.critical import critical

OF_ONE_MAP = 60
"""Intervals taken from one map, and asked for directly on the same motion."""

Case = tuple[str, GroundMotion, GroundMotion | None, Polarity, float]


def cases(combinations: Sequence[Combination], rng: np.random.Generator) -> Iterator[Case]:
    """Real combinations and made-up motions in turn, without end but for the real ones."""
    makers = list(MAKERS.items())
    for number, combination in enumerate(combinations):
        yield (
            "real",
            combination.recording.motion,
            combination.vertical,
            combination.polarity,
            combination.p2,
        )
        name, make = makers[number % len(makers)]
        motion = make(rng)
        up = vertical_of(motion, rng) if number % 2 else None
        polarity: Polarity = "forward" if rng.random() < 0.5 else "reverse"
        yield name, motion, up, polarity, float(np.exp(rng.uniform(np.log(0.1), np.log(60.0))))


def study(
    combinations: Sequence[Combination], limit: int, rng: np.random.Generator
) -> dict[str, Any]:
    """Check intervals until as many are done; half lie in maps, half are asked for directly.

    The intervals of a map are small near its borders and safe or toppling by many steps of the
    search. Asked for directly, the rules have to answer for any interval, whole decades of it
    in width, among them such as the search would never try.
    """
    in_maps: dict[str, Count] = {}
    direct: dict[str, Count] = {}
    intervals = 0
    wrong: list[str] = []
    finished = 0
    for kind, motion, up, polarity, p2 in cases(combinations, rng):
        if finished >= limit:
            break
        result = critical(
            motion,
            p2=p2,
            vertical=up,
            polarity=polarity,
            search_limit=0.02,
            full_map=True,
            map_depth=MAP_DEPTH,
        )
        if result.status == "outside_model" or not result.intervals.outcome:
            continue
        excited = excitation(motion, up, polarity)
        pga = excited.pga_g
        contradictions: list[str] = []
        decided = [m for m, w in enumerate(result.intervals.outcome) if w != "undecided"]
        count = in_maps.setdefault(kind, Count())
        for m in rng.choice(decided, OF_ONE_MAP).tolist():
            ends = rng.uniform(result.intervals.k_lo[m], result.intervals.k_hi[m], 2)
            # as often as not, up to the border itself
            low = result.intervals.k_lo[m] if rng.random() < 0.3 else ends.min()
            high = result.intervals.k_hi[m] if rng.random() < 0.3 else ends.max()
            topples = result.intervals.outcome[m] == "topples"
            kr = inner_values(excited, low * pga, high * pga, rng)
            contradictions += count.check(excited, p2, low * pga, high * pga, topples, kr)
            finished += 1
        count = direct.setdefault(kind, Count())
        top = max(result.k_up_over_pga or 0.02, 0.02) * pga
        for _ in range(OF_ONE_MAP):
            # anywhere, or inside an interval of the map, however narrow that is
            low = top * np.exp(rng.uniform(np.log(0.05), 0.02))
            if rng.random() < 0.5:
                m = rng.choice(decided)
                low = pga * rng.uniform(result.intervals.k_lo[m], result.intervals.k_hi[m])
            high = low * (1.0 + np.exp(rng.uniform(np.log(1e-7), np.log(0.3))))
            intervals += 1
            answer = verdict_on(excited, p2, low, high)
            if answer is None:
                continue
            kr = inner_values(excited, low, high, rng)
            contradictions += count.check(excited, p2, low, high, answer, kr)
            finished += 1
        wrong += [
            f"{kind} {motion.label} p2={p2!r} {polarity}: {sentence}" for sentence in contradictions
        ]
    return {
        "intervals": finished,
        "of_maps": {kind: asdict(count) for kind, count in in_maps.items()},
        "asked_for": intervals,
        "direct": {kind: asdict(count) for kind, count in direct.items()},
        "contradictions": wrong,
    }
