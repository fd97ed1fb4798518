"""Scores on nodes: failure probabilities of pairs of block and earthquake without the models."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from rbfrag.hazards import event_counts
from rbfrag.hazards.event_counts import EventYears, TriggeredBlocks, _noticeable, tables_of
from rbfrag.hazards.event_set import TOLERANCE, Duration, EventSet
from rbfrag.hazards.losses import event_losses
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.score_tables import MEAN, MEDIAN, VARIANCE
from rbfrag.question.components import component_named
from rbfrag.question.keywords import model_for
from rbfrag.solver.results import FloatArray

BLOCKS = 12
RANGES = {
    "p2": ("p2_1_s2", 0.5, 20.0), "kr": ("kr", 0.04, 0.5), "ky": ("ky", 0.04, 0.4),
    "displacement_m": ("displacement_m", 0.05, 0.4),
}  # fmt: skip
CASES = [
    ("toppling", "pgv_m_s", ("p2", "kr")),
    ("toppling", "pga_g", ("p2", "kr")),  # P = 0 below PGA = k_r
    ("rocking", "pgv_m_s", ("p2", "kr")),
    ("rocking", "pga_g", ("p2", "kr")),
    ("sliding", "pgv_m_s", ("ky", "displacement_m")),
]


def part_of(
    kind: str, measure: str, names: tuple[str, ...], meaning: str, **sigma: float
) -> tuple[EventYears, FloatArray]:
    """Return blocks at one site of an event set, and u of its events."""
    random = np.random.default_rng(5)
    levels = np.sort(np.exp(random.uniform(np.log(0.02), np.log(2.0), 40)))
    events = EventSet(
        np.arange(40), np.zeros(40, np.int64), np.arange(40), np.full(40, 0.01), ("s",),
        np.arange(40), np.zeros(40, np.int64), {measure: levels}, Duration(100.0, 1), {0: 1.0},
    )  # fmt: skip
    columns: dict[str, Any] = {
        "block_id": np.arange(BLOCKS).astype(str).astype(object),
        "kind": np.full(BLOCKS, kind, dtype=object),
    }
    for name in names:
        column, low, high = RANGES[name]
        columns[column] = np.exp(random.uniform(np.log(low), np.log(high), BLOCKS))
    columns |= {name: np.full(BLOCKS, value) for name, value in sigma.items()}
    model = model_for({}, (*names, measure), kind)
    blocks = Portfolio.of(columns, ("s",), {kind: model}, component_named(meaning))
    return EventYears(0, blocks, events, np.empty(0), np.empty(0), 10, 0), np.log(levels)


@pytest.mark.parametrize(("kind", "measure", "names"), CASES)
@pytest.mark.parametrize("meaning", ["single", "rotd50"])
def test_scores_are_those_of_the_models(
    kind: str, measure: str, names: tuple[str, ...], meaning: str
) -> None:
    part, u = part_of(kind, measure, names, meaning)
    tables, blocks, block = tables_of(part), part.portfolio, np.arange(BLOCKS)
    assert tables is not None
    shaking = {measure: np.exp(u)[:, None]}
    xi = np.random.default_rng(1).normal(size=(u.size, BLOCKS))
    exact, _ = blocks.probability(block, shaking, (xi, 0.0, 0.0))
    rows, levels = np.tile(block, u.size), np.repeat(u, BLOCKS)
    moved = levels + blocks.component.sigma * xi.ravel()
    scores = tables.score_at(MEDIAN, rows, moved).reshape(xi.shape)
    np.testing.assert_array_equal(scores == -np.inf, exact == 0.0)
    np.testing.assert_allclose(ndtr(scores), exact, atol=1e-4)
    assert np.median(np.abs(ndtr(scores) - exact)) < 1e-7
    # the mean over the dispersion of the component
    z = np.linspace(-6.0, 6.0, 601)
    weight = np.exp(-0.5 * z * z) / np.exp(-0.5 * z * z).sum()
    points = (z[:, None], 0.0, 0.0)
    at_points, _ = blocks.probability(block, {measure: np.exp(u)[:, None, None]}, points)
    mean = np.einsum("rkm,k->rm", at_points, weight)
    score = tables.score_at(MEAN, rows, levels)
    # P leaves zero as a root: steps of half a standard deviation average over it less exactly
    error = 1e-3 if measure == "pga_g" else 1e-4
    np.testing.assert_allclose(ndtr(score).reshape(mean.shape), mean, atol=error)


def test_scores_of_uncertain_blocks_are_means_over_their_parameters() -> None:
    part, u = part_of("toppling", "pgv_m_s", ("p2", "kr"), "rotd50", kr_sigma=0.25, p2_sigma=0.1)
    tables, blocks, block = tables_of(part), part.portfolio, np.arange(BLOCKS)
    assert tables is not None
    z, weight = blocks.scatter_points()
    at_points, _ = blocks.probability(
        block, {"pgv_m_s": np.exp(u)[:, None, None]}, tuple(z.T[:, :, None])
    )
    mean = np.einsum("rkm,k->rm", at_points, weight)
    score = np.clip(ndtri(at_points), -5.0, 5.0)
    variance = np.einsum("rkm,k->rm", score**2, weight) - np.einsum("rkm,k->rm", score, weight) ** 2
    rows, levels = np.tile(block, u.size), np.repeat(u, BLOCKS)
    p = ndtr(tables.score_at(MEAN, rows, levels))
    np.testing.assert_allclose(p.reshape(mean.shape), mean, atol=1e-3)
    square = tables.means_at(rows, levels)[VARIANCE]
    np.testing.assert_allclose(square.reshape(mean.shape), variance, atol=0.02)


def test_blocks_without_samples_add_less_than_the_tolerance() -> None:
    random = np.random.default_rng(2)
    part, _ = part_of("toppling", "pgv_m_s", ("p2", "kr"), "single")
    p = 10.0 ** random.uniform(-11.0, 0.0, BLOCKS)
    ones, zeros = np.arange(BLOCKS), np.zeros(BLOCKS)
    shaken = TriggeredBlocks(ones, ones, p, zeros, zeros, zeros[None])
    chosen = _noticeable(part.portfolio, shaken)
    assert 0 < chosen.size < BLOCKS
    assert p.sum() - p[chosen].sum() <= TOLERANCE * p.max()  # P of any failure is no less
    assert p[chosen].min() > np.delete(p, chosen).max()
    # what one failure counts does not decide which blocks may fail at all
    weight = np.where(np.arange(BLOCKS) == 0, 1e12, 1.0)
    heavy = _noticeable(replace(part.portfolio, weight=weight), shaken)
    np.testing.assert_array_equal(np.union1d(chosen, [0]), heavy)


def test_failures_that_count_nothing_are_not_sampled() -> None:
    part, _ = part_of("toppling", "pgv_m_s", ("p2", "kr"), "rotd50")
    nothing = replace(part.portfolio, weight=np.zeros(BLOCKS))
    counts = event_counts.count_part(part._replace(portfolio=nothing, counts=np.array([1.0])))
    assert not counts.any_fails.any()
    assert not counts.counts.events.any()


def test_the_tolerance_changes_no_rate_beyond_sampling(monkeypatch: pytest.MonkeyPatch) -> None:
    part, _ = part_of("toppling", "pgv_m_s", ("p2", "kr"), "rotd50")
    part = part._replace(samples=4000, counts=np.array([1.0, 2.0, 4.0]))
    default = event_counts.count_part(part)
    monkeypatch.setattr(event_counts, "TOLERANCE", 0.0)
    exact = event_counts.count_part(part)
    np.testing.assert_array_equal(default.failures, exact.failures)
    np.testing.assert_allclose(default.any_fails, exact.any_fails, atol=4.0 * np.sqrt(0.5 / 4000))
    error = 4.0 * np.sqrt(exact.counts.events[1, 0] / 4000)
    assert (np.abs(default.counts.events[0, 0] - exact.counts.events[0, 0]) < error).all()


def test_tables_of_each_site_give_the_failures_of_those_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    part, _ = part_of("toppling", "pgv_m_s", ("p2", "kr"), "single")
    from_one = event_losses(part.events, part.portfolio, samples=50)
    monkeypatch.setattr("rbfrag.hazards.losses.MOST_KEPT", 0)
    by_site = event_losses(part.events, part.portfolio, samples=50)
    assert by_site.as_dict() == from_one.as_dict()


@pytest.mark.parametrize(("most_kept", "larger"), [(0, True), (1 << 26, False)])
def test_parts_are_larger_only_where_each_makes_tables(
    monkeypatch: pytest.MonkeyPatch, most_kept: int, larger: bool
) -> None:
    part, _ = part_of("toppling", "pgv_m_s", ("p2", "kr"), "single")
    monkeypatch.setattr("rbfrag.hazards.losses.MOST_KEPT", most_kept)
    monkeypatch.setattr("rbfrag.hazards.losses.PAIRS_AT_ONCE", BLOCKS)
    sizes: list[int] = []

    def run(parts: Any, number: int, shared: EventYears) -> Any:
        sizes.append(number)
        return (event_counts.count_years(shared, batch) for batch in parts)

    event_losses(part.events, part.portfolio, samples=1, run=run)
    monkeypatch.setattr(event_counts, "_MOST_ON_NODES", 0)  # the models answer each pair
    event_losses(part.events, part.portfolio, samples=1, run=run)
    assert [number == 1 for number in sizes] == [larger, False]
