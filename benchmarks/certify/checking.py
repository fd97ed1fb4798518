"""Blocks run inside intervals that have a verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.block_excitation import BlockExcitation, block_excitation
from rbfrag.solver.integrator.compiled import bare_kernel
from rbfrag.solver.integrator.toppling_kernel import STABLE, TOPPLED
from rbfrag.solver.search.certified import MARGIN, keeps_order
from rbfrag.solver.search.envelopes import ALL_SAFE, ALL_TOPPLE, decide
from rbfrag.solver.search.renewal import ExcursionTable, begin, excursion_table, no_work
from rbfrag.solver.toppling_run import runner

FloatArray = NDArray[np.float64]

INNER = 10
"""Blocks that are run inside each interval."""


@dataclass
class Count:
    """Intervals checked, blocks run in them, blocks that did otherwise than was said."""

    intervals: int = 0
    topple: int = 0
    blocks: int = 0
    contradictions: int = 0
    undetermined: int = 0

    def check(
        self, excited: Excitation, p2: float, low: float, high: float, topples: bool, kr: FloatArray
    ) -> list[str]:
        """Run blocks inside [low, high], of which it is said whether they topple."""
        run = runner(excited, p2=p2)
        self.intervals += 1
        self.topple += topples
        wrong = []
        for k in kr.tolist():
            self.blocks += 1
            outcome = run(k).outcome
            if outcome not in (STABLE, TOPPLED):
                self.undetermined += 1
            elif (outcome == TOPPLED) != topples:
                self.contradictions += 1
                wrong.append(f"k_r {k!r} in [{low!r}, {high!r}] topples={topples}")
        return wrong


def inner_values(
    excited: Excitation, low: float, high: float, rng: np.random.Generator
) -> FloatArray:
    """Ten k_r of [low, high]: both ends, samples of q that lie between, the rest at random."""
    q = excited.q[(excited.q > low) & (excited.q < high)]
    at_samples = rng.choice(q, min(3, q.size), replace=False) if q.size else q
    random = rng.uniform(low, high, INNER - 2 - at_samples.size)
    return np.concatenate([[low, high], at_samples, random])


def verdict_on(excited: Excitation, p2: float, low: float, high: float) -> bool | None:
    """Ask the rules of the search for one interval of k_r: all topple, none does, or None."""
    verdict = _verdict(
        block_excitation(excited, p2=p2), low, high, MARGIN, not keeps_order(excited),
        excursion_table(excited.q.size), no_work(),
    )  # fmt: skip
    return {ALL_SAFE: False, ALL_TOPPLE: True}.get(verdict)


@bare_kernel
def _verdict(
    excitation: BlockExcitation,
    low: float,
    high: float,
    margin: float,
    check: bool,
    table: ExcursionTable,
    work: np.void,
) -> int:
    begin(table, low, margin, high * (1.0 + margin), check, 0, excitation.q.size)
    return decide(excitation, low, high, margin, check, table, 0, work).verdict
