"""Critical values against runs above them: what is certified holds, what is not hides little.

The runs above are those of a Runge-Kutta integrator of its own; the ends of the brackets, and
whatever it says differently, are judged by the reference of 32 digits.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.certify.recordings import recordings
from benchmarks.extended.toppling import truth
from benchmarks.hard_cases import Row
from benchmarks.hard_cases._records import made_up, vertical_of
from benchmarks.hard_cases._rocking_block import topple
from benchmarks.page import RECORDS_VARIABLE
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.results import DEFAULT_P2, Polarity
from rbfrag.solver.search.critical import critical

SEED = 7
OF_RECORDINGS, RUNS_ABOVE = 40, 2000
OF_MADE_UP, RUNS_OF_MADE_UP = 500, 400
UNCERTIFIED, RUNS_OF_UNCERTIFIED = 500, 4000

HIDDEN = 1.005
"""A search that is not certified may hide a block that is stronger by this factor at most."""


class Case(NamedTuple):
    """One critical search."""

    motion: GroundMotion
    p2: float
    vertical: GroundMotion | None = None
    polarity: Polarity = "forward"

    def search(self) -> CriticalResult:
        return critical(self.motion, p2=self.p2, vertical=self.vertical, polarity=self.polarity)

    def excitation(self) -> Excitation:
        return excitation(self.motion, self.vertical, self.polarity)


def scaled(motion: GroundMotion, factor: float) -> GroundMotion:
    return GroundMotion(motion.acceleration_g * factor, motion.dt_s)


def of_recordings(rng: np.random.Generator, number: int) -> Iterator[Case]:
    """Yield searches on recordings as they are, half of them with their vertical motion."""
    if RECORDS_VARIABLE not in os.environ:
        print(f"{RECORDS_VARIABLE} is not set: no recordings", file=sys.stderr)
        return
    records = recordings()
    upward = [record for record in records if record.vertical is not None]
    for i in range(number):
        candidates = upward if i % 2 else records
        recording = candidates[int(rng.integers(len(candidates)))]
        polarity: Polarity = "forward" if rng.integers(2) else "reverse"
        p2 = DEFAULT_P2[int(rng.integers(len(DEFAULT_P2)))]
        yield Case(recording.motion, p2, recording.vertical if i % 2 else None, polarity)


def hard_to_certify(rng: np.random.Generator) -> Iterator[Case]:
    """Yield strong motion on end: made up, and recordings twice as strong, with vertical motion."""
    records = recordings() if RECORDS_VARIABLE in os.environ else []
    upward = [record for record in records if record.vertical is not None]
    while True:
        motion, p2 = made_up(rng)
        if upward and rng.integers(3) == 0:
            recording = upward[int(rng.integers(len(upward)))]
            assert recording.vertical is not None
            motion = scaled(recording.motion, 2.0)
            most = float(np.abs(recording.vertical.acceleration_g).max())
            up = scaled(recording.vertical, rng.uniform(0.5, 0.99) / most)
            yield Case(motion, DEFAULT_P2[int(rng.integers(len(DEFAULT_P2)))], up)
            continue
        strong = scaled(motion, rng.uniform(1.0, 2.5))
        yield Case(strong, p2, vertical_of(motion, rng) if rng.integers(2) else None)


def toppling_above(case: Case, excited: Excitation, low: float, high: float, runs: int) -> float:
    """Return the strongest k_r between two that topples by brute force, 0 for none.

    Half of the blocks are equally spaced in ln k_r, half are drawn.
    """
    if not low < high:
        return 0.0
    rng = np.random.default_rng(runs)
    spaced = low * (high / low) ** ((np.arange(runs // 2) + 0.5) / (runs // 2))
    drawn = rng.uniform(low, high, runs - runs // 2)
    kr = np.sort(np.concatenate([spaced, drawn]))[::-1]
    for k in kr[topple(excited.time_s, excited.k_h, excited.w, case.p2**0.5, kr)].tolist():
        if truth(excited, p2=case.p2, kr=k).outcome == "toppled":
            return float(k)
    return 0.0


def contradictions(case: Case, result: CriticalResult, runs: int) -> Iterator[str]:
    """Yield what an answer gets wrong."""
    excited = case.excitation()
    pga = excited.pga_g
    bottom = result.search_limit * pga
    top = max(excited.max_q, bottom)
    if result.lower is not None:
        if truth(excited, p2=case.p2, kr=result.lower * pga).outcome != "toppled":
            yield f"the block at the lower end {result.lower!r} does not topple"
        bottom = result.lower * pga
    upper = None if result.upper is None else result.upper * pga
    if upper is not None and truth(excited, p2=case.p2, kr=upper).outcome == "toppled":
        yield f"the block at the upper end {result.upper!r} topples"
    if result.certified:
        above = bottom if upper is None else upper
        if contradiction := toppling_above(case, excited, above * (1.0 + 1e-12), top, runs):
            yield f"a block of {contradiction / pga!r} topples above a certified bracket"
    else:
        assert upper is not None
        if contradiction := toppling_above(case, excited, bottom * HIDDEN, upper, runs):
            above_lower = contradiction / bottom - 1.0
            yield f"a block of {contradiction / pga!r} topples, {above_lower:.2g} above `lower`"
        if contradiction := toppling_above(case, excited, upper, top, runs // 4):
            yield f"a block of {contradiction / pga!r} topples above K_up"


def study(subject: str, cases: Iterator[Case], runs: int) -> Row:
    """Judge the answers to some searches."""
    tried = wrong = certified = undecided = 0
    for case in cases:
        result = case.search()
        if result.status in ("no_motion", "outside_model"):
            continue
        tried += 1
        certified += result.certified
        undecided += not result.certified
        problems = list(contradictions(case, result, runs))
        wrong += bool(problems)
        for problem in problems:
            print(f"{subject}, {tried} (p2 {case.p2!r}): {problem}", file=sys.stderr, flush=True)
    against = f"Runge-Kutta, {runs:,} runs above each; ends in 32 digits"
    return Row(subject, against, tried, wrong, certified, undecided)


def uncertified(number: int, seed: int = SEED) -> tuple[Row, str]:
    """Judge so many searches without certificate; and say how often and how long they are."""
    rng = np.random.default_rng(seed)
    spent = {True: [0, 0.0], False: [0, 0.0]}

    def drawn() -> Iterator[Case]:
        for case in hard_to_certify(rng):
            if spent[False][0] >= number:
                return
            started = time.process_time()
            result = case.search()
            taken = spent[result.certified]
            if result.status not in ("no_motion", "outside_model"):
                taken[0], taken[1] = taken[0] + 1, taken[1] + time.process_time() - started
                if not result.certified:
                    yield case

    row = study("searches without certificate", drawn(), RUNS_OF_UNCERTIFIED)
    (yes, yes_s), (no, no_s) = spent[True], spent[False]
    about = (
        f"not certified: {no} of {yes + no}; {1e3 * no_s / no:.0f} ms each, certified ones "
        f"{1e3 * yes_s / max(yes, 1):.0f} ms"
    )
    return row, about


def rows() -> list[Row]:
    """Return the rows of the table."""
    rng = np.random.default_rng(SEED)
    table_rows = [
        study("critical values of recordings", of_recordings(rng, OF_RECORDINGS), RUNS_ABOVE),
        study(
            "critical values of made-up records",
            (Case(*made_up(rng)) for _ in range(OF_MADE_UP)),
            RUNS_OF_MADE_UP,
        ),
    ]
    last, about = uncertified(UNCERTIFIED)
    print(about, file=sys.stderr)
    return [*table_rows, last]
