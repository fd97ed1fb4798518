"""Models of the measures that a hazard is given in: their forms, their rows, and what they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.campaign.kinds.toppling import Y_OVER_PGV
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models
from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.checks import CREDIBLE
from rbfrag.fragility.fit.data import Y0_OVER_PGV, FitSource, fit_data
from rbfrag.fragility.measures import SPECTRAL, TERMS
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import Prediction
from rbfrag.question.question import predict
from tests.fragility.conftest import model_row
from tests.fragility.outcome_draws import G, drawn_outcomes

COEFFICIENTS = {
    ("logistic", "sa10"): (-3.006, 0.348, -0.275, 3.618, -0.412, -2.700),
    ("logistic", "sa20"): (-2.019, 0.388, -0.206, 3.106, -0.449, -3.771),
    ("logistic", "sa30"): (-1.400, 0.425, -0.168, 2.860, -0.500, -4.602),
    ("logistic", "sa03"): (-0.589, 0.280, -0.168, 2.372, 0.107, -2.711),
    ("bounded", "pga"): (-3.897, 1.627, -0.160, 1.659),
    ("bounded", "pgv_kr"): (-0.817, 0.128, -0.240, 2.410, 2.113, -1.211),
    ("bounded", "pga_sa10"): (-2.964, 2.038, -0.235, 2.727, 1.895, -0.327),
    ("bounded", "pga_sa03_sa10_sa30"): (
        -3.323, 2.719, -0.261, 3.149, 0.068, 0.172, 0.981, 0.038, 1.004, -0.363,
    ),
}  # fmt: skip
"""Parameters of the recorded motions."""

P2 = np.geomspace(0.1, 30.0, 16)
KR = np.geomspace(0.01, 1.5, 120)
LEVELS = {
    "sa10": np.geomspace(0.01, 2.0, 60), "sa20": np.geomspace(0.005, 1.0, 60),
    "sa30": np.geomspace(0.003, 0.6, 60), "sa03": np.geomspace(0.02, 4.0, 60),
    "pga": np.geomspace(0.02, 2.0, 60), "pgv_kr": np.geomspace(0.02, 3.0, 60),
}  # fmt: skip


SCORES = {
    "sa10": (0.221, 0.93, 1.07), "sa20": (0.258, 0.93, 1.07), "sa30": (0.277, 0.93, 1.07),
    "sa03": (0.336, 0.83, 0.97), "pga": (0.339, 0.83, 0.97), "pgv_kr": (0.164, 0.93, 1.07),
    "pga_sa10": (0.199, 0.93, 1.07), "pga_sa03_sa10_sa30": (0.174, 0.93, 1.07),
}  # fmt: skip
"""Log loss on earthquakes left out, and the least and greatest calibration slope."""


@pytest.mark.parametrize(("method", "term"), COEFFICIENTS)
def test_shipped_models_score_what_is_asked(method: str, term: str) -> None:
    (row,) = (row for row in read_models(REFERENCE) if row.name == f"{method}-{term}")
    assert list(row.coefficients.values()) == pytest.approx(COEFFICIENTS[method, term], abs=0.025)
    scores = row.diagnostics["scores"]
    assert isinstance(scores, dict)
    log_loss, least, greatest = SCORES[term]
    assert scores["log_loss_held_out"] == pytest.approx(log_loss, abs=0.005)
    assert least <= scores["calibration_slope_held_out"] <= greatest
    assert row.dependence is not None
    assert row.leave_out_steps is not None


@pytest.mark.parametrize(
    ("measures", "term"),
    [
        ({"pgv_m_s": 0.4}, "pgv_kr"),
        ({"pgv_m_s": 0.4, "pga_g": 0.3}, "pgv_pga"),
        ({"pgv_m_s": 0.4, "sa10_g": 0.3}, "pgv_kr"),
        ({"pga_g": 0.3}, "pga"),
        ({"pga_g": 0.3, "tm_s": 0.5}, "pga_tm"),
        ({"pga_g": 0.3, "sa10_g": 0.3}, "pga_sa10"),
        ({"pga_g": 0.3, "sa03_g": 0.6, "sa10_g": 0.3, "sa30_g": 0.06}, "pga_sa03_sa10_sa30"),
        ({"sa10_g": 0.3, "sa20_g": 0.1}, "sa10"),
        ({"sa03_g": 0.6, "sa30_g": 0.06}, "sa30"),
        ({"sa03_g": 0.6}, "sa03"),
    ],
)
def test_what_is_known_chooses_the_model(measures: dict[str, float], term: str) -> None:
    assert predict(3.0, 0.1, **arguments(term, measures), db=REFERENCE).term == term
    with_pgv = predict(3.0, 0.1, pgv_m_s=0.4, model="bounded-pgv", db=REFERENCE)
    assert with_pgv.term == "pgv"


def shipped_form(method: str, term: str) -> FragilityModel:
    """Return a model with the parameters of the recorded motions."""
    names = method_named(method).forms[term].parameters
    values = COEFFICIENTS[method, term]
    size = len(names)
    row = model_row(
        term,
        name=f"{method}-{term}",
        method=method,
        coefficients=dict(zip(names, values, strict=True)),
        covariance=tuple(tuple(0.01 * (i == j) for j in range(size)) for i in range(size)),
        domain={},
    )
    return FragilityModel.from_row(replace(row, leave_out_steps=None))


def arguments(term: str, measures: dict[str, np.ndarray]) -> dict[str, object]:
    """Return measures by name as arguments of predict."""
    periods = {name: period for period, name in SPECTRAL.items()}
    spectral = {periods[name]: value for name, value in measures.items() if name in periods}
    others = {name: value for name, value in measures.items() if name not in periods}
    return {**others, **({"sa_g": spectral} if spectral else {})}


@pytest.mark.parametrize(("method", "term"), COEFFICIENTS)
def test_probability_falls_with_strength(method: str, term: str) -> None:
    model = shipped_form(method, term)
    rng = np.random.default_rng(7)
    pga = np.exp(rng.uniform(np.log(0.03), np.log(1.5), 40))[:, None, None]
    measures = {
        "pga_g": pga, "pgv_m_s": pga * np.exp(rng.normal(-0.1, 0.5, pga.shape)),
        "sa03_g": pga * np.exp(rng.normal(0.7, 0.3, pga.shape)),
        "sa10_g": pga * np.exp(rng.normal(-0.4, 0.5, pga.shape)),
        "sa20_g": pga * np.exp(rng.normal(-1.4, 0.6, pga.shape)),
        "sa30_g": pga * np.exp(rng.normal(-2.0, 0.7, pga.shape)),
    }  # fmt: skip
    own = {name: measures[name] for name in TERMS[term].inputs}
    answers = predict(
        P2[:, None], KR, **arguments(term, own), model=model, interval=False
    ).probability
    assert (np.diff(answers, axis=-1) <= 0.0).all()
    middle = (answers[..., 1:] > 1e-6) & (answers[..., :-1] < 1.0 - 1e-6)
    assert (np.diff(answers, axis=-1)[middle] < 0.0).all()


@pytest.mark.parametrize(("method", "term"), [key for key in COEFFICIENTS if key[1] in LEVELS])
def test_probability_rises_with_the_one_measure(method: str, term: str) -> None:
    model = shipped_form(method, term)
    own = {TERMS[term].inputs[0]: LEVELS[term]}
    answers = predict(
        P2[:, None, None], KR[:, None], **arguments(term, own), model=model, interval=False
    ).probability
    steps = np.diff(answers, axis=-1)
    assert (steps >= 0.0).all()
    middle = (answers[..., 1:] > 1e-6) & (answers[..., :-1] < 1.0 - 1e-6)
    assert (steps[middle] > 0.0).all()


@pytest.mark.parametrize("term", ["sa03", "pga"])
def test_measures_that_say_little_say_so(term: str) -> None:
    method = "logistic" if term == "sa03" else "bounded"
    own = {TERMS[term].inputs[0]: 0.5}
    answer = predict(3.0, 0.1, **arguments(term, own), model=shipped_form(method, term))
    assert isinstance(answer, Prediction)
    assert any("PGV or SA(1.0) would be worth" in text for text in answer.warnings)
    other = predict(3.0, 0.1, sa_g={1.0: 0.5}, model=shipped_form("logistic", "sa10"))
    assert not any("would be worth" in text for text in other.warnings)


def test_intensity_of_an_answer() -> None:
    answer = predict(3.0, 0.1, sa_g={2.0: 0.4}, model=shipped_form("logistic", "sa20"))
    assert answer.intensity_m_s == pytest.approx(0.4 * G * 2.0 / (2.0 * np.pi), rel=1e-14)
    answer = predict(3.0, 0.1, pga_g=0.4, model=shipped_form("bounded", "pga"))
    assert answer.intensity_m_s == pytest.approx(0.4 * G / np.sqrt(3.0), rel=1e-14)


def test_accelerations_in_another_unit_are_doubted() -> None:
    for name, period in ((name, period) for period, name in SPECTRAL.items()):
        term = name.removesuffix("_g")
        model = shipped_form("logistic", term)
        answer = predict(3.0, 0.1, sa_g={period: 60.0}, model=model)
        assert any("is it in g?" in text for text in answer.warnings)
        assert CREDIBLE[name][1] <= 10.0


@pytest.mark.parametrize("zero", ["sa03_g", "sa10_g", "sa30_g", "pga_g"])
def test_no_shaking_at_one_period(zero: str) -> None:
    model = shipped_form("bounded", "pga_sa03_sa10_sa30")
    measures = {"pga_g": 0.5, "sa03_g": 0.8, "sa10_g": 0.4, "sa30_g": 0.05, zero: 0.0}
    one = predict(3.0, 0.1, **arguments("", measures), model=model)
    many = predict(np.array([3.0, 3.0]), 0.1, **arguments("", measures), model=model)
    assert one.probability == pytest.approx(many.probability[0], abs=1e-300)
    assert 0.0 <= one.probability <= 1.0


def whole_grid(source: FitSource, seed: int = 2) -> FitSource:
    """Return a source with the weak blocks of the stored grid, and spectral accelerations."""
    table = source.table
    rng = np.random.default_rng(seed)
    n, weak = table.p2.size, Y_OVER_PGV.size - Y0_OVER_PGV.size
    with_spectrum = {
        name: table.pgv_m_s * 2.0 * np.pi / period / G * np.exp(rng.normal(0.0, 0.3, n))
        for period, name in SPECTRAL.items()
    }
    per_pga = np.sqrt(table.p2) * table.pgv_m_s / (table.pga_g * G)
    return replace(
        source,
        table=CombinationTable(**{**vars(table), **with_spectrum}),
        k_over_pga=per_pga[:, None] * Y_OVER_PGV,
        failed=np.hstack([np.ones((n, weak)), source.failed]),
    )


def test_wide_forms_read_more_than_they_are_judged_on() -> None:
    source = whole_grid(drawn_outcomes("bounded", "pgv_pga", (3.1, 1.9, 4.7, 2.7, 2.5), events=8))
    usual = fit_data(source, method_named("bounded"), TERMS["pgv"])
    wide = fit_data(source, method_named("logistic"), TERMS["sa10"])
    ratio = np.sort(wide.grid("y_m_s") / wide.grid("pgv_m_s"), axis=1)
    assert wide.read.all()
    assert usual.read.sum(axis=1).tolist() == [25] * usual.read.shape[0]
    assert wide.read.shape[1] == 45
    steps = np.diff(np.log(ratio), axis=1)
    assert steps == pytest.approx(np.full_like(steps, np.log(40.0) / 24.0), rel=1e-9)
    assert wide.judged.known.sum() == usual.judged.known.sum()
    scored = (wide.grid("y_m_s") / wide.grid("pgv_m_s"))[wide.judged.known]
    assert (scored.min(), scored.max()) == pytest.approx((0.1, 4.0), rel=1e-9)
    # what is stronger than the grid is safe
    above = wide.grid("y_m_s") > 4.0 * wide.grid("pgv_m_s") * (1.0 + 1e-9)
    assert (wide.failed[above] == 0.0).all()


def test_where_nothing_was_run_nothing_is_added() -> None:
    source = whole_grid(drawn_outcomes("bounded", "pgv_pga", (3.1, 1.9, 4.7, 2.7, 2.5), events=8))
    failed = source.failed.copy()
    failed[0] = np.nan
    wide = fit_data(replace(source, failed=failed), method_named("logistic"), TERMS["sa10"])
    assert np.isnan(wide.failed).all(axis=1).sum() == 1
