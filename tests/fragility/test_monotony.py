"""P of every shipped model over its whole range of shaking, strength and displacement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.fit.completions import PERIOD_SETS_S, stored_inputs
from rbfrag.fragility.fit.data import KR
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import stored_rows
from rbfrag.fragility.prediction import answer_given
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2 as G
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.spectral import spectral_name

ROWS = stored_rows(REFERENCE)
N, STEPS = 400, 160
ROUNDING = 1e-12
FIXED = ("tm_s", "magnitude")
"""Measures that stay where a motion is scaled."""


@pytest.fixture(params=ROWS, ids=lambda row: row.name)
def model(request: pytest.FixtureRequest) -> FragilityModel:
    row: ModelRow = request.param
    return FragilityModel.from_row(row)


def given_sets(model: FragilityModel) -> list[tuple[str, ...]]:
    """Return the sets of measures that a model may be asked with."""
    if model.form.velocity is None:
        return [model.term.inputs]
    return [*stored_inputs(model.term, model.form.velocity)]


def questions(model: FragilityModel, names: Sequence[str], seed: int = 5) -> dict[str, FloatArray]:
    """Return blocks and motions of every sort, shape (n, 1)."""
    random = np.random.default_rng(seed)

    def between(low: float, high: float) -> NDArray[Any]:
        return np.exp(random.uniform(np.log(low), np.log(high), (N, 1)))

    pga = between(0.02, 2.0)
    period = between(0.1, 2.0)
    pgv = pga * G * period / (2.0 * np.pi) * between(0.6, 1.6)
    values = {
        "p2": between(0.1, 30.0), "ps2": between(0.1, 30.0), "pct2": between(0.1, 60.0),
        "displacement_m": between(0.01, 1.0),
        **dict.fromkeys(("kr", "ky", "ks", "kct"), between(*KR)),
        "pga_g": pga, "pgv_m_s": pgv, "tm_s": period, "magnitude": random.uniform(5.0, 8.0, (N, 1)),
        "pgd_m": pgv * period / 6.0 * between(1.2, 6.0), "xp_m_s": pgv * between(0.4, 1.6),
        "arias_m_s": pgv * pgv * between(2.0, 60.0),
    }  # fmt: skip
    for period_s in sorted({period_s for periods in PERIOD_SETS_S for period_s in periods}):
        shape = 2.5 / (1.0 + (period_s / period) ** 2) + 0.1
        values[spectral_name(period_s)] = pga * shape * between(0.5, 2.0)
    return {name: values[name] for name in (*model.method.block.names, *names)}


def p_of(model: FragilityModel, inputs: dict[str, FloatArray]) -> FloatArray:
    """Return P, shape (n, steps)."""
    arrays = dict(zip(inputs, np.broadcast_arrays(*inputs.values()), strict=True))
    shape = next(iter(arrays.values())).shape
    flat = {name: value.ravel() for name, value in arrays.items()}
    answer: Any = answer_given(model, flat, 0.95, interval=False)
    return np.asarray(answer.probability).reshape(shape)


def test_it_rises_with_all_measures_together(model: FragilityModel) -> None:
    factor = np.geomspace(1e-4, 100.0, STEPS)
    for names in given_sets(model):
        arguments = questions(model, names)
        for name in names:
            if name not in FIXED:
                arguments[name] = arguments[name] * factor ** (2.0 if name == "arias_m_s" else 1.0)
        p = p_of(model, arguments)
        assert np.diff(p, axis=1).min() >= -ROUNDING, names
        assert p[:, 0].max() < 1e-3
        assert np.median(p[:, -1]) > 0.7


def test_it_falls_with_strength(model: FragilityModel) -> None:
    for names in given_sets(model):
        inputs = questions(model, names)
        inputs[model.method.block.strength] = np.geomspace(*KR, STEPS)[None, :]
        assert np.diff(p_of(model, inputs), axis=1).max() <= ROUNDING, names


@pytest.mark.parametrize("name", [row.name for row in ROWS if row.kind == "sliding"])
def test_it_falls_with_displacement(name: str) -> None:
    model = FragilityModel.from_row(next(row for row in ROWS if row.name == name))
    inputs = questions(model, model.term.inputs)
    inputs["displacement_m"] = np.geomspace(1e-3, 10.0, STEPS)[None, :]
    assert np.diff(p_of(model, inputs), axis=1).max() <= ROUNDING
