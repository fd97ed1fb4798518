"""Failure rates against closed forms and an independent quadrature."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import ndtr

from rbfrag.errors import InputError
from rbfrag.hazards.curve import HazardCurve, hazard_curve, probability_in
from rbfrag.hazards.standing_blocks import STEP, failure_rate

FloatArray = NDArray[np.float64]


def power_law(k: float = 1e-4, b: float = 2.5, n: int = 30) -> HazardCurve:
    x = np.geomspace(1e-4, 1e4, n)
    return hazard_curve("pgv_m_s", x, k * x**-b)


@pytest.mark.parametrize("beta", [0.05, 0.4, 0.9])
@pytest.mark.parametrize("b", [1.2, 2.5, 3.5])
def test_lognormal_fragility_on_a_power_law(b: float, beta: float) -> None:
    # λ = k x^-b and P = Φ(ln(x/m)/β):  λ_f = k m^-b exp(b²β²/2)  (Cornell 1996)
    result = failure_rate(power_law(1e-4, b), lambda x: ndtr(np.log(x / 0.5) / beta))
    expected = 1e-4 * 0.5**-b * np.exp(0.5 * (b * beta) ** 2)
    assert result.annual_rate[0] == pytest.approx(expected, rel=1e-6)


def test_a_step_fragility_gives_the_rate_of_its_level() -> None:
    result = failure_rate(power_law(), lambda x: (x >= 0.37).astype(float))
    assert result.annual_rate[0] == pytest.approx(1e-4 * 0.37**-2.5, rel=2.5 * STEP)


def by_quadrature(curve: HazardCurve, p: object, kinks: list[float]) -> float:
    """The integral piece by piece with QUADPACK, told where the kinks are."""
    u, rate = np.log(curve.levels), curve.annual_rate
    total = float(rate[-1] * p(curve.levels[-1]))  # type: ignore[operator]
    for low, high in pairwise(u):
        inside = [np.log(x) for x in kinks if low < np.log(x) < high]

        def density(w: float) -> float:
            # the slope of ln λ by differences of λ itself
            step = 1e-6
            ends = np.exp([max(w - step, u[0]), min(w + step, u[-1])])
            slope = -np.diff(np.log(curve.rate_at(ends)))[0] / np.diff(np.log(ends))[0]
            share = p(np.exp(w))  # type: ignore[operator]
            return float(share * slope * curve.rate_at(np.exp(w)))

        total += quad(density, low, high, points=inside or None, epsabs=0, epsrel=1e-8,
                      limit=100)[0]  # fmt: skip
    return total


def test_any_fragility_against_adaptive_quadrature() -> None:
    random = np.random.default_rng(4)
    for _ in range(12):
        n = int(random.integers(3, 12))
        x = np.sort(10.0 ** random.uniform(-3, 1, n))
        rate = np.sort(10.0 ** random.uniform(-7, 0, n))[::-1]
        curve = hazard_curve("pgv_m_s", x, rate)
        start, scale = 10.0 ** random.uniform(-2, 0, 2)
        power = random.uniform(0.3, 8.0)

        def p(v: FloatArray, g: float = start, m: float = scale, e: float = power) -> FloatArray:
            shifted = np.maximum(np.asarray(v) - g, 0.0) / m
            return np.where(shifted > 0.0, -np.expm1(-(shifted**e)), 0.0)

        expected = by_quadrature(curve, p, [start, start + scale])
        result = failure_rate(curve, p)
        assert result.annual_rate[0] == pytest.approx(expected, rel=2e-4, abs=1e-300)


def test_a_fine_grid_of_a_curve_that_bends() -> None:
    curve = bending(25)
    x = np.geomspace(curve.levels[0], curve.levels[-1], 400_001)
    rate = curve.rate_at(x)

    def p(v: FloatArray) -> FloatArray:
        return np.asarray(ndtr(np.log(v / 0.4) / 0.5))

    brute = float(-np.diff(rate) @ p(np.sqrt(x[1:] * x[:-1])) + rate[-1] * p(x[-1]))
    assert failure_rate(curve, p).annual_rate[0] == pytest.approx(brute, rel=1e-7)


def bending(n: int) -> HazardCurve:
    """A curve that bends down in log-log, known everywhere."""
    x = np.geomspace(0.01, 4.0, n)
    return hazard_curve("pgv_m_s", x, 0.02 / (1.0 + (x / 0.03) ** 1.5) * np.exp(-x / 0.8))


def test_a_thinned_curve_is_better_than_its_chords() -> None:
    complete, few = bending(241), bending(9)
    x = np.geomspace(0.0101, 3.99, 500)
    log_rate = np.log(0.02 / (1.0 + (x / 0.03) ** 1.5)) - x / 0.8
    chords = np.interp(np.log(x), np.log(few.levels), np.log(few.annual_rate))
    missed = np.abs(np.log(few.rate_at(x)) - log_rate)
    assert np.abs(np.log(complete.rate_at(x)) - log_rate).max() < 1e-4
    assert missed.mean() < 0.4 * np.abs(chords - log_rate).mean()
    assert missed.max() < 0.5 * np.abs(chords - log_rate).max()
    # and so is a rate of failure, which chords make too small
    rates = [
        failure_rate(item, lambda v: ndtr(np.log(v / 0.4) / 0.5)).annual_rate[0]
        for item in (complete, few)
    ]
    assert rates[1] == pytest.approx(rates[0], rel=0.01)


def test_interpolation_keeps_power_laws_and_never_rises() -> None:
    x = np.geomspace(0.011, 9.9, 300)
    line = hazard_curve("pga_g", [0.01, 0.07, 0.2, 3.0, 10.0], 1e-3 * np.array(
        [0.01, 0.07, 0.2, 3.0, 10.0]) ** -1.7)  # fmt: skip
    np.testing.assert_allclose(line.rate_at(x), 1e-3 * x**-1.7, rtol=1e-12)
    steps = hazard_curve("pga_g", [0.01, 0.1, 0.2, 1.0, 10.0], [0.5, 0.5, 1e-3, 9e-4, 1e-9])
    assert (np.diff(steps.rate_at(x)) <= 0.0).all()


def test_rows_are_answered_as_if_alone() -> None:
    curve = power_law(n=12)
    medians = np.array([0.1, 0.5, 2.0])
    together = failure_rate(curve, lambda x: ndtr(np.log(x / medians[:, None]) / 0.3))
    for m, rate in zip(medians, together.annual_rate, strict=True):
        alone = failure_rate(curve, lambda x, m=m: ndtr(np.log(x / m) / 0.3)).annual_rate[0]
        assert rate == pytest.approx(alone, rel=1e-9)


def test_what_lies_beyond_the_curve_is_bounded() -> None:
    x = np.array([0.1, 0.2, 0.4])
    curve = hazard_curve("pgv_m_s", [*x, 0.8], [1e-2, 3e-3, 1e-3, 0.0])
    assert curve.end_level == 0.8
    result = failure_rate(curve, lambda v: np.clip(v, 0.0, 1.0))
    assert result.above[0] == pytest.approx(1e-3 * 0.4)
    assert result.above_at_most[0] == pytest.approx(1e-3 * 0.8)  # nothing is beyond 0.8
    endless = failure_rate(
        hazard_curve("pgv_m_s", x, [1e-2, 3e-3, 1e-3]), lambda v: np.clip(v, 0, 1)
    )
    assert endless.above_at_most[0] == pytest.approx(1e-3)
    assert endless.below[0] == pytest.approx(0.1)


def test_probability_in_a_period() -> None:
    assert probability_in(50.0, np.array([0.01]))[0] == pytest.approx(1 - np.exp(-0.5))
    with pytest.raises(InputError, match="years = 0"):
        probability_in(0.0, np.array([0.01]))


def test_a_fragility_that_is_no_number_is_rejected() -> None:
    with pytest.raises(InputError, match="not a number"):
        failure_rate(power_law(), lambda x: np.where(x > 1.0, np.nan, 0.0))


@pytest.mark.parametrize(
    ("levels", "rates", "words"),
    [
        ([0.1, 0.2, 0.2], [3e-3, 2e-3, 1e-3], "level 3.*repeats"),
        ([0.1, 0.3, 0.2], [3e-3, 2e-3, 1e-3], "level 3.*falls"),
        ([0.1, 0.2, 0.3], [3e-3, 4e-3, 1e-3], "rate rises from 0.003 to 0.004"),
        ([0.1, 0.2, 0.3], [3e-3, np.nan, 1e-3], "the rate at level 2 .* is nan"),
        ([0.1, 0.2, 0.3], [3e-3, -1e-3, -2e-3], "the rate at level 2 .* is -0.001"),
        ([0.0, 0.2, 0.3], [3e-3, 2e-3, 1e-3], "level 1 is 0"),
        ([0.1, 0.2], [3e-3, 0.0], "at least two"),
        ([0.1, 0.2], [3e-3], "2 levels and 1 rates"),
    ],
)
def test_disorder_is_rejected(levels: list[float], rates: list[float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        hazard_curve("pgv_m_s", levels, rates, source="a.csv")


def test_a_certain_exceedance_is_left_out_with_a_warning() -> None:
    curve = hazard_curve("pga_g", [0.1, 0.2, 0.3], [np.inf, 2e-3, 1e-3])
    assert curve.levels.tolist() == [0.2, 0.3]
    assert "probability 1" in curve.warnings[0]
    # straight in log-log, and nothing outside
    middle = curve.rate_at(np.sqrt(0.2 * 0.3))
    assert float(middle) == pytest.approx(np.sqrt(2e-3 * 1e-3), rel=1e-12)
    assert np.isnan(curve.rate_at(0.5))
