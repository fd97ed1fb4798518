"""P of every shipped model over its whole range of shaking, strength and displacement."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.fit.data import KR
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import stored_rows
from rbfrag.fragility.prediction import answer_given
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2 as G
from rbfrag.solver.results import FloatArray

ROWS = stored_rows(REFERENCE)
N, STEPS = 400, 160
ROUNDING = 1e-12
FIXED = ("tm_s", "magnitude")
"""Measures that stay where a motion is scaled."""


@pytest.fixture(params=ROWS, ids=lambda row: row.name)
def model(request: pytest.FixtureRequest) -> FragilityModel:
    row: ModelRow = request.param
    return FragilityModel.from_row(row)


def questions(model: FragilityModel, seed: int = 5) -> dict[str, FloatArray]:
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
        "sa03_g": pga * between(0.5, 4.0), "sa10_g": pga * between(0.1, 3.0),
        "sa30_g": pga * between(0.02, 1.0),
    }  # fmt: skip
    return {name: values[name] for name in (*model.method.block.names, *model.term.inputs)}


def p_of(model: FragilityModel, inputs: dict[str, FloatArray]) -> FloatArray:
    """Return P, shape (n, steps)."""
    arrays = dict(zip(inputs, np.broadcast_arrays(*inputs.values()), strict=True))
    shape = next(iter(arrays.values())).shape
    flat = {name: value.ravel() for name, value in arrays.items()}
    answer: Any = answer_given(model, flat, 0.95, interval=False)
    return np.asarray(answer.probability).reshape(shape)


def test_it_rises_with_all_measures_together(model: FragilityModel) -> None:
    arguments = questions(model)
    factor = np.geomspace(1e-4, 100.0, STEPS)
    for name in model.term.inputs:
        if name not in FIXED:
            arguments[name] = arguments[name] * factor ** (2.0 if name == "arias_m_s" else 1.0)
    p = p_of(model, arguments)
    assert np.diff(p, axis=1).min() >= -ROUNDING
    assert p[:, 0].max() < 1e-3
    assert np.median(p[:, -1]) > 0.7


def test_it_falls_with_strength(model: FragilityModel) -> None:
    inputs = questions(model)
    name = model.method.block.strength
    inputs[name] = np.geomspace(*KR, STEPS)[None, :]
    assert np.diff(p_of(model, inputs), axis=1).max() <= ROUNDING


@pytest.mark.parametrize("name", [row.name for row in ROWS if row.kind == "sliding"])
def test_it_falls_with_displacement(name: str) -> None:
    model = FragilityModel.from_row(next(row for row in ROWS if row.name == name))
    inputs = questions(model)
    inputs["displacement_m"] = np.geomspace(1e-3, 10.0, STEPS)[None, :]
    assert np.diff(p_of(model, inputs), axis=1).max() <= ROUNDING
