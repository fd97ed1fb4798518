"""Models of blocks that slide or slump: formulas, fits, answers."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from rbfrag.fragility.fit.kind_data import LEAST_DISPLACEMENT_M, KindData
from rbfrag.fragility.fit.kind_fitting import (
    ARRAYS,
    STARTS,
    fit_kind,
    fit_kind_data,
    maximum_likelihood,
)
from scipy.special import ndtr

from rbfrag.db.engine import opened_database
from rbfrag.db.rows import ModelRow
from rbfrag.errors import FitError, InputError, ModelError, UnknownModelError
from rbfrag.fragility.kind_formulas import FORMULAS, METHODS, SINGLE
from rbfrag.fragility.kind_model import KindModel
from rbfrag.fragility.kind_prediction import dip_factor, predict_sliding, predict_slumping
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

TRUE = {
    ("sliding", "pgv_pga"): (0.3, 0.8, 3.5, -0.6, 1.0),
    ("slumping", "pgv_pga"): (-0.2, 0.9, -0.9),
    ("slumping", "pgv"): (0.3, 0.9, -0.9),
}


def row_of(kind: str, term: str = "pgv_pga", **changes: Any) -> ModelRow:
    formula = FORMULAS[kind, term]
    size = len(formula.parameters)
    covariance = tuple(tuple(0.01 * (i == j) for j in range(size)) for i in range(size))
    values: dict[str, Any] = {
        "name": f"{kind}-{term}",
        "kind": kind,
        "term": term,
        "method": METHODS[kind],
        "coefficients": dict(zip(formula.parameters, STARTS[kind, term], strict=True)),
        "covariance": covariance,
        "domain": {"pgv_over_pga_s": (0.02, 0.4)},
        "data_fingerprint": "f",
        "diagnostics": {"degrees_of_freedom": 40, "rotation_deg": None},
    }
    return ModelRow(**{**values, **changes})


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


@pytest.mark.parametrize(("kind", "term"), sorted(FORMULAS))
def test_slopes_are_the_derivatives(kind: str, term: str) -> None:
    formula = FORMULAS[kind, term]
    p = [value + 0.1 for value in STARTS[kind, term]]
    values = {"ky": 0.1, "ks": 0.15, "ps2": 3.0, "displacement_m": 0.05}
    values |= {"pgv_m_s": 0.4, "pga_g": 0.5}
    here = formula.eta(p, values, SINGLE)
    step = 1e-6
    for i in range(len(p)):
        up, down = list(p), list(p)
        up[i] += step
        down[i] -= step
        above, below = formula.eta(up, values, SINGLE), formula.eta(down, values, SINGLE)
        assert here.slopes[i] == pytest.approx((above.eta - below.eta) / (2 * step), rel=1e-6)
        slope = (above.log_sigma - below.log_sigma) / (2 * step)
        assert here.sigma_slopes[i] == pytest.approx(slope, rel=1e-6, abs=1e-9)
    arrays = {name: np.array([value, value]) for name, value in values.items()}
    assert formula.eta(p, arrays, ARRAYS).eta[0] == pytest.approx(here.eta, rel=1e-14)


@settings(max_examples=60, deadline=None)
@given(
    ky=st.floats(0.01, 0.5),
    d=st.floats(0.001, 1.0),
    pgv=st.floats(0.01, 2.0),
    pga=st.floats(0.02, 1.5),
)
def test_probabilities_fall_with_strength_and_distance(
    ky: float, d: float, pgv: float, pga: float
) -> None:
    model = row_of("sliding")
    here = predict_sliding(ky, d, pgv_m_s=pgv, pga_g=pga, model=model)
    assert 0.0 <= here.ci_low <= here.probability <= here.ci_high <= 1.0
    further = predict_sliding(ky, 1.5 * d, pgv_m_s=pgv, pga_g=pga, model=model)
    assert further.probability <= here.probability
    if ky >= pga:
        assert here.probability == here.ci_high == 0.0
        assert any("does not move" in text for text in here.warnings)
    elif here.median_displacement_m is not None:
        # what is exceeded with P = 1/2 splits the distances
        assert (d < here.median_displacement_m) == (here.probability > 0.5)


def test_a_base_that_dips_is_a_shorter_distance_on_a_level_one() -> None:
    model = row_of("sliding")
    factor = dip_factor(0.1, 25.0)
    assert factor == pytest.approx(
        math.cos(math.atan(0.1)) / math.cos(math.radians(25.0) + math.atan(0.1))
    )
    inclined = predict_sliding(0.1, 0.2, pgv_m_s=0.5, pga_g=0.6, beta_deg=25.0, model=model)
    level = predict_sliding(0.1, 0.2 / factor, pgv_m_s=0.5, pga_g=0.6, model=model)
    assert inclined.probability == pytest.approx(level.probability, rel=1e-12)
    with pytest.raises(InputError, match="friction angle"):
        dip_factor(0.1, 88.0)


def test_a_slump_is_answered_by_its_formula() -> None:
    ks, ps2, pgv, pga = 0.15, 3.0, 0.5, 0.6
    c, b, s0 = STARTS["slumping", "pgv_pga"]
    found = predict_slumping(ks, ps2, pgv_m_s=pgv, pga_g=pga, model=row_of("slumping"))
    r = ks / pga
    z = math.sqrt(ps2) * pgv / (pga * STANDARD_GRAVITY_M_S2)
    eta = (math.log((1 - r) / r) - c + b * math.log(z)) / math.exp(s0)
    assert found.probability == pytest.approx(float(ndtr(eta)), rel=1e-12)
    assert found.y_m_s == pytest.approx(ks * STANDARD_GRAVITY_M_S2 / math.sqrt(ps2))
    assert found.in_domain
    without = predict_slumping(ks, ps2, pgv_m_s=pgv, model=row_of("slumping", "pgv"))
    assert 0.0 < without.probability < 1.0
    thrown = predict_slumping(
        ks, ps2, pgv_m_s=pgv, pga_g=pga, leaves_g=0.5, model=row_of("slumping")
    )
    assert any("leaves its back plane" in text for text in thrown.warnings)
    still = predict_slumping(0.7, ps2, pgv_m_s=pgv, pga_g=pga, model=row_of("slumping"))
    assert still.probability == 0.0
    far = predict_slumping(ks, ps2, pgv_m_s=5.0, pga_g=pga, model=row_of("slumping"))
    assert not far.in_domain
    assert any("pgv_over_pga_s" in text for text in far.warnings)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: predict_sliding(0.0, 0.1, pgv_m_s=0.5, model=m), "ky = 0.0"),
        (lambda m: predict_sliding(0.1, math.nan, pgv_m_s=0.5, model=m), "displacement_m = nan"),
        (lambda m: predict_sliding(0.1, 0.1, pgv_m_s=-1.0, model=m), "pgv_m_s = -1.0"),
        (lambda m: predict_sliding(0.1, 0.1, pgv_m_s=0.5, model=m), "reads PGA"),
        (lambda m: predict_sliding(0.1, 0.1, pgv_m_s=0.5, pga_g=0.0, model=m), "both are zero"),
        (lambda m: predict_sliding(0.1, 0.1, pgv_m_s=0.5, pga_g=1.0, level=2, model=m), "level"),
        (lambda m: predict_slumping(0.1, 1.0, pgv_m_s=0.5, pga_g=1.0, model=m), "of kind sliding"),
    ],
)
def test_what_cannot_be_answered_is_refused(call: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        call(row_of("sliding"))


def test_a_model_of_another_rotation_is_refused() -> None:
    with pytest.raises(InputError, match="failure past recovery, asked is a rotation of 2°"):
        predict_slumping(
            0.1, 1.0, pgv_m_s=0.5, pga_g=1.0, rotation_deg=2.0, model=row_of("slumping")
        )


@pytest.mark.parametrize(
    "changes",
    [
        {"term": "xp"},
        {"method": "wls"},
        {"coefficients": {"c": 1.0}},
        {"covariance": ((1.0,),)},
    ],
)
def test_torn_rows_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ModelError):
        KindModel.from_row(replace(row_of("sliding"), **changes))


@pytest.mark.parametrize("kind", ["sliding", "slumping"])
def test_a_database_without_such_campaigns_is_refused(kind: str, tmp_path: Path) -> None:
    place = tmp_path / "empty.db"
    with opened_database(place, create=True) as engine, engine.connect() as connection:
        with pytest.raises(FitError, match="rbfrag simulate --kind"):
            fit_kind(connection, kind=kind)
        with pytest.raises(InputError, match="no model of toppling"):
            fit_kind(connection, kind="toppling")


def test_an_unknown_model_is_named(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    with pytest.raises(UnknownModelError, match="none-such"):
        predict_sliding(0.1, 0.1, pgv_m_s=0.5, pga_g=0.5, model="none-such")


def test_single_answers_load_no_library() -> None:
    code = (
        "import sys\n"
        "from rbfrag.fragility.kind_prediction import predict_sliding\n"
        "heavy = {'numpy', 'scipy', 'pandas', 'statsmodels', 'numba', 'matplotlib', 'sqlalchemy'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
