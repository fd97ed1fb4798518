"""The joint domain: measures that do not go together, and points far from those of the fit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow
from rbfrag.errors import ModelError
from rbfrag.exchange.database_tables import read_table
from rbfrag.fragility.completion import Regression, encode_regressions
from rbfrag.fragility.domain import RATIOS, ratios_of
from rbfrag.fragility.fit.data import FitData, fit_data
from rbfrag.fragility.fit.fitting import fit_source, joint_scatter
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import SINGLE
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import Prediction, answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.question.components import SINGLE_ASSUMED
from rbfrag.question.question import predict
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, spectral_name
from tests.fragility.outcome_draws import drawn_outcomes

METHOD, TERM = method_named("toppling"), TERMS["pgv_pga"]
TRUE = (2.4, 0.6, 2.3, 4.5, 1.0, 2.1)

REFERENCE_DOMAIN = {
    "p2": (0.1, 30.0),
    "intensity_m_s": (0.005, 1.77),
    "y_m_s": (0.0005, 7.08),
    "tm_s": (0.108, 1.912),
    "pga_g": (0.004, 1.22),
    "pgv_over_pga_s": (0.016, 0.4326),
    "pgv_over_pga_tm": (0.4993, 2.818),
}
"""What 265 recorded motions hold."""


def given_by_issue() -> dict[str, float]:
    return {"p2": 9.5, "kr": 0.053, "pgv_m_s": 0.169, "pga_g": 0.906, "tm_s": 1.605}


@pytest.fixture(scope="module")
def source() -> Any:
    return drawn_outcomes("toppling", "pgv_pga", TRUE, events=20, motions=3)


@pytest.fixture(scope="module")
def data(source: Any) -> FitData:
    return fit_data(source, METHOD, TERM)


@pytest.fixture(scope="module")
def fitted(source: Any) -> FragilityModel:
    return fit_source(source, TERM, METHOD).report.model


def predict_block(model: FragilityModel | ModelRow, **inputs: float) -> Prediction:
    answer = predict(**inputs, model=model)
    assert isinstance(answer, Prediction)
    return answer


def domain_sentences(answer: Prediction) -> list[str]:
    return [text for text in answer.warnings if "extrapolation" in text]


def columns_of(data: FitData) -> dict[str, np.ndarray]:
    names = ("p2", "kr", "pgv_m_s", "pga_g", "velocity_m_s")
    return {name: data.grid(name)[data.read] for name in names}


def exact(data: FitData, source: Any) -> dict[str, np.ndarray]:
    """Return the blocks of a fit with the whole spectrum of their motions."""
    columns = {name: value for name, value in columns_of(data).items() if name != "velocity_m_s"}
    row = np.nonzero(data.read)[0]
    spectra = source.spectra[data.combination][row].T
    return columns | dict(zip(map(spectral_name, SPECTRUM_PERIODS_S), spectra, strict=True))


def measured_columns(data: FitData) -> dict[str, np.ndarray]:
    """Return the blocks of a fit with PGV, PGA and Tm alone."""
    names = ("p2", "kr", "pgv_m_s", "pga_g", "tm_s")
    return {name: data.grid(name)[data.read] for name in names}


def many(model: FragilityModel, columns: dict[str, np.ndarray]) -> PredictionArray:
    answer = answer_given(model, columns, 0.95)
    assert isinstance(answer, PredictionArray)
    return answer


def test_points_of_the_fit_are_in_the_domain(
    fitted: FragilityModel, data: FitData, source: Any
) -> None:
    columns = exact(data, source)
    answer = many(fitted, columns)
    allowed = (columns["kr"] < columns["pga_g"]) & (answer.y_m_s < 2.0 * columns["pgv_m_s"])
    # of the ratio of PGV to PGA 99.5 % are in its range, too
    assert 0.989 <= answer.in_domain[allowed].mean() < 1.0
    values = {text.split(" is ")[0] for text in answer.reason[allowed] if text}
    assert values <= {
        "the combination of p2, kr, pgv_m_s, pga_g and the spectral velocity",
        "PGV",
    }


def test_contradictory_measures_are_named() -> None:
    form = METHOD.forms["pgv_pga"]
    regression = Regression([[0.3, -0.1, -0.02, 0.5]] * 6, [0.2] * 6, [[0.2, 0.5]] * 6)
    size = len(form.parameters)
    row = ModelRow(
        name="toppling-pgv_pga", term="pgv_pga", method="toppling",
        coefficients=dict(zip(form.parameters, TRUE, strict=True)),
        covariance=tuple(tuple(0.01 * (i == j) for j in range(size)) for i in range(size)),
        domain=REFERENCE_DOMAIN, data_fingerprint="f",
        completions=encode_regressions({"pgv_m_s pga_g tm_s": regression}),
    )  # fmt: skip
    answer = predict_block(row, **given_by_issue())
    assert not answer.in_domain
    assert domain_sentences(answer) == [
        "a PGV of 0.169 m/s is inconsistent with a PGA of 0.906 g and a Tm of 1.6 s: "
        "PGV/(PGA·g·Tm/2π) is 0.074, outside the fitted 0.5 to 2.8: the answer is an "
        "extrapolation",
    ]
    as_array = predict(**{name: [v] for name, v in given_by_issue().items()}, model=row)
    assert isinstance(as_array, PredictionArray)
    assert not as_array.in_domain[0]
    assert as_array.probability[0] == pytest.approx(answer.probability, rel=1e-12)
    assert as_array.reason[0] == (
        "PGV is inconsistent with PGA and Tm: PGV/(PGA·g·Tm/2π) is outside the fitted 0.5 to 2.8: "
        "the answer is an extrapolation"
    )
    # a motion that goes together, and one number that is out of its range by itself
    assert predict_block(row, **{**given_by_issue(), "pgv_m_s": 1.6}).in_domain
    size_alone = predict_block(row, **{**given_by_issue(), "pgv_m_s": 1.6, "p2": 40.0})
    assert [t.split(" is ")[0] for t in domain_sentences(size_alone)] == ["p2 = 40 1/s²"]


def test_measures_that_the_model_does_not_read_are_judged_too(model: FragilityModel) -> None:
    row = replace(model.row, domain={**model.row.domain, "pgv_over_pga_tm": (0.5, 2.8)})
    inputs = {**given_by_issue(), "tm_s": 1.4}
    assert predict_block(row, p2=9.5, kr=0.053, pgv_m_s=0.169).in_domain
    beside = predict_block(row, **inputs)
    assert not beside.in_domain
    assert (
        "a PGV of 0.169 m/s is inconsistent with a PGA of 0.906 g and a Tm of 1.4 s"
        in (domain_sentences(beside)[0])
    )


@settings(max_examples=80)
@given(i=st.integers(0, 10**6), factor=st.floats(8.0, 100.0))
def test_scaling_pgv_alone_leaves_the_domain(
    fitted: FragilityModel, data: FitData, i: int, factor: float
) -> None:
    columns = measured_columns(data)
    block_inputs = {name: float(v[i % v.size]) for name, v in columns.items()}
    block_inputs["kr"] = min(block_inputs["kr"], 0.5 * block_inputs["pga_g"])
    answer = predict_block(fitted, **{**block_inputs, "pgv_m_s": block_inputs["pgv_m_s"] * factor})
    assert not answer.in_domain
    assert any("a PGV of" in text and "is inconsistent with" in text for text in answer.warnings)
    # the whole motion scaled, the block's strength with it, contradicts nothing
    scaled = {name: block_inputs[name] * factor for name in ("kr", "pgv_m_s", "pga_g")}
    assert not any(
        "does not go" in text
        for text in predict_block(fitted, **{**block_inputs, **scaled}).warnings
    )


def test_arrays_agree_with_scalars(fitted: FragilityModel, data: FitData) -> None:
    random, n = np.random.default_rng(7), 300
    rows = random.integers(0, int(data.read.sum()), n)
    columns = {
        name: v[rows] * np.exp(random.normal(0.0, 0.7, n))
        for name, v in measured_columns(data).items()
    }
    answer = many(fitted, columns)
    assert 20 < answer.in_domain.sum() < n - 20
    for i in range(n):
        alone = predict_block(fitted, **{name: float(v[i]) for name, v in columns.items()})
        assert answer.probability[i] == pytest.approx(alone.probability, rel=1e-12, abs=1e-250)
        assert answer.in_domain[i] == alone.in_domain
        rest = len(fitted.notes) + (SINGLE_ASSUMED in alone.warnings)
        rest += any("Check the unit" in text for text in alone.warnings)
        assert len(alone.warnings) - rest == len([r for r in answer.reason[i].split("; ") if r])


def test_a_single_block_under_many_motions(fitted: FragilityModel, data: FitData) -> None:
    columns = measured_columns(data)
    motions = {name: columns[name][:50] for name in ("pgv_m_s", "pga_g", "tm_s")}
    held = predict(3.0, 0.01, **motions, model=fitted)
    full = predict(np.full(50, 3.0), np.full(50, 0.01), **motions, model=fitted)
    assert isinstance(held, PredictionArray)
    assert isinstance(full, PredictionArray)
    assert held.in_domain.tolist() == full.in_domain.tolist()
    assert held.reason.tolist() == full.reason.tolist()


def test_the_distance_is_that_of_mahalanobis(fitted: FragilityModel, data: FitData) -> None:
    from scipy.spatial.distance import mahalanobis

    spread = fitted.spread
    assert spread is not None
    stored: Any = fitted.row.diagnostics["mahalanobis"]
    columns = columns_of(data)
    logs = np.log(np.stack([columns[name] for name in stored["names"]], axis=-1))
    numbers = {name: float(v[5]) for name, v in columns.items()}
    assert spread.distance2(numbers, SINGLE) == pytest.approx(
        mahalanobis(logs[5], stored["centre"], stored["inverse_covariance"]) ** 2, rel=1e-9
    )


def test_a_direction_without_scatter_counts_nothing() -> None:
    random = np.random.default_rng(0)
    a = np.exp(random.normal(size=(500, 1)))
    values = {"a": a, "b": 2.0 * a, "c": np.full((500, 1), 3.0)}
    result: Any = joint_scatter(("a", "b", "c"), values, np.ones((500, 1), dtype=np.bool_))
    inverse = np.array(result["inverse_covariance"])
    assert np.isfinite(inverse).all()
    assert np.abs(inverse[2]).max() < 1e-30
    inside = np.abs(np.log(a) - result["centre"][0]) / np.log(a).std(ddof=1) <= result["radius"]
    assert inside.sum() == 498  # 99.5 % of 500, the point at the edge included


def test_z_is_judged_only_where_its_range_says_more(model: FragilityModel) -> None:
    expected = ("p", "pgv_m_s", "pga_g")
    wide = {"pgv_over_pga_s": (0.01, 0.4), "z": (0.003, 2.2)}
    assert [r.name for r in ratios_of(expected)] == ["pgv_over_pga_s", "z"]
    for z, judged in (((0.003, 2.2), False), ((0.01, 2.2), True), ((0.003, 1.0), True)):
        row = replace(model.row, domain={**model.row.domain, **wide, "z": z})
        names = [ratio.name for ratio in FragilityModel.from_row(row).ratios_of(expected)]
        assert ("z" in names) is judged


def test_ratios_do_not_change_with_the_scale_of_the_motion() -> None:
    values = {
        "pgv_m_s": 0.3, "pga_g": 0.4, "tm_s": 0.5, "pgd_m": 0.1, "p": 1.7, "velocity_m_s": 0.3,
    }  # fmt: skip
    motion = [name for name in values if name not in ("tm_s", "p")]
    twice = {**values, **{name: 2.0 * values[name] for name in motion}}
    assert len(ratios_of(values)) == len(RATIOS)
    for ratio in RATIOS:
        assert ratio.formula(twice) == pytest.approx(ratio.formula(values), rel=1e-12)


@pytest.mark.parametrize(
    "broken",
    [{}, {"names": ["p2", "kr"]}, {"centre": [0.0]}, {"inverse_covariance": [[1.0]]}],
)
def test_a_scatter_that_is_not_whole_is_rejected(model: FragilityModel, broken: Any) -> None:
    complete = {
        "names": ["p2", "kr", "pgv_m_s"], "centre": [0.0, -3.0, -1.0],
        "inverse_covariance": np.eye(3).tolist(), "radius": 3.0,
    }  # fmt: skip
    assert FragilityModel.from_row(replace(model.row, diagnostics={"mahalanobis": complete})).spread
    stored = {**complete, **broken} if broken else {}
    with pytest.raises(ModelError, match="fit it again"):
        FragilityModel.from_row(replace(model.row, diagnostics={"mahalanobis": stored}))


def test_a_displacement_that_velocity_and_period_cannot_go_with_is_told_of() -> None:
    shaking = {"pgv_m_s": 0.6, "tm_s": 0.5}
    # a harmonic motion has PGD = PGV Tm / 2π, any other more
    for pgd_m, output in ((0.02, True), (0.06, False), (1.0, False), (12.0, True)):
        answer = predict(3.0, 0.1, pgd_m=pgd_m, **shaking)
        text = f"a PGD of {pgd_m:.3g} m is inconsistent with a PGV of 0.6 m/s and a Tm of 0.5 s"
        assert any(text in warning for warning in answer.warnings) is output
        assert answer.in_domain is not output
        many = predict(3.0, [0.1, 0.2], pgd_m=pgd_m, **shaking)
        assert all(
            ("PGD is inconsistent with PGV and Tm" in item) is output for item in many.reason
        )
        assert many.in_domain.tolist() == [not output] * 2


def test_the_range_of_a_ratio_that_the_shipped_motions_judge_is_theirs() -> None:
    motions = read_table("motion", db=REFERENCE)
    motions = motions[~motions.is_vertical]
    for ratio in (item for item in RATIOS if item.shipped is not None):
        values = ratio.formula(motions)
        assert ratio.shipped == pytest.approx((values.min(), values.max()), rel=5e-3)
