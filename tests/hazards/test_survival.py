"""Evidence of standing blocks on a hazard, against closed forms and numbers worked by hand."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import ndtr

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError
from rbfrag.hazards.curve import HazardCurve, hazard_curve
from rbfrag.hazards.curve_file import read_hazard_curves
from rbfrag.hazards.hazard_rates import hazard
from rbfrag.hazards.standing_blocks import Age, Standing, failure_rate, weights_given_standing
from rbfrag.hazards.survival import SurvivalAnswer, survival
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2 as G
from tests.fragility.conftest import model_row

FloatArray = NDArray[np.float64]

K, B = 1e-4, 2.5
MEDIAN, BETA = 0.5, 0.4
YEARS = 3000.0
RATE = K * MEDIAN**-B * math.exp(0.5 * (B * BETA) ** 2)
"""λ = K x^-B and P = Φ(ln(x/m)/β):  λ_f = K m^-B exp(B²β²/2)  (Cornell 1996)."""

SHARED = {
    "rho_e": 0.14, "rho_s": 0.24, "rho_v": 0.22, "rho_o": 0.40,
    "l_e": 1.0, "l_v": 2.5, "l_o": 6.7, "l_y": 0.5,
}  # fmt: skip


def power_law(times: float = 1.0, statistic: str = "", measure: str = "pgv_m_s") -> HazardCurve:
    x = np.geomspace(1e-3, 1e2, 40)
    return hazard_curve(measure, x, times * K * x**-B, statistic=statistic)


def lognormal(x: FloatArray) -> FloatArray:
    return np.asarray(ndtr(np.log(x / MEDIAN) / BETA))


def test_lognormal_fragility_on_a_power_law() -> None:
    answer = survival(power_law(), fragility=lognormal, age_years=YEARS)
    assert answer.annual_rate_any == pytest.approx(RATE, rel=1e-7)
    assert answer.probability_standing == pytest.approx(math.exp(-RATE * YEARS), rel=1e-6)
    assert answer.factor_5_percent == pytest.approx(math.log(20.0) / (RATE * YEARS), rel=1e-7)
    assert answer.factor_50_percent == pytest.approx(math.log(2.0) / (RATE * YEARS), rel=1e-7)
    assert (answer.blocks, answer.joint_law, answer.bounds) == (1, "one block", None)


@pytest.mark.parametrize(("mean", "sd"), [(3000.0, 600.0), (3000.0, 3000.0), (5e4, 2e4)])
def test_uncertain_age_is_integrated(mean: float, sd: float) -> None:
    answer = survival(power_law(), fragility=lognormal, age_years=mean, age_sd_years=sd)
    s = math.sqrt(math.log1p((sd / mean) ** 2))
    mu = math.log(mean) - 0.5 * s * s

    def share(z: float, factor: float) -> float:
        return math.exp(-0.5 * z * z - factor * RATE * math.exp(mu + s * z)) / math.sqrt(
            2 * math.pi
        )

    for factor, result in ((1.0, answer.probability_standing), (answer.factor_5_percent, 0.05)):
        expected = quad(share, -12.0, 12.0, args=(factor,), epsabs=0, epsrel=1e-10, limit=200)[0]
        assert result == pytest.approx(expected, rel=1e-6)


def test_the_age_has_the_mean_and_deviation_that_are_given() -> None:
    age = Age.of(12_000.0, 4000.0)
    mean = age.weight @ age.years
    assert mean == pytest.approx(12_000.0, rel=1e-9)
    assert math.sqrt(age.weight @ (age.years - mean) ** 2) == pytest.approx(4000.0, rel=1e-9)
    assert age.years.min() > 0.0


def test_hazard_times_the_factor_leaves_what_the_factor_is_of() -> None:
    inputs: dict[str, Any] = {"age_years": YEARS, "age_sd_years": 900.0, "fragility": lognormal}
    answer = survival(power_law(), **inputs)
    for factor, remaining in ((answer.factor_5_percent, 0.05), (answer.factor_50_percent, 0.5)):
        assert factor is not None
        again = survival(power_law(factor), **inputs)
        assert again.probability_standing == pytest.approx(remaining, rel=1e-8)


def test_two_equal_blocks_that_fail_together_are_one() -> None:
    def two(x: FloatArray) -> FloatArray:
        return np.stack([lognormal(x), lognormal(x)])

    single = survival(power_law(), fragility=lognormal, age_years=YEARS)
    both = survival(power_law(), fragility=two, age_years=YEARS)
    assert both.blocks == 2
    assert both.bounds is not None
    assert both.bounds["fully_dependent"]["probability_standing"] == pytest.approx(
        single.probability_standing, rel=1e-12
    )
    # P(any) = 1 - (1-P)² in each earthquake, if they are independent in it
    rate = failure_rate(power_law(), lambda x: 1.0 - (1.0 - lognormal(x)) ** 2).annual_rate[0]
    assert both.bounds["independent"]["probability_standing"] == pytest.approx(
        math.exp(-rate * YEARS), rel=1e-9
    )
    # the answer is what says least against the hazard, and says so
    assert both.probability_standing == pytest.approx(single.probability_standing, rel=1e-12)
    assert any("dependence between the blocks is unknown" in text for text in both.warnings)


def answered(row: ModelRow, p2: Any, kr: Any, **inputs: Any) -> Any:
    return survival(
        power_law(), p2, kr, kind="toppling", age_years=2e4, component="single", model=row, **inputs
    )


def test_one_block_has_the_rate_of_hazard() -> None:
    row = model_row()
    expected = hazard(power_law(), 3.0, 0.1, component="rotd50", model=row)
    answer = survival(
        power_law(), 3.0, 0.1, kind="toppling", age_years=2e4, component="rotd50", model=row
    )
    assert answer.annual_rate_any == pytest.approx(expected.annual_rate[0], rel=1e-4)
    ends = (expected.ci_high[0], expected.ci_low[0])
    for result, rate in zip((answer.ci_low, answer.ci_high), ends, strict=True):
        assert result == pytest.approx(math.exp(-rate * 2e4), rel=1e-3)
    assert answer.ci_low < answer.probability_standing < answer.ci_high
    low, high = answer.factor_5_percent_ci
    assert low is not None
    assert high is not None
    assert answer.factor_5_percent is not None
    assert low < answer.factor_5_percent < high


def test_uncertain_block_is_integrated() -> None:
    row = model_row()
    sigma, years = 0.3, 2e4
    answer = answered(row, 3.0, 0.1, kr_sigma=sigma).probability_standing
    z, weight = np.polynomial.hermite_e.hermegauss(40)
    rates = hazard(
        power_law(), 3.0, 0.1 * np.exp(sigma * z), component="single", model=row
    ).annual_rate
    expected = float(weight @ np.exp(-rates * years) / weight.sum())
    assert answer == pytest.approx(expected, rel=1e-3)
    # what is not known of the block is the same in all earthquakes, outside of the exponential
    assert answer > math.exp(-years * float(weight @ rates / weight.sum()))


def test_several_uncertain_blocks_are_drawn_with_the_seed() -> None:
    row = model_row()
    single = answered(row, 3.0, 0.1, kr_sigma=0.3, p2_sigma=0.1)
    # the second never fails: what is drawn for it does not matter
    drawn = answered(row, [3.0, 3.0], [0.1, 1e4], kr_sigma=0.3, p2_sigma=0.1, draws=512)
    assert drawn.probability_standing == pytest.approx(single.probability_standing, rel=0.02)
    again = answered(row, [3.0, 3.0], [0.1, 1e4], kr_sigma=0.3, p2_sigma=0.1, draws=512)
    other = answered(row, [3.0, 3.0], [0.1, 1e4], kr_sigma=0.3, p2_sigma=0.1, draws=512, seed=1)
    assert again.probability_standing == drawn.probability_standing
    assert other.probability_standing != drawn.probability_standing


def test_the_copula_lies_between_its_bounds() -> None:
    answer = answered(model_row(dependence=SHARED), [3.0, 10.0], [0.1, 0.2])
    assert answer.joint_law == "the model's copula"
    alone, together = (
        answer.bounds[name]["probability_standing"] for name in ("independent", "fully_dependent")
    )
    assert alone < answer.probability_standing < together
    assert not any("dependence between the blocks is unknown" in text for text in answer.warnings)


def test_limits_of_the_copula() -> None:
    nothing = dict.fromkeys(("rho_e", "rho_s", "rho_v", "rho_o"), 0.0)
    all_shared = model_row(dependence={**SHARED, **nothing, "rho_e": 1.0})
    single = answered(all_shared, 3.0, 0.1)
    assert answered(all_shared, [3.0, 3.0], [0.1, 0.1]).probability_standing == pytest.approx(
        single.probability_standing, rel=1e-6
    )
    # what is forgotten over the least difference in y is not shared by blocks of unlike y
    none_shared = model_row(dependence={**SHARED, **nothing, "rho_o": 1.0, "l_y": 1e-12})
    answer = answered(none_shared, [3.0, 3.0], [0.1, 0.1000001])
    assert answer.probability_standing == pytest.approx(
        answer.bounds["independent"]["probability_standing"], rel=5e-3
    )


def test_weights_by_hand() -> None:
    curves = [power_law(times, f"rlz-00{i}") for i, times in enumerate((0.5, 1.0, 4.0))]
    mean = power_law(statistic="mean")
    weights = [0.2, 0.5, 0.3]
    answer = survival(
        [mean, *curves], fragility=lognormal, age_years=YEARS, weights=[None, *weights]
    )
    stand = [math.exp(-times * RATE * YEARS) for times in (0.5, 1.0, 4.0)]
    total = sum(w * s for w, s in zip(weights, stand, strict=True))
    assert answer.probability_standing == pytest.approx(total, rel=1e-6)
    first, *branches = answer.branches
    assert (first.name, first.weight, first.weight_given_standing) == ("mean", None, None)
    for branch, w, s in zip(branches, weights, stand, strict=True):
        assert branch.weight == pytest.approx(w, rel=1e-12)
        assert branch.probability_standing == pytest.approx(s, rel=1e-6)
        assert branch.weight_given_standing == pytest.approx(w * s / total, rel=1e-6)
    assert [branch.name for branch in branches] == ["rlz-000", "rlz-001", "rlz-002"]
    factor = answer.factor_5_percent
    assert factor is not None
    remaining = sum(w * s**factor for w, s in zip(weights, stand, strict=True))
    assert remaining == pytest.approx(0.05, rel=1e-6)


def test_weights_where_no_hazard_lets_the_blocks_stand() -> None:
    # exp(-2000) is 0 for a computer, its ratio to exp(-2001) is not
    age = Age.of(1.0)
    parts = [Standing.of([rate], [1.0], age) for rate in (2000.0, 2001.0)]
    assert parts[0].probability == 0.0
    after = weights_given_standing(parts, [0.5, 0.5])
    assert after == pytest.approx([math.e / (1.0 + math.e), 1.0 / (1.0 + math.e)], rel=1e-9)


def test_without_weights_the_first_curve_answers() -> None:
    curves = [power_law(1.0, "mean"), power_law(2.0, "quantile-0.84")]
    answer = survival(curves, fragility=lognormal, age_years=YEARS)
    assert answer.hazard == "mean"
    assert answer.probability_standing == answer.branches[0].probability_standing
    assert answer.branches[1].probability_standing == pytest.approx(
        math.exp(-2 * RATE * YEARS), rel=1e-6
    )
    assert any("quantile-0.84 is not a realization" in w for w in answer.warnings)


def test_blocks_that_nothing_fells_have_no_factor() -> None:
    answer = survival(power_law(), fragility=np.zeros_like, age_years=YEARS)
    assert answer.probability_standing == 1.0
    assert answer.factor_5_percent is None
    # with one half certain to stand, survival never falls below it
    never = Standing.of([0.0, 1e-3], [0.5, 0.5], Age.of(YEARS))
    assert never.factor(0.5) is None
    assert never.factor(0.6) == pytest.approx(-math.log(0.2) / 3.0, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"age_years": 0.0}, "age = 0 years"),
        ({"age_years": -5.0}, "age = -5 years"),
        ({"age_years": math.nan}, "age = nan years"),
        ({"age_sd_years": -1.0}, "standard deviation of the age = -1"),
        ({"curves": []}, "no hazard curve"),
        ({"curves": [power_law(), power_law(measure="pga_g")]}, "curves are of PGV, PGA"),
        ({"curves": [power_law(), power_law()], "weights": [0.5, 0.4]}, "add up to 0.9, not 1"),
        ({"curves": [power_law(), power_law()], "weights": [1.5, -0.5]}, "must be from 0 to 1"),
        ({"weights": [0.5, 0.5]}, "2 weights for 1 curves"),
        ({"p2": 3.0, "kr": 0.1}, "omit p2 and kr"),
        ({"fragility": None}, "give p2 and kr"),
        ({"fragility": None, "p2": 3.0, "kr": 0.0}, "kr = 0 is not above zero"),
        ({"fragility": None, "p2": 3.0, "kr": 0.1, "kr_sigma": -0.1}, "kr_sigma = -0.1 is"),
        ({"fragility": None, "p2": [3.0, 3.0], "kr": 0.1, "kr_sigma": 0.1, "draws": 0},
         "draws = 0"),
    ],
)  # fmt: skip
def test_rejections(changes: dict[str, Any], words: str) -> None:
    inputs = {"curves": power_law(), "fragility": lognormal, "age_years": YEARS, **changes}
    if inputs["fragility"] is None:
        inputs |= {"model": model_row(), "kind": "toppling"}
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        survival(inputs.pop("curves"), **inputs)


def test_curves_of_two_sites_are_rejected() -> None:
    x = np.array([0.1, 1.0])
    local, there = (hazard_curve("pgv_m_s", x, [1e-2, 1e-4], site=site) for site in ("A", "B"))
    with pytest.raises(InputError, match="2 sites"):
        survival([local, there], fragility=lognormal, age_years=YEARS)


def test_more_than_the_ranges_and_the_ends_is_told() -> None:
    row = model_row()
    x = np.array([0.7, 0.8, 0.9])
    short = hazard_curve("pgv_m_s", x, K * x**-B)
    answer = survival(
        short, 300.0, 1.0, kind="toppling", age_years=YEARS, model=row, component="single"
    )
    document = " ".join(answer.warnings)
    assert "the hazard curve begins at" in document
    assert "the hazard curve ends at" in document
    assert "outside the fitted range" in document
    assert "backed by a rock face" in document


def test_a_free_block_of_los_angeles(formats_dir: Path) -> None:
    # p² = 18, k_r = .25; SA(1.0) with PGV = .946 SA, PGV/PGA lognormal about .946 m/s per g with
    # sd of ln .579; two-sided rocking: logit P = 5.491 - 1.885 L + 4.072 ln z
    (curve,) = read_hazard_curves(
        formats_dir / "usgs_nshm_hazard_curves_los_angeles_2018.json", imt="SA(1.0)"
    )
    p, kr = math.sqrt(18.0), 0.25
    xi, weight = np.polynomial.hermite_e.hermegauss(15)

    def overturns(pgv: FloatArray) -> FloatArray:
        pga = pgv[:, None] / 0.946 * np.exp(0.579 * xi)
        r = np.minimum(kr / pga, 1.0 - 1e-15)
        eta = 5.491 - 1.885 * np.log(r / (1.0 - r)) + 4.072 * np.log(p * pgv[:, None] / (pga * G))
        return np.where(kr < pga, 1.0 / (1.0 + np.exp(-eta)), 0.0) @ weight / weight.sum()

    # printed are .111 .742 .966 .993
    assert overturns(np.array([0.25, 0.5, 1.0, 2.0])) == pytest.approx(
        [0.111, 0.742, 0.966, 0.993], abs=5e-4
    )
    answer = survival(curve, fragility=lambda sa: overturns(0.946 * sa), age_years=10_000.0)
    assert answer.annual_rate_any == pytest.approx(1.345e-3, rel=5e-3)
    assert answer.factor_5_percent == pytest.approx(0.2228, rel=5e-3)
    assert answer.probability_standing == pytest.approx(1.44e-6, rel=0.02)
    # the number was worked with straight lines between the logarithms of the points
    level = np.geomspace(curve.levels[0], curve.levels[-1], 2000)
    rate = np.interp(np.log(level), np.log(curve.levels), np.log(curve.annual_rate))
    straight = hazard_curve(curve.measure, level, np.exp(rate), period_s=1.0)
    worked = survival(straight, fragility=lambda sa: overturns(0.946 * sa), age_years=10_000.0)
    assert worked.annual_rate_any == pytest.approx(1.334e-3, rel=5e-3)
    assert worked.factor_5_percent == pytest.approx(0.225, rel=5e-3)
    assert worked.probability_standing == pytest.approx(1.6e-6, rel=2e-2)


def test_an_interval_that_includes_5_percent_decides_nothing() -> None:
    curve = hazard_curve("pgv_m_s", np.array([0.1, 1.0, 10.0]), np.array([1e-2, 1e-3, 1e-4]))
    answer = survival(curve, fragility=lambda x: np.clip(x, 0.0, 1.0), age_years=300.0)

    def test_of(p: float, low: float, high: float) -> str:
        changed = replace(
            answer, probability_standing=p, ci_low=low, ci_high=high, annual_rate_beyond=0.0
        )
        return [*changed.sentences()][-1]

    assert " is rejected at the 5 % level" in test_of(0.02, 0.01, 0.03)
    assert " is neither rejected nor accepted at the 5 % level" in test_of(0.04, 0.02, 0.08)
    assert " is not rejected at the 5 % level" in test_of(0.2, 0.1, 0.3)


def test_a_curve_that_ends_early_gives_a_range() -> None:
    curve = hazard_curve("pgv_m_s", np.array([0.01, 0.1, 0.2]), np.array([1e-2, 2e-3, 1e-3]))
    answer = survival(curve, fragility=lambda x: np.clip(x - 0.19, 0.0, 1.0), age_years=2000.0)
    assert answer.annual_rate_beyond == pytest.approx(1e-3, rel=0.05)
    first, second, last = answer.sentences()
    assert re.search(r" = \d+–\d+ %: the hazard curve ends at PGV = 0.2 m/s$", first)
    assert second.startswith("Return period of failure between 1,000 and ")
    assert "is not rejected at the 5 % level; P would be 5 %" in last
    # in 5,000 years at a rate of 1e-3 /yr less than 1 % would stand
    old = survival(curve, fragility=lambda x: np.clip(x - 0.19, 0.0, 1.0), age_years=5000.0)
    *_, last = old.sentences()
    assert "is neither rejected nor accepted at the 5 % level: it ends too early; P would" in last
    assert re.search("all its rates multiplied by at most [0-9]+", last)


def test_p_is_a_bound_where_a_rate_within_a_factor_of_2_decides_it() -> None:
    curve = hazard_curve("pgv_m_s", np.array([0.01, 0.1, 0.2]), np.array([1e-2, 2e-3, 1e-3]))

    def answered(end: float, age_years: float) -> SurvivalAnswer:
        def fragility(x: np.ndarray) -> np.ndarray:
            return np.where(x < 0.02, 0.0, np.where(x < 0.19, 0.2, end))

        return survival(curve, fragility=fragility, age_years=age_years)

    answer = answered(0.3, 5000.0)
    assert 0.3 < answer.annual_rate_beyond / answer.annual_rate_any < 1.0
    first, _, last = answer.sentences()
    assert re.search(r"years\) at most [\d.]+ %: the hazard curve ends at PGV = 0.2 m/s$", first)
    assert "multiplied by at most 0." in last
    (table,) = answer.tables()
    assert table.headers == ["", "at most"]
    # so short an age leaves P open by a few percent only
    first, *_ = answered(0.3, 10.0).sentences()
    assert first.endswith(" = 99 %")


def test_a_curve_that_begins_too_late_gives_a_bound() -> None:
    curve = hazard_curve("pgv_m_s", np.array([0.1, 1.0, 10.0]), np.array([1e-2, 1e-3, 1e-4]))
    answer = survival(curve, fragility=lambda x: np.full(x.shape, 0.5), age_years=100.0)
    first, second, last = answer.sentences()
    assert re.search(r"years\) at most [\d.]+ %: the hazard curve begins at PGV = 0.1 m/s$", first)
    assert second.startswith("Return period of failure at most ")
    assert "it begins too late" in last
