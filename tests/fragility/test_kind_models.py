"""Models of blocks that slide or slump: formulas, fits, answers."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.db.engine import opened_database
from rbfrag.errors import FitError, InputError
from rbfrag.fragility.fit.kind_data import LEAST_DISPLACEMENT_M, KindData
from rbfrag.fragility.fit.kind_fitting import (
    ARRAYS,
    STARTS,
    fit_kind,
    fit_kind_data,
    maximum_likelihood,
)
from rbfrag.fragility.kind_formulas import FORMULAS
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

TRUE = {
    ("sliding", "pgv_pga"): (0.3, 0.8, 3.5, -0.6, 1.0),
    ("slumping", "pgv_pga"): (-0.2, 0.9, -0.9),
    ("slumping", "pgv"): (0.3, 0.9, -0.9),
}


def drawn(kind: str, term: str, n: int = 4000, seed: int = 1) -> KindData:
    """Rows that follow a formula exactly, some of them censored."""
    rng = np.random.default_rng(seed)
    event = np.sort(rng.integers(0, 20, n))
    pulse = np.exp(rng.normal(-2.5, 0.5, n))
    z = rng.standard_normal(n)
    values: dict[str, NDArray[np.float64]]
    if kind == "sliding":
        pga = np.exp(rng.normal(-1.5, 0.6, n))
        values = {
            "ky": pga * rng.uniform(0.05, 0.95, n),
            "pga_g": pga,
            "pgv_m_s": pulse * pga * STANDARD_GRAVITY_M_S2,
            "displacement_m": np.ones(n),
        }
        unit = FORMULAS[kind, term].eta(TRUE[kind, term], values, ARRAYS)
        sigma = np.exp(unit.log_sigma)
        slid = np.exp((unit.eta + z) * sigma)
        found = slid >= LEAST_DISPLACEMENT_M
        values["displacement_m"] = np.maximum(slid, LEAST_DISPLACEMENT_M)
    else:
        c, b, s0 = TRUE[kind, term]
        ks, ps2 = np.exp(rng.normal(-1.5, 0.4, n)), np.exp(rng.normal(1.0, 0.8, n))
        if term == "pgv_pga":
            excess = np.exp(c - b * np.log(np.sqrt(ps2) * pulse) + math.exp(s0) * z)
            pga = ks * (1.0 + excess)
        else:
            y = ks * STANDARD_GRAVITY_M_S2 / np.sqrt(ps2)
            pgv = np.exp(c + b * np.log(y) + math.exp(s0) * z)
            pga = pgv / (pulse * STANDARD_GRAVITY_M_S2)
        limit = ks / rng.uniform(0.05, 0.2, n)
        found = pga < limit
        pga = np.minimum(pga, limit)
        values = {"ks": ks, "ps2": ps2, "pga_g": pga}
        values["pgv_m_s"] = pulse * pga * STANDARD_GRAVITY_M_S2
    return KindData(
        kind=kind,
        values=values,
        found=found,
        event=event.astype(np.intp),
        group=np.arange(n),
        block=np.zeros(n, dtype=np.intp),
        pgv_m_s=values["pgv_m_s"],
        pga_g=values["pga_g"],
        guessed_events=0,
        fingerprint="f",
    )


@pytest.mark.parametrize(("kind", "term"), sorted(TRUE))
def test_a_fit_finds_the_parameters_that_made_the_data(kind: str, term: str) -> None:
    fitted = fit_kind_data(drawn(kind, term), term, name="m", selection={})
    errors = fitted.row.diagnostics["standard_errors"]
    for (name, value), true in zip(fitted.row.coefficients.items(), TRUE[kind, term], strict=True):
        assert value == pytest.approx(true, abs=4.0 * errors[name])  # type: ignore[index]
        assert errors[name] < 0.2  # type: ignore[index]
    scores = fitted.row.diagnostics["scores"]
    assert scores["calibration_slope"] == pytest.approx(1.0, abs=0.15)  # type: ignore[index]


def test_leaving_the_censored_rows_out_would_be_wrong() -> None:
    data = drawn("slumping", "pgv_pga")
    assert 0.05 < np.mean(~data.found) < 0.6
    formula = FORMULAS["slumping", "pgv_pga"]
    start = np.array(STARTS["slumping", "pgv_pga"])
    right = maximum_likelihood(formula, data, np.ones(data.found.size, dtype=bool), start)
    wrong = maximum_likelihood(formula, data, data.found, start)
    true = np.array(TRUE["slumping", "pgv_pga"])
    assert np.abs(right - true).max() < 0.5 * np.abs(wrong - true).max()


@pytest.mark.parametrize("kind", ["sliding", "slumping"])
def test_a_database_without_such_campaigns_is_refused(kind: str, tmp_path: Path) -> None:
    place = tmp_path / "empty.db"
    with opened_database(place, create=True) as engine, engine.connect() as connection:
        with pytest.raises(FitError, match="rbfrag simulate --kind"):
            fit_kind(connection, kind=kind)
        with pytest.raises(InputError, match="no model of toppling"):
            fit_kind(connection, kind="toppling")
