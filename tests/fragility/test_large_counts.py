"""Numbers of failures of many blocks against draws of each block."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler, LargeCounts, _number
from rbfrag.solver.results import FloatArray
from tests.fragility.portfolio_draws import LAW

DRAWS = 4000


def blocks(n: int, sites: int, middle: float) -> tuple[Placement, FloatArray]:
    """Return blocks of some sites, each shaken otherwise, and Φ⁻¹ of their P."""
    random = np.random.default_rng(n)
    site, ln_y = np.sort(random.integers(sites, size=n)), random.uniform(-2.5, 0.5, n)
    bound = middle + 0.8 * random.normal(size=sites)[site] - ln_y
    where = Placement.of(random.uniform(-0.5, 1.5, n), ln_y, site=site, polarity=0)
    return where, np.asarray(bound)


@pytest.mark.parametrize(("n", "sites", "middle"), [(1200, 300, -3.5), (1200, 30, -3.0)])
def test_numbers_are_those_of_draws(n: int, sites: int, middle: float) -> None:
    where, bound = blocks(n, sites, middle)
    weight = np.linspace(1.0, 3.0, n)
    large = LargeCounts(LAW, where, np.ones(n, dtype=np.int64))
    marks = [(np.ones(n), np.ones(n)), (weight, weight**2)]
    latent = large.latent(4 * DRAWS, np.random.default_rng(1))
    drawn, with_any = large.sums(bound, 0.0, latent, marks)
    random = np.random.default_rng(2)
    sampler = JointSampler(LAW, where)
    fails = np.concatenate([sampler.normals(200, random) <= bound for _ in range(DRAWS // 200)])
    for item, other in zip(drawn, (fails.sum(axis=1), fails @ weight), strict=True):
        assert item.mean() == pytest.approx(other.mean(), rel=0.03)
        assert item.std() == pytest.approx(other.std(), rel=0.06)
    assert drawn[0].mean() == pytest.approx(ndtr(bound).sum(), rel=0.02)
    assert with_any == pytest.approx(fails.any(axis=1).mean(), abs=0.02)
    low, high = np.quantile(fails.sum(axis=1), (0.05, 0.95))
    assert np.quantile(drawn[0], (0.05, 0.95)) == pytest.approx((low, high), abs=0.1 * high + 1.0)


def test_like_blocks_are_as_many_rows() -> None:
    where, bound = blocks(300, 40, -3.0)
    count = np.random.default_rng(1).integers(1, 6, 300)
    separate = np.repeat(np.arange(300), count)
    item = np.ones(300)
    rows = LargeCounts(LAW, where, count)
    apart = LargeCounts(LAW, where.only(separate), np.ones(separate.size, dtype=np.int64))
    draws = 20_000
    together, any_together = rows.sums(
        bound, 0.0, rows.latent(draws, np.random.default_rng(1)), [(item, item)]
    )
    single, any_single = apart.sums(
        bound[separate],
        0.0,
        apart.latent(draws, np.random.default_rng(1)),
        [(item[separate], item[separate])],
    )
    assert together.mean() == pytest.approx(single.mean(), rel=0.01)
    assert together.std() == pytest.approx(single.std(), rel=0.03)
    assert any_together == pytest.approx(any_single, abs=0.01)


def test_what_a_site_shares_beside_z_widens_the_law() -> None:
    # fails where √(1-g) Z + √g ξ of the site is low enough: with ξ common to each site
    where, bound = blocks(1200, 30, -2.5)
    large, single, share = (
        LargeCounts(LAW, where, np.ones(1200, dtype=np.int64)),
        np.ones(1200),
        0.3,
    )
    latent = large.latent(4 * DRAWS, np.random.default_rng(1))
    drawn, _ = large.sums(bound, share, latent, [(single, single)])
    random, sampler, numbers = np.random.default_rng(2), JointSampler(LAW, where), []
    for _ in range(DRAWS // 200):
        xi = random.normal(size=(200, 30))[:, where.site]
        value = np.sqrt(1.0 - share) * sampler.normals(200, random) + np.sqrt(share) * xi
        numbers.append((value <= bound).sum(axis=1))
    assert drawn.std() == pytest.approx(np.concatenate(numbers).std(), rel=0.06)


def test_numbers_have_their_mean_and_variance() -> None:
    mean, variance = np.array([0.02, 3.0, 3.0, 40.0]), np.array([0.02, 2.0, 7.0, 90.0])
    wide = np.broadcast_to(mean, (200_000, 4)), np.broadcast_to(variance, (200_000, 4))
    number, none = _number(*wide, np.random.default_rng(1))
    np.testing.assert_allclose(number.mean(axis=0), mean, rtol=0.05)
    np.testing.assert_allclose(number.var(axis=0), variance, rtol=0.08)
    np.testing.assert_allclose((number == 0).mean(axis=0), none[0], atol=0.005)
