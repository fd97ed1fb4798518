"""Samples of which blocks fail in one earthquake: drawn, and at points of low discrepancy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from rbfrag.fragility import joint_sampling
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler, LatentPoints
from tests.fragility.portfolio_draws import LAW, anywhere, correlation

DRAWS = 20_000


@pytest.fixture(params=["factors", "grid"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Each way of drawing, for portfolios of any size."""
    if request.param == "grid":
        monkeypatch.setattr(joint_sampling, "MOST_OF_A_COMPONENT", 1)
    return str(request.param)


def test_covariance_is_the_matrix_of_correlations(way: str) -> None:
    blocks = anywhere(40, 2)
    z = JointSampler(LAW, blocks).normals(DRAWS, np.random.default_rng(0))
    assert z.shape == (DRAWS, 40)
    error = 4.5 / np.sqrt(DRAWS)
    np.testing.assert_allclose(z.mean(axis=0), 0.0, atol=error)
    np.testing.assert_allclose(z.T @ z / DRAWS, correlation(LAW, blocks), atol=1.5 * error)


def test_covariance_on_nodes_of_a_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    # so many unlike values that the nodes are no longer their own
    random = np.random.default_rng(4)
    blocks = Placement.of(
        random.uniform(-1.2, 1.7, 1000), random.normal(size=1000),
        polarity=random.choice((-1, 1), 1000),
    )  # fmt: skip
    z = JointSampler(LAW, blocks).normals(2000, np.random.default_rng(0))
    r = correlation(LAW, blocks)
    error = z.T @ z / 2000 - r
    assert np.abs(error).max() < 0.16
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert abs(error.mean()) < 0.015


def test_marginals_are_the_probabilities(way: str) -> None:
    blocks, p = anywhere(30, 3), np.linspace(0.0, 1.0, 30)
    failed = JointSampler(LAW, blocks).failures(p, DRAWS, np.random.default_rng(1))
    np.testing.assert_array_less(
        np.abs(failed.mean(axis=0) - p), 4.0 * np.sqrt(p * (1.0 - p) / DRAWS) + 1e-12
    )


def test_equal_blocks_that_face_the_same_way_fail_together(way: str) -> None:
    # blocks 0 and 1 are equal; 2 faces the other way, 3 stands elsewhere, 4 is of another strength
    blocks = Placement.of(
        np.zeros(5), [0.0, 0.0, 0.0, 0.0, 0.5], site=[0, 0, 0, 1, 0], polarity=[1, 1, -1, 1, 1]
    )
    failed = JointSampler(LAW, blocks).failures(np.full(5, 0.4), 500, np.random.default_rng(2))
    assert (failed[:, 0] == failed[:, 1]).all()
    for other in (2, 3, 4):
        assert not (failed[:, 0] == failed[:, other]).all()


def test_earthquakes_share_nothing(way: str) -> None:
    blocks = Placement.of(np.zeros(2), 0.0, earthquake=[0, 1])
    z = JointSampler(LAW, blocks).normals(DRAWS, np.random.default_rng(3))
    assert abs((z[:, 0] * z[:, 1]).mean()) < 4.5 / np.sqrt(DRAWS)


def test_unknown_azimuths_are_drawn_in_every_sample() -> None:
    # equal blocks: the same component in one half of the samples, and then either side
    blocks = Placement.of(np.zeros(2), 0.0, polarity=0)
    z = JointSampler(LAW, blocks).normals(DRAWS, np.random.default_rng(4))
    expected = LAW.rho_e + LAW.rho_s + 0.5 * LAW.rho_v
    assert (z[:, 0] * z[:, 1]).mean() == pytest.approx(expected, abs=5.0 / np.sqrt(DRAWS))
    assert np.mean(z[:, 0] == z[:, 1]) == pytest.approx(0.25, abs=0.02)


def test_a_seed_gives_the_same_samples(way: str) -> None:
    blocks, p = anywhere(30, 6), np.full(30, 0.3)
    single, same, other = (
        JointSampler(LAW, blocks).failures(p, 50, np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(single, same)
    assert (single != other).any()


def test_points_have_the_correlation_of_the_law() -> None:
    random = np.random.default_rng(1)
    for blocks in (anywhere(12, 5), Placement.of(random.normal(size=400), random.normal(size=400))):
        z, _ = LatentPoints(LAW, blocks, 2**15).sides()
        assert z.shape == (1, blocks.size, 2**15)
        np.testing.assert_allclose(z[0].std(axis=1), 1.0, atol=0.03)
        np.testing.assert_allclose(np.corrcoef(z[0]), correlation(LAW, blocks), atol=0.05)


def test_sides_of_unknown_azimuths_are_those_of_the_law() -> None:
    unknown = Placement.of([0.0, 0.3], [0.1, 0.4], polarity=0)
    z, first = LatentPoints(LAW, unknown, 2**14).sides()
    np.testing.assert_allclose(np.bincount(first.ravel()) / first.size, 0.25, atol=0.01)
    sides = list(itertools.product((0, 1), (1, -1)))
    for (k, item), (m, other) in itertools.product(enumerate(sides), repeat=2):
        reference = Placement.of(
            [0.0, 0.3], [0.1, 0.4], component=[item[0], other[0]], polarity=[item[1], other[1]]
        )
        expected = correlation(LAW, reference)[0, 1]
        assert np.corrcoef(z[k][0], z[m][1])[0, 1] == pytest.approx(expected, abs=0.02)


def test_known_azimuths_beside_unknown_ones() -> None:
    mixed = Placement.of([0.0, 0.3, 0.3], 0.1, component=[1, 0, 1], polarity=[0, -1, 1])
    z, _ = LatentPoints(LAW, mixed, 2**14).sides()
    np.testing.assert_array_equal(z[:, 1:], np.broadcast_to(z[:1, 1:], z[:, 1:].shape))
    for k, (component, polarity) in enumerate(itertools.product((0, 1), (1, -1))):
        expected = Placement.of(
            [0.0, 0.3, 0.3], 0.1, component=[component, 0, 1], polarity=[polarity, -1, 1]
        )
        np.testing.assert_allclose(np.corrcoef(z[k]), correlation(LAW, expected), atol=0.02)


def test_points_are_the_same_whenever_asked() -> None:
    blocks = anywhere(5, 1)
    single, same, other = (LatentPoints(LAW, blocks, 2**8, seed).sides()[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(single, same)
    assert (single != other).any()
