"""Joint failures in one earthquake:  python -m benchmarks.joint_failures [MODEL...]

Estimates the copula of failures from predictions for held-out earthquakes, and tests the variance
of the number of failures, and P of any failure among rare ones, on portfolios of blocks of
earthquakes that neither the probabilities nor the copula were fitted to. Where the spectral
velocity is completed, its regression adds to the copula what it shares. A MODEL is
the name of a stored model, with intensity measures after a colon if more are given than it
requires: "toppling-pgv_pga:tm_s", "toppling-pga:sa(0.3),sa(1)"; "exact" for the whole spectrum. The
built-in data set has all that is read; --db DATABASE: another. --write keeps the tables, in
docs/evidence/joint-failures.md.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import betabinom

from benchmarks.held_out import StoredModels
from benchmarks.page import ROOT, markdown, parser, write_table
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models
from rbfrag.fragility.dependence import EXACT, Dependence, Loadings
from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.fit.dependence import PairTables, estimate_dependence, observed_blocks
from rbfrag.fragility.fit.likelihood import most_likely
from rbfrag.fragility.fit.losses import held_out_probabilities
from rbfrag.fragility.fit.maximum_likelihood import OutcomeRows, outcome_rows, parameter_names
from rbfrag.fragility.joint import Placement, count_moments
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import BlockParameters, arrays
from rbfrag.fragility.methods import method_named

FloatArray = NDArray[np.float64]
Rows = NDArray[np.intp]

PAGE = ROOT / "docs" / "evidence" / "joint-failures.md"

EXACT_SPECTRUM = "exact"
MODELS = (
    "toppling-pgv", "toppling-pgv_pga:exact", "toppling-pga:exact", "toppling-sa:exact",
    "record-xp", "toppling-pgv_pga", "toppling-pgv_pga:sa(1)", "toppling-pga:sa(0.3),sa(1),sa(3)",
    "toppling-pga:tm_s", "toppling-pga",
)  # fmt: skip
LOADINGS = tuple(f"of_{name}" for name in Loadings._fields)
PARAMETERS = tuple(field.name for field in fields(Dependence))
FOLDS = 16
RANGES = {"mixed": (0.005, 0.995), "rare": (0.002, 0.15)}
"""P of the blocks of a portfolio."""
PLACEMENTS = ("one site, one side", "one site", "several sites")
PORTFOLIOS, FEWEST = 1500, 100


@dataclass(frozen=True, eq=False)
class Study:
    """A model fitted to all earthquakes, and what it predicts of each by a fit to the others.

    Args:
        rows: the fitted outcomes with their features.
        b: the parameters, shape (k,).
        blocks: columns as :class:`~rbfrag.fragility.fit.dependence.ObservedBlocks` has them, of
            blocks of known outcome, and those of :class:`~rbfrag.fragility.dependence.Loadings`.
        laws: the copula without the fold of each earthquake, by its label.
    """

    name: str
    data: FitData
    rows: OutcomeRows
    b: FloatArray
    blocks: pd.DataFrame
    laws: Mapping[str, Dependence]

    @classmethod
    def of(cls, db: str | Path, name: str) -> Study:
        """Return the study of a stored model, such as ``toppling-pgv_pga:tm_s``."""
        models = StoredModels(str(db), read_models(db))
        model_name, _, measures = name.partition(":")
        row = models.rows[model_name]
        method, term = method_named(row.method), TERMS[row.term]
        data = models.data(row)
        rows = outcome_rows(data, method, term, parameter_names(method, term))
        b = most_likely(rows.data)
        exact = _frame(data, method.block, rows.held_out(b), EXACT)
        laws = laws_of_folds(exact.dropna(ignore_index=True))
        blocks = exact
        if method.forms[row.term].velocity is not None and measures != EXACT_SPECTRUM:
            names = (*term.inputs, *re.findall(r"[^,]+", measures))
            model = models.model(row)
            p = held_out_probabilities(model, data, models.spectra(row), names)
            numbers = {n: data.grid(n) for n in (*method.block.names, *method.block.options)}
            loadings = model.for_inputs(names).loadings(numbers, arrays())
            blocks = _frame(data, method.block, p, loadings)
        return cls(name, data, rows, b, blocks.dropna(ignore_index=True), laws)

    @property
    def placement(self) -> Placement:
        """Where the fitted blocks are, their spectral velocity known."""
        place, data = self.rows.place, self.data
        row = place // data.failed.shape[1]
        assert data.recording is not None
        p, y = (np.log(data.grid(name).ravel()[place]) for name in ("p", "y_m_s"))
        return Placement.of(
            p, y, earthquake=data.event[row], site=data.recording[row],
            component=data.motion[row], polarity=data.polarity[row].astype(np.intp),
        )  # fmt: skip


def _frame(
    data: FitData, block: BlockParameters, held_out: FloatArray, loadings: Loadings
) -> pd.DataFrame:
    """Return the blocks of a fit with their probabilities and loadings."""
    columns = dict(observed_blocks(data, block, held_out))
    for name, values in zip(LOADINGS, loadings, strict=True):
        columns[name] = np.broadcast_to(values, data.failed.shape).ravel()
    blocks = pd.DataFrame(columns)
    blocks["earthquake"] = blocks["earthquake"].astype(str)
    return blocks


def loadings_of(blocks: pd.DataFrame) -> Loadings:
    """Return the loadings of some blocks; those of an exact spectral velocity without columns."""
    if LOADINGS[0] not in blocks:
        return EXACT
    return Loadings(*(blocks[name].to_numpy() for name in LOADINGS))


def _observed(blocks: pd.DataFrame) -> dict[str, Any]:
    return {str(n): blocks[n] for n in blocks if n not in LOADINGS}


def laws_of_folds(blocks: pd.DataFrame) -> dict[str, Dependence]:
    """Return the copula without each of so many parts of the earthquakes, by earthquake."""
    tables = PairTables.of(**_observed(blocks))
    everything = tables.likeliest()
    by_size = blocks["earthquake"].value_counts().index
    fold = {label: i % FOLDS for i, label in enumerate(by_size)}
    number = np.array([fold[label] for label in tables.earthquakes])
    laws = [
        tables.likeliest((number != fold_number).astype(np.float64), start=everything)
        for fold_number in range(FOLDS)
    ]
    return {label: laws[fold_number] for label, fold_number in fold.items()}


def placement_of(blocks: pd.DataFrame) -> Placement:
    """Return the placement of some blocks of one earthquake."""
    ln_p, ln_y = 0.5 * np.log(blocks["p2"]), np.log(blocks["y_m_s"])
    site, component = (pd.factorize(blocks[name])[0] for name in ("site", "component"))
    return Placement.of(
        ln_p, ln_y, site=site, component=component, polarity=blocks["polarity"],
        loadings=loadings_of(blocks),
    )  # fmt: skip


def portfolio(
    blocks: pd.DataFrame, place: str, generator: np.random.Generator
) -> pd.DataFrame | None:
    """Return 10 to 50 blocks of one earthquake: of one component and side, a site, or 4 to 10
    components; None where there are too few."""
    label = "site" if place == "one site" else "component"
    labels = blocks[label].unique()
    if place == "several sites":
        if labels.size < 4:
            return None
        number = int(generator.integers(4, min(10, labels.size) + 1))
        blocks = blocks[blocks[label].isin(generator.choice(labels, number, replace=False))]
    else:
        blocks = blocks[blocks[label] == generator.choice(labels)]
        if place == "one site, one side":
            blocks = blocks[blocks["polarity"] == generator.choice((-1, 1))]
    number = int(generator.integers(10, 51))
    return None if len(blocks) < number else blocks.sample(number, random_state=generator)


@dataclass(frozen=True, eq=False)
class Line:
    """Portfolios of one kind: what was expected of them, and what they did, each (number,).

    Args:
        event: the earthquake.
        count: number of failures.
        mean: its expectation.
        variance: its variance by the copula.
        any_by: probability that any fails, by the copula and if independent.
    """

    event: Rows
    count: FloatArray
    mean: FloatArray
    variance: FloatArray
    any_by: tuple[FloatArray, FloatArray]

    def ratio(self) -> tuple[float, float, float]:
        """Return observed over modelled variance, with its 90 % interval by earthquakes."""
        square = (self.count - self.mean) ** 2
        return (float(square.sum() / self.variance.sum()), *self._ends(square, self.variance))

    def gain(self) -> tuple[float, float, float]:
        """Return by how much the copula's log score of any failure is below that of independence,
        with its 90 % interval by earthquakes."""
        any_portfolio = self.count > 0
        clipped = (np.clip(p, 1e-4, 1.0 - 1e-4) for p in self.any_by)
        law, alone = (np.where(any_portfolio, np.log(p), np.log1p(-p)) for p in clipped)
        return (float((law - alone).mean()), *self._ends(law - alone, np.ones(any_portfolio.size)))

    def _ends(self, top: FloatArray, bottom: FloatArray) -> tuple[float, float]:
        number = np.unique(self.event, return_inverse=True)[1]
        sums = [np.bincount(number, values) for values in (top, bottom)]
        g, generator = sums[0].size, np.random.default_rng(0)
        times = generator.multinomial(g, np.full(g, 1.0 / g), size=1000)
        low, high = np.quantile((times @ sums[0]) / (times @ sums[1]), (0.05, 0.95))
        return float(low), float(high)


def line(study: Study, place: str, kind: str) -> Line | None:
    """Draw portfolios of one kind and predict them."""
    low, high = RANGES[kind]
    p = study.blocks["probability"]
    earthquakes = [(law, blocks) for law, blocks in _by_earthquake(study, (p > low) & (p < high))]
    generator, rows = np.random.default_rng(0), []
    for _ in range(10 * PORTFOLIOS if earthquakes else 0):
        number = int(generator.integers(len(earthquakes)))
        law, blocks = earthquakes[number]
        chosen = portfolio(blocks, place, generator)
        if chosen is None:
            continue
        probabilities = chosen["probability"].to_numpy()
        mean, variance = count_moments(probabilities, placement_of(chosen), law)
        rows.append((
            number, float(chosen["failed"].sum()), mean, variance,
            any_of(probabilities, mean, variance), 1.0 - np.prod(1.0 - probabilities),
        ))  # fmt: skip
        if len(rows) == PORTFOLIOS:
            break
    if len(rows) < FEWEST or len({row[0] for row in rows}) < 10:
        return None
    event, *columns = np.array(rows).T
    return Line(event.astype(np.intp), *columns[:3], (columns[3], columns[4]))


def any_of(probabilities: FloatArray, mean: float, variance: float) -> float:
    """Return P of any failure by the beta-binomial law of a mean and a variance, or a binomial."""
    n, share = probabilities.size, mean / probabilities.size
    alone = n * share * (1.0 - share)
    rho = (variance / alone - 1.0) / (n - 1.0) if n > 1 and alone > 0.0 else 0.0
    if rho > 1e-9:
        more = 1.0 / min(rho, 1.0 - 1e-12) - 1.0
        none = float(betabinom.pmf(0, n, share * more, (1.0 - share) * more))
    else:
        p = 1.0 - variance / mean
        none = (1.0 - p) ** (mean / p) if p > 0.0 else (1.0 - share) ** n
    return float(np.clip(1.0 - none, probabilities.max(), min(mean, 1.0)))


def _by_earthquake(study: Study, chosen: pd.Series) -> Iterator[tuple[Dependence, pd.DataFrame]]:
    for label, blocks in study.blocks[chosen].groupby("earthquake"):
        yield study.laws[str(label)], blocks


def parameter_row(study: Study) -> list[str]:
    """Return the estimates with their errors."""
    estimate = estimate_dependence(**_observed(study.blocks))
    cells = [f"{estimate[n]:.2f} ± {estimate['errors'][n]:.2f}" for n in PARAMETERS]
    return [study.name, *cells]


def cell(estimate: tuple[float, float, float], sign: str = "") -> str:
    """Return a number with its interval."""
    value, low, high = (f"{value:{sign}.2f}" for value in estimate)
    return f"{value} ({low} to {high})"


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("models", nargs="*", default=MODELS, metavar="MODEL")
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes of the grid")
    chosen = options.parse_args(arguments)
    parameters, counts, gains = [], [], []
    for name in chosen.models:
        study = Study.of(chosen.db, name)
        if loadings_of(study.blocks).variance.max() == 1.0:
            parameters.append(parameter_row(study))
        mixed, rare = ([line(study, place, kind) for place in PLACEMENTS] for kind in RANGES)
        counts.append([name, *("" if result is None else cell(result.ratio()) for result in mixed)])
        gains.append(
            [name, *("" if result is None else cell(result.gain(), "+") for result in rare)]
        )
    tables = {
        "parameters": (["model", *PARAMETERS], parameters),
        "counts": (["model", *PLACEMENTS], counts),
        "any": (["model", *PLACEMENTS], gains),
    }
    for name, table in tables.items():
        text = markdown(table)
        print(f"## {name}\n\n{text}\n", flush=True)
        if chosen.write:
            write_table(PAGE, name, text)


if __name__ == "__main__":
    main()
