"""Blocks of a map that fail together: marginals, limits, and an independent way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards.joint_rate import COPULA, DEPENDENT, INDEPENDENT
from rbfrag.hazards.map_failures import (
    EARTH_RADIUS_KM,
    MapFailures,
    SpatialField,
    correlation_range_km,
    group_sites,
    map_failures,
)
from rbfrag.hazards.map_probability import SiteProbability, site_probability
from rbfrag.question.components import component_named
from rbfrag.question.question import predict
from tests.hazards.conftest import measure_row

FloatArray = NDArray[np.float64]

LON, LAT = np.array([10.0, 10.1, 10.15, 10.4]), np.array([45.0, 45.0, 45.1, 45.05])
POSITIONS = LON, LAT
P2, KR = np.array([3.0, 3.0, 10.0, 1.0]), np.array([0.1, 0.1, 0.15, 0.08])
SHAKING = {"pgv_m_s": np.array([0.6, 0.5, 0.5, 0.8]), "pga_g": np.array([0.5, 0.4, 0.5, 0.4])}
STD = {"pgv_m_s": np.array([0.5, 0.4, 0.5, 0.6]), "pga_g": np.full(4, 0.5)}
LENGTHS = {"l_e": 1e9, "l_v": 1e9, "l_o": 1e9, "l_y": 1e9}
Row = Callable[..., ModelRow]


def shares(e: float, s: float = 0.0, v: float = 0.0, o: float = 0.0) -> dict[str, float]:
    return {"rho_e": e, "rho_s": s, "rho_v": v, "rho_o": o, **LENGTHS}


def blocks_at_places(
    row: ModelRow, *, certain: bool = False, meaning: str = "larger"
) -> SiteProbability:
    # certain values are stronger, lest nothing fails
    shaking = {name: (1.7 if certain else 1.0) * values for name, values in SHAKING.items()}
    return site_probability(
        shaking, P2, KR, component=component_named(meaning), own_block=True,
        std_ln=None if certain else STD, model=FragilityModel.from_row(row),
    )  # fmt: skip


def which(result: MapFailures) -> NDArray[np.bool_]:
    """Return which of four blocks of weights 1, 2, 4 and 8 fail, shape (draws, 4)."""
    counts = result.drawn[COPULA].astype(np.int64)
    return np.asarray((counts[:, None] >> np.arange(4)) & 1 == 1)


BITS = np.array([1.0, 2.0, 4.0, 8.0])


@pytest.mark.parametrize("term", ["pgv", "pga"])
def test_each_block_fails_as_often_as_the_map_says(row: Row, term: str) -> None:
    if term == "pgv":
        answer = blocks_at_places(row())
    else:
        measures = {"pga_g": SHAKING["pga_g"], "sa(1)": np.array([0.5, 0.6, 0.7, 0.5])}
        answer = site_probability(
            measures, P2, KR, component=component_named("rotd50"), own_block=True,
            std_ln={"pga_g": STD["pga_g"], "sa(1)": STD["pgv_m_s"]},
            model=FragilityModel.from_row(measure_row(term, dependence=shares(0.1, 0.3, 0.2, 0.4))),
        )  # fmt: skip
    for seed in (0, 1):
        result = map_failures(
            answer, {"p2": P2, "kr": KR}, *POSITIONS, weight=BITS, draws=60_000, seed=seed
        )
        p = answer.probability
        error = np.sqrt(p * (1.0 - p) / 60_000)
        # the spectral velocity of ordinates that scatter is taken as lognormal
        approximate = 0.08 * p if term == "pga" else 0.0
        assert (np.abs(which(result).mean(axis=0) - p) < 4.0 * error + 1e-4 + approximate).all()
        assert result.expected == pytest.approx(float(BITS @ p), rel=1e-12)


def test_against_dense_matrices(row: Row) -> None:
    # every residual and Z from one covariance, without anything of the module but its formulas
    law, between = shares(0.3, 0.7), 0.4
    answer = blocks_at_places(row(dependence=law))
    draws = 40_000
    result = map_failures(
        answer, {"p2": P2, "kr": KR}, *POSITIONS, weight=BITS, draws=draws, between=between
    )
    random = np.random.default_rng(9)
    x = np.radians(LON) * np.cos(np.radians(45.05)) * 6371.0
    y = np.radians(LAT) * 6371.0
    rho = np.exp(-3.0 / 25.7 * np.hypot(x[:, None] - x, y[:, None] - y))
    larger = component_named("larger")
    residual = np.outer(STD["pgv_m_s"], STD["pgv_m_s"]) * (between + (1.0 - between) * rho)
    residual += larger.sigma**2 * np.eye(4)
    ln_pgv = np.log(SHAKING["pgv_m_s"] / larger.ratio("pgv_m_s"))
    pgv = np.exp(random.multivariate_normal(ln_pgv, residual, draws))
    z = random.multivariate_normal(np.zeros(4), 0.3 + 0.7 * np.eye(4), draws)
    model = FragilityModel.from_row(row(dependence=law))
    fails = norm.cdf(z) <= predict(P2, KR, pgv_m_s=pgv, model=model).probability
    expected, other = which(result), fails
    for item, two in (
        (expected.any(axis=1), other.any(axis=1)),
        (expected.all(axis=1), other.all(axis=1)),
    ):
        error = np.sqrt((item.var() + two.var()) / draws)
        assert abs(item.mean() - two.mean()) < 4.0 * error
    pairs = np.cov(expected.T) - np.cov(other.T)
    assert np.abs(pairs).max() < 4.0 * 0.5 / np.sqrt(draws)
    assert result.by_law[COPULA]["probability_any"] == expected.any(axis=1).mean()


def test_nothing_in_common_is_a_sum_of_independent_blocks(row: Row) -> None:
    answer = blocks_at_places(row(dependence=shares(0.0, 1.0)))
    result = map_failures(
        answer, {"p2": P2, "kr": KR}, *POSITIONS, draws=40_000, between=0.0, range_km=1e-6, seed=3
    )
    p = answer.probability
    assert result.drawn[COPULA].mean() == pytest.approx(p.sum(), abs=4 * np.sqrt(p.sum() / 40_000))
    assert result.drawn[COPULA].var() == pytest.approx((p * (1.0 - p)).sum(), rel=0.03)
    assert result.by_law[COPULA]["probability_any"] == pytest.approx(
        1.0 - (1.0 - p).prod(), abs=0.01
    )


def test_all_in_common_is_all_or_nothing(row: Row) -> None:
    model = FragilityModel.from_row(row(dependence=shares(1.0)))
    single = np.ones(4)
    answer = site_probability(
        {"pgv_m_s": 0.6 * single}, 3.0 * single, 0.1 * single, component=component_named("single"),
        own_block=True, std_ln={"pgv_m_s": 0.5 * single}, model=model,
    )  # fmt: skip
    result = map_failures(
        answer, {"p2": 3.0 * single, "kr": 0.1 * single}, *POSITIONS, draws=20_000, between=1.0
    )
    assert set(result.drawn[COPULA].tolist()) == {0.0, 4.0}
    p = answer.probability[0]
    error = np.sqrt(p * (1.0 - p) / 20_000)
    assert result.by_law[COPULA]["probability_any"] == pytest.approx(p, abs=4.0 * error)


def test_certain_shaking_leaves_the_blocks_own_dependence(row: Row) -> None:
    answer = blocks_at_places(row(dependence=shares(0.0, 1.0)), certain=True, meaning="single")
    result = map_failures(answer, {"p2": P2, "kr": KR}, *POSITIONS, draws=40_000)
    p = answer.probability
    assert result.drawn[COPULA].var() == pytest.approx((p * (1.0 - p)).sum(), rel=0.03)
    assert result.range_km is None
    # of one site instead, however far apart
    together = np.array(["A"] * 4, dtype=object)
    result = map_failures(
        answer, {"p2": P2, "kr": KR}, *POSITIONS, site_names=together, draws=40_000
    )
    assert result.by_law[COPULA]["probability_any"] == pytest.approx(p.max(), abs=0.01)


def test_places_within_a_hundred_metres_are_one_site() -> None:
    result = group_sites(np.array([10.0, 10.0002, 10.002]), np.array([45.0, 45.0001, 45.0]))
    assert result[0] == result[1] != result[2]


def test_without_an_estimate_there_are_bounds(row: Row) -> None:
    answer = blocks_at_places(row(dependence=None), certain=True, meaning="single")
    result = map_failures(answer, {"p2": P2, "kr": KR}, *POSITIONS, draws=20_000)
    p = answer.probability
    assert result.by_law[DEPENDENT]["probability_any"] == pytest.approx(p.max(), abs=0.015)
    assert result.by_law[INDEPENDENT]["probability_any"] == pytest.approx(
        1.0 - (1.0 - p).prod(), abs=0.015
    )
    document = result.as_dict()
    assert document["probability_any"] is document["failures_p50"] is None
    assert document["joint_law"] == "bounds"
    assert "not known to this model" in result.warnings[-1]


def test_a_seed_repeats_and_another_differs(row: Row) -> None:
    answer = blocks_at_places(row())
    runs = [
        map_failures(
            answer, {"p2": P2, "kr": KR}, *POSITIONS, weight=BITS, draws=500, seed=seed
        ).drawn[COPULA]
        for seed in (4, 4, 5)
    ]
    assert (runs[0] == runs[1]).all()
    assert (runs[0] != runs[2]).any()


def test_a_class_at_every_node_counts_its_weights(row: Row) -> None:
    p2, kr, weight = np.array([3.0, 10.0]), np.array([0.1, 0.2]), np.array([3.0, 1.0])
    answer = site_probability(
        SHAKING, p2, kr, component=component_named("rotd50"), weight=weight, std_ln=STD,
        model=FragilityModel.from_row(row()),
    )  # fmt: skip
    result = map_failures(answer, {"p2": p2, "kr": kr}, *POSITIONS, weight=weight, draws=20_000)
    assert result.expected == pytest.approx(4.0 * answer.probability.sum(), rel=1e-12)
    spread = result.drawn[COPULA].std() / np.sqrt(20_000)
    assert result.drawn[COPULA].mean() == pytest.approx(result.expected, abs=4.0 * spread)
    law = result.by_law[COPULA]
    quantiles = [law[f"failures_p{q}"] for q in ("05", "50", "95")]
    assert quantiles == sorted(quantiles)
    assert quantiles[-1] <= 16.0
    assert answer.probability.max() <= law["probability_any"] <= 1.0


def test_where_nothing_fails(row: Row) -> None:
    answer = site_probability(
        {"pgv_m_s": np.zeros(4)}, P2, KR, component=component_named("single"), own_block=True,
        model=FragilityModel.from_row(row()),
    )  # fmt: skip
    document = map_failures(answer, {"p2": P2, "kr": KR}, *POSITIONS).as_dict()
    assert (
        document["expected_failures"]
        == document["failures_p95"]
        == document["probability_any"]
        == 0.0
    )


def test_rejections(row: Row) -> None:
    answer = blocks_at_places(row(), certain=True)
    with pytest.raises(InputError, match="draws = 3"):
        map_failures(answer, {"p2": P2, "kr": KR}, *POSITIONS, draws=3)
    with pytest.raises(InputError, match="seed = -1"):
        map_failures(answer, {"p2": P2, "kr": KR}, *POSITIONS, seed=-1)
    with pytest.raises(InputError, match="between = 2"):
        map_failures(answer, {"p2": P2, "kr": KR}, *POSITIONS, between=2.0)


class _Unit:
    """In place of random numbers: each place's own noise once, so that fields are L itself."""

    def standard_normal(self, shape: tuple[int, int]) -> FloatArray:
        return np.eye(*shape)


