"""Coverage of confidence and prediction intervals:  python -m benchmarks.coverage [MODEL...]

Confidence intervals of P: each fitted model is assumed to be true, its spectral velocity exact.
Outcomes of all blocks of the grid are drawn from it with the dependence within earthquakes, the
model is fitted to them, and the intervals of random blocks are compared with the known P.
Prediction intervals for a single earthquake: identical blocks, one on each side of all sites of a
held-out earthquake, or of one site, are compared with the interval of `rbfrag predict --sites`.
MODEL is as in benchmarks.joint_failures. The built-in data set has all that is read; --db DATABASE:
another. --write keeps the tables, in docs/evidence/model-choice.md and joint-failures.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from benchmarks.joint_failures import LOADINGS, MODELS, Study, loadings_of
from benchmarks.joint_failures import PAGE as RANGES_PAGE
from benchmarks.model_aims import Mark, acceptance_table
from benchmarks.page import ROOT, markdown, parser, write_table
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.confidence import ParameterErrors, packed, quantiles_of
from rbfrag.fragility.dependence import Dependence, Loadings, Shares
from rbfrag.fragility.fit.likelihood import Binomial, maximise
from rbfrag.fragility.fit.result import cr3, event_derivatives, jackknife_steps
from rbfrag.fragility.joint import COMPONENTS, overdispersion, share_range
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.fragility.method import LinearPredictor, arrays

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "evidence" / "model-choice.md"

LEVEL = 0.95
SETS = 300
BLOCKS = 60
RESAMPLES = 400
BETWEEN = (0.03, 0.97)
"""P of the blocks whose intervals are looked at."""

HELD = (0.93, 0.98)
"""Share of intervals that shall hold the truth."""

CLASSES = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 0.98)
"""Ends of the classes of P in which blocks are taken for alike."""

CELLS, ONE_SITE = 0.92, 0.95
"""Least share of ranges that shall hold what fell, by earthquake and class, and at one site."""

MOST_BIAS = 3.0
"""Greatest difference between what falls and P that chance leaves, in standard deviations."""

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
    def holds(self) -> bool:
        """Whether the intervals of predictions hold the truth as often as is asked."""
        return bool(HELD[0] <= self.share[-1] <= HELD[1])

    @property
    def error(self) -> FloatArray:
        """Standard error of the shares, shape (ways,): the blocks of one set go together."""
        return np.asarray(self.held.mean(axis=2).std(axis=1, ddof=1) / self.held.shape[1] ** 0.5)


def coverage(
    model: Study, law: Dependence, *, sets: int = SETS, seed: int = 0, steeper: float = 1.0
) -> Coverage:
    """Return what the intervals of a model hold where it is the truth.

    Args:
        model: the fit that outcomes are drawn from.
        law: what blocks of one earthquake share.
        sets: how many times outcomes of all blocks are drawn and fitted.
        seed: of the random numbers.
        steeper: factor on eta of the outcomes: of a model that is not the truth, where it is not 1.
    """
    generator = np.random.default_rng(seed)
    rows = model.rows.data
    p, true = rows.probability(model.b), rows.probability(steeper * model.b)
    between = np.flatnonzero((p > BETWEEN[0]) & (p < BETWEEN[1]))
    held = np.zeros((len(INTERVALS), sets, BLOCKS), dtype=np.bool_)
    half = np.zeros((sets, BLOCKS))
    drawn = _outcomes(JointSampler(law, model.placement), true, sets, generator)
    for number, failed in enumerate(drawn):
        fitted = replace(rows, outcome=failed)
        b = maximise(fitted, model.b, tolerance=1e-9)[0]
        x = rows.columns[generator.choice(between, BLOCKS, replace=False)]
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
        errors.half_width(LinearPredictor(0.0, tuple(x.T)), quantiles_of(LEVEL), arrays()),
    ])  # fmt: skip
    low = -high
    low[2] = ends[0]
    return low, high


@dataclass(frozen=True)
class RangeCoverage:
    """Of how many ranges of one earthquake the share that fell was held.

    Args:
        cells: share of the cells of earthquake, size and class of P; like blocks at all its sites.
        one_site: the same of cells of one site.
        bias: greatest difference between what fell and P in a class, in its standard deviations by
            the copula.
        numbers: how many cells of either.
        sites: mean number of sites of the former.
    """

    cells: float
    one_site: float
    bias: float
    numbers: tuple[int, int]
    sites: float

    @property
    def holds(self) -> bool:
        """Whether they hold as much as is asked, about what falls on average."""
        return self.cells >= CELLS and self.one_site >= ONE_SITE and self.bias <= MOST_BIAS


def range_coverage(blocks: pd.DataFrame, laws: Mapping[str, Dependence]) -> RangeCoverage:
    """Return what the ranges of like blocks hold.

    Args:
        blocks: columns as :class:`~rbfrag.fragility.fit.dependence.ObservedBlocks` has them, P
            without their earthquake.
        laws: the copula by earthquake, estimated without it.
    """
    # what stands free is run on one side, and does the same on the other
    sides = COMPONENTS * blocks["polarity"].nunique()
    alike = _like_blocks(blocks, sides)
    of_earthquake, of_site = (
        alike.groupby([*label, "p2", "class"])
        .agg(
            p=("probability", "mean"),
            fell=("failed", "mean"),
            n=("failed", "size"),
            **{name: (name, "mean") for name in LOADINGS if name in blocks},
        )
        .reset_index()
        for label in (["earthquake"], ["earthquake", "site"])
    )
    held = []
    for cells in (of_earthquake, of_site):
        ends = [
            share_range(p, law, n // sides, LEVEL)
            for law, p, n in zip(_laws(cells, laws), cells["p"], cells["n"], strict=True)
        ]
        low, high = np.array(ends).reshape(-1, 2).T
        held.append(float(((cells["fell"] >= low - 1e-9) & (cells["fell"] <= high + 1e-9)).mean()))
    return RangeCoverage(
        *held,
        _bias(of_earthquake, laws, sides),
        (len(of_earthquake), len(of_site)),
        float(of_earthquake["n"].mean() / sides),
    )


def _laws(cells: pd.DataFrame, laws: Mapping[str, Dependence]) -> Iterator[Shares]:
    """Yield the dependence of the blocks of each cell."""
    columns = np.broadcast_arrays(*loadings_of(cells), np.zeros(len(cells)))[:-1]
    for event, *loadings in zip(cells["earthquake"], *columns, strict=True):
        yield laws[event].shares(Loadings(*loadings))


def _bias(cells: pd.DataFrame, laws: Mapping[str, Dependence], sides: int) -> float:
    """Return the greatest standardised difference between what fell and P over the classes."""
    p, n = cells["p"].to_numpy(), cells["n"].to_numpy()
    rho = [
        float(overdispersion(np.array(probability), law, number // sides))
        for law, probability, number in zip(_laws(cells, laws), p, n, strict=True)
    ]
    sums = pd.DataFrame({
        "class": cells["class"], "earthquake": cells["earthquake"],
        "more": n * (cells["fell"] - p), "sd": np.sqrt(n * p * (1.0 - p) * (1.0 + (n - 1.0) * rho)),
    })  # fmt: skip
    # the sizes of an earthquake are taken to go together wholly
    by_earthquake = sums.groupby(["class", "earthquake"]).sum()
    by_earthquake["sd"] **= 2
    total = by_earthquake.groupby("class").sum()
    return float((total["more"].abs() / np.sqrt(total["sd"])).max())


def _like_blocks(blocks: pd.DataFrame, sides: int) -> pd.DataFrame:
    """Return one block of each size and class of P on every side of sites that have all of them."""
    p = blocks["probability"]
    selected = blocks[(p > CLASSES[0]) & (p < CLASSES[-1])].copy()
    number = np.digitize(selected["probability"], CLASSES)
    bounds = ndtri(np.array(CLASSES))
    middle = 0.5 * (bounds[number] + bounds[number - 1])
    selected["class"] = number
    selected["away"] = np.abs(ndtri(selected["probability"].to_numpy()) - middle)
    selected = selected.sort_values("away", kind="stable")
    place = ["earthquake", "site", "p2", "class"]
    selected = selected.drop_duplicates([*place, "component", "polarity"])
    return selected[selected.groupby(place)["failed"].transform("size") == sides]


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("models", nargs="*", default=MODELS, metavar="MODEL")
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes of the grid")
    options.add_argument("--sets", type=int, default=SETS, help="sets of outcomes; 0 for ranges")
    options.add_argument("--seed", type=int, default=0)
    chosen = options.parse_args(arguments)
    result, ranges = {}, {}
    for name in chosen.models:
        study = Study.of(chosen.db, name)
        ranges[name] = range_coverage(study.blocks, study.laws)
        if chosen.sets and loadings_of(study.blocks).variance.max() == 1.0:
            law = next(iter(study.laws.values()))
            result[name] = coverage(study, law, sets=chosen.sets, seed=chosen.seed)
    tables = {"ranges": range_table(ranges)}
    if result:
        tables["coverage"] = coverage_table(result)
    tables["coverage-aims"] = acceptance_table(marks(result, ranges))
    for name, table in tables.items():
        print(f"## {name}\n\n{table}\n", flush=True)
        if chosen.write:
            write_table(RANGES_PAGE if name == "ranges" else PAGE, name, table)


def range_table(ranges: Mapping[str, RangeCoverage]) -> str:
    """Return what the ranges of one earthquake hold, by model."""
    heads = ["model", "by earthquake and class", "cells", "sites", "at one site", "cells", "bias"]
    return markdown((heads, [
        [name, f"{held.cells:.3f}", str(held.numbers[0]), f"{held.sites:.1f}",
         f"{held.one_site:.3f}", str(held.numbers[1]), f"{held.bias:.1f}"]
        for name, held in ranges.items()
    ]))  # fmt: skip


def coverage_table(result: Mapping[str, Coverage]) -> str:
    """Return coverage by way and model."""
    rows = [
        [
            way,
            *(f"{held.share[i]:.3f} ± {held.error[i]:.3f}" for held in result.values()),
        ]
        for i, way in enumerate(INTERVALS)
    ]
    width = [
        "half width in eta",
        *(f"{held.half_width.mean():.2f}" for held in result.values()),
    ]
    return markdown(([f"nominal {LEVEL:g}", *result], [*rows, width]))


def marks(result: Mapping[str, Coverage], ranges: Mapping[str, RangeCoverage]) -> list[Mark]:
    """Return the aims, with what is reached."""
    table_marks = [
        Mark(name, "intervals that hold P", *HELD, float(held.share[-1]))
        for name, held in result.items()
    ]
    for name, held in ranges.items():
        table_marks.append(
            Mark(name, "ranges of one earthquake that hold", CELLS, np.inf, held.cells)
        )
        table_marks.append(
            Mark(name, "ranges at one site that hold", ONE_SITE, np.inf, held.one_site)
        )
    return table_marks


if __name__ == "__main__":
    main()
