"""Rate of at least k failures at a site: closed forms, limits, bounds, independent samples."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.special import ndtr, ndtri
from scipy.stats import binom, multivariate_normal

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.hazards.joint_rate import joint_rates
from rbfrag.solver.results import FloatArray
from tests.fragility.portfolio_draws import LAW, SHARED, correlation

U = np.arange(-4.0, 2.0, 0.0112)
MASS = 0.0112 * 2.5e-3 * np.exp(-2.5 * U)
"""Of a power law that is steep enough for every part of P to count."""

NOTHING = dict.fromkeys(("rho_e", "rho_s", "rho_v", "rho_o"), 0.0)
TOGETHER = Dependence(**{**SHARED, **NOTHING, "rho_e": 1.0})
APART = Dependence(**{**SHARED, **NOTHING, "rho_o": 1.0, "l_y": 1e-12})


def blocks(n: int, seed: int = 0) -> tuple[Placement, FloatArray]:
    """Return blocks of one site and of unknown azimuths, and P on the nodes."""
    random = np.random.default_rng(seed)
    ln_y = random.uniform(-1.5, 0.0, n)
    where = Placement.of(random.uniform(0.0, 1.5, n), ln_y, polarity=0)
    return where, ndtr((U - ln_y[:, None] - 0.4) / 0.45)


def test_one_block_is_its_own_rate() -> None:
    where, p = blocks(1)
    rates = joint_rates(p[None], MASS, where, LAW)
    assert rates.rate[0, 0] == pytest.approx(float(p[0] @ MASS), rel=1e-14)
    assert rates.error.tolist() == [0.0]


def test_two_blocks_by_the_normal_law_of_their_sides() -> None:
    where, p = blocks(2, seed=3)
    subset = slice(150, None, 40)  # scipy's own integral, node by node
    mass = np.zeros(U.size)
    mass[subset] = MASS[subset]
    both = np.zeros(U.size)
    for sides, weight in (((0, 1, 1, 1), 0.5), ((0, 0, 1, 1), 0.25), ((0, 0, 1, -1), 0.25)):
        expected = Placement.of(where.l, where.ln_y, component=sides[:2], polarity=sides[2:])
        law = multivariate_normal(np.zeros(2), correlation(LAW, expected))
        both[subset] += weight * law.cdf(ndtri(p[:, subset]).T)
    rates = joint_rates(p[None], mass, where, LAW, (1, 2))
    assert rates.rate[1, 0] == pytest.approx(float(both @ mass), rel=1e-6)
    assert rates.rate[:, 0].sum() == pytest.approx(float(p.sum(axis=0) @ mass), rel=1e-12)
    assert rates.error.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("n", [3, 6])
def test_ones_that_share_all_or_nothing_are_exact(n: int) -> None:
    where, p = blocks(n)
    alike = Placement.of(0.5, where.ln_y, polarity=0)
    counts = range(1, n + 1)
    together = joint_rates(p[None], MASS, alike, TOGETHER, counts)
    separate = np.sort(p @ MASS)[::-1]
    np.testing.assert_allclose(together.rate[:, 0], separate, rtol=1e-12)
    same = np.broadcast_to(p[0], p.shape)
    apart = joint_rates(same[None], MASS, where, APART, counts)
    expected = [binom.sf(k - 1, n, p[0]) @ MASS for k in counts]
    np.testing.assert_allclose(apart.rate[:, 0], expected, rtol=1e-9)
    unlike = joint_rates(p[None], MASS, where, APART).rate[0, 0]
    assert unlike == pytest.approx(float((1.0 - (1.0 - p).prod(axis=0)) @ MASS), rel=1e-12)
    assert not together.error.any()
    assert not apart.error.any()


@pytest.mark.parametrize("n", [3, 15, 60])
def test_rates_are_those_of_samples(n: int) -> None:
    where, p = blocks(n, seed=n)
    rates = joint_rates(p[None], MASS, where, LAW, (1, 2, 3))
    above = MASS[::-1].cumsum()[::-1]
    z = JointSampler(LAW, where).normals(20_000, np.random.default_rng(0))
    bound = ndtri(np.minimum(p, 1.0 - 1e-16))
    node = np.stack([np.searchsorted(bound[i], z[:, i]) for i in range(n)], axis=1)
    separate = np.sort(np.append(above, 0.0)[node], axis=1)[:, ::-1]
    for i, k in enumerate(rates.counts):
        error = separate[:, k - 1].std() / np.sqrt(len(z))
        assert (
            abs(rates.rate[i, 0] - separate[:, k - 1].mean())
            < 4.0 * error + 0.006 * rates.rate[i, 0]
        )
    assert rates.error[0] < 0.01 * rates.rate[0, 0]


@pytest.mark.parametrize("n", [2, 3, 5, 15, 40])
def test_between_the_bounds(n: int) -> None:
    for seed in range(5):
        where, p = blocks(n, seed)
        rates = joint_rates(p[None], MASS, where, LAW, range(1, n + 1)).rate[:, 0]
        assert p.max(axis=0) @ MASS <= rates[0] <= p.sum(axis=0) @ MASS
        assert all(more >= fewer >= 0.0 for more, fewer in pairwise(rates))
        # numbers of failures add up to those expected
        assert rates.sum() == pytest.approx(float(p.sum(axis=0) @ MASS), rel=2e-3)


def test_like_blocks_by_the_sides_that_they_face() -> None:
    # three like blocks face one, two or three of the four sides, whose Z are normal
    same = np.zeros(3)
    where, (p, *_) = Placement.of(same, same, polarity=0), blocks(1)[1]
    rates = joint_rates(np.stack([p, p, p])[None], MASS, where, LAW)
    sides = Placement.of(np.zeros(4), 0.0, component=[0, 0, 1, 1], polarity=[1, -1, 1, -1])
    z = np.random.default_rng(1).multivariate_normal(
        np.zeros(4), correlation(LAW, sides), size=400_000
    )
    faced = np.random.default_rng(2).integers(4, size=(len(z), 3))
    first = np.take_along_axis(z, faced, axis=1).min(axis=1)
    any_fails = np.searchsorted(np.sort(first), ndtri(p), side="right") / len(z)
    assert rates.rate[0, 0] == pytest.approx(float(any_fails @ MASS), rel=0.01)


def test_tables_answer_by_the_same_points() -> None:
    where, p = blocks(7)
    more = np.stack([p, np.minimum(1.01 * p, 1.0), p])
    rates = joint_rates(more, MASS, where, LAW, (1, 3)).rate
    np.testing.assert_array_equal(rates[:, 0], rates[:, 2])
    # of rare failures a hundredth more; by points of its own the table would scatter by as much
    assert rates[0, 1] / rates[0, 0] == pytest.approx(1.008, abs=0.003)