def covariance(field: SpatialField, positions: int) -> FloatArray:
    factor = field.draw(positions, cast("Any", _Unit()))
    return factor @ factor.T


def distances_km(lon: FloatArray, lat: FloatArray) -> FloatArray:
    """By the haversine formula."""
    x, y = np.radians(lon), np.radians(lat)
    half = np.sin(0.5 * (y[:, None] - y)) ** 2
    half += np.cos(y[:, None]) * np.cos(y) * np.sin(0.5 * (x[:, None] - x)) ** 2
    return 2.0 * EARTH_RADIUS_KM * np.arcsin(np.sqrt(half))


def grid(rows: int, columns: int, step_deg: float) -> tuple[FloatArray, FloatArray]:
    lat, lon = np.meshgrid(
        38.0 - step_deg * np.arange(rows), -122.0 + step_deg * np.arange(columns), indexing="ij"
    )
    return lon.ravel(), lat.ravel()


def test_few_places_are_exact() -> None:
    random = np.random.default_rng(3)
    lon, lat = 10.0 + random.uniform(0, 1, 41), 60.0 + random.uniform(0, 0.5, 41)
    expected = np.exp(-3.0 / 20.0 * distances_km(lon, lat))
    assert covariance(SpatialField(lon, lat, 20.0), 41) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("range_km", [8.5, 25.7, 60.0])
