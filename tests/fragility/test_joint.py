"""Counts of failures in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import ndtr, ndtri
from scipy.stats import betabinom, binom, multivariate_normal

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement, count_moments, count_quantiles, joint_excess
from rbfrag.fragility.joint_sampling import JointSampler
from tests.fragility.portfolio_draws import LAW, anywhere, bivariate_normal

ALONE = Dependence(0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1e-9)


@pytest.mark.parametrize("r", [-1.0, -0.9995, -0.6, 0.0, 0.3, 0.95, 0.9999, 1.0])
def test_orthant_of_two_medians(r: float) -> None:
    assert bivariate_normal(0.0, 0.0, r) == pytest.approx(
        0.25 + math.asin(r) / (2.0 * math.pi), abs=1e-14
    )


@pytest.mark.parametrize("r", [-0.9999, -0.98, -0.4, 0.2, 0.9, 0.985, 0.995, 0.999, 0.99999])
def test_bivariate_normal_is_that_of_scipy(r: float) -> None:
    random = np.random.default_rng(3)
    a = random.normal(size=60) * 1.5
    b = np.copysign(1.0, r) * (a + random.normal(size=60) * 3.0 * math.sqrt(1.0 - abs(r)))
    both = multivariate_normal([0.0, 0.0], [[1.0, r], [r, 1.0]])
    theirs = [both.cdf(pair) for pair in zip(a, b, strict=True)]
    np.testing.assert_allclose(bivariate_normal(a, b, r), theirs, rtol=0, atol=1e-8)


def test_bivariate_normal_is_its_integral_over_one_variable() -> None:
    a, b, r = -1.1, 0.4, 0.7

    def inner(x: float) -> float:
        upper = (b - r * x) / math.sqrt(1.0 - r * r)
        return math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi) * float(ndtr(upper))

    complete = quad(inner, -12.0, a, epsabs=1e-13)[0]
    assert bivariate_normal(a, b, r) == pytest.approx(complete, abs=1e-12)


def test_limits_of_the_excess() -> None:
    p, q = np.array([0.0, 1.0, 0.3, 0.3]), np.array([0.4, 0.2, 0.0, 0.6])
    a, b = ndtri(p), ndtri(q)
    np.testing.assert_allclose(joint_excess(a, b, 1.0), np.minimum(p, q) - p * q, atol=1e-15)
    beyond = np.nextafter(1.0, 2.0)  # a sum that was rounded up
    for sign in (-1.0, 1.0):
        assert np.array_equal(joint_excess(a, b, sign * beyond), joint_excess(a, b, sign))
    np.testing.assert_allclose(joint_excess(a, b, 0.0), 0.0, atol=1e-15)
    least = np.maximum(p + q - 1.0, 0.0) - p * q
    np.testing.assert_allclose(joint_excess(a, b, -1.0), least, atol=1e-15)


def test_one_block_and_equal_blocks_have_exact_moments() -> None:
    single = Placement.of([0.3], [0.1])
    assert count_moments([0.2], single, LAW, [3.0]) == pytest.approx((0.6, 9 * 0.16))
    five = Placement.of(np.full(5, 0.3), 0.1)
    assert count_moments(np.full(5, 0.2), five, LAW) == pytest.approx((1.0, 25 * 0.16))
    counts = count_quantiles(5, 1.0, 25 * 0.16, [0.5, 0.79, 0.81])
    assert counts.tolist() == [0, 0, 5]


def test_variance_of_independent_blocks_is_their_sum() -> None:
    p = np.array([0.1, 0.5, 0.7])
    apart = Placement.of([0.0, 0.0, 0.0], 0.0, earthquake=[0, 1, 2])
    assert count_moments(p, apart, LAW) == pytest.approx((1.3, 0.09 + 0.25 + 0.21))


@pytest.mark.parametrize("drawn", [False, True])
def test_variance_is_that_of_samples(drawn: bool) -> None:
    random = np.random.default_rng(5)
    blocks = anywhere(40, 5)
    if drawn:
        parts = vars(blocks) | {"polarity": np.where(random.random(40) < 0.6, 0, blocks.polarity)}
        blocks = Placement(**parts)
    p, w = random.uniform(0.02, 0.98, 40), random.uniform(0.5, 2.0, 40)
    mean, variance = count_moments(p, blocks, LAW, w)
    counts = JointSampler(LAW, blocks).failures(p, 60_000, random) @ w
    assert counts.mean() == pytest.approx(mean, abs=4.0 * math.sqrt(variance / counts.size))
    assert counts.var() == pytest.approx(variance, rel=0.03)


def test_variance_of_many_blocks_is_summed_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    blocks, p = anywhere(30, 1), np.linspace(0.01, 0.9, 30)
    complete = count_moments(p, blocks, LAW)
    monkeypatch.setattr("rbfrag.fragility.joint._PAIRS_AT_ONCE", 50)
    assert count_moments(p, blocks, LAW) == pytest.approx(complete, rel=1e-13)


@given(
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30),
    st.integers(0, 1000),
    st.sampled_from([LAW, ALONE]),
)
@settings(max_examples=100)
def test_numbers_lie_between_none_and_all(p: list[float], seed: int, law: Dependence) -> None:
    moments = count_moments(p, anywhere(len(p), seed), law)
    numbers = count_quantiles(len(p), *moments, [0.01, 0.5, 0.99])
    assert 0 <= numbers[0] <= numbers[1] <= numbers[2] <= len(p)


def test_count_has_the_given_mean_and_variance() -> None:
    n, mean, variance = 20, 5.0, 14.0
    more = 1.0 / ((variance / (mean * (1.0 - mean / n)) - 1.0) / (n - 1.0)) - 1.0
    theirs = betabinom(n, mean / n * more, (1.0 - mean / n) * more)
    assert (theirs.mean(), theirs.var()) == pytest.approx((mean, variance))
    levels = [0.05, 0.5, 0.95]
    assert count_quantiles(n, mean, variance, levels).tolist() == theirs.ppf(levels).tolist()


def test_count_that_scatters_less_than_a_binomial_number() -> None:
    # two blocks, nearly sure and nearly safe: 1 or so
    assert count_quantiles(2, 1.0, 0.18, 0.5) == 1
    alone = count_quantiles(10, 3.0, 2.1, [0.1, 0.9])
    assert alone.tolist() == binom.ppf([0.1, 0.9], 10, 0.3).tolist()


def test_count_of_nothing_or_all() -> None:
    assert [int(count_quantiles(3, mean, 0.0, 0.5)) for mean in (0.0, 3.0)] == [0, 3]


def test_what_is_no_portfolio_is_rejected() -> None:
    with pytest.raises(InputError, match="columns of one length"):
        Placement.of([0.0, 1.0], [0.0, 1.0, 2.0])
    with pytest.raises(InputError, match="must be finite"):
        Placement.of([math.nan], 0.0)
    with pytest.raises(InputError, match="polarity is"):
        Placement.of([0.0], 0.0, polarity=2)
    with pytest.raises(InputError, match="must be 0 and 1"):
        Placement.of([0.0, 0.0], 0.0, component=[7, 0], polarity=[1, 0])
    single = Placement.of([0.0], 0.0)
    with pytest.raises(InputError, match="1 blocks need as many probabilities"):
        count_moments([0.1, 0.2], single, LAW)
    with pytest.raises(InputError, match="not between 0 and 1"):
        count_moments([1.1], single, LAW)
    with pytest.raises(InputError, match="weight"):
        count_moments([0.1], single, LAW, [math.inf])
