"""Limit states of a rock mass: shares of its blocks that fail, by the joint law."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import FragilityFunction
from rbfrag.exchange.nrml import nrml_text, read_nrml
from rbfrag.exchange.share_fragility import DRAWS, share_functions
from rbfrag.fragility.model import FragilityModel
from rbfrag.question.question import predict
from tests.fragility.conftest import model as model
from tests.fragility.conftest import model_row
from tests.fragility.conftest import row as row

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
    each = predict(p2[:, None], kr[:, None], pgv_m_s=X, model=model).probability
    mean = np.mean([function.at(X) for function in functions], axis=0)
    assert mean == pytest.approx(each.mean(axis=0), abs=SPREAD)


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
