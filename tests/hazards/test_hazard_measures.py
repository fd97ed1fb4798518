"""Annual rates by the measure that the hazard is given in."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import normal_quantile
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import Prediction, answer_given
from rbfrag.hazards.curve import HazardCurve, hazard_curve
from rbfrag.hazards.hazard_rates import hazard
from rbfrag.hazards.shaking import CONVERSIONS
from tests.hazards.conftest import measure_row

K, B = 1e-4, 2.0

CURVES: dict[str, tuple[str, float | None, str]] = {
    "pgv": ("pgv_m_s", None, "pgv_m_s"),
    "pga": ("pga_g", None, "pga_g"),
    "sa": ("sa_g", 1.0, "sa(1)"),
}


def power_law(measure: str, period_s: float | None, reach: float = 1e5) -> HazardCurve:
    x = np.geomspace(1.0 / reach, reach, 60)
    return hazard_curve(measure, x, K * x**-B, period_s=period_s)


def probability(model: Any, measure: str, level: float) -> float:
    result = find_model(model, ("p2", "kr", measure))
    answer = answer_given(result, {"p2": 3.0, "kr": 0.1, measure: level}, 0.95)
    assert isinstance(answer, Prediction)
    return answer.probability


@pytest.mark.parametrize("term", CURVES)
def test_each_measure_is_answered_by_its_own_model(measures_db: str, term: str) -> None:
    measure, period, name = CURVES[term]
    model = "toppling-pga" if term == "pga" else None
    about: dict[str, Any] = {"component": "single", "db": measures_db, "model": model}
    answer = hazard(power_law(measure, period), 3.0, 0.1, **about)
    assert answer.tau == (None if term == "pga" else 0.15)
    assert (answer.term, answer.measure) == (term, measure)
    row = measure_row(term)
    # λ_f = ∫ P K B x^-B d(ln x), past the lowest level at which the block may fail
    total, edges = 0.0, np.linspace(math.log(1e-5), math.log(1e5), 41)
    for low, high in pairwise(edges.tolist()):
        total += quad(
            lambda u: probability(row, name, math.exp(u)) * K * B * math.exp(-B * u),
            low, high, epsabs=1e-13, epsrel=1e-9, limit=200,
        )[0]  # fmt: skip
    assert answer.annual_rate[0] == pytest.approx(total, rel=1e-5)
    assert answer.ci_low[0] < answer.annual_rate[0] < answer.ci_high[0]


def test_a_lognormal_fragility_on_a_power_law(measures_db: str) -> None:
    # P = Φ(ln(x/m)/β):  λ_f = K m^-B exp(B² β²/2)
    row = measure_row("sa")
    scores = [normal_quantile(probability(row, "sa(1)", level)) for level in (0.2, 0.8)]
    beta = math.log(4.0) / (scores[1] - scores[0])
    median = 0.2 * math.exp(-scores[0] * beta)
    answer = hazard(power_law("sa_g", 1.0), 3.0, 0.1, component="single", db=measures_db)
    expected = K * median**-B * math.exp(0.5 * (B * beta) ** 2)
    assert answer.annual_rate[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("sigma", [None, 0.2, 0.7])
@pytest.mark.parametrize("name", CONVERSIONS)
def test_the_scatter_of_a_conversion_is_integrated(
    measures_db: str, name: str, sigma: float | None
) -> None:
    used = CONVERSIONS[name]
    of_pgv = hazard(power_law("pgv_m_s", None), 3.0, 0.1, component="single", db=measures_db)
    answer = hazard(
        power_law("sa_g", used.period_s), 3.0, 0.1, convert=name, convert_sigma=sigma,
        component="single", db=measures_db,
    )  # fmt: skip
    spread = used.scatter if sigma is None else sigma
    # PGV = factor x exp(spread ξ): the rates of PGV are those of x times factor^B exp(B² spread²/2)
    expected = of_pgv.annual_rate[0] * used.factor**B * math.exp(0.5 * (B * spread) ** 2)
    assert answer.annual_rate[0] == pytest.approx(expected, rel=2e-3)
    assert answer.term == "pgv"
    assert any(f"σ_ln {spread:g}, integrated" in text for text in answer.warnings)


def test_one_class_of_blocks(measures_db: str) -> None:
    curve = power_law("sa_g", 1.0)
    separate = hazard(curve, [3.0, 10.0], [0.1, 0.2], component="rotd50", db=measures_db)
    single = hazard(
        curve, [3.0, 10.0], [0.1, 0.2], component="rotd50", one_class=True, db=measures_db
    )
    assert single.annual_rate[0] == pytest.approx(separate.annual_rate.mean(), rel=1e-4)


def test_a_measure_that_knows_little_is_said(measures_db: str) -> None:
    inputs: dict[str, Any] = {"component": "single", "db": measures_db}
    words = "PGA alone is biased; give a curve of PGV .* accept the bias with model toppling-pga"
    with pytest.raises(InputError, match=words):
        hazard(power_law("pga_g", None), 3.0, 0.1, **inputs)
    document = hazard(power_law("pga_g", None), 3.0, 0.1, model="toppling-pga", **inputs).warnings
    assert any("PGA alone is biased" in text for text in document)
    assert any("PGA alone predicts" in text for text in document)
    quiet = hazard(power_law("sa_g", 1.0), 3.0, 0.1, **inputs).warnings
    assert not any("PGA alone predicts" in text for text in quiet)


@pytest.mark.parametrize("period", [0.1, 0.5, 0.75, 1.5, 5.0])
def test_any_period_is_answered(period: float) -> None:
    answer = hazard(power_law("sa_g", period), 3.0, 0.1, component="single")
    assert (answer.term, answer.model) == ("sa", "toppling-sa")
    assert 0.0 < answer.annual_rate[0] < 1.0


def test_no_other_period_is_answered(measures_db: str) -> None:
    with pytest.raises(InputError, match=r"no model uses SA\(20\): give a curve of one of PGV, SA"):
        hazard(power_law("sa_g", 20.0), 3.0, 0.1, db=measures_db)


@pytest.mark.parametrize("model", ["toppling-pgv_pga", "toppling-pgv"])
def test_a_model_that_reads_more_is_rejected(measures_db: str, model: str) -> None:
    with pytest.raises(InputError, match="requires"):
        hazard(power_law("pga_g", None), 3.0, 0.1, model=model, db=measures_db)


@pytest.mark.parametrize(
    ("measure", "period", "options", "words"),
    [
        ("pga_g", None, {"convert": "newmark_hall_1982"}, "is for spectral accelerations"),
        ("sa_g", 2.0, {"convert": "newmark_hall_1982"}, r"is for SA\(1\), not for SA\(2\)"),
        ("sa_g", 1.0, {"convert": "x"}, "unknown conversion 'x'"),
        ("sa_g", 1.0, {"convert_sigma": 0.3}, "requires convert"),
        ("sa_g", 1.0, {"convert": "newmark_hall_1982", "convert_sigma": 0.0}, "above zero"),
        ("sa_g", 1.0, {"convert": "newmark_hall_1982", "convert_sigma": math.nan}, "above zero"),
    ],
)
def test_conversions_that_make_no_sense_are_rejected(
    measures_db: str, measure: str, period: float | None, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        hazard(power_law(measure, period), 3.0, 0.1, db=measures_db, **options)
