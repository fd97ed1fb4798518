"""Blocks of a map that fail together: marginals, limits, and an independent way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards.maps.map_failures import (
    MapFailures,
    SiteLocations,
    map_failures,
)
from rbfrag.hazards.maps.site_probability import SiteProbability, site_probability
from rbfrag.hazards.standing_blocks import COPULA, DEPENDENT, INDEPENDENT
from rbfrag.question.components import component_named
from rbfrag.question.question import predict
from tests.hazards.conftest import measure_row

FloatArray = NDArray[np.float64]

LON, LAT = np.array([10.0, 10.1, 10.15, 10.4]), np.array([45.0, 45.0, 45.1, 45.05])
PLACES = SiteLocations.of(LON, LAT)
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


def which(found: MapFailures) -> NDArray[np.bool_]:
    """Return which of four blocks of weights 1, 2, 4 and 8 fail, shape (draws, 4)."""
    counts = found.drawn[COPULA].astype(np.int64)
    return np.asarray((counts[:, None] >> np.arange(4)) & 1 == 1)


BITS = np.array([1.0, 2.0, 4.0, 8.0])


@pytest.mark.parametrize("term", ["pgv", "pga_sa10"])
def test_each_block_fails_as_often_as_the_map_says(row: Row, term: str) -> None:
    if term == "pgv":
        answer = blocks_at_places(row())
    else:
        measures = {"pga_g": SHAKING["pga_g"], "sa10_g": np.array([0.5, 0.6, 0.7, 0.5])}
        answer = site_probability(
            measures, P2, KR, component=component_named("rotd50"), own_block=True,
            std_ln={"pga_g": STD["pga_g"], "sa10_g": STD["pgv_m_s"]},
            model=FragilityModel.from_row(measure_row(term, dependence=shares(0.1, 0.3, 0.2, 0.4))),
        )  # fmt: skip
    for seed in (0, 1):
        found = map_failures(
            answer, {"p2": P2, "kr": KR}, PLACES, weight=BITS, draws=60_000, seed=seed
        )
        p = answer.probability
        error = np.sqrt(p * (1.0 - p) / 60_000)
        assert (np.abs(which(found).mean(axis=0) - p) < 4.0 * error + 1e-4).all()
        assert found.expected == pytest.approx(float(BITS @ p), rel=1e-12)


def test_against_dense_matrices(row: Row) -> None:
    # every residual and Z from one covariance, without anything of the module but its formulas
    law, between = shares(0.3, 0.7), 0.4
    answer = blocks_at_places(row(dependence=law))
    draws = 40_000
    found = map_failures(
        answer, {"p2": P2, "kr": KR}, PLACES, weight=BITS, draws=draws, between=between
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
    own, other = which(found), fails
    for one, two in ((own.any(axis=1), other.any(axis=1)), (own.all(axis=1), other.all(axis=1))):
        error = np.sqrt((one.var() + two.var()) / draws)
        assert abs(one.mean() - two.mean()) < 4.0 * error
    pairs = np.cov(own.T) - np.cov(other.T)
    assert np.abs(pairs).max() < 4.0 * 0.5 / np.sqrt(draws)
    assert found.by_law[COPULA].probability_any == own.any(axis=1).mean()


def test_nothing_in_common_is_a_sum_of_independent_blocks(row: Row) -> None:
    answer = blocks_at_places(row(dependence=shares(0.0, 1.0)))
    found = map_failures(
        answer, {"p2": P2, "kr": KR}, PLACES, draws=40_000, between=0.0, range_km=1e-6, seed=3
    )
    p = answer.probability
    assert found.drawn[COPULA].mean() == pytest.approx(p.sum(), abs=4 * np.sqrt(p.sum() / 40_000))
    assert found.drawn[COPULA].var() == pytest.approx((p * (1.0 - p)).sum(), rel=0.03)
    assert found.by_law[COPULA].probability_any == pytest.approx(1.0 - (1.0 - p).prod(), abs=0.01)


def test_all_in_common_is_all_or_nothing(row: Row) -> None:
    model = FragilityModel.from_row(row(dependence=shares(1.0)))
    one = np.ones(4)
    answer = site_probability(
        {"pgv_m_s": 0.6 * one}, 3.0 * one, 0.1 * one, component=component_named("single"),
        own_block=True, std_ln={"pgv_m_s": 0.5 * one}, model=model,
    )  # fmt: skip
    found = map_failures(
        answer, {"p2": 3.0 * one, "kr": 0.1 * one}, PLACES, draws=20_000, between=1.0
    )
    assert set(found.drawn[COPULA].tolist()) == {0.0, 4.0}
    p = answer.probability[0]
    error = np.sqrt(p * (1.0 - p) / 20_000)
    assert found.by_law[COPULA].probability_any == pytest.approx(p, abs=4.0 * error)


def test_certain_shaking_leaves_the_blocks_own_dependence(row: Row) -> None:
    answer = blocks_at_places(row(dependence=shares(0.0, 1.0)), certain=True, meaning="single")
    found = map_failures(answer, {"p2": P2, "kr": KR}, PLACES, draws=40_000)
    p = answer.probability
    assert found.drawn[COPULA].var() == pytest.approx((p * (1.0 - p)).sum(), rel=0.03)
    assert found.range_km is None
    # of one site instead, however far apart
    together = SiteLocations.of(LON, LAT, np.array(["A"] * 4, dtype=object))
    found = map_failures(answer, {"p2": P2, "kr": KR}, together, draws=40_000)
    assert found.by_law[COPULA].probability_any == pytest.approx(p.max(), abs=0.01)


def test_places_within_a_hundred_metres_are_one_site() -> None:
    found = SiteLocations.of(np.array([10.0, 10.0002, 10.002]), np.array([45.0, 45.0001, 45.0]))
    assert found.group[0] == found.group[1] != found.group[2]


def test_without_an_estimate_there_are_bounds(row: Row) -> None:
    answer = blocks_at_places(row(dependence=None), certain=True, meaning="single")
    found = map_failures(answer, {"p2": P2, "kr": KR}, PLACES, draws=20_000)
    p = answer.probability
    assert found.by_law[DEPENDENT].probability_any == pytest.approx(p.max(), abs=0.015)
    assert found.by_law[INDEPENDENT].probability_any == pytest.approx(
        1.0 - (1.0 - p).prod(), abs=0.015
    )
    told = found.as_dict()
    assert told["probability_any"] is told["failures_p50"] is None
    assert told["joint_law"] == "bounds"
    assert "not known to this model" in found.warnings[-1]


def test_a_seed_repeats_and_another_differs(row: Row) -> None:
    answer = blocks_at_places(row())
    runs = [
        map_failures(answer, {"p2": P2, "kr": KR}, PLACES, weight=BITS, draws=500, seed=seed).drawn[
            COPULA
        ]
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
    found = map_failures(answer, {"p2": p2, "kr": kr}, PLACES, weight=weight, draws=20_000)
    assert found.expected == pytest.approx(4.0 * answer.probability.sum(), rel=1e-12)
    spread = found.drawn[COPULA].std() / np.sqrt(20_000)
    assert found.drawn[COPULA].mean() == pytest.approx(found.expected, abs=4.0 * spread)
    law = found.by_law[COPULA]
    assert law.p05 <= law.p50 <= law.p95 <= 16.0
    assert answer.probability.max() <= law.probability_any <= 1.0


def test_where_nothing_fails(row: Row) -> None:
    answer = site_probability(
        {"pgv_m_s": np.zeros(4)}, P2, KR, component=component_named("single"), own_block=True,
        model=FragilityModel.from_row(row()),
    )  # fmt: skip
    told = map_failures(answer, {"p2": P2, "kr": KR}, PLACES).as_dict()
    assert told["expected_failures"] == told["failures_p95"] == told["probability_any"] == 0.0


def test_rejections(row: Row) -> None:
    answer = blocks_at_places(row(), certain=True)
    with pytest.raises(InputError, match="draws = 3"):
        map_failures(answer, {"p2": P2, "kr": KR}, PLACES, draws=3)
    with pytest.raises(InputError, match="seed = -1"):
        map_failures(answer, {"p2": P2, "kr": KR}, PLACES, seed=-1)
    with pytest.raises(InputError, match="between = 2"):
        map_failures(answer, {"p2": P2, "kr": KR}, PLACES, between=2.0)