def test_many_places_are_nearly_so(range_km: float) -> None:
    lon, lat = grid(30, 30, 0.025)
    result = covariance(SpatialField(lon, lat, range_km), lon.size)
    error = result - np.exp(-3.0 / range_km * distances_km(lon, lat))
    assert np.abs(error).max() < 0.015
    assert np.sqrt((error**2).mean()) < 0.002
    assert np.abs(np.diag(error)).max() < 0.002


def test_the_semivariogram_of_draws_is_that_of_the_model() -> None:
    rows, columns, count = 24, 32, 2000
    lon, lat = grid(rows, columns, 0.025)
    field = SpatialField(lon, lat, 25.7).draw(count, np.random.default_rng(5))
    apart = distances_km(lon, lat).reshape(rows, columns, rows, columns)
    values = field.reshape(rows, columns, count)
    for lag in (1, 2, 5, 10, 20):
        half = 0.5 * (values[lag:] - values[:-lag]) ** 2
        separate = half.mean(axis=(0, 1))
        h = np.mean([apart[i, 0, i + lag, 0] for i in range(rows - lag)])
        error = separate.std() / np.sqrt(count)
        assert separate.mean() == pytest.approx(
            1.0 - np.exp(-3.0 * h / 25.7), abs=4.0 * error + 0.002
        )


def test_no_correlation_full_correlation_and_equal_places() -> None:
    lon, lat = grid(10, 10, 0.02)
    random = np.random.default_rng(1)
    apart = SpatialField(lon, lat, 1e-6).draw(20_000, random)
    assert np.abs(np.corrcoef(apart[:20]) - np.eye(20)).max() < 4.5 / np.sqrt(20_000)
    same = SpatialField(lon, lat, 1e9).draw(50, random)
    assert np.ptp(same, axis=0).max() < 1e-2
    twice = SpatialField(np.array([1.0, 2.0, 1.0]), np.zeros(3), 20.0).draw(5, random)
    assert (twice[0] == twice[2]).all()
    assert (twice[0] != twice[1]).all()


def test_ranges_of_jayaram_and_baker_2009() -> None:
    assert correlation_range_km("pgv_m_s") == correlation_range_km("sa(1)") == 25.7
    assert correlation_range_km("pga_g") == 8.5
    assert correlation_range_km("sa(0.3)") == pytest.approx(13.66)
    assert correlation_range_km("sa(3)") == pytest.approx(33.1)
