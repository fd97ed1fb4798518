"""Normals of the copula at points of low discrepancy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_points import LatentPoints
from tests.fragility.portfolio_draws import LAW, anywhere


def test_points_have_the_correlation_of_the_law() -> None:
    random = np.random.default_rng(1)
    for blocks in (anywhere(12, 5), Placement.of(random.normal(size=400), random.normal(size=400))):
        z, _ = LatentPoints(LAW, blocks, 2**15).sides()
        assert z.shape == (1, blocks.size, 2**15)
        np.testing.assert_allclose(z[0].std(axis=1), 1.0, atol=0.03)
        np.testing.assert_allclose(np.corrcoef(z[0]), blocks.correlation(LAW), atol=0.05)


def test_sides_of_unknown_azimuths_are_those_of_the_law() -> None:
    unknown = Placement.of([0.0, 0.3], [0.1, 0.4], polarity=0)
    z, first = LatentPoints(LAW, unknown, 2**14).sides()
    np.testing.assert_allclose(np.bincount(first.ravel()) / first.size, 0.25, atol=0.01)
    sides = list(itertools.product((0, 1), (1, -1)))
    for (k, one), (m, other) in itertools.product(enumerate(sides), repeat=2):
        known = Placement.of(
            [0.0, 0.3], [0.1, 0.4], component=[one[0], other[0]], polarity=[one[1], other[1]]
        )
        expected = known.correlation(LAW)[0, 1]
        assert np.corrcoef(z[k][0], z[m][1])[0, 1] == pytest.approx(expected, abs=0.02)


def test_known_azimuths_beside_unknown_ones() -> None:
    mixed = Placement.of([0.0, 0.3, 0.3], 0.1, component=[1, 0, 1], polarity=[0, -1, 1])
    z, _ = LatentPoints(LAW, mixed, 2**14).sides()
    np.testing.assert_array_equal(z[:, 1:], np.broadcast_to(z[:1, 1:], z[:, 1:].shape))
    for k, (component, polarity) in enumerate(itertools.product((0, 1), (1, -1))):
        known = Placement.of(
            [0.0, 0.3, 0.3], 0.1, component=[component, 0, 1], polarity=[polarity, -1, 1]
        )
        np.testing.assert_allclose(np.corrcoef(z[k]), known.correlation(LAW), atol=0.02)


def test_points_are_the_same_whenever_asked() -> None:
    blocks = anywhere(5, 1)
    one, same, other = (LatentPoints(LAW, blocks, 2**8, seed).sides()[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert (one != other).any()
