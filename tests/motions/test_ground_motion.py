"""The motion that every room passes on: checked once, read-only, with an identity of its own."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion


def test_samples_are_copied_and_read_only() -> None:
    samples = np.array([0.1, -0.2])
    motion = GroundMotion(samples, 0.01)
    samples[0] = 9.0
    assert motion.acceleration_g.tolist() == [0.1, -0.2]
    for array in (motion.acceleration_g, motion.time_s, motion.interval_s):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_intervals_are_dt_to_the_bit() -> None:
    motion = GroundMotion(np.zeros(1000), 0.005)
    assert set(motion.interval_s.tolist()) == {0.005}
    assert motion.time_s[999] == 999 * 0.005


@pytest.mark.parametrize(
    ("samples", "dt_s", "words"),
    [
        ([], 0.01, "at least one"),
        ([[0.1]], 0.01, "one-dimensional"),
        ([0.1, math.nan], 0.01, "sample 1 is nan"),
        ([0.1, 0.2, -math.inf], 0.01, "sample 2 is -inf"),
        ([0.1], 0.0, "positive"),
        ([0.1], -0.01, "-0.01"),
        ([0.1], math.nan, "nan"),
        ([0.1], None, "None"),
    ],
)
def test_bad_samples(samples: list[float], dt_s: float | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        GroundMotion(np.array(samples), dt_s)


@pytest.mark.parametrize(
    ("times", "samples", "words"),
    [
        ([0.0, 1.0], [1.0], "2 node times but 1 acceleration"),
        ([0.0, 1.0, 0.5], [0.0, 1.0, 0.0], "node 2 at 0.5 s follows 1 s"),
        ([0.0, math.nan], [0.0, 1.0], "node time 1 is nan"),
    ],
)
def test_bad_nodes(times: list[float], samples: list[float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        GroundMotion.from_nodes(times, samples)


def test_nodes_keep_jumps() -> None:
    motion = GroundMotion.from_nodes([0.0, 0.0, 1.0, 1.0], [0.0, 2.0, 2.0, 0.0])
    assert motion.dt_s is None
    assert motion.interval_s.tolist() == [0.0, 1.0, 0.0]
    assert motion.pgv_m_s == pytest.approx(2.0 * 9.80665, rel=1e-15)
    assert motion.tm_s is None


def test_hash_is_of_samples_alone() -> None:
    motion = GroundMotion(np.array([0.1, -0.2]), 0.01, station="A")
    assert motion.sha256 == GroundMotion(np.array([0.1, -0.2]), 0.01, station="B").sha256
    assert motion.sha256 != GroundMotion(np.array([0.1, -0.2000000001]), 0.01).sha256
    nodes = GroundMotion.from_nodes([0.0, 0.01], [0.1, -0.2])
    assert nodes.sha256 != motion.sha256
    assert nodes.sha256 != GroundMotion.from_nodes([0.0, 0.02], [0.1, -0.2]).sha256


def test_scaled_keeps_labels() -> None:
    motion = GroundMotion(np.array([0.1, -0.2]), 0.01, station="ABC", component="090")
    assert motion.scaled(-2.0).acceleration_g.tolist() == [-0.2, 0.4]
    assert motion.scaled(-2.0).label == "ABC 090"
