"""The copula estimated from outcomes."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from rbfrag.errors import FitError, InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.fit import dependence as dependence_fit
from rbfrag.fragility.fit.dependence import PairTables, estimate_dependence
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler
from tests.fragility.portfolio_draws import bivariate_normal

TRUE = Dependence(0.15, 0.20, 0.25, 0.40, 1.5, 1.5, 3.0, 0.5)


def simulated(earthquakes: int, sites: int = 2, seed: int = 0) -> dict[str, Any]:
    """Draw outcomes of blocks of four strengths and three sizes on both sides of each component."""
    random = np.random.default_rng(seed)
    axes = (np.arange(earthquakes), np.arange(sites), (0, 1), (-1, 1), (0.1, 1.0, 10.0), range(4))
    event, site, component, polarity, p2, step = (
        part.ravel() for part in np.meshgrid(*axes, indexing="ij")
    )
    y = np.exp(0.35 * (step - 1.5))
    blocks = Placement.of(
        0.5 * np.log(p2), np.log(y), earthquake=event, site=site, component=component,
        polarity=polarity,
    )  # fmt: skip
    p = ndtr(-1.2 * np.log(y))
    z = JointSampler(TRUE, blocks).normals(1, random)[0]
    return {
        "probability": p, "failed": (z <= ndtri(p)).astype(float), "earthquake": event,
        "site": site, "component": component, "polarity": polarity, "p2": p2, "y_m_s": y,
    }  # fmt: skip


@pytest.fixture(scope="module")
def columns() -> dict[str, Any]:
    return simulated(100)


def test_known_parameters_are_found_again(columns: dict[str, Any]) -> None:
    result = estimate_dependence(**columns, replicates=12)
    assert (result["earthquakes"], result["replicates"], result["seed"]) == (100, 12, 0)
    for name, true in asdict(TRUE).items():
        if name.startswith("rho"):
            assert result[name] == pytest.approx(true, abs=0.1)
            assert 0.005 < result["errors"][name] < 0.1
            assert abs(result[name] - true) < 4.0 * result["errors"][name]
    assert result["l_y"] == pytest.approx(0.5, rel=0.3)


def test_blocks_run_in_one_polarity_do_not_know_the_side_they_face(columns: dict[str, Any]) -> None:
    one_side = columns["polarity"] > 0
    part = {name: value[one_side] for name, value in columns.items()}
    result = PairTables.of(**part).likeliest()
    assert result.rho_o == 0.0
    assert result.rho_e == pytest.approx(TRUE.rho_e, abs=0.1)
    assert result.rho_v == pytest.approx(TRUE.rho_v + TRUE.rho_o, abs=0.15)


def test_a_seed_gives_the_same_estimate(
    columns: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dependence_fit, "MOST_PAIRS", 500)
    single, same, other = (
        estimate_dependence(**columns, replicates=2, seed=seed) for seed in (1, 1, 2)
    )
    assert single == same
    assert all(single[name] != other[name] for name in ("rho_e", "l_e"))


def test_labels_and_order_do_not_matter(columns: dict[str, Any]) -> None:
    subset = columns["earthquake"] < 15
    part = {name: value[subset] for name, value in columns.items()}
    order = np.random.default_rng(0).permutation(int(subset.sum()))
    mixed = {name: value[order] for name, value in part.items()}
    mixed["earthquake"] = np.array([f"event {single:03}" for single in mixed["earthquake"]])
    single, other = (PairTables.of(**subset).likeliest() for subset in (part, mixed))
    for name, value in asdict(single).items():
        assert getattr(other, name) == pytest.approx(value, rel=1e-3)


def test_earthquakes_that_do_not_count_are_left_out(columns: dict[str, Any]) -> None:
    times = (np.arange(100) < 30).astype(float)
    tables = PairTables.of(**columns)
    names = tables.earthquakes.astype(int)
    without = tables.likeliest(times[names])
    subset = columns["earthquake"] < 30
    alone = PairTables.of(**{name: value[subset] for name, value in columns.items()}).likeliest()
    for name, value in asdict(alone).items():
        assert getattr(without, name) == pytest.approx(value, rel=1e-3)


def test_likelihood_of_a_pair_is_the_copula_s() -> None:
    # one pair: its table holds the logarithm of the chance of what both did
    bound = np.array([0.3, -0.6])
    for side in ([1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]):
        zero = np.zeros(2, dtype=np.intp)
        rows = dependence_fit.PairRows(
            bound, np.array(side), zero, zero, zero, np.ones(2), np.zeros(2), np.zeros(2)
        )
        table = dependence_fit._log_likelihoods(rows, zero[:1], zero[:1] + 1)[:, 0]
        r = np.sin(dependence_fit.ANGLES)
        a, b = np.array(side) * bound
        np.testing.assert_allclose(
            np.exp(table), bivariate_normal(a, b, side[0] * side[1] * r), atol=1e-5
        )


def test_many_cells_are_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(0)
    d_l, d_y = random.uniform(0, 3, 20_000), random.uniform(0, 4, 20_000)
    cell, count = dependence_fit._cells(d_l, d_y, random.choice((-1.0, 1.0), 20_000))
    assert count <= dependence_fit._MOST_CELLS
    spread = [np.ptp(d_l[cell == item]) for item in range(0, count, 50)]
    assert max(spread) < 0.5


def test_too_little_is_rejected(columns: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="differ in length"):
        estimate_dependence(**{**columns, "p2": [1.0]})
    few = columns["earthquake"] < 5
    with pytest.raises(FitError, match=r"in 10 earthquakes: there are \d+ in 5"):
        estimate_dependence(**{name: value[few] for name, value in columns.items()})
    one_site = columns["site"] == 0
    with pytest.raises(FitError, match="other sites in 10 earthquakes: there are 0 in 0"):
        estimate_dependence(**{name: value[one_site] for name, value in columns.items()})
    with pytest.raises(FitError, match="there are 0 in 0"):
        estimate_dependence(**{**columns, "failed": np.full(columns["p2"].size, np.nan)})
