"""Workers change nothing, and say how far they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbfrag.campaign.rock_mass_answer import shake
from rbfrag.campaign.summary import CampaignProgress
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.rockmasses.file import read_rock_mass
from rbfrag.rockmasses.shaking import CHUNK
from tests.synthetic import shaking

EXAMPLE = Path(__file__).resolve().parent.parent.parent / "docs" / "examples" / "rockmass.toml"


def record() -> GroundMotion:
    a = shaking(5)
    return GroundMotion(0.6 * a / np.abs(a).max(), 0.01)


def test_two_workers_find_what_one_finds() -> None:
    result = read_rock_mass(EXAMPLE).realise(3 * CHUNK, 1)
    document: list[CampaignProgress] = []
    alone = shake(result, record(), scales=[0.7, 1.3], jobs=1)
    both = shake(result, record(), scales=[0.7, 1.3], jobs=2, on_progress=document.append)
    assert np.array_equal(alone.code, both.code)
    assert np.array_equal(alone.displacement_m, both.displacement_m, equal_nan=True)
    assert np.array_equal(alone.rotation_rad, both.rotation_rad, equal_nan=True)
    assert alone.about == both.about
    assert alone.runs == both.runs > 2 * CHUNK
    moved = int(alone.moves.any(axis=0).sum())
    assert document[0].completed == 0
    assert document[-1].completed == document[-1].total == moved
    assert document[-1].rate_per_s > 0.0
    assert document[-1].seconds_left == 0.0
    assert document[0].seconds_left is None


def test_no_worker_is_rejected() -> None:
    result = read_rock_mass(EXAMPLE).realise(10, 1)
    with pytest.raises(InputError, match="jobs"):
        shake(result, record(), jobs=0)
