"""How often intervals of P hold the truth:  python -m benchmarks.coverage [--db DATABASE]

Each fitted model is taken for the truth. Outcomes of all blocks of the grid are drawn from it, with
what blocks of one earthquake share (the copula of docs/theory/joint-failures.md), the model is
fitted to them, and the intervals of blocks drawn at random are compared with the P that is known.
The copula is that of an earlier estimate, or with --estimated of this project's.
The reference that is shipped has all that is read. Two minutes of processor time. --write keeps the
table beside those of docs/evidence/model-choice.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from benchmarks.held_out import MODELS, Study, read, studied
from benchmarks.joint_failures import PUBLISHED, dependence_columns
from benchmarks.model_acceptance import Mark, acceptance_table
from benchmarks.page import ROOT, parser, write_table
from rbfrag.bench.tables import markdown
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.fit.clusters import cr3, event_derivatives, jackknife_steps
from rbfrag.fragility.fit.dependence import PairTables
from rbfrag.fragility.fit.likelihood import Binomial, maximise
from rbfrag.fragility.intervals import ParameterErrors, packed, quantiles_of
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.fragility.method import arrays

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "evidence" / "model-choice.md"

LEVEL = 0.95
SETS = 300
BLOCKS = 60
RESAMPLES = 400
BETWEEN = (0.03, 0.97)
"""P of the blocks whose intervals are looked at."""

AT_ONCE = 50
"""Sets of outcomes that are drawn together, for memory."""

INTERVALS = (
    "naive",
    "CR1, normal",
    "bootstrap of earthquakes",
    "CR3, t with G-1",
    "CR3, t with nu(x)",
)
"""The ways; the last is by the function that predictions state their intervals with."""


@dataclass(frozen=True, eq=False)
class Coverage:
    """What intervals held.

    Args:
        held: whether the interval held the truth, shape (ways, sets, blocks).
        half_width: of the last way in eta, shape (sets, blocks).
    """

    held: NDArray[np.bool_]
    half_width: FloatArray

    @property
    def share(self) -> FloatArray:
        """Of each way, shape (ways,)."""
        return np.asarray(self.held.mean(axis=(1, 2)))

    @property
    def error(self) -> FloatArray:
        """Standard error of the shares, shape (ways,): the blocks of one set go together."""
        return np.asarray(self.held.mean(axis=2).std(axis=1, ddof=1) / self.held.shape[1] ** 0.5)


def coverage(model: Study, law: Dependence, *, sets: int = SETS, seed: int = 0) -> Coverage:
    """Return what the intervals of a model hold where it is the truth.

    Args:
        model: the fit that outcomes are drawn from.
        law: what blocks of one earthquake share.
        sets: how many times outcomes of all blocks are drawn and fitted.
        seed: of the random numbers.
    """
    generator = np.random.default_rng(seed)
    rows, p = model.rows.data, model.rows.data.probability(model.b)
    usable = np.flatnonzero((p > BETWEEN[0]) & (p < BETWEEN[1]))
    held = np.zeros((len(INTERVALS), sets, BLOCKS), dtype=np.bool_)
    half = np.zeros((sets, BLOCKS))
    drawn = _outcomes(JointSampler(law, model.placement), p, sets, generator)
    for number, failed in enumerate(drawn):
        fitted = replace(rows, outcome=failed)
        b = maximise(fitted, model.b, tolerance=1e-9)[0]
        x = rows.columns[generator.choice(usable, BLOCKS, replace=False)]
        low, high = intervals(fitted, b, x, generator)
        truth = x @ model.b - x @ b
        held[:, number] = (low <= truth) & (truth <= high)
        half[number] = high[-1]
    return Coverage(held, half)


def _outcomes(
    sampler: JointSampler, p: FloatArray, sets: int, generator: np.random.Generator
) -> Iterator[FloatArray]:
    for start in range(0, sets, AT_ONCE):
        yield from sampler.failures(p, min(AT_ONCE, sets - start), generator).astype(np.float64)


def intervals(
    rows: Binomial, b: FloatArray, x: FloatArray, generator: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper ends of eta less its estimate, each of shape (ways, blocks).

    Args:
        rows: of the fit.
        b: its parameters, shape (k,).
        x: slopes of eta of some blocks, shape (blocks, k).
        generator: source of random numbers of the bootstrap.
    """
    scores, parts = event_derivatives(rows, b)
    naive = np.linalg.inv(parts.sum(axis=0))
    (g, k), n = scores.shape, rows.event.size
    cr1 = g / (g - 1.0) * (n - 1.0) / (n - k) * naive @ (scores.T @ scores) @ naive
    steps = jackknife_steps(rows, b)
    tail = 0.5 + 0.5 * LEVEL

    def reach(covariance: FloatArray, freedom: float) -> FloatArray:
        error = np.sqrt(np.einsum("ij,jk,ik->i", x, covariance, x))
        return np.asarray(stdtrit(freedom, tail) * error)

    # one Newton step from the fit for each resample of earthquakes
    times = generator.multinomial(g, np.full(g, 1.0 / g), size=RESAMPLES).astype(np.float64)
    resampled = np.einsum("rg,gij->rij", times, parts)
    moved = np.linalg.solve(resampled, (times @ scores)[..., None])[..., 0] @ x.T
    ends = np.quantile(moved, (1.0 - tail, tail), axis=0)
    normal = 1e9
    jackknife = cr3(steps)
    errors = ParameterErrors(packed(jackknife.tolist()), tuple(map(tuple, steps.tolist())))
    high = np.array([
        reach(naive, normal), reach(cr1, normal), ends[1], reach(jackknife, g - 1.0),
        errors.half_width([*x.T], quantiles_of(LEVEL), arrays()),
    ])  # fmt: skip
    low = -high
    low[2] = ends[0]
    return low, high


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes of the grid")
    options.add_argument("--sets", type=int, default=SETS, help="sets of outcomes for each model")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument(
        "--estimated", action="store_true", help="what earthquakes share as estimated here"
    )
    chosen = options.parse_args(arguments)
    source, data = read(chosen.db)
    result = {}
    for name in MODELS:
        model = studied(source, data, name)
        law = PUBLISHED[name]
        if chosen.estimated:
            law = PairTables.of(*dependence_columns(data, model)).likeliest()
        result[name] = coverage(model, law, sets=chosen.sets, seed=chosen.seed)
    table = f"{coverage_table(result)}\n\n{acceptance_table(marks(result))}"
    print(table, flush=True)
    if chosen.write:
        write_table(PAGE, "coverage", table)


def coverage_table(result: dict[str, Coverage]) -> str:
    """Return coverage by way and model."""
    rows = [
        [way, *(f"{one.share[i]:.3f} ± {one.error[i]:.3f}" for one in result.values())]
        for i, way in enumerate(INTERVALS)
    ]
    width = ["half width in eta", *(f"{one.half_width.mean():.2f}" for one in result.values())]
    return markdown(([f"nominal {LEVEL:g}", *result], [*rows, width]))


def marks(result: dict[str, Coverage]) -> list[Mark]:
    """Return the aims, with what is reached."""
    return [
        Mark(name, "coverage of nominal 95 %", 0.93, 0.98, float(one.share[-1]))
        for name, one in result.items()
    ]


if __name__ == "__main__":
    main()
