"""Rate of earthquakes in which any of several blocks fails, in cases with a closed form."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any, cast

import numpy as np
import pytest
from scipy.special import ndtri

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.hazards import joint_rate
from rbfrag.hazards.branches import mixture_quantiles
from rbfrag.hazards.curve import HazardCurve, hazard_curve
from rbfrag.hazards.hazard_answer import HazardAnswer
from rbfrag.hazards.hazard_rates import hazard, hazard_at_sites
from rbfrag.hazards.standing_blocks import failure_rate
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.question.question import predict
from tests.fragility.conftest import SHARED, model_row

SHARES = ("rho_e", "rho_s", "rho_v", "rho_o")
TOGETHER = {**SHARED, **dict.fromkeys(SHARES, 0.0), "rho_e": 1.0}
APART = {**SHARED, **dict.fromkeys(SHARES, 0.0), "rho_o": 1.0, "l_y": 1e-12}


def power_law(site: str = "") -> HazardCurve:
    x = np.geomspace(0.01, 10.0, 20)
    return hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0, site=site)


def answered(p2: Any, kr: Any, law: dict[str, float] | None, **inputs: Any) -> HazardAnswer:
    row = model_row(dependence=law)
    return hazard(
        power_law(), p2, kr, model=row, **{"component": "single", "joint": True, **inputs}
    )


def bound(answer: HazardAnswer, law: str) -> float:
    assert answer.joint is not None
    return answer.joint.bounds[law]["annual_rate_any"]


def test_equal_blocks_that_fail_together_are_one() -> None:
    single = answered(3.0, 0.1, TOGETHER)
    three = answered([3.0] * 3, [0.1] * 3, TOGETHER, years=200.0)
    assert single.joint is None
    assert three.annual_rate_any == pytest.approx(single.annual_rate_any, rel=5e-4)
    assert three.expected_failures_per_year == pytest.approx(3.0 * single.annual_rate[0], rel=1e-8)
    assert three.joint is not None
    # earthquakes are the Poisson process, not failures
    assert three.joint.probability_any == pytest.approx(
        1.0 - np.exp(-200.0 * single.annual_rate[0]), rel=5e-4
    )
    ends = [single.ci_low[0], single.ci_high[0]]
    # its ends are those of P at each level, which is the wider interval
    assert three.joint.annual_rate_any_ci == pytest.approx(ends, rel=0.02)


def test_independent_blocks() -> None:
    p2, kr = np.array([3.0, 3.0, 10.0]), np.array([0.1, 0.1001, 0.3])
    answer = answered(p2, kr, APART)
    model = model_row(dependence=APART)

    def any_of_them(x: Any) -> Any:
        single = [
            predict(a, b, pgv_m_s=x, model=model).probability for a, b in zip(p2, kr, strict=True)
        ]
        return 1.0 - np.prod([1.0 - p for p in single], axis=0)[None]

    expected = failure_rate(power_law(), any_of_them).annual_rate[0]
    assert bound(answer, "independent") == pytest.approx(expected, rel=5e-4)
    # the beta-binomial law has the mean and the variance of these three, not all their moments
    assert answer.annual_rate_any == pytest.approx(expected, rel=0.02)


def test_between_the_greatest_rate_and_the_sum() -> None:
    answer = answered([3.0, 5.0, 10.0, 1.0], [0.1, 0.12, 0.2, 0.1], SHARED, component="rotd50")
    assert answer.annual_rate_any is not None
    least, most = bound(answer, "fully_dependent"), bound(answer, "independent")
    assert answer.annual_rate.max() < least * (1.0 + 1e-3)
    assert least < answer.annual_rate_any < most < answer.expected_failures_per_year


def test_without_an_estimate_both_bounds_are_given() -> None:
    answer = answered([3.0, 3.0], [0.1, 0.1], None)
    assert answer.annual_rate_any is None
    assert answer.joint is not None
    assert answer.joint.probability_any is None
    assert bound(answer, "fully_dependent") == pytest.approx(answer.annual_rate[0], rel=5e-4)
    assert bound(answer, "independent") > 1.05 * bound(answer, "fully_dependent")
    assert any("the model has no dependence" in text for text in answer.warnings)


def test_many_blocks_have_the_bounds_of_few(monkeypatch: pytest.MonkeyPatch) -> None:
    p2, kr = np.linspace(1.0, 10.0, 5), np.linspace(0.1, 0.2, 5)
    few = answered(p2, kr, SHARED)
    monkeypatch.setattr(joint_rate, "MOST_JOINT", 4)
    many = answered(p2, kr, SHARED)
    assert few.annual_rate_any is not None
    assert many.annual_rate_any is None
    np.testing.assert_allclose(many.annual_rate, few.annual_rate, rtol=1e-12)
    for law in ("fully_dependent", "independent"):
        assert bound(many, law) == pytest.approx(bound(few, law), rel=1e-9)
    assert any("more than 4 blocks" in text for text in many.warnings)


def at_least(answer: HazardAnswer) -> dict[int, float]:
    assert answer.joint is not None
    return {item.count: item.annual_rate for item in answer.joint.at_least}


def test_rates_of_k_or_more() -> None:
    # blocks that fail together fail by their strength: k or more at the rate of the k-th
    kr = np.array([0.3, 0.1, 0.2])
    answer = answered(np.full(3, 3.0), kr, TOGETHER, at_least=[2, 3])
    separate = np.sort(answer.annual_rate)[::-1]
    assert list(at_least(answer).values()) == pytest.approx(separate.tolist(), rel=2e-3)
    # what k blocks or more fail adds up to the failures expected
    subset = answered(np.linspace(1.0, 9.0, 6), np.linspace(0.1, 0.2, 6), SHARED,
                    at_least=range(1, 7))  # fmt: skip
    rates = list(at_least(subset).values())
    assert sum(rates) == pytest.approx(subset.expected_failures_per_year, rel=5e-3)
    assert all(more >= fewer for more, fewer in pairwise(rates))
    with pytest.raises(InputError, match="at least 4 failures of 3 blocks"):
        answered(np.full(3, 3.0), kr, TOGETHER, at_least=[4])


def test_joint_rates_are_those_of_samples() -> None:
    random = np.random.default_rng(3)
    p2, kr = random.uniform(1.0, 15.0, 24), random.uniform(0.08, 0.3, 24)
    curve = power_law()
    answer = answered(p2, kr, SHARED)
    p = np.sqrt(p2)
    blocks = Placement.of(np.log(p), np.log(kr * STANDARD_GRAVITY_M_S2 / p), polarity=0)
    sampler = JointSampler(Dependence(**SHARED), blocks)
    z = np.concatenate([sampler.normals(4000, random) for _ in range(8)])
    x = np.geomspace(0.01, 10.0, 120)
    model = model_row(dependence=SHARED)
    shaken = [
        predict(a, b, pgv_m_s=x, model=model).probability for a, b in zip(p2, kr, strict=True)
    ]
    mass = -np.diff(curve.rate_at(x))
    for k in (1, 2, 5):
        share = np.array(
            [((z <= ndtri(p_at)).sum(axis=1) >= k).mean() for p_at in np.array(shaken).T]
        )
        brute = float(mass @ (0.5 * (share[1:] + share[:-1])) + curve.annual_rate[-1] * share[-1])
        assert at_least(answer)[k] == pytest.approx(brute, rel=0.02)
    assert answer.joint is not None
    assert answer.joint.at_least[0].numerical_error < 3e-3
    assert answer.numerical_error.max() < 1e-3


def test_branches_of_a_logic_tree() -> None:
    x = np.geomspace(0.01, 10.0, 20)
    curves = [
        hazard_curve("pgv_m_s", x, k * x**-2.0, statistic=f"rlz-{i:03d}")
        for i, k in enumerate((1e-3, 2e-3, 4e-3))
    ]
    row = model_row(dependence=SHARED)
    inputs: dict[str, Any] = {"component": "single", "model": row, "joint": True}
    separate = [hazard(curve, [3.0, 5.0], [0.1, 0.2], **inputs) for curve in curves]
    answer = hazard(curves, [3.0, 5.0], [0.1, 0.2], weights=[0.5, 0.3, 0.2], **inputs)
    mean = sum(w * curve.annual_rate for w, curve in zip((0.5, 0.3, 0.2), separate, strict=True))
    np.testing.assert_allclose(answer.annual_rate, mean, rtol=1e-12)
    chance = sum(w * curve.probability for w, curve in zip((0.5, 0.3, 0.2), separate, strict=True))
    np.testing.assert_allclose(answer.probability, chance, rtol=1e-12)
    assert answer.curve_kind == "weighted branches"
    np.testing.assert_allclose(answer.logic_tree_low, separate[0].annual_rate)
    np.testing.assert_allclose(answer.logic_tree_high, separate[2].annual_rate)
    assert [curve.weight for curve in answer.branches] == [0.5, 0.3, 0.2]
    np.testing.assert_allclose(answer.branches[1].annual_rate, separate[1].annual_rate)
    assert answer.annual_rate_any == pytest.approx(
        sum(
            w * (curve.annual_rate_any or 0.0)
            for w, curve in zip((0.5, 0.3, 0.2), separate, strict=True)
        )
    )
    first = hazard(curves, [3.0, 5.0], [0.1, 0.2], **inputs)
    assert (first.curve_kind, first.annual_rate.tolist()) == (
        "rlz-000",
        separate[0].annual_rate.tolist(),
    )
    assert first.quantiles == {}


def test_a_quantile_curve_is_warned_of() -> None:
    x = np.geomspace(0.01, 10.0, 20)
    curve = hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0, statistic="quantile-0.84")
    answer = hazard(curve, 3.0, 0.1, model=model_row(), component="single")
    assert answer.curve_kind == "quantile-0.84"
    assert any("quantile-0.84 is not a realization" in text for text in answer.warnings)


def test_quantiles_are_those_of_branches_and_parameters_together() -> None:
    rates, weight = np.array([[1e-4], [3e-4], [2e-3]]), np.array([0.5, 0.3, 0.2])
    sd = np.array([0.4])
    random = np.random.default_rng(5)
    drawn = rates[random.choice(3, 400_000, p=weight), 0]
    drawn = drawn * np.exp(sd[0] * random.standard_normal(drawn.size))
    result = mixture_quantiles(rates, weight, sd, (0.05, 0.5, 0.95))[:, 0]
    np.testing.assert_allclose(result, np.quantile(drawn, (0.05, 0.5, 0.95)), rtol=0.01)
    # branches alone where the parameters are known
    certain = mixture_quantiles(rates, weight, np.zeros(1), (0.05, 0.6, 0.95))[:, 0]
    np.testing.assert_allclose(certain, rates[:, 0], rtol=1e-6)


def at_two_sites(joint: bool) -> HazardAnswer:
    inputs = {"p2": [3.0, 3.0, 5.0], "kr": [0.1, 0.2, 0.1]}
    answering = cast("Any", {"model": model_row(dependence=SHARED)})
    where = np.array([1, 1, 0])
    curves = [[power_law("A")], [power_law("B")]]
    return hazard_at_sites(curves, where, inputs, {"component": "single"}, answering, joint=joint)


def test_keys_of_several_sites() -> None:
    result = replace(at_two_sites(joint=True), names=("x", "y", "z")).as_dict()
    assert [(row["site"], row["block_id"]) for row in result["blocks"]] == [
        ("B", "x"), ("B", "y"), ("A", "z"),
    ]  # fmt: skip
    (site,) = result["sites"]
    together = answered([3.0, 3.0], [0.1, 0.2], SHARED)
    assert site["site"] == "B"
    assert site["annual_rate_any"] == pytest.approx(together.annual_rate_any, rel=1e-12)
    assert result["annual_rate_any"] is None


def test_any_failure_is_counted_only_where_it_is_asked_for() -> None:
    assert at_two_sites(joint=False).joints == (None, None)
    alone = answered([3.0, 3.0], [0.1, 0.2], SHARED, joint=False)
    assert (alone.joint, alone.annual_rate_any) == (None, None)
    assert answered(3.0, 0.1, SHARED, joint=False).annual_rate_any is not None
