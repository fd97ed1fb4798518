"""Numbers of failures in events: like blocks against as many rows, shifted models, many blocks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import binom

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement, pair_excess
from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards import event_counts
from rbfrag.hazards.event_counts import (
    EventYears,
    PartCounts,
    _shaken,
    _sum_by_moments,
    _sum_lognormals,
    count_part,
    shift_error,
)
from rbfrag.hazards.event_set import Duration, EventSet
from rbfrag.hazards.losses import shifted_portfolios
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.question.components import component_named
from rbfrag.solver.results import FloatArray
from tests.fragility.conftest import model_row
from tests.fragility.portfolio_draws import SHARED
from tests.hazards.test_losses import probability, table


def events(pgv: FloatArray) -> EventSet:
    """Return one event a year: PGV by events and sites [m/s]."""
    n, sites = pgv.shape
    return EventSet(
        event_id=np.arange(n), realization=np.zeros(n, dtype=np.int64), year=np.arange(n),
        weight=np.full(n, 1.0 / n), site_ids=tuple(f"s{i}" for i in range(sites)),
        event=np.repeat(np.arange(n), sites), site=np.tile(np.arange(sites), n),
        measures={"pgv_m_s": pgv.ravel()}, duration=Duration(float(n), 1),
        realization_weights={0: 1.0},
    )  # fmt: skip


def portfolio(
    of: EventSet, law: dict[str, float] | None, meaning: str, **columns: Any
) -> Portfolio:
    """Return blocks of toppling velocities y [m/s]."""
    inputs = table(columns.pop("y"), columns.pop("site", "s0"), **columns)
    n = inputs["kr"].size
    names = np.array([str(i) for i in range(n)], dtype=object)
    complete = {"block_id": names, "kind": np.full(n, "toppling", dtype=object), **inputs}
    model = FragilityModel.from_row(model_row(dependence=law))
    return Portfolio.of(complete, of.site_ids, {"toppling": model}, component_named(meaning))


def counted(of: EventSet, blocks: Portfolio, samples: int, **about: Any) -> PartCounts:
    most = float(blocks.weight @ blocks.count)
    ends = np.arange(1.0, most + 1.0)
    return count_part(EventYears(0, blocks, of, ends, np.empty(0), samples, 0, **about))


@pytest.mark.parametrize("law", [SHARED, None])
@pytest.mark.parametrize(("meaning", "sigma"), [("single", 0.0), ("rotd50", 0.0), ("rotd50", 0.2)])
def test_ten_like_blocks_are_ten_rows(
    law: dict[str, float] | None, meaning: str, sigma: float
) -> None:
    shaking, samples = events(np.array([[0.5], [0.45]])), 10_000
    row = portfolio(shaking, law, meaning, y=[0.36, 0.3], count=[10.0, 1.0], kr_sigma=sigma)
    rows = portfolio(shaking, law, meaning, y=[0.36] * 10 + [0.3], kr_sigma=sigma)
    assert (row.size, rows.size) == (2, 11)
    single, other = (counted(shaking, item, samples) for item in (row, rows))
    assert single.failures == pytest.approx(other.failures)
    assert single.bounds == pytest.approx(other.bounds)
    # every number of failures as often, to four standard errors of both
    first, second = single.counts.events[0], other.counts.events[0]
    assert first.shape == (1 if law else 2, 11)
    error = np.sqrt(2.0 * second * (1.0 - second) / (2 * samples)) + 1e-4
    np.testing.assert_array_less(np.abs(first - second), 4.0 * error)
    assert single.any_fails == pytest.approx(other.any_fails, abs=4.0 * np.sqrt(0.5 / samples))


def test_two_like_blocks_fail_together_as_the_law_has_it() -> None:
    shaking, samples = events(np.array([[0.5]])), 40_000
    result = counted(shaking, portfolio(shaking, SHARED, "single", y=0.36, count=2.0), samples)
    p = probability(0.36, 0.5)
    a, place = np.array([ndtri(p)]), np.array([0])
    both = p * p + pair_excess(
        a, a, Placement.of([0.0, 0.0], 0.0, polarity=0), place, place + 1, Dependence(**SHARED)
    )
    error = 4.0 * np.sqrt(0.25 / samples)
    assert result.counts.events[0, 0] == pytest.approx([2.0 * p - both[0], both[0]], abs=error)


def test_independent_like_blocks_are_binomial() -> None:
    shaking, samples, count = events(np.array([[0.5]])), 20_000, 12
    blocks = portfolio(shaking, None, "single", y=0.4, count=float(count))
    curve = counted(shaking, blocks, samples).counts.events[0]
    p = probability(0.4, 0.5)
    error = 4.0 * np.sqrt(0.25 / samples)
    together, alone = np.full(count, p), binom.sf(np.arange(count), count, p)
    assert curve[0] == pytest.approx(together, abs=error)
    assert curve[1] == pytest.approx(alone, abs=error)


def test_a_hundred_thousand_like_blocks() -> None:
    shaking = events(0.5 * np.exp(0.3 * np.random.default_rng(1).normal(size=(50, 1))))
    result = count_part(
        EventYears(
            0, portfolio(shaking, SHARED, "single", y=0.4, count=1e5), shaking,
            np.array([1.0, 1e5]), np.empty(0), 200, 0,
        )
    )  # fmt: skip
    # sides fail as a whole: none, a quarter, … or all, each about as often as one block does
    assert result.failures == pytest.approx(1e5 * probability(0.4, shaking.measures["pgv_m_s"]))
    assert 0.0 < result.counts.events[0, 0, 1] < result.counts.events[0, 0, 0]


def shifted(blocks: Portfolio, by: float) -> Portfolio:
    """Return the portfolio by a model whose slope is larger."""
    (model,) = blocks.models
    coefficients = {
        name: value * (1.0 + by) if i == 1 else value
        for i, (name, value) in enumerate(model.coefficients.items())
    }
    return replace(blocks, models=(replace(model, coefficients=coefficients),))


@pytest.mark.parametrize("meaning", ["single", "rotd50"])
def test_shifted_models_answer_by_the_same_samples(meaning: str) -> None:
    shaking = events(0.5 * np.exp(0.3 * np.random.default_rng(1).normal(size=(40, 2))))
    y, site = [0.3, 0.4, 0.5, 0.45, 0.35], ["s0", "s0", "s1", "s1", "s1"]
    blocks = portfolio(shaking, SHARED, meaning, y=y, site=site, count=[1.0, 4.0, 1.0, 9.0, 1.0])
    by = (blocks, shifted(blocks, 0.05), shifted(blocks, -0.05))
    result, alone = counted(shaking, blocks, 60, shifted=by), counted(shaking, blocks, 60)
    same, more, less = result.counts.events[0, 1:]
    np.testing.assert_array_equal(result.counts.events[:, 0], alone.counts.events[:, 0])
    np.testing.assert_array_equal(same, result.counts.events[0, 0])
    assert (less <= same).all()
    assert (same <= more).all()
    assert less[0] < same[0] < more[0]
    # as far apart as a run of its own says, without its scatter
    ends = [counted(shaking, item, 4000).counts.events[0, 0, :2] for item in by[1:]]
    apart = np.log(ends[0] / ends[1])
    result = counted(shaking, blocks, 1000, shifted=by)
    _, _, more, less = result.counts.events[0]
    np.testing.assert_allclose(np.log(more / less)[:2], apart, rtol=0.05)


@pytest.mark.parametrize("meaning", ["single", "rotd50"])
def test_shifts_on_nodes_are_those_of_each_pair(meaning: str) -> None:
    shaking = events(0.5 * np.exp(0.15 * np.random.default_rng(1).normal(size=(9, 2))))
    blocks = portfolio(shaking, SHARED, meaning, y=[0.3, 0.45, 0.5], site=["s0", "s0", "s1"])
    part = EventYears(0, blocks, shaking, np.empty(0), np.empty(0), 1, 0)
    by = shifted_portfolios(blocks)
    nodes, pairs = (
        [shaken.shift for _, shaken in _shaken(part._replace(shifted=item))]
        for item in (by, (*by, by[0]))  # another number than that of the axes: no nodes
    )
    for node, other in zip(nodes, pairs, strict=True):
        np.testing.assert_allclose(node, other[:-1], atol=5e-4, rtol=1e-2)


def test_error_from_the_axes() -> None:
    rates = np.array([[1.0], [np.exp(0.3)], [np.exp(-0.3)], [np.exp(0.2)], [np.exp(-0.6)]])
    assert shift_error(rates) == pytest.approx(np.hypot(0.3, 0.4))


def test_sums_of_costs_have_three_moments() -> None:
    n, sigma, draws = 60, 0.8, 100_000
    number, sigmas = np.full(draws, n), np.full(draws, sigma)
    laws = (_sum_lognormals(number, sigmas, np.random.default_rng(1)),
            _sum_by_moments(number, sigmas, np.random.default_rng(2)))  # fmt: skip
    for values in laws:
        square = np.exp(sigma**2)
        assert values.mean() == pytest.approx(n * np.sqrt(square), rel=2e-3)
        assert values.var() == pytest.approx(n * square * (square - 1.0), rel=0.03)
    single, other = (np.quantile(values, (0.01, 0.5, 0.99)) for values in laws)
    assert single == pytest.approx(other, rel=0.01)


def test_many_blocks_have_the_law_of_draws_of_each(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(3)
    shaking = events(0.5 * np.exp(0.4 * random.normal(size=(6, 40))))
    y, site = random.uniform(0.2, 0.6, 240), [f"s{i % 40}" for i in range(240)]
    blocks = portfolio(
        shaking, SHARED, "rotd50", y=y, site=site, loss=10.0, loss_sigma=0.4,
        count=random.integers(1, 4, 240).astype(float),
    )  # fmt: skip
    separate = counted(shaking, blocks, 3000)
    monkeypatch.setattr(event_counts, "LARGE", 100)
    many = counted(shaking, blocks, 3000, shifted=(blocks,))
    np.testing.assert_allclose(many.any_fails, separate.any_fails, atol=0.03)
    np.testing.assert_allclose(many.loss_variance, separate.loss_variance, rtol=0.2)
    assert many.loss_variance.sum() == pytest.approx(separate.loss_variance.sum(), rel=0.08)
    first, second = many.counts.events[0], separate.counts.events[0, 0]
    np.testing.assert_array_equal(first[0], first[1])
    np.testing.assert_allclose(first[0], second, atol=0.03)
