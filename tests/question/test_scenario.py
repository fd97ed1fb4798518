"""Scenarios: the ground-motion model against its oracles, and questions that state them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError
from rbfrag.fragility.correlation import correlation, nearest_correlation
from rbfrag.fragility.measures import SIGMAS
from rbfrag.fragility.method import SINGLE, arrays
from rbfrag.fragility.prediction import Prediction
from rbfrag.question.bssa14 import MEASURES, bssa14
from rbfrag.question.components import COMPONENT_SIGMA
from rbfrag.question.question import predict
from rbfrag.vocabulary.quantities import MECHANISMS
from tests.by_period import by_period

BLOCK = {"p2": 3.6368, "kr": 0.15, "db": REFERENCE}
S1 = {"magnitude": 6.8, "rjb_km": 11.765, "vs30_m_s": 760.0, "mechanism": "reverse"}
S3 = {"magnitude": 7.5, "rjb_km": 10.0, "vs30_m_s": 500.0, "mechanism": "strike-slip"}


def ask(**question: object) -> Prediction:
    answer = predict(**{**BLOCK, **question})  # type: ignore[call-overload]
    assert isinstance(answer, Prediction)
    return answer


@pytest.mark.parametrize(
    ("measure", "median", "tau", "phi"),
    [
        ("pgv_m_s", 0.16845, 0.346, 0.552),
        ("pga_g", 0.19952, 0.348, 0.495),
        ("sa(0.3)", 0.42155, 0.229, 0.561),
        ("sa(1)", 0.14129, 0.298, 0.625),
        ("sa(3)", 0.03060, 0.344, 0.619),
    ],
)
def test_medians_and_deviations_of_the_ground_motion_model(
    measure: str, median: float, tau: float, phi: float
) -> None:
    # two libraries of ground-motion models give these
    result = bssa14(measure, 6.8, 11.765, 760.0, MECHANISMS.index("reverse"), SINGLE)
    assert result.median == pytest.approx(median, rel=2e-4)
    assert (result.tau, result.phi) == pytest.approx((tau, phi), rel=1e-12)


def test_another_distance() -> None:
    assert bssa14(
        "pgv_m_s", 6.8, 12.0, 760.0, MECHANISMS.index("reverse"), SINGLE
    ).median == pytest.approx(0.16584, rel=2e-4)


def test_numbers_and_arrays_agree() -> None:
    magnitude, rjb, vs30 = (
        np.array([3.2, 5.0, 6.1, 8.0]), np.array([0.0, 50.0, 150.0, 390.0]),
        np.array([180.0, 250.0, 700.0, 1400.0]),
    )  # fmt: skip
    for measure in MEASURES:
        many = bssa14(measure, magnitude, rjb, vs30, MECHANISMS.index("normal"), arrays())
        separate = [
            bssa14(measure, *values, MECHANISMS.index("normal"), SINGLE)
            for values in zip(magnitude.tolist(), rjb.tolist(), vs30.tolist(), strict=True)
        ]
        for name in ("median", "tau", "phi"):
            expected = [getattr(item, name) for item in separate]
            assert getattr(many, name) == pytest.approx(expected, rel=1e-12)


def test_deviations_far_off_on_soft_ground_and_small() -> None:
    # phi grows beyond R1 by up to its whole amount at R2, falls to 225 m/s; both change with M
    near, far = (
        bssa14("pgv_m_s", 6.0, r, 760.0, MECHANISMS.index("normal"), SINGLE).phi
        for r in (105.0, 272.0)
    )
    assert far - near == pytest.approx(0.082)
    soft = bssa14("pgv_m_s", 6.0, 20.0, 200.0, MECHANISMS.index("normal"), SINGLE).phi
    assert soft == pytest.approx(0.552 - 0.08)
    middle = bssa14("pgv_m_s", 5.0, 20.0, 760.0, MECHANISMS.index("normal"), SINGLE)
    assert (middle.tau, middle.phi) == pytest.approx(((0.401 + 0.346) / 2, (0.644 + 0.552) / 2))


def test_a_scenario_is_the_question_of_its_measures() -> None:
    result, shaking = (
        ask(**S1, gmm_sigma=0.0),
        bssa14("pgv_m_s", 6.8, 11.765, 760.0, MECHANISMS.index("reverse"), SINGLE),
    )
    sigma = math.sqrt(shaking.tau**2 + shaking.phi**2)
    measures = {
        name: bssa14(name, 6.8, 11.765, 760.0, MECHANISMS.index("reverse"), SINGLE)
        for name in MEASURES
    }
    medians = {name: item.median for name, item in measures.items()}
    sigmas = {SIGMAS[name]: item.sigma(SINGLE) for name, item in measures.items()}
    value = ask(**by_period({**medians, **sigmas}), amplification_sigma=COMPONENT_SIGMA)
    assert result.model == "toppling-pgv_pga"
    assert sigma == sigmas["pgv_sigma"]
    assert result.probability == pytest.approx(value.probability, rel=1e-12)
    assert result.model == value.model
    assert result.shaking is not None
    assert result.shaking["pgv_m_s"]["median"] == pytest.approx(0.16845, rel=2e-4)
    assert result.shaking["pgv_m_s"]["tau"] == 0.346
    assert any("factor of up to 3" in text for text in result.warnings)
    assert not any("factor of up to 3" in text for text in ask(**S1).warnings)


@pytest.mark.parametrize(
    ("model", "names"),
    [
        ("toppling-pgv", ("pgv_m_s",)),
        ("toppling-pgv_pga", MEASURES),
        ("toppling-pga", MEASURES[1:]),
    ],
)
def test_a_model_reads_its_measures_of_the_scenario(model: str, names: tuple[str, ...]) -> None:
    result = ask(**S3, model=model, gmm_sigma=0.0)
    shaking = {
        n: bssa14(n, 7.5, 10.0, 500.0, MECHANISMS.index("strike-slip"), SINGLE) for n in names
    }
    sigma = {n: math.hypot(item.tau, item.phi) for n, item in shaking.items()}
    # the whole matrix is not positive definite
    rho = nearest_correlation([[correlation(a, b) for b in names] for a in names], 1e-4)
    widths = np.array([sigma[name] for name in names])
    covariance = rho * np.outer(widths, widths) + COMPONENT_SIGMA**2
    z = np.random.default_rng(4).multivariate_normal(np.zeros(len(names)), covariance, 1_000_000)
    drawn = {n: shaking[n].median * np.exp(z[:, i]) for i, n in enumerate(names)}
    p = predict(**BLOCK, **by_period(drawn), model=model, interval=False).probability
    error, mean = float(p.std()) / 1000.0, float(p.mean())
    approximate = 0.05 * mean if len(names) > 1 else 0.0  # the velocity is taken as lognormal
    assert result.probability == pytest.approx(mean, abs=2e-4 + 3.0 * error + approximate)


def test_a_footprint_is_an_answer_a_site() -> None:
    rjb = np.array([2.0, 10.0, 30.0])
    many = predict(**BLOCK, **{**S3, "rjb_km": rjb})
    separate = [ask(**{**S3, "rjb_km": float(r)}).probability for r in rjb]
    assert many.probability == pytest.approx(separate, rel=1e-9)
    assert (np.diff(many.probability) < 0.0).all()


def test_a_table_of_another_model(tmp_path: Path) -> None:
    path = tmp_path / "gmm.csv"
    path.write_text("rjb_km,PGV [cm/s],pgv_sigma,pgv_tau\n5,40,0.6,0.3\n20,20,0.7,0.35\n")
    at_row = ask(gmm=path, rjb_km=20.0, gmm_sigma=0.0)
    assert at_row.probability == pytest.approx(
        ask(pgv_m_s=0.2, pgv_sigma=math.hypot(0.7, COMPONENT_SIGMA)).probability, rel=1e-9
    )
    between = ask(gmm=path, rjb_km=10.0).shaking
    assert between is not None
    assert between["pgv_m_s"]["median"] == pytest.approx(math.sqrt(0.4 * 0.2))
    with pytest.raises(InputError, match="which has 5 to 20 km"):
        ask(gmm=path, rjb_km=21.0)
    with pytest.raises(InputError, match="no column pga_g"):
        ask(gmm=path, rjb_km=10.0, model="toppling-pgv_pga")
    path.write_text(",\n")
    with pytest.raises(InputError, match=r"gmm\.csv is empty"):
        ask(gmm=path, rjb_km=10.0)


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"magnitude": 8.6}, "3 to 8.5"),
        ({"magnitude": 7.2, "mechanism": "normal"}, "of normal faults"),
        ({"rjb_km": 401.0}, "0 to 400"),
        ({"vs30_m_s": 100.0}, "150 to 1500"),
        ({"mechanism": "thrust"}, "strike-slip"),
        ({"vs30_m_s": None}, "vs30_m_s is missing"),
        ({"pgv_m_s": 0.5}, "pgv_m_s cannot be combined with a scenario"),
        ({"pgv_sigma": 0.5}, "pgv_sigma cannot be combined with a scenario"),
        ({"rjb_km": np.array([10.0, 500.0])}, "rjb_km = 500"),
    ],
)
def test_what_is_no_scenario_is_rejected(changed: dict[str, object], text: str) -> None:
    with pytest.raises(InputError, match=text):
        ask(**{**S1, **changed})
