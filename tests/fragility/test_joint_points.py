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
