"""Failures and losses in event sets: small ones worked out by hand, limits, and bounds."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import binom, binomtest, chi2

from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from rbfrag.errors import InputError
from rbfrag.exchange.event_losses import losses
from rbfrag.exchange.openquake_events import job_files, read_events
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.fragility.methods import method_named
from rbfrag.hazards import event_counts
from rbfrag.hazards.curve_file import read_hazard_curves
from rbfrag.hazards.event_counts import EventBatch, EventYears, count_years
from rbfrag.hazards.event_set import rate_interval, share_interval
from rbfrag.hazards.hazard_rates import hazard
from rbfrag.hazards.loss_answer import LossAnswer
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.question.components import COMPONENT_SIGMA
from rbfrag.question.question import predict
from tests.exchange.openquake_job import write_job
from tests.fragility.conftest import SHARED, model_row

SHARES = ("rho_e", "rho_s", "rho_v", "rho_o")
TOGETHER = {**SHARED, **dict.fromkeys(SHARES, 0.0), "rho_e": 1.0}
APART = {**SHARED, **dict.fromkeys(SHARES, 0.0), "rho_o": 1.0, "l_y": 1e-12}


def table(y: Any, site: Any, **columns: Any) -> dict[str, Any]:
    """Blocks of toppling velocities y [m/s] and one size at sites."""
    kr = np.atleast_1d(np.asarray(y, dtype=np.float64)) * 2.0 / STANDARD_GRAVITY_M_S2
    sites = np.array([site] * kr.size if isinstance(site, str) else site, dtype=object)
    inputs = {name: np.broadcast_to(value, kr.size) for name, value in columns.items()}
    return {"p2_1_s2": np.full(kr.size, 4.0), "kr": kr, "site_id": sites, **inputs}


def probability(y: float, pgv: Any) -> Any:
    """P of the model with round numbers, written out."""
    x = np.asarray(pgv, dtype=np.float64)
    return ndtr((0.002 + 0.72 * x - y) / np.sqrt(4e-5 + 3e-3 * x))


def answered(folder: Path, blocks: dict[str, Any], **about: Any) -> LossAnswer:
    """The answer of the model with round numbers."""
    dependence = about.pop("dependence", SHARED)
    about = {"component": "single", "model": model_row(dependence=dependence), **about}
    return losses(folder, blocks, **about)


@pytest.fixture
def job(tmp_path: Path) -> Path:
    """Three realizations of 100 years each; two events of the first in year 3."""
    return write_job(tmp_path / "job")


def test_three_realizations_by_hand(job: Path) -> None:
    answer = answered(job, table([0.4, 0.4, 0.35], ["0012", "007", "Z9"]), expected=True)
    # weights .5, .3, .2 over 100 years; site 0012 in the events 0, 1 and 4, 007 in 0, Z9 in 3
    at_0012 = 0.005 * (probability(0.4, 0.6) + probability(0.4, 0.8)) + 0.002 * probability(
        0.4, 0.9
    )
    at_007, at_z9 = 0.005 * probability(0.4, 0.4), 0.003 * probability(0.35, 0.5)
    rates = [row["average_annual_failures"] for row in answer.as_dict()["blocks"]]
    assert rates == pytest.approx([at_0012, at_007, at_z9], rel=1e-5)
    assert answer.average_annual_failures == pytest.approx(at_0012 + at_007 + at_z9, rel=1e-5)
    of_events = answer.table_columns()
    both = probability(0.4, 0.6) + probability(0.4, 0.4)
    assert of_events["expected_failures"][0] == pytest.approx(both, rel=1e-5)
    assert of_events["expected_failures"][2] == 0.0  # shook nothing
    assert of_events["annual_weight"] == pytest.approx([0.005, 0.005, 0.005, 0.003, 0.002])
    error = math.sqrt(
        float(((of_events["annual_weight"] * of_events["expected_failures"]) ** 2).sum())
    )
    assert answer.as_dict()["average_annual_failures_error"] == pytest.approx(error)


def test_largest_event_and_sum_of_a_year(job: Path) -> None:
    # y = 0.05: certain to fail wherever the ground shakes
    answer = answered(job, table([0.05] * 3, ["0012", "007", "Z9"]), samples=4)
    curve = {item.value: item for item in answer.exceedance["the model's copula"]}
    # event 0 fails two, 1 one (in the same year), 3 and 4 one each
    assert curve[1].annual_rate == pytest.approx(0.005 + 0.005 + 0.003 + 0.002)
    assert curve[2].annual_rate == pytest.approx(0.005)
    assert curve[1].largest_of_year == pytest.approx(0.005 + 0.003 + 0.002)
    assert curve[2].largest_of_year == pytest.approx(0.005)
    assert curve[1].sum_of_year == pytest.approx(0.005 + 0.003 + 0.002)
    assert curve[2].sum_of_year == pytest.approx(0.005)
    assert 3 not in curve  # no event fails three; the year's sum does
    assert answer.annual_rate_any == pytest.approx(0.015)
    effective = 100.0 / (0.25 + 0.09 + 0.04)
    assert [item.beyond_effective_time for item in curve.values()] == [
        0.015 * effective < 1.0,
        0.005 * effective < 1.0,
    ]


def test_sum_of_a_year_reaches_what_no_event_does(tmp_path: Path) -> None:
    events = [(0, 0, 7), (1, 0, 7), (2, 0, 9)]
    shaking = [(i, 80.0, "Z9") for i in range(3)]
    shaking += [(2, 80.0, "007")]
    folder = write_job(tmp_path, events=events, shaking=shaking, weights=(1.0,))
    answer = answered(folder, table([0.05, 0.05], ["Z9", "007"]), samples=2)
    single, two = answer.exceedance["the model's copula"]
    assert (single.annual_rate, two.annual_rate) == pytest.approx((0.03, 0.01))
    assert (single.largest_of_year, two.largest_of_year) == pytest.approx((0.02, 0.01))
    assert (single.sum_of_year, two.sum_of_year) == pytest.approx((0.02, 0.02))


def test_samples_of_a_tree(tmp_path: Path) -> None:
    events = [(i, i, 1 + 100 * i) for i in range(6)]
    shaking = [(i, 10.0 * (i + 2), "0012") for i in range(6)]
    folder = write_job(tmp_path, events=events, shaking=shaking, weights=[0.16666667] * 6)
    answer = answered(folder, table([0.3], "0012"))
    pgv = 0.1 * np.arange(2, 8)
    assert answer.average_annual_failures == pytest.approx(probability(0.3, pgv).sum() / 600.0)


def test_a_scenario(tmp_path: Path) -> None:
    events = [(i, int(i >= 2), 0) for i in range(3)]
    shaking = [(0, 80.0, "Z9"), (1, 80.0, "Z9"), (1, 80.0, "007"), (2, 80.0, "007")]
    folder = write_job(tmp_path, events=events, shaking=shaking, weights=(0.4, 0.6), ruptures=False)
    answer = answered(folder, table([0.05, 0.05], ["Z9", "007"], loss=10.0), samples=3)
    document = answer.as_dict()
    assert document["scenario"]
    assert document["average_annual_failures"] is None
    assert document["annual_rate_any"] is None
    assert document["effective_years"] is None
    # realizations of the motion weigh .2, .2 and .6 and fail one, two and one
    assert document["expected_failures"] == pytest.approx(1.2)
    assert document["probability_any"] == pytest.approx(1.0)
    assert document["expected_loss"] == pytest.approx(12.0)
    assert [row["expected_failures"] for row in document["blocks"]] == pytest.approx([0.4, 0.8])
    assert [(row["count"], row["probability"]) for row in document["exceedance"]] == [
        (1.0, pytest.approx(1.0)),
        (2.0, pytest.approx(0.2)),
    ]
    names = ("failures_p05", "failures_p50", "failures_p95", "loss_p50", "loss_p95")
    assert [document[name] for name in names] == [1.0, 1.0, 2.0, 10.0, 20.0]


def test_counts_and_weights(job: Path) -> None:
    once = answered(job, table([0.05], "007", loss=100.0), samples=2)
    many = answered(job, table([0.05], "007", count=3.0, loss=100.0), samples=2)
    heavy = answered(job, table([0.05], "007", weight=2.5, loss=100.0), samples=2)
    rates = [item.average_annual_failures for item in (once, many, heavy)]
    assert rates == pytest.approx([0.005, 0.015, 0.0125])
    costs = [item.average_annual_loss for item in (once, many, heavy)]
    assert costs == pytest.approx([0.5, 1.5, 1.25])
    assert [item.value for item in many.exceedance["the model's copula"]] == [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match=r"row 1: count = 1\.5"):
        answered(job, table([0.05], "007", count=1.5))
    with pytest.raises(InputError, match="row 1: loss = -1"):
        answered(job, table([0.05], "007", loss=-1.0))


@pytest.mark.parametrize("expected", [True, False])
def test_losses_that_scatter(job: Path, expected: bool) -> None:
    blocks = table([0.4], "0012", loss=100.0, loss_sigma=0.5)
    answer = answered(job, blocks, expected=expected, samples=100_000)
    p, mean = probability(0.4, 0.6), 100.0 * math.exp(0.125)
    assert answer.loss[0] == pytest.approx(p * mean)
    variance = p * 1e4 * math.exp(0.5) - (p * mean) ** 2
    if expected:
        assert np.isnan(answer.loss_variance[0, 0])
        assert answer.any_fails[0, 0] == pytest.approx(p)  # of one block
    else:
        assert answer.loss_variance[0, 0] == pytest.approx(variance, rel=0.02)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_sampled_frequencies_are_the_probabilities(tmp_path: Path, seed: int) -> None:
    folder = write_job(
        tmp_path, events=[(5, 0, 1)], shaking=[(5, 50.0, "Z9"), (5, 40.0, "007")], weights=(1.0,)
    )
    y = [0.25, 0.3, 0.36, 0.4, 0.45, 0.2, 0.28]
    blocks = table(y, ["Z9"] * 5 + ["007"] * 2, kr_sigma=[0.0, 0.2, 0.0, 0.0, 0.1, 0.0, 0.0])
    draws = 50_000
    answer = answered(folder, blocks, component="rotd50", seed=seed, samples=1)
    part = EventYears(0, answer.portfolio, answer.events, np.empty(0), np.empty(0), draws, seed)
    ((event, shaken),) = event_counts._shaken(part)
    generator = np.random.default_rng(seed)
    bounds = event_counts._bounds_of_z(part, shaken, generator)(draws)
    sampler = event_counts._sampler(answer.portfolio, shaken.block)
    assert isinstance(sampler, JointSampler)
    # a weight a bit: the sum of weights tells which of the blocks fail
    blocks_by_bit = replace(answer.portfolio, weight=2.0 ** np.arange(len(y)))
    totals = event_counts._failing(
        blocks_by_bit, shaken, sampler.sides(draws, generator), bounds, generator, alone=False
    )[0, 0]
    fails = totals.astype(np.int64)[:, None] >> shaken.block & 1
    frequency = fails.mean(axis=0)
    error = np.sqrt(shaken.probability * (1.0 - shaken.probability) / draws)
    assert event == 0
    assert (np.abs(frequency - shaken.probability) <= 4.0 * error).all()


def test_scatter_of_component_and_block(job: Path) -> None:
    xi, weight = np.polynomial.hermite_e.hermegauss(60)
    weight = weight / weight.sum()
    scatter, sigma = COMPONENT_SIGMA, 0.3
    answer = answered(job, table([0.4], "007"), component="geometric_mean", expected=True)
    mean = probability(0.4, 0.4 * np.exp(scatter * xi)) @ weight
    assert answer.average_annual_failures == pytest.approx(0.005 * mean, rel=1e-4)
    answer = answered(job, table([0.4], "007", kr_sigma=sigma), expected=True)
    mean = np.array([probability(0.4 * math.exp(sigma * x), 0.4) for x in xi]) @ weight
    assert answer.average_annual_failures == pytest.approx(0.005 * mean, rel=1e-4)


def one_event(folder: Path) -> Path:
    """One event that shakes one site."""
    return write_job(folder, events=[(0, 0, 1)], shaking=[(0, 50.0, "Z9")], weights=(1.0,))


def test_limits_of_the_dependence(tmp_path: Path) -> None:
    folder, p = one_event(tmp_path), probability(0.36, 0.5)
    # of unknown azimuth, two equal blocks that happen to face one way would fail together
    blocks, draws = table(0.36 + 1e-9 * np.arange(4), "Z9"), 100_000
    error = 4.0 * math.sqrt(0.25 / draws)
    for law, shares in (
        (TOGETHER, [p] * 4),
        (APART, binom.sf(np.arange(4), 4, p)),
    ):
        answer = answered(folder, blocks, dependence=law, samples=draws)
        rates = [item.annual_rate * 100.0 for item in answer.exceedance["the model's copula"]]
        assert rates == pytest.approx(list(shares), abs=error)


def test_without_a_stored_dependence_both_bounds_are_given(tmp_path: Path) -> None:
    folder = one_event(tmp_path)
    y = [0.3, 0.36, 0.4]
    p = probability(np.array(y), 0.5)
    answer = answered(folder, table(y, "Z9", loss=1.0), dependence=None, samples=50_000)
    document = answer.as_dict()
    assert document["annual_rate_any"] is None
    assert document["joint_law"] == "bounds"
    low, high = p.max(), 1.0 - (1.0 - p).prod()
    assert document["bounds"]["fully_dependent"]["annual_rate_any"] == pytest.approx(0.01 * low)
    assert document["bounds"]["independent"]["annual_rate_any"] == pytest.approx(0.01 * high)
    assert document["exceedance"] == []
    curves = document["exceedance_bounds"]
    assert curves["fully_dependent"][0]["annual_rate"] == pytest.approx(0.01 * low, rel=0.02)
    assert curves["independent"][0]["annual_rate"] == pytest.approx(0.01 * high, rel=0.02)
    assert any("bounds" in text for text in document["warnings"])
    exact = answered(folder, table(y, "Z9", loss=1.0), dependence=None, expected=True)
    least = np.minimum.outer(p, p) - np.outer(p, p)
    assert exact.any_fails[:, 0] == pytest.approx([low, high])
    variance = [least.sum(), (p * (1 - p)).sum()]
    assert answer.loss_variance[:, 0] == pytest.approx(variance, rel=0.05)


def test_parts_of_the_work_change_nothing(
    formats_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = formats_dir / "openquake_event_based" / "three_realizations"
    blocks = table([0.1, 0.2, 0.3], ["0012", "Z9", "SLIDE-A"], loss=5.0, loss_sigma=0.3)
    seen: list[tuple[int, int]] = []
    complete = answered(
        folder, blocks, samples=20, on_progress=lambda *progress: seen.append(progress)
    )
    assert seen == [(212, 212)] or seen[-1][0] == seen[-1][1]
    monkeypatch.setattr("rbfrag.hazards.losses.PAIRS_AT_ONCE", 7)

    def backwards(parts: Iterator[EventBatch], number: int, common: EventYears) -> Iterator[Any]:
        results = [count_years(common, part) for part in parts]
        assert len(results) == number > 20
        return iter(results[::-1])

    parts = answered(folder, blocks, samples=20, run=backwards)
    assert parts.any_fails.tolist() == complete.any_fails.tolist()
    assert parts.loss_variance.tolist() == complete.loss_variance.tolist()
    single, other = complete.as_dict(), parts.as_dict()
    for name in ("exceedance", "loss_exceedance", "blocks"):
        for row, same in zip(single[name], other[name], strict=True):
            numbers = {key: value for key, value in row.items() if isinstance(value, float)}
            assert numbers == pytest.approx({key: same[key] for key in numbers}, rel=1e-12)
    again = answered(folder, blocks, samples=20, seed=1)
    assert again.any_fails.tolist() != complete.any_fails.tolist()


def test_without_samples_only_bounds_are_known(tmp_path: Path) -> None:
    answer = answered(one_event(tmp_path), table([0.36] * 4, "Z9", loss=1.0), expected=True)
    assert answer.annual_rate_any is None
    assert np.isnan(answer.table_columns()["probability_any"][0])
    assert answer.exceedance == {}
    assert answer.average_annual_failures == pytest.approx(0.04 * probability(0.36, 0.5))
    assert any("without samples" in text for text in answer.warnings)


def test_measures_that_the_engine_draws_independently_are_warned_of(
    tmp_path: Path, measures_db: str
) -> None:
    folder = write_job(
        tmp_path, events=[(0, 0, 1)], shaking=[(0, 50.0, 0.4, "Z9")], weights=(1.0,),
        measures=("SA(1.0)", "PGA"),
    )  # fmt: skip
    blocks = table([0.3], "Z9")
    shaking = {"imt": ("PGA", "SA(1.0)"), "component": "single", "db": measures_db}
    (folder / "gmf-data_5.csv").write_text(
        (folder / "gmf-data_5.csv").read_text().replace("0,50.0,", "0,0.5,")
    )
    with pytest.raises(InputError, match="models by name"):
        losses(folder, blocks, expected=True, **shaking)  # type: ignore[arg-type]
    shaking["model"] = "toppling-pga"
    answer = losses(folder, blocks, expected=True, **shaking)  # type: ignore[arg-type]
    kr = float(blocks["kr"][0])
    same = predict(p2=4.0, kr=kr, pga_g=0.4, sa_g={1.0: 0.5}, db=measures_db, model="toppling-pga")
    assert answer.failures[0] == pytest.approx(same.probability)
    assert any("independently" in text for text in answer.warnings)


def test_more_samples_than_are_drawn_at_once(job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = table([0.36, 0.4, 0.3], "0012", kr_sigma=0.2, loss=10.0, loss_sigma=0.3)
    complete = answered(job, blocks, samples=3000, component="rotd50")
    monkeypatch.setattr("rbfrag.hazards.event_counts._VALUES_AT_ONCE", 1 << 10)
    monkeypatch.setattr("rbfrag.hazards.losses.SAMPLES_AT_ONCE", 4000)
    parts = answered(job, blocks, samples=3000, component="rotd50")
    assert parts.failures == pytest.approx(complete.failures)
    assert parts.any_fails == pytest.approx(complete.any_fails, abs=4.0 * math.sqrt(0.5 / 3000))
    assert parts.loss_variance == pytest.approx(complete.loss_variance, rel=0.2)


def test_blocks_that_nothing_shakes(job: Path) -> None:
    folder = write_job(job.parent / "far", sites=("0012", "007", "Z9", "far"))
    answer = answered(folder, table([0.3], "far", loss=1.0))
    assert answer.average_annual_failures == answer.average_annual_loss == 0.0
    assert answer.annual_rate_any == 0.0
    assert answer.as_dict()["exceedance"] == []


def test_blocks_that_cannot_be_placed(job: Path) -> None:
    with pytest.raises(InputError, match=r"row 1: .* at site '12'.*'0012' is not 12"):
        answered(job, table([0.4], "12"))
    blocks = table([0.4], "0012")
    del blocks["site_id"]
    with pytest.raises(InputError, match="there are 3 sites, and"):
        answered(job, blocks)
    with pytest.raises(InputError, match="samples = -1"):
        answered(job, table([0.4], "0012"), samples=-1)
    with pytest.raises(InputError, match="seed = -1"):
        answered(job, table([0.4], "0012"), seed=-1)


def test_interval_of_equal_weights_is_the_exact_one() -> None:
    """Garwood (1936): χ² quantiles of 2n and 2n + 2 degrees of freedom."""
    n, weight = 7, 1e-3
    low, high = rate_interval(n * weight, n * weight**2, weight, 0.95)
    assert low == pytest.approx(weight * chi2.ppf(0.025, 2 * n) / 2)
    assert high == pytest.approx(weight * chi2.ppf(0.975, 2 * n + 2) / 2)


def test_interval_of_a_share_is_wilsons() -> None:
    """Where each of n realisations reaches a number or does not, and 3 of 20 do."""
    low, high = share_interval(0.15, 0.15 * 0.85 / 20, 1 / 20, 0.95)
    same = binomtest(3, 20).proportion_ci(0.95, method="wilson")
    assert (low, high) == pytest.approx((same.low, same.high))
    low, high = share_interval(1.0, 0.0, 1 / 20, 0.95)
    same = binomtest(20, 20).proportion_ci(0.95, method="wilson")
    assert (low, high) == pytest.approx((same.low, same.high))


def test_minimum_intensity_above_the_weakest_block_is_warned_of(tmp_path: Path) -> None:
    shaking = [(0, 30.0, "Z9")]
    folder = write_job(tmp_path, events=[(0, 0, 1)], shaking=shaking, weights=(1.0,))
    assert any("minimum_intensity" in t for t in answered(folder, table([0.2], "Z9")).warnings)
    assert not any("minimum_intensity" in t for t in answered(folder, table([0.5], "Z9")).warnings)


def site_curves(folder: Path) -> dict[str, Any]:
    """Hazard curves of PGV by site."""
    (path,) = folder.glob("hazard_curve-mean-PGV_*.csv")
    return {curve.site: curve for curve in read_hazard_curves(path)}


def test_events_agree_with_curves_of_the_same_sources(formats_dir: Path) -> None:
    folder = formats_dir / "openquake_event_based" / "one_realization"
    curves = site_curves(formats_dir / "openquake_classical_logic_tree" / "one_realization")
    p2 = np.array([10.0, 10.0, 3.0, 3.0, 1.0, 1.0, 0.3])
    kr = np.array([0.1, 0.15, 0.1, 0.2, 0.05, 0.1, 0.03])
    sites = [*curves]
    blocks = {
        "p2_1_s2": np.tile(p2, len(sites)),
        "kr": np.tile(kr, len(sites)),
        "site_id": np.repeat(np.array(sites, dtype=object), p2.size),
    }
    answer = losses(folder, blocks, component="rotd50", expected=True)
    rows = answer.as_dict()["blocks"]
    compared = 0
    for i, site in enumerate(sites):
        by_curve = hazard(curves[site], p2, kr, component="rotd50").annual_rate
        for rate, row in zip(by_curve.tolist(), rows[i * p2.size :], strict=False):
            if rate * 90_000.0 > 20.0:
                compared += 1
                reference, error = (
                    row["average_annual_failures"],
                    row["average_annual_failures_error"],
                )
                assert abs(reference - rate) < 3.0 * error, (site, row, rate)
    assert compared >= 30


@pytest.mark.parametrize(
    ("item", "other"),
    [("one_realization", "engine_made_site_ids"), ("three_realizations", "six_samples")],
)
def test_runs_of_the_same_models_agree(formats_dir: Path, item: str, other: str) -> None:
    answers = []
    for name in (item, other):
        folder = formats_dir / "openquake_event_based" / name
        sites = read_events(job_files(folder)).site_ids  # the same places in the same order
        blocks = table(np.tile([0.1, 0.15, 0.2], len(sites)), np.repeat(sites, 3), loss=1.0)
        answers.append(losses(folder, blocks, component="rotd50"))
    first, second = answers
    for value, values in (
        (lambda a: a.average_annual_failures, lambda a: a.failures),
        (lambda a: a.annual_rate_any, lambda a: a.any_fails[0]),
    ):
        error = math.hypot(first.error(values(first)), second.error(values(second)))
        assert abs(value(first) - value(second)) < 3.0 * error
    rows = [answer.as_dict()["blocks"] for answer in answers]
    for row, same in zip(*rows, strict=True):
        names = ("average_annual_failures", "average_annual_failures_error")
        (rate, error), (rate_too, error_too) = (
            [element[n] for n in names] for element in (row, same)
        )
        assert abs(rate - rate_too) < 3.0 * math.hypot(error, error_too)


def test_a_scenario_of_the_engine(formats_dir: Path) -> None:
    folder = formats_dir / "openquake_scenario"
    (path,) = folder.glob("gmf-data_*.csv")
    with path.open() as file:
        next(file)
        pgv = [
            float(row["gmv_PGV"]) for row in csv.DictReader(file) if row["custom_site_id"] == "0012"
        ]
    answer = answered(folder, table([0.4], "0012"), expected=True)
    assert len(pgv) == 200
    mean = probability(0.4, 0.01 * np.array(pgv)).mean()
    assert answer.as_dict()["expected_failures"] == pytest.approx(mean, rel=1e-7)
    assert answer.as_dict()["probability_any"] == pytest.approx(mean, rel=1e-7)


def test_kinds_and_their_options(job: Path) -> None:
    """Free-standing blocks with and without a stated restitution beside one that is backed."""
    values = (1.0, 3.0, 0.1, -0.1, -6.0)
    names = method_named("rocking").forms["pgv"].parameters
    free_standing = model_row(
        name="free", kind="rocking", method="rocking", term="pgv", dependence=None,
        coefficients=dict(zip(names, values, strict=True)),
        covariance=tuple(tuple(0.0 for _ in names) for _ in names), domain={},
    )  # fmt: skip
    with opened_database(job / "models.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, free_standing)
        save_model(connection, model_row(is_default=True))
    blocks = table([0.4, 0.4, 0.4], "0012", kind=np.array(["", "rocking", "rocking"], dtype=object))
    blocks["restitution"] = np.array([np.nan, 0.9, np.nan])
    answer = losses(job, blocks, component="single", expected=True, db=job / "models.db")
    kr, pgv = float(blocks["kr"][0]), np.array([0.6, 0.8, 0.9])
    weight = np.array([0.005, 0.005, 0.002])
    alone = [
        predict(
            p2=4.0, kr=kr, pgv_m_s=pgv, kind=kind, restitution=restitution, db=job / "models.db"
        )
        for kind, restitution in (("toppling", None), ("rocking", 0.9), ("rocking", None))
    ]
    rows = answer.as_dict()["blocks"]
    assert [row["average_annual_failures"] for row in rows] == pytest.approx(
        [float(weight @ item.probability) for item in alone]
    )
    assert rows[1]["average_annual_failures"] != rows[2]["average_annual_failures"]
    assert answer.as_dict()["kind"] == "toppling, rocking"
    assert any("blocks of several models is unknown" in text for text in answer.warnings)
