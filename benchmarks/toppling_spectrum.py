"""The toppling spectrum, its cost and its bound:  python -m benchmarks.toppling_spectrum"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

import numpy as np

from benchmarks.page import ROOT, find_records, markdown, parser, report
from rbfrag.bench.peers import Records
from rbfrag.bench.work_precision import spread, timed
from rbfrag.motions.polarity import POLARITIES
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.toppling_kernel import TOPPLED
from rbfrag.solver.results import DEFAULT_P2
from rbfrag.solver.toppling_run import runner
from tests.physics import linear_block
from tests.solver.excursions_from_rest import fails

PAGE = ROOT / "docs" / "theory" / "toppling-spectrum.md"

SIZES = np.geomspace(0.1, 100.0, 100)
EXACT = 1e-9
"""Relative distance on both sides of X(p) at which the linear verdict must differ."""

CLOSE_TO_LINEAR_K = 0.05
WIDTH = 1e-7
ABOVE = (1.02, 2.0)
"""Range of k_r g/(p X) that blocks above the bound are drawn from."""


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--trials", type=int, default=27_000)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--p2", type=float, nargs="+", default=list(DEFAULT_P2))
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    rows = [*bounds(records, chosen.p2), *trials(records, chosen.trials, chosen.seed)]
    rows += cost(records)
    table = markdown((["statement", "checked on", "found"], rows))
    about = f"{records.source}, both polarities, seed {chosen.seed}."
    report("toppling-spectrum", f"{table}\n\n{about}", write=chosen.write, page=PAGE)


def bounds(records: Records, p2: Sequence[float]) -> list[list[str]]:
    """Compare X with the greatest k_r of a failing excursion from rest, linear and non-linear."""
    wrong, linear, strengths, apart = 0, 0, [], []
    for count, motion in enumerate(records.motions):
        print(f"bounds: {count}/{len(records.motions)} motions", file=sys.stderr)
        for polarity in POLARITIES:
            excited = excitation(motion, None, polarity)
            for size in p2:
                k = bound_k(toppling_spectrum(motion, size, polarity), size)
                if k <= 0.0:
                    continue
                below = linear_block.fails(excited, size, k * (1.0 - EXACT))
                wrong += not below or linear_block.fails(excited, size, k * (1.0 + EXACT))
                linear += 1
                k_up = non_linear_bound(excited, size, k)
                strengths.append(k_up)
                apart.append(abs(math.log(k_up / k)))
    small = np.array(strengths) < CLOSE_TO_LINEAR_K
    distance = np.array(apart)
    share = float(np.mean(distance[~small] <= 0.01)) if (~small).any() else math.nan
    return [
        [
            f"equals the linear bound: toppling {EXACT:g} below it, not {EXACT:g} above",
            f"{linear} combinations",
            f"{wrong} wrong",
        ],
        [
            f"non-linear bound $K_{{up}}$ below {CLOSE_TO_LINEAR_K:g}: "
            r"$\lvert\ln(K_{up}\,g/(p\,X))\rvert$",
            f"{int(small.sum())} combinations",
            _distances(distance[small]),
        ],
        [
            f"the same, $K_{{up}}$ from {CLOSE_TO_LINEAR_K:g}",
            f"{int((~small).sum())} combinations",
            f"{_distances(distance[~small])}; {100.0 * share:.2f} % within .01",
        ],
    ]


def trials(records: Records, number: int, seed: int) -> list[list[str]]:
    """Run blocks a little above the bound of motions, polarities and sizes drawn at random."""
    rng = np.random.default_rng(seed)
    low, high = math.log(min(DEFAULT_P2)), math.log(max(DEFAULT_P2))
    trials_made = toppled = just_below = 0
    per_motion = -(-number // (2 * len(records.motions)))
    for motion in records.motions:
        for polarity in POLARITIES:
            excited = excitation(motion, None, polarity)
            for p2 in np.exp(rng.uniform(low, high, per_motion)).tolist():
                k = bound_k(toppling_spectrum(motion, p2, polarity), p2)
                if k <= 0.0:
                    continue
                run = runner(excited, p2=p2)
                factor = math.exp(rng.uniform(*map(math.log, ABOVE)))
                toppled += run(factor * k).outcome == TOPPLED
                just_below += run(0.98 * k).outcome == TOPPLED
                trials_made += 1
    return [
        [
            f"no block with $k_r\\,g/p$ from {ABOVE[0]:g} to {ABOVE[1]:g} $X(p)$ topples",
            f"{trials_made} runs, $p^2$ from {min(DEFAULT_P2):g} to {max(DEFAULT_P2):g}",
            f"{toppled} toppled (of as many at .98 $X$: {just_below})",
        ]
    ]


def cost(records: Records) -> list[list[str]]:
    """Time of 100 values of p over 100 running sums of the same record."""
    ratios = []
    toppling_spectrum(records.motions[0], SIZES)  # what it needs is loaded once
    for motion in records.motions[:: max(1, len(records.motions) // 40)]:
        _, seconds = timed(lambda motion=motion: toppling_spectrum(motion, SIZES))  # type: ignore[misc]
        _, once = timed(lambda motion=motion: np.cumsum(motion.acceleration_g))  # type: ignore[misc]
        ratios.append(seconds / (SIZES.size * once))
    middle, _, high = spread(ratios)
    return [
        [
            "time of one value of $p$ over one `numpy.cumsum` of the record (100 values)",
            f"{len(ratios)} motions",
            f"median {middle:.1f}, 90 % {high:.1f}, most {max(ratios):.1f}",
        ]
    ]


def bound_k(x_m_s: float, p2: float) -> float:
    """Return the k_r whose toppling velocity is X."""
    return x_m_s * math.sqrt(p2) / STANDARD_GRAVITY_M_S2


def non_linear_bound(excited: Excitation, p2: float, guess: float) -> float:
    """Bisect for the greatest k_r of the non-linear model with a failing excursion from rest."""
    low, high = guess, guess
    step = 0.002
    while low > 0.0 and not fails(excited, p2, low):
        high, low, step = low, low * (1.0 - step), 2.0 * step
    while high <= excited.max_q and fails(excited, p2, high):
        low, high, step = high, high * (1.0 + step), 2.0 * step
    while high - low > WIDTH * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fails(excited, p2, middle) else (low, middle)
    return low


def _distances(distance: np.ndarray) -> str:
    if not distance.size:
        return "none"
    return (
        f"median {np.median(distance):.1g}, 99 % {np.quantile(distance, 0.99):.2g}, "
        f"most {distance.max():.2g}"
    )


if __name__ == "__main__":
    main()
