"""What falls together in one earthquake:  python -m benchmarks.joint_failures [--db DATABASE]

Estimates the copula of failures from predictions of held-out earthquakes, and tests it on
portfolios of blocks in earthquakes that neither the probabilities nor the copula were fitted to.
The reference that is shipped has all that is read. Ten minutes of processor time. --write keeps
the tables in benchmarks/results. --quadrature only compares P(any) by
quadrature with so many samples, on portfolios at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from benchmarks.held_out import FOLDS, MODELS, STEP, Outcomes, Study, read, studied
from benchmarks.joint_law import JointFailures
from benchmarks.joint_orthant import none_fails
from benchmarks.model_acceptance import Mark, acceptance_table
from benchmarks.page import ROOT, parser, write_table
from rbfrag.bench.tables import markdown
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.fit.dependence import PairTables, estimate_dependence
from rbfrag.fragility.fit.pair_tables import ANGLES, PairTable
from rbfrag.fragility.joint import FailureCount, Placement, event_ranges
from rbfrag.fragility.joint_sampling import JointSampler

FloatArray = NDArray[np.float64]
Rows = NDArray[np.intp]

PAGE = ROOT / "docs" / "evidence" / "joint-failures.md"

PUBLISHED = {
    "pgv": Dependence(0.136, 0.236, 0.219, 0.409, 1.0, 2.5, 6.7, 0.50),
    "pgv_pga": Dependence(0.055, 0.162, 0.270, 0.513, 1.7, 2.5, 5.1, 0.67),
    "pgv_pga_tm": Dependence(0.035, 0.182, 0.283, 0.500, 2.5, 0.55, 8.1, 0.57),
    "record": Dependence(0.082, 0.021, 0.450, 0.447, 2.7, 2.1, 0.66, 0.32),
}
"""An earlier estimate by other code, with its rounding errors put into rho_v."""

AT_EQUAL_SIZE = {
    "other site": ((0.14, 0.05, 0.03, 0.11), 0, 0),
    "other component": ((0.32, 0.24, 0.22, 0.05), 0, 0),
    "opposite side": ((0.16, 0.03, -0.04, 0.08), -1, 0),
    "one step": ((0.84, 0.81, 0.81, 0.65), 1, 1),
    "four steps": ((0.56, 0.50, 0.45, 0.24), 1, 4),
    "eight steps": ((0.25, 0.29, 0.15, 0.15), 1, 8),
}
"""R of blocks of equal size by the earlier estimate, by model; sign of sides, steps apart."""

SAMPLES = 2000
POINTS = 8
"""Points of a scramble of the quadrature of P(any), as a power of two."""
LEVEL = 0.95
RANGES = {"mixed": (0.005, 0.995), "rare": (0.002, 0.15)}
PLACES = ("one site one side", "one site", "several sites")
PORTFOLIOS = {"mixed": 1500, "rare": 400}
FEWEST = 100
"""Portfolios, below which a line of a table is left out."""

CELLS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 0.98)


def dependence_columns(data: Outcomes, model: Study) -> tuple[NDArray[np.generic], ...]:
    return (
        model.own, data.failed, data.event, data.site, data.motion, data.polarity,
        data.value["p2"], data.value["y"],
    )  # fmt: skip


def of_folds(data: Outcomes, tables: PairTables) -> list[Dependence]:
    """Return the copula without each fold."""
    everything = tables.likeliest()
    fold_of = dict(zip(data.event.tolist(), data.fold.tolist(), strict=True))
    fold = np.array([fold_of[int(one)] for one in tables.earthquakes])
    return [
        tables.likeliest((fold != number).astype(np.float64), start=everything)
        for number in range(FOLDS)
    ]


def portfolio(
    data: Outcomes, usable: list[Rows], place: str, generator: np.random.Generator
) -> Rows | None:
    """Return 10 to 50 blocks of one earthquake: of one component and side, a site, or 4 to 10
    components; None where there are too few."""
    own = usable[int(generator.integers(len(usable)))]
    label = data.site if place == "one site" else data.motion
    labels = np.unique(label[own])
    if place == "several sites":
        if labels.size < 4:
            return None
        number = int(generator.integers(4, min(10, labels.size) + 1))
        own = own[np.isin(label[own], generator.choice(labels, number, replace=False))]
    else:
        own = own[label[own] == generator.choice(labels)]
        if place == "one site one side":
            own = own[data.polarity[own] == generator.choice((-1, 1))]
    number = int(generator.integers(10, 51))
    return None if own.size < number else generator.choice(own, number, replace=False)


@dataclass(frozen=True, eq=False)
class Line:
    """Portfolios of one kind: what was expected of them, and what they did, each (number,).

    Args:
        event: the earthquake.
        count: number of failures.
        mean: its expectation.
        variance: its variance by the copula.
        alone: the same, were the blocks independent.
        inside: whether the number is inside its 95 % range by sampling.
        any_by: probability that any fails, by name of how it was found.
    """

    event: Rows
    count: FloatArray
    mean: FloatArray
    variance: FloatArray
    alone: FloatArray
    inside: NDArray[np.bool_]
    any_by: dict[str, FloatArray]

    def ratio(self, variance: FloatArray) -> float:
        return float(np.sum((self.count - self.mean) ** 2) / variance.sum())

    def ratio_range(self) -> tuple[float, float]:
        """Return the 90 % interval of the variance ratio by resampling earthquakes."""
        number = np.unique(self.event, return_inverse=True)[1]
        top = np.bincount(number, (self.count - self.mean) ** 2)
        bottom = np.bincount(number, self.variance)
        generator = np.random.default_rng(0)
        times = generator.multinomial(top.size, np.full(top.size, 1.0 / top.size), size=1000)
        low, high = np.quantile((times @ top) / (times @ bottom), (0.05, 0.95))
        return float(low), float(high)

    def gain(self, other: str) -> tuple[float, float, float]:
        """Return by how much the copula's log score is below another's, and its 90 % interval by
        resampling earthquakes."""
        some = self.count > 0
        less = -np.subtract(*(
            np.where(some, np.log(p), np.log1p(-p))
            for p in (np.clip(self.any_by[name], 1e-4, 1.0 - 1e-4) for name in (other, WAYS[0]))
        ))  # fmt: skip
        number = np.unique(self.event, return_inverse=True)[1]
        top, bottom = np.bincount(number, less), np.bincount(number)
        generator = np.random.default_rng(0)
        times = generator.multinomial(top.size, np.full(top.size, 1.0 / top.size), size=1000)
        low, high = np.quantile((times @ top) / (times @ bottom), (0.05, 0.95))
        return float(less.mean()), float(low), float(high)

    def scores(self) -> dict[str, tuple[float, float, float]]:
        """Return mean P(any), log score and Brier score of each way."""
        found = {}
        for name, p in self.any_by.items():
            p, some = np.clip(p, 1e-4, 1.0 - 1e-4), self.count > 0
            loss = -np.where(some, np.log(p), np.log1p(-p))
            found[name] = (float(p.mean()), float(loss.mean()), float(((p - some) ** 2).mean()))
        return found


def line(
    data: Outcomes, model: Study, laws: Sequence[Dependence], place: str, kind: str
) -> Line | None:
    """Draw portfolios of one kind and predict them."""
    generator = np.random.default_rng(len(place) + len(kind))
    low, high = RANGES[kind]
    p = model.own
    usable = np.flatnonzero((p > low) & (p < high))
    by_event = [usable[data.event[usable] == event] for event in np.unique(data.event[usable])]
    asked = PORTFOLIOS[kind]
    rows: list[tuple[float, ...]] = []
    for _ in range(40 * asked if by_event else 0):
        some = portfolio(data, by_event, place, generator)
        if some is None:
            continue
        law, blocks = laws[int(data.fold[some[0]])], data.placement(some)
        own, count = p[some], float(data.failed[some].sum())
        failures = FailureCount.of(own, blocks, law)
        drawn = JointSampler(law, blocks).counts(own, SAMPLES, generator)
        ends = np.quantile(drawn, (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL), method="inverted_cdf")
        any_fails = float(np.mean(drawn > 0))
        if kind == "rare":  # of these it is scored
            any_fails = float(1.0 - none_fails(own, blocks, law, POINTS).mean())
        rows.append((
            float(data.event[some[0]]), count, failures.mean, failures.variance,
            float(np.sum(own * (1.0 - own))), float(ends[0] <= count <= ends[1]),
            any_fails, failures.probability_any,
            float(1.0 - np.prod(1.0 - own)), float(own.max()),
        ))  # fmt: skip
        if len(rows) == asked:
            break
    if len(rows) < FEWEST or len({row[0] for row in rows}) < 10:
        return None
    column = np.array(rows).T
    ways = ("copula", "beta-binomial", "independent", "greatest P")
    return Line(
        column[0].astype(np.intp), *column[1:5], column[5] > 0.5,
        dict(zip(ways, column[6:], strict=True)),
    )  # fmt: skip


def cells(data: Outcomes, model: Study, laws: Sequence[Dependence]) -> dict[str, tuple[float, int]]:
    """Return how many shares failing, by earthquake and class of P, are in their 95 % ranges."""
    generator = np.random.default_rng(0)
    p, found = model.own, []
    tails = (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL)
    for event in np.unique(data.event):
        rows = np.flatnonzero((data.event == event) & (p > CELLS[0]) & (p < CELLS[-1]))
        law = laws[int(data.fold[data.event == event][0])]
        kind = np.digitize(p[rows], CELLS) - 1
        failed = JointSampler(law, data.placement(rows)).failures(p[rows], SAMPLES // 2, generator)
        motions = np.unique(data.motion[rows]).size
        for number in np.unique(kind):
            own = kind == number
            share = float(data.failed[rows[own]].mean())
            ends = np.quantile(failed[:, own].mean(axis=1), tails)
            single = event_ranges(float(p[rows[own]].mean()), law.rho_e, LEVEL)
            alone = generator.random((SAMPLES // 2, int(own.sum()))) < p[rows[own]]
            apart = np.quantile(alone.mean(axis=1), tails)
            found.append((
                ends[0] <= share <= ends[1], motions >= 4,
                single[0] <= share <= single[1], apart[0] <= share <= apart[1],
            ))  # fmt: skip
    table = np.array(found, dtype=np.float64).T
    large = table[1] > 0.5
    return {
        "sampled": (float(table[0].mean()), table.shape[1]),
        "sampled, 4 components or more": (float(table[0][large].mean()), int(large.sum())),
        "closed form of many sites": (float(table[2].mean()), table.shape[1]),
        "independent": (float(table[3].mean()), table.shape[1]),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes of the grid")
    options.add_argument(
        "--published", action="store_true", help="test the earlier estimate's copula instead"
    )
    options.add_argument(
        "--quadrature", type=int, metavar="N", help="compare the quadrature with N samples"
    )
    chosen = options.parse_args(arguments)
    if chosen.quadrature is not None:
        table = quadrature_table(chosen.quadrature)
        print(table)
        if chosen.write:
            write_table(PAGE, "quadrature", table)
        return
    source, data = read(chosen.db)
    models = [studied(source, data, name) for name in MODELS]
    pairs = {one.name: PairTables.of(*dependence_columns(data, one)) for one in models}
    laws = {
        name: [PUBLISHED[name]] * FOLDS if chosen.published else of_folds(data, tables)
        for name, tables in pairs.items()
    }
    lines = {
        (model.name, place, kind): line(data, model, laws[model.name], place, kind)
        for kind in RANGES
        for place in PLACES
        for model in models
    }
    shares = {model.name: cells(data, model, laws[model.name]) for model in models}
    tables = {
        "parameters": parameter_table(data, models),
        "equal-size": equal_size_table(pairs),
        "counts": count_table(lines),
        "any": any_table(lines),
        "gains": gain_table(lines),
        "cells": cell_table(shares),
        "aims": acceptance_table(marks(lines, shares)),
    }
    for name, table in tables.items():
        print(f"## {name}\n\n{table}\n", flush=True)
        if chosen.write:
            write_table(PAGE, name, table)


def likeliest_r(table: PairTable, sign: int, steps: int) -> float:
    """Return the R of greatest likelihood of pairs of equal size.

    Args:
        table: of one kind of pair.
        sign: product of the sides, 0 where any.
        steps: how many steps of the grid apart in strength.
    """
    here = (table.distance_l < 1e-6) & (table.sign == sign)
    here &= np.abs(table.distance_y - steps * STEP) < 0.3 * STEP
    fine = np.linspace(ANGLES[0], ANGLES[-1], 4001)
    curve = CubicSpline(ANGLES, table.value[:, here].sum(axis=(0, 1)))(fine)
    return float(np.sin(fine[np.argmax(curve)]))


def equal_size_table(pairs: dict[str, PairTables]) -> str:
    """Return R of blocks of equal size, without any law of how it falls off."""
    rows = []
    for name, (asked, sign, steps) in AT_EQUAL_SIZE.items():
        found = []
        for tables in pairs.values():
            kinds = {"other site": tables.far, "other component": tables.near}
            found.append(likeliest_r(kinds.get(name, tables.own), sign, steps))
        cell = [f"{one:.2f} ({other:.2f})" for one, other in zip(found, asked, strict=True)]
        rows.append([name, *cell])
    return markdown((["pairs", *(f"{name} (earlier)" for name in pairs)], rows))


def parameter_table(data: Outcomes, models: Sequence[Study]) -> str:
    """Return the estimates with their errors, each over the earlier one."""
    names = [field.name for field in fields(Dependence)]
    rows = []
    for model in models:
        found = estimate_dependence(*dependence_columns(data, model))
        law = found.dependence
        rows.append([
            model.name,
            *(f"{getattr(law, name):.3f} ± {found.errors[name]:.3f}" for name in names),
            " ".join(f"{pairs:,}" for pairs in found.pairs),
        ])  # fmt: skip
        asked = PUBLISHED[model.name]
        rows.append(["earlier", *(f"{getattr(asked, name):.3f}" for name in names), ""])
    return markdown((["model", *names, "pairs"], rows))


Lines = dict[tuple[str, str, str], Line | None]


def count_table(lines: Lines) -> str:
    """Return the variance of numbers of failures, observed over modelled."""
    head = ["model", "portfolio", "portfolios", "variance ratio", "90 % by earthquakes",
            "if independent", "inside 95 %"]  # fmt: skip
    rows = []
    for (model, place, kind), one in lines.items():
        if one is not None:
            low, high = one.ratio_range()
            rows.append([
                model, f"{place}, {kind}", str(one.count.size), f"{one.ratio(one.variance):.2f}",
                f"{low:.2f}–{high:.2f}", f"{one.ratio(one.alone):.1f}", f"{one.inside.mean():.3f}",
            ])  # fmt: skip
    return markdown((head, rows))


def any_table(lines: Lines) -> str:
    """Return mean, log score and Brier score of the probability of any failure."""
    rows = []
    for (model, place, kind), one in lines.items():
        if one is not None and kind == "rare":
            scores = one.scores()
            cell = [f"{p:.3f}, {loss:.3f}, {brier:.3f}" for p, loss, brier in scores.values()]
            rows.append([model, place, f"{np.mean(one.count > 0):.3f}", *cell])
    head = ["model", "rare blocks of", "observed", *WAYS]
    return markdown((head, rows))


def gain_table(lines: Lines) -> str:
    """Return what the copula gains in log score over independence and full dependence."""
    rows = []
    for (model, place, kind), one in lines.items():
        if one is not None and kind == "rare":
            gains = (one.gain(other) for other in WAYS[2:])
            cells = [f"{mean:.3f} ({low:.3f} to {high:.3f})" for mean, low, high in gains]
            rows.append([model, place, str(np.unique(one.event).size), *cells])
    head = ["model", "rare blocks of", "earthquakes", *(f"below {way}" for way in WAYS[2:])]
    return markdown((head, rows))


def quadrature_table(samples: int) -> str:
    """Return P(any) and P(5 or more) of portfolios at random, by quadrature and by samples."""
    generator, law, rows = np.random.default_rng(1), PUBLISHED["pgv_pga"], []
    for n, name, highest in (
        (16, "unknown azimuths", 0.15), (37, "unknown azimuths", 0.15),
        (37, "unknown azimuths", 0.002), (37, "one side", 0.5), (50, "two components", 0.15),
    ):  # fmt: skip
        p = generator.uniform(0.1 * highest, highest, n)
        blocks = Placement.of(
            generator.uniform(-0.5, 1.5, n), 0.6 * generator.normal(size=n),
            component=generator.integers(2, size=n) if name == "two components" else 0,
            polarity=0 if name == "unknown azimuths" else 1,
        )  # fmt: skip
        failures, sampler = JointFailures.of(p, blocks, law), JointSampler(law, blocks)
        part = min(samples, 100_000)
        counts = np.concatenate([
            sampler.counts(p, part, generator) for _ in range(max(1, samples // part))
        ])  # fmt: skip
        cells = []
        for k, value, error in (
            (1, failures.probability_any, failures.numerical_error),
            (5, failures.at_least(5), failures.error_at_least(5)),
        ):
            share = float((counts >= k).mean())
            scatter = float(np.sqrt(share * (1.0 - share) / counts.size))
            cells += [f"{value:.5f} ± {error:.5f}", f"{share:.5f} ± {scatter:.5f}"]
        of_moments = FailureCount.of(p, blocks, law).probability_any
        rows.append([str(n), name, f"≤ {highest:g}", *cells, f"{of_moments:.5f}"])
    head = ["blocks", "facing", "P", "P(any)", "samples", "P(5 or more)", "samples",
            "P(any), beta-binomial"]  # fmt: skip
    return markdown((head, rows))


WAYS = ("copula", "beta-binomial", "independent", "greatest P")


def cell_table(shares: dict[str, dict[str, tuple[float, int]]]) -> str:
    """Return how many cells lie in their ranges."""
    head = ["model", *next(iter(shares.values()))]
    return markdown((head, [
        [model, *(f"{share:.3f} of {number}" for share, number in one.values())]
        for model, one in shares.items()
    ]))  # fmt: skip


def marks(lines: Lines, shares: dict[str, dict[str, tuple[float, int]]]) -> list[Mark]:
    """Return the aims, with what is reached."""
    found = [
        Mark(model, "share of cells in their 95 % ranges", 0.90, 0.985, one["sampled"][0])
        for model, one in shares.items()
    ]
    for place, low in (("one site", 0.80), ("several sites", 0.65)):
        for model in shares:
            one = lines[model, place, "mixed"]
            if one is not None:
                words = f"variance ratio, {place}, mixed"
                found.append(Mark(model, words, low, 1.25, one.ratio(one.variance)))
    for place in PLACES:
        one = lines["pgv_pga", place, "rare"]
        if one is not None:
            loss = {name: score[1] for name, score in one.scores().items()}
            words = f"log score of any failure below that of {{}}, {place}"
            for other in WAYS[2:]:
                gain = loss[other] - loss["copula"]
                found.append(Mark("pgv_pga", words.format(other), 0.01, np.inf, gain))
            apart = abs(loss["beta-binomial"] - loss["copula"])
            words = f"beta-binomial from the copula's log score, {place}"
            found.append(Mark("pgv_pga", words, -np.inf, 0.02, apart))
    return found


if __name__ == "__main__":
    main()
