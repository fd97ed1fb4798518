"""The law of the number of failures: limits, closed forms of others, and samples."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtr, ndtri
from scipy.stats import multivariate_normal

from benchmarks.joint_law import JointFailures
from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_points import LatentPoints
from rbfrag.fragility.joint_sampling import JointSampler
from tests.fragility.portfolio_draws import LAW, anywhere, bivariate_normal

ALONE = Dependence(0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1e-9)


def poisson_binomial(p: np.ndarray) -> np.ndarray:
    pmf = np.ones(1)
    for one in p:
        pmf = np.convolve(pmf, [1.0 - one, one])
    return pmf


def test_one_block_is_exact() -> None:
    for polarity in (1, 0):
        law = JointFailures.of([0.2], Placement.of([0.3], 0.1, polarity=polarity), LAW, [3.0])
        assert (law.probability_any, law.numerical_error) == (pytest.approx(0.2, abs=1e-15), 0.0)
        assert (law.mean, law.variance) == pytest.approx((0.6, 9 * 0.16))
        assert law.at_least(3) == pytest.approx(0.2)
        assert law.at_least(3.5) == 0.0
        assert law.quantile([0.5, 0.81]).tolist() == [0.0, 3.0]


def test_identical_blocks_fail_together() -> None:
    p = np.array([0.2, 0.5, 0.3])
    law = JointFailures.of(p, Placement.of(np.full(3, 0.3), 0.1), LAW)
    assert law.numerical_error == 0.0
    np.testing.assert_allclose(law.probability[0], [0.5, 0.2, 0.1, 0.2], atol=1e-15)
    assert law.probability_any == pytest.approx(0.5, abs=1e-15)


def test_independent_blocks_are_exact() -> None:
    p = np.random.default_rng(0).uniform(0.0, 0.6, 23)
    places = (
        (Placement.of(np.zeros(23), 0.0, earthquake=np.arange(23)), LAW),
        (Placement.of(np.zeros(23), np.linspace(-1.0, 1.0, 23)), ALONE),
    )
    for blocks, dependence in places:
        law = JointFailures.of(p, blocks, dependence)
        assert law.probability_any == pytest.approx(1.0 - np.prod(1.0 - p), abs=1e-14)
        np.testing.assert_allclose(law.probability[0], poisson_binomial(p), atol=1e-14)
        assert law.numerical_error == 0.0
    np.testing.assert_allclose(
        JointFailures.independent(p).probability[0], poisson_binomial(p), atol=1e-14
    )


def test_full_dependence_is_one_step_after_another() -> None:
    law = JointFailures.fully_dependent([0.1, 0.6], [5.0, 2.0])
    assert [law.at_least(k) for k in (1, 2, 3, 7)] == pytest.approx([0.6, 0.6, 0.1, 0.1])
    values = np.arange(8) * law.unit
    assert law.mean == pytest.approx(law.probability[0] @ values)
    assert law.variance == pytest.approx(law.probability[0] @ values**2 - law.mean**2)
    assert law.probability_any == pytest.approx(0.6)


def test_two_blocks_are_a_bivariate_normal() -> None:
    p = np.array([0.1, 0.3])
    for q in (1, -1):
        blocks = Placement.of([0.0, 0.4], [0.2, 0.0], polarity=[1, q])
        r = blocks.correlation(LAW)[0, 1]
        both = float(bivariate_normal(*ndtri(p), r))
        law = JointFailures.of(p, blocks, LAW)
        assert law.at_least(2) == pytest.approx(both, abs=1e-9)
        assert law.probability_any == pytest.approx(p.sum() - both, abs=1e-9)


def test_three_blocks_are_a_trivariate_normal() -> None:
    p = np.array([0.1, 0.3, 0.6])
    blocks = Placement.of([0.0, 0.4, 1.0], [0.2, 0.0, -0.3], polarity=[1, -1, 1])
    normal = multivariate_normal(np.zeros(3), blocks.correlation(LAW))
    law = JointFailures.of(p, blocks, LAW)
    assert law.probability_any == pytest.approx(1.0 - normal.cdf(-ndtri(p)), abs=2e-4)
    assert law.at_least(3) == pytest.approx(normal.cdf(ndtri(p)), abs=2e-3)


def test_equal_sharing_is_an_integral_over_what_is_shared() -> None:
    # R = ρ of every two blocks: given what the earthquake adds they are independent
    rho, p = 0.4, np.linspace(0.02, 0.3, 25)
    dependence = Dependence(rho, 0.0, 0.0, 1.0 - rho, 1e9, 1.0, 1.0, 1e-9)
    blocks = Placement.of(np.zeros(25), np.linspace(-1.0, 1.0, 25))

    def none(x: float) -> float:
        given = ndtr((ndtri(p) - math.sqrt(rho) * x) / math.sqrt(1.0 - rho))
        return float(np.prod(1.0 - given) * math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi))

    law = JointFailures.of(p, blocks, dependence)
    exact = 1.0 - quad(none, -10.0, 10.0, epsabs=1e-12)[0]
    assert law.probability_any == pytest.approx(exact, abs=1e-4)
    assert abs(law.probability_any - exact) < 5.0 * law.numerical_error + 1e-7


@pytest.mark.parametrize(("n", "unknown"), [(16, 1.0), (37, 1.0), (40, 0.0), (30, 0.5)])
def test_law_is_that_of_samples(n: int, unknown: float) -> None:
    random = np.random.default_rng(n)
    p = random.uniform(0.002, 0.15, n)
    if unknown == 1.0:
        blocks = Placement.of(random.uniform(-0.5, 1.5, n), 0.6 * random.normal(size=n), polarity=0)
    else:
        blocks = anywhere(n, 3)
        drawn = random.random(n) < unknown
        blocks = Placement(**(vars(blocks) | {"polarity": np.where(drawn, 0, blocks.polarity)}))
    law = JointFailures.of(p, blocks, LAW)
    counts = JointSampler(LAW, blocks).counts(p, 200_000, random)
    for k in (1, 2, 5):
        share = float((counts >= k).mean())
        chance = math.sqrt(share * (1.0 - share) / counts.size)
        found = law.probability_any if k == 1 else law.at_least(k)
        error = law.numerical_error if k == 1 else law.error_at_least(k)
        assert found == pytest.approx(share, abs=4.0 * math.hypot(chance, error))
    assert law.numerical_error < 1e-3
    assert law.at_least(1) == pytest.approx(law.probability_any, abs=1e-12)
    values = np.arange(law.probability.shape[1])
    pmf = law.probability.mean(axis=0)
    assert pmf.sum() == pytest.approx(1.0)
    assert pmf @ values == pytest.approx(law.mean, rel=0.01)
    assert pmf @ values**2 - law.mean**2 == pytest.approx(law.variance, rel=0.03)
    for q, one in zip((0.05, 0.5, 0.95), law.quantile([0.05, 0.5, 0.95]), strict=True):
        assert (counts <= one).mean() > q - 0.005
        assert (counts < one).mean() < q + 0.005


def test_losses_that_are_no_whole_numbers() -> None:
    random = np.random.default_rng(2)
    p, w = random.uniform(0.05, 0.5, 12), random.uniform(0.0, 3.0e4, 12)
    blocks = Placement.of(random.normal(size=12), random.normal(size=12), polarity=0)
    law = JointFailures.of(p, blocks, LAW, w)
    sampled = JointSampler(LAW, blocks).counts(p, 100_000, random, w)
    assert law.mean == pytest.approx(p @ w)
    levels = np.array([0.1, 0.5, 0.9, 0.99])
    np.testing.assert_allclose(
        law.quantile(levels), np.quantile(sampled, levels), atol=0.02 * w.sum()
    )
    assert law.at_least(0.5 * w.sum()) == pytest.approx((sampled > 0.5 * w.sum()).mean(), abs=0.01)


def test_points_have_the_correlation_of_the_law() -> None:
    random = np.random.default_rng(1)
    for blocks in (anywhere(12, 5), Placement.of(random.normal(size=400), random.normal(size=400))):
        points = LatentPoints(LAW, blocks, 2**15)
        z = np.concatenate([one[0] for one in points.replicates()])
        np.testing.assert_allclose(z.std(axis=0), 1.0, atol=0.03)
        np.testing.assert_allclose(np.corrcoef(z.T), blocks.correlation(LAW), atol=0.05)


def test_sides_of_unknown_azimuths_are_those_of_the_law() -> None:
    unknown = Placement.of([0.0, 0.3], [0.1, 0.4], polarity=0)
    z = np.concatenate(list(LatentPoints(LAW, unknown, 2**14).replicates()), axis=1)
    sides = list(itertools.product((0, 1), (1, -1)))
    for (k, one), (m, other) in itertools.product(enumerate(sides), repeat=2):
        known = Placement.of(
            [0.0, 0.3], [0.1, 0.4], component=[one[0], other[0]], polarity=[one[1], other[1]]
        )
        expected = known.correlation(LAW)[0, 1]
        assert np.corrcoef(z[k][:, 0], z[m][:, 1])[0, 1] == pytest.approx(expected, abs=0.02)


def test_the_same_question_has_the_same_answer() -> None:
    p, blocks = np.linspace(0.01, 0.3, 8), anywhere(8, 0)
    one, other = (JointFailures.of(p, blocks, LAW).probability for _ in range(2))
    np.testing.assert_array_equal(one, other)
    assert (JointFailures.of(p, blocks, LAW, seed=1).probability != one).any()


def test_what_cannot_be_weighed_is_refused() -> None:
    with pytest.raises(InputError, match="below 0"):
        JointFailures.of([0.1], Placement.of([0.0], 0.0), LAW, [-1.0])
    with pytest.raises(InputError, match="as many probabilities"):
        JointFailures.of([0.1, 0.2], Placement.of([0.0], 0.0), LAW)
