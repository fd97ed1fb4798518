"""Many free-standing blocks under one motion in one call, each with its sensitivity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rbfrag.solver.excitation import Excitation, Nodes
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.free_rocking import STABLE
from rbfrag.solver.integrator.rocking_kernel import RockingRules, run_rocking
from rbfrag.solver.integrator.state import Corner
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX
from rbfrag.solver.results import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class FreeRuns:
    """Results of many runs; every array has shape (n,), one element per block.

    Args:
        outcome: codes of `rbfrag.solver.integrator.rocking_kernel`.
        theta_n: the greater ratio of a peak rotation to its critical angle; NaN unless the block
            stays.
        sensitive: 1 where the outcome is another one for the motion times a little more or less.
    """

    outcome: IntArray
    theta_n: FloatArray
    sensitive: IntArray


@kernel
def run_free_blocks(
    excitations: tuple[Nodes, Nodes, Nodes],
    tails: tuple[FloatArray, FloatArray, FloatArray],
    corners: FloatArray,
    slowest: FloatArray,
    most_impacts: int,
    outcome: IntArray,
    theta_n: FloatArray,
    sensitive: IntArray,
) -> None:
    """Run one block after another, each under the motion and under two almost identical ones.

    Args:
        excitations: the motion, and the same times a little more and a little less.
        tails: greatest k_h/(1 + k_v) from each node on, of each.
        corners: numbers of both corners of each block, toe before heel, shape (n, 2, 6).
        slowest: speed after an impact below which each block rests [rad/s], shape (n,).
        most_impacts: impacts beyond which a run is given up.
        outcome: filled with the codes, shape (n,).
        theta_n: filled with the peaks over their critical angles, shape (n,).
        sensitive: filled with 1 where the outcomes differ, shape (n,).
    """
    # made once for all blocks: the coefficients of a step, and no history
    u = np.empty(9)
    no_rows = np.empty((4, 0))
    for j in range(outcome.size):
        c = corners[j]
        toe = Corner(c[0, 0], c[0, 1], c[0, 2], c[0, 3], c[0, 4], c[0, 5])
        heel = Corner(c[1, 0], c[1, 1], c[1, 2], c[1, 3], c[1, 4], c[1, 5])
        rules = RockingRules(ORDER, PH_MAX, slowest[j], most_impacts)
        run = run_rocking(excitations[0], tails[0], toe, heel, rules, no_rows, u)
        outcome[j] = run.outcome
        theta_n[j] = np.nan
        if run.outcome == STABLE:
            theta_n[j] = max(run.forward.x / toe.theta_c, run.backward.x / heel.theta_c)
        sensitive[j] = 0
        # one other outcome is enough: most sensitive blocks cost two runs, not three
        for i in (1, 2):
            if sensitive[j] == 0:
                other = run_rocking(excitations[i], tails[i], toe, heel, rules, no_rows, u)
                sensitive[j] = 1 if other.outcome != run.outcome else 0


def simulate_free(
    excited: Excitation,
    corners: FloatArray,
    slowest: FloatArray,
    *,
    most_impacts: int,
    change: float,
) -> FreeRuns:
    """Run many free-standing blocks under one excitation.

    Args:
        corners: numbers of both corners of each block, toe before heel, shape (n, 2, 6).
        slowest: speed after an impact below which each block rests [rad/s], shape (n,).
        most_impacts: impacts beyond which a run is given up.
        change: relative change of the motion that sensitive outcomes are told by.
    """
    # Rocking about two corners is chaotic for slender blocks (docs/theory/rocking.md): an outcome
    # that changes under a motion scaled by 1 + change or 1 - change is reported as sensitive
    more, less = excited.scaled(1.0 + change), excited.scaled(1.0 - change)
    excitations = (excited.nodes, more.nodes, less.nodes)
    tails = (excited.tail_max_q, more.tail_max_q, less.tail_max_q)
    runs = FreeRuns(
        np.empty(slowest.size, np.int64), np.empty(slowest.size), np.empty(slowest.size, np.int64)
    )
    run_free_blocks(
        excitations,
        tails,
        corners,
        slowest,
        most_impacts,
        runs.outcome,
        runs.theta_n,
        runs.sensitive,
    )
    return runs
