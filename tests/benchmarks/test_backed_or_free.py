"""Backed and free-standing blocks: shares that another code found, and the table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks import backed_or_free
from benchmarks.backed_or_free import Scan, Shares, shares, stored_motions, table
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.results import DEFAULT_P2
from tests.synthetic import shaking

INDEPENDENT = {
    (10.0, 11): (0.95, 0.42),
    (3.0, 13): (0.77, 0.02),
    (3.0, 15): (0.48, 0.0),
    (0.1, 9): (0.25, 0.67),
}
"""Shares of free and of backed blocks by (p², number of the strength), by an RK4 integration of
the same equations. Chaos moves a share of 265 motions by up to 0.04."""


def test_shares_are_those_of_an_independent_integration(records_dir: Path) -> None:
    motions = stored_motions(records_dir)
    assert len(motions) == 265
    for (p2, number), (free_standing, backed) in INDEPENDENT.items():
        result = shares(motions, (p2,), backed_or_free.Y_OVER_PGV[[number]])
        assert result.free_standing.mean() == pytest.approx(free_standing, abs=0.04)
        assert result.backed.mean() == pytest.approx(backed, abs=0.04)


def test_the_table_has_every_size_and_what_is_thought_safe() -> None:
    motions = [GroundMotion(shaking(seed, npts=400), 0.02) for seed in range(3)]
    result = shares(motions)
    lines = table(result).splitlines()
    assert [line.split("|")[1].strip() for line in lines[2:]] == [f"{p2:g}" for p2 in DEFAULT_P2]
    shape = (2, 1, 3)
    free_standing = np.array([1.0, 0.0, 1.0, 0.0, 0.0, 1.0]).reshape(shape)
    predicted = np.array([0.9, 0.01, 0.02, 0.9, 0.01, 0.01]).reshape(shape)
    below = np.array([True, True, True, True, True, False]).reshape(shape)
    fractions = Shares(free_standing, free_standing, predicted, below)
    assert fractions.where_thought_safe() == pytest.approx([1.0 / 3.0])


def test_islands_are_counted() -> None:
    falls = np.array([True, True, False, True, False, False, True])
    assert Scan(falls, np.zeros(7)).islands == 3
    assert Scan(~falls, np.zeros(7)).islands == 2
