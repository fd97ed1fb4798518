"""How often an earthquake fails any of several blocks, in cases with a closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rbfrag.fragility.predict import predict
from rbfrag.hazards import joint_rate
from rbfrag.hazards.annual_rate import failure_rate
from rbfrag.hazards.answer import HazardAnswer, hazard
from rbfrag.hazards.curve import HazardCurve, hazard_curve
from rbfrag.hazards.report import as_dict
from tests.fragility.conftest import SHARED, model_row

SHARES = ("rho_e", "rho_s", "rho_v", "rho_o")
TOGETHER = {**SHARED, **dict.fromkeys(SHARES, 0.0), "rho_e": 1.0}
APART = {**SHARED, **dict.fromkeys(SHARES, 0.0), "rho_o": 1.0, "l_y": 1e-12}


def power_law(site: str = "") -> HazardCurve:
    x = np.geomspace(0.01, 10.0, 20)
    return hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0, site=site)


def answered(p2: Any, kr: Any, law: dict[str, float] | None, **asked: Any) -> HazardAnswer:
    row = model_row(dependence=law)
    return hazard(power_law(), p2, kr, model=row, **{"component": "single", **asked})


def bound(answer: HazardAnswer, law: str) -> float:
    assert answer.joint is not None
    return answer.joint.bounds[law]["annual_rate_any"]


def test_equal_blocks_that_fail_together_are_one() -> None:
    one = answered(3.0, 0.1, TOGETHER)
    three = answered([3.0] * 3, [0.1] * 3, TOGETHER, years=200.0)
    assert one.joint is None
    assert three.annual_rate_any == pytest.approx(one.annual_rate_any, rel=5e-4)
    assert three.expected_failures_per_year == pytest.approx(3.0 * one.annual_rate[0], rel=1e-8)
    assert three.joint is not None
    # earthquakes are the Poisson process, not failures
    assert three.joint.probability_any == pytest.approx(
        1.0 - np.exp(-200.0 * one.annual_rate[0]), rel=5e-4
    )
    ends = [one.ci_low[0], one.ci_high[0]]
    assert three.joint.annual_rate_any_ci == pytest.approx(ends, rel=1e-3)


def test_independent_blocks() -> None:
    p2, kr = np.array([3.0, 3.0, 10.0]), np.array([0.1, 0.1001, 0.3])
    found = answered(p2, kr, APART)
    model = model_row(dependence=APART)

    def any_of_them(x: Any) -> Any:
        one = [
            predict(a, b, pgv_m_s=x, model=model).probability for a, b in zip(p2, kr, strict=True)
        ]
        return 1.0 - np.prod([1.0 - p for p in one], axis=0)[None]

    expected = failure_rate(power_law(), any_of_them).annual_rate[0]
    assert bound(found, "independent") == pytest.approx(expected, rel=5e-4)
    # the beta-binomial law has the mean and the variance of these three, not all their moments
    assert found.annual_rate_any == pytest.approx(expected, rel=0.02)


def test_between_the_greatest_rate_and_the_sum() -> None:
    found = answered([3.0, 5.0, 10.0, 1.0], [0.1, 0.12, 0.2, 0.1], SHARED, component="rotd50")
    assert found.annual_rate_any is not None
    least, most = bound(found, "fully_dependent"), bound(found, "independent")
    assert found.annual_rate.max() < least * (1.0 + 1e-3)
    assert least < found.annual_rate_any < most < found.expected_failures_per_year


def test_without_an_estimate_both_bounds_are_given() -> None:
    found = answered([3.0, 3.0], [0.1, 0.1], None)
    assert found.annual_rate_any is None
    assert found.joint is not None
    assert found.joint.probability_any is None
    assert bound(found, "fully_dependent") == pytest.approx(found.annual_rate[0], rel=5e-4)
    assert bound(found, "independent") > 1.05 * bound(found, "fully_dependent")
    assert any("not known to this model" in text for text in found.warnings)


def test_many_blocks_have_the_bounds_of_few(monkeypatch: pytest.MonkeyPatch) -> None:
    p2, kr = np.linspace(1.0, 10.0, 5), np.linspace(0.1, 0.2, 5)
    few = answered(p2, kr, SHARED)
    monkeypatch.setattr(joint_rate, "MOST_JOINT", 4)
    monkeypatch.setattr(joint_rate, "_AT_ONCE", 2)
    many = answered(p2, kr, SHARED)
    assert few.annual_rate_any is not None
    assert many.annual_rate_any is None
    for law in ("fully_dependent", "independent"):
        assert bound(many, law) == pytest.approx(bound(few, law), rel=1e-9)
    assert any("more than 4 blocks" in text for text in many.warnings)


def test_keys_of_several_sites() -> None:
    curves = [power_law("A"), power_law("B")]
    row = model_row(dependence=SHARED)
    answers = [hazard(c, [3.0, 3.0], [0.1, 0.2], component="single", model=row) for c in curves]
    found = as_dict(curves, ["x", "y"], answers)
    assert [(row["site"], row["block_id"]) for row in found["blocks"]] == [
        ("A", "x"), ("A", "y"), ("B", "x"), ("B", "y"),
    ]  # fmt: skip
    assert [site["site"] for site in found["sites"]] == ["A", "B"]
    assert found["sites"][1]["annual_rate_any"] == answers[1].annual_rate_any
