"""Samples of which blocks fail in one earthquake."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.fragility import joint_sampling
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler
from tests.fragility.portfolio_draws import LAW, anywhere

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
    np.testing.assert_allclose(z.T @ z / DRAWS, blocks.correlation(LAW), atol=1.5 * error)


def test_covariance_on_nodes_of_a_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    # so many unlike values that the nodes are no longer their own
    random = np.random.default_rng(4)
    blocks = Placement.of(
        random.uniform(-1.2, 1.7, 1000), random.normal(size=1000),
        polarity=random.choice((-1, 1), 1000),
    )  # fmt: skip
    z = JointSampler(LAW, blocks).normals(2000, np.random.default_rng(0))
    r = blocks.correlation(LAW)
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
    one, same, other = (
        JointSampler(LAW, blocks).failures(p, 50, np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, same)
    assert (one != other).any()
