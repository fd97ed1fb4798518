"""Levels of exported functions: what other tools read off them is what `predict` answers."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom, norm

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models
from rbfrag.errors import InputError
from rbfrag.exchange.block_fragility import DRAWS, FLOOR, TOP, block_functions, share_functions
from rbfrag.exchange.fragility_function import FragilityFunction, chords, renamed
from rbfrag.exchange.nrml import nrml_text, read_nrml
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.model import FragilityModel
from rbfrag.question.components import COMPONENTS, Component
from rbfrag.question.question import predict
from tests.fragility.conftest import model as model
from tests.fragility.conftest import model_row
from tests.fragility.conftest import row as row

ALLOWED = 0.01
NODES, WEIGHTS = np.polynomial.legendre.leggauss(300)
RANDOM = np.random.default_rng(8)
NUMBERS: dict[str, Any] = {
    "p2": 10.0 ** RANDOM.uniform(-0.5, 1.3, 40),
    "kr": 10.0 ** RANDOM.uniform(-1.5, -0.5, 40),
    "ky": 10.0 ** RANDOM.uniform(-1.5, -0.5, 40),
    "beta_deg": RANDOM.uniform(0.0, 30.0, 40),
    "displacement_m": 10.0 ** RANDOM.uniform(-2.0, 0.0, 40),
}
"""Blocks as any model of one measure reads them, but such as credible shaking fails."""
EXPORTED = [
    (row, inputs[0])
    for row in read_models(REFERENCE)
    if (inputs := TERMS[row.term].inputs or ("sa(1)",)) in (("pgv_m_s",), ("sa(1)",), ("pga_g",))
]


def numbers_of(model: FragilityModel) -> dict[str, Any]:
    return {name: NUMBERS[name] for name in model.method.block.names if name in NUMBERS}


def functions_of(model: FragilityModel, measure: str, **how: Any) -> list[FragilityFunction]:
    names = [f"b{i}" for i in range(40)]
    numbers = numbers_of(model)
    return block_functions(names, numbers, measure, model.row.kind, model=model, **how).functions


def probability(model: FragilityModel, i: int, measure: str, x: Any) -> Any:
    block = {name: values[i] for name, values in numbers_of(model).items()}
    return rbfrag.predict(
        **block, kind=model.row.kind, model=model, interval=False, **{measure: x}
    ).probability


def relative_error(function: FragilityFunction, x: Any, p: Any) -> float:
    seen = p > FLOOR
    return float(np.abs(function.at(x[seen]) / p[seen] - 1.0).max())


@pytest.mark.parametrize(("row", "measure"), EXPORTED, ids=[row.name for row, _ in EXPORTED])
def test_chords_of_every_model_stay_within_one_percent(row: Any, measure: str) -> None:
    model = FragilityModel.from_row(row)
    for i, function in enumerate(functions_of(model, measure)):
        if function.levels is None:  # lognormal
            x = np.geomspace(0.01, TOP[measure], 300)
            assert relative_error(function, x, probability(model, i, measure, x)) < 1e-6
            continue
        assert function.levels.size <= 80
        x = np.geomspace(function.levels[1], min(function.levels[-1], TOP[measure]), 3000)
        error = relative_error(function, x, probability(model, i, measure, x))
        assert error < ALLOWED
        assert function.grid_error is not None
        assert error < 1.2 * function.grid_error + 2e-4  # what is told of them


@pytest.mark.parametrize(("row", "measure"), EXPORTED, ids=[row.name for row, _ in EXPORTED])
@pytest.mark.parametrize("meaning", [COMPONENTS["rotd50"], COMPONENTS["larger"]])
def test_so_do_those_of_another_component(row: Any, measure: str, meaning: Component) -> None:
    model = FragilityModel.from_row(row)
    for i, function in enumerate(functions_of(model, measure, component=meaning.name)[:10]):
        x = np.geomspace(0.01, TOP[measure], 40)
        if function.levels is not None:
            x = np.geomspace(function.levels[1], function.levels[-1], 40)[:-1]
        # Gauss's points on both sides of where PGA lifts the block
        lifts = np.log(NUMBERS["kr"][i] * meaning.ratio(measure) / x) / meaning.sigma
        ends = [np.full(x.size, -8.0), np.clip(lifts, -8.0, 8.0), np.full(x.size, 8.0)]
        smoothed = np.zeros(x.size)
        for low, high in pairwise(ends):
            half = 0.5 * (high - low)[:, None]
            xi = low[:, None] + half * (1.0 + NODES)
            p = probability(
                model, i, measure, x[:, None] / meaning.ratio(measure) * np.exp(meaning.sigma * xi)
            )
            smoothed += (half * WEIGHTS * norm.pdf(xi) * p).sum(axis=1)
        assert relative_error(function, x, smoothed) < ALLOWED


@pytest.mark.parametrize("meaning", COMPONENTS.values(), ids=list(COMPONENTS))
def test_a_lognormal_function_stays_one(meaning: Component) -> None:
    row = model_row(
        "pgv", name="lognormal-pgv", method="lognormal",
        coefficients={"ln_median": -0.41, "slope": 0.95, "ln_sigma": -1.25},
        covariance=tuple(tuple(1e-3 * (i == j) for j in range(3)) for i in range(3)),
    )  # fmt: skip
    model = FragilityModel.from_row(row)
    single, other = (
        functions_of(model, "pgv_m_s", component=name)[0] for name in ("single", meaning.name)
    )
    assert single.median is not None
    assert single.beta is not None
    assert other.median == pytest.approx(single.median * meaning.ratio("pgv_m_s"), rel=1e-6)
    assert other.beta == pytest.approx(np.hypot(single.beta, meaning.sigma), rel=1e-6)


def pga_model() -> FragilityModel:
    """Return a model whose P is far from 0 just above k_r, where the ground begins to lift."""
    row = next(row for row, _ in EXPORTED if row.name == "toppling-pga")
    return FragilityModel.from_row(
        replace(row, coefficients={**row.coefficients, "b_ln_1_minus_r": 0.0})
    )


def test_a_pair_of_levels_shows_where_the_ground_begins_to_lift() -> None:
    # flat in k_r/PGA: P is far from 0 as soon as PGA exceeds k_r
    p2, kr = np.array([60.0]), np.array([0.3])
    model = pga_model()
    (function,) = block_functions(["b"], {"p2": p2, "kr": kr}, "pga_g", model=model).functions
    assert function.levels is not None
    assert function.probability is not None
    assert function.levels[:2] == pytest.approx([0.3 * (1.0 - 1e-5), 0.3], rel=1e-9)
    jump = rbfrag.predict(60.0, 0.3, pga_g=0.3 * (1.0 + 1e-9), model=model).probability
    assert jump > 3.0 * FLOOR
    assert function.probability[:2] == pytest.approx([0.0, jump], rel=1e-5)
    assert function.at([0.1, 0.299]).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("component", ["single", "rotd50"])
def test_the_mean_of_blocks_is_that_of_their_functions(component: str) -> None:
    row = next(row for row, _ in EXPORTED if row.name == "toppling-pga")
    model, few = FragilityModel.from_row(row), slice(0, 5)
    numbers = {"p2": np.full(5, 50.0), "kr": np.linspace(0.1, 0.3, 5)}
    separate = block_functions(
        list("abcde"), numbers, "pga_g", model=model, component=component, levels=400
    ).functions
    (mean,) = block_functions(
        ["class"], numbers, "pga_g", model=model, component=component, one_class=True
    ).functions
    assert mean.levels is not None
    x = np.geomspace(mean.levels[1], 5.0, 2000)
    near = np.abs(x[:, None] / numbers["kr"][few] - 1.0).min(axis=1) < 1e-4
    p = np.mean([function.at(x) for function in separate], axis=0)
    assert relative_error(mean, x[~near], p[~near]) < ALLOWED


def test_the_fewest_chords_of_a_parabola() -> None:
    # a chord of x² over h is off by h²/4: n equal chords of 0 to 1 by 1/(4 n²)
    x = np.linspace(0.0, 1.0, 4001)[None]
    ((levels, probability, error),) = chords(1.0 + x, x[:, None] ** 2, 42, 1.0)
    assert error == pytest.approx(1.0 / (4.0 * 40**2), rel=0.02)
    assert levels.size == 42
    middle = 0.5 * (levels[1:-1] + levels[2:])
    straight = 0.5 * (probability[0, 1:-1] + probability[0, 2:])
    assert np.abs(straight - (middle - 1.0) ** 2).max() <= error * (1.0 + 1e-9)


def test_a_block_that_credible_shaking_does_not_fail_has_none() -> None:
    numbers = {"p2": np.array([3.0, 0.1]), "kr": np.array([0.1, 3.0])}
    with pytest.raises(InputError, match=r"1 of 2 blocks, first 'b', have no fragility"):
        block_functions(["a", "b"], numbers, "pgv_m_s")
    with pytest.raises(
        InputError, match=("levels = 9: a discrete fragility function requires at least 10")
    ):
        block_functions(["a"], {"p2": np.array([3.0]), "kr": np.array([0.1])}, "pgv_m_s", levels=9)


def test_names_that_a_tool_rejects_are_written_otherwise() -> None:
    kind = functions_of(pga_model(), "pga_g")[0].kind
    functions = [FragilityFunction(name, "toppled", kind) for name in ("a#1", "b", "c'd\"")]
    named, (warning,) = renamed(functions, "#'\"", "_", "the engine rejects")
    assert [item.name for item in named] == ["a_1", "b", "c_d_"]
    assert "2 of 3 IDs" in warning
    assert "'a#1' is written as 'a_1'" in warning


X = np.linspace(0.3, 1.4, 40)
SPREAD = 4.0 * 0.5 / np.sqrt(DRAWS)
LENGTHS = {"l_e": 1.0, "l_v": 1.0, "l_o": 1.0, "l_y": 0.5}


def of(model: object, p2: object, kr: object, shares: list[float]) -> list[FragilityFunction]:
    return share_functions("m", np.asarray(p2, float), np.asarray(kr, float), "pgv_m_s", shares,
                           levels=400, model=model).functions  # type: ignore[arg-type]  # fmt: skip


def test_shares_add_up_to_the_mean(model: FragilityModel) -> None:
    random = np.random.default_rng(2)
    p2, kr = 10.0 ** random.uniform(0.0, 1.0, 20), random.uniform(0.06, 0.2, 20)
    functions = of(model, p2, kr, [5.0 * k for k in range(1, 21)])
    separate = predict(p2[:, None], kr[:, None], pgv_m_s=X, model=model).probability
    mean = np.mean([function.at(X) for function in functions], axis=0)
    assert mean == pytest.approx(separate.mean(axis=0), abs=SPREAD)


def test_limit_states_rise_and_do_not_cross(model: FragilityModel, tmp_path: Path) -> None:
    p2, kr = np.full(150, 3.0), np.linspace(0.06, 0.2, 150)
    functions = of(model, p2, kr, [1.0, 10.0, 50.0])
    path = tmp_path / "a.xml"
    path.write_text(nrml_text(functions))
    back = read_nrml(path)
    assert [f.limit_state for f in back] == [f"failed_{s}_percent" for s in (1, 10, 50)]
    values = np.array([f.at(np.geomspace(0.05, 5.0, 300)) for f in back])
    assert (np.diff(values, axis=1) >= 0.0).all()
    assert (np.diff(values, axis=0) <= 0.0).all()
    assert values[0].max() - values[2].max() < 0.05
    assert (values[0] - values[2]).max() > 0.2


def test_equal_blocks_fail_together(model: FragilityModel) -> None:
    functions = of(model, np.full(30, 3.0), np.full(30, 0.1), [1.0, 50.0, 100.0])
    p = predict(3.0, 0.1, pgv_m_s=X, model=model).probability
    for function in functions:
        assert function.at(X) == pytest.approx(p, abs=SPREAD + 0.003)


def test_blocks_that_share_nothing_are_counted_by_the_binomial_law() -> None:
    law = {"rho_e": 0.0, "rho_s": 0.0, "rho_v": 1.0, "rho_o": 0.0, **LENGTHS, "l_y": 1e-9}
    model = FragilityModel.from_row(model_row(dependence=law))
    kr = 0.1 * (1.0 + 1e-6 * np.arange(20))
    functions = of(model, np.full(20, 3.0), kr, [5.0, 25.0])
    p = predict(3.0, 0.1, pgv_m_s=X, model=model).probability
    assert functions[0].at(X) == pytest.approx(binom.sf(0, 20, p), abs=SPREAD + 0.003)
    assert functions[1].at(X) == pytest.approx(binom.sf(4, 20, p), abs=SPREAD + 0.003)


@pytest.mark.parametrize("shares", [[], [0.0], [10.0, 5.0], [101.0], [5.0, 5.0]])
def test_shares_that_are_rejected(model: FragilityModel, shares: list[float]) -> None:
    with pytest.raises(InputError, match="increasing percentages"):
        of(model, [3.0], [0.1], shares)


def test_without_the_dependence_nothing_is_known() -> None:
    model = FragilityModel.from_row(model_row(dependence=None))
    with pytest.raises(InputError, match="has no dependence model"):
        of(model, [3.0, 4.0], [0.1, 0.1], [50.0])


def test_a_share_of_less_than_one_block_is_said(model: FragilityModel) -> None:
    warnings = share_functions(
        "m", np.full(30, 3.0), np.full(30, 0.1), "pgv_m_s", [1.0], model=model
    ).warnings
    assert "1 % of 30 blocks is less than one" in warnings[-1]
