"""The study of joint failures: which blocks its portfolios hold, and how they are judged."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.held_out import MODELS, Outcomes
from benchmarks.joint_failures import PLACES, PUBLISHED, Line, portfolio


def outcomes() -> Outcomes:
    """Return three sites with two components each in one earthquake, one component in another."""
    random = np.random.default_rng(0)
    motion = np.repeat(np.arange(7), 60)
    return Outcomes(
        keys=(),
        failed=random.integers(2, size=420).astype(float),
        event=(motion == 6).astype(np.intp),
        site=motion // 2,
        motion=motion,
        polarity=np.tile((-1, 1), 210),
        fold=np.zeros(420, dtype=np.intp),
        strength=np.zeros(420, dtype=np.intp),
        value={},
    )


@pytest.mark.parametrize("place", PLACES)
def test_portfolios_hold_blocks_of_one_earthquake_and_place(place: str) -> None:
    data, random = outcomes(), np.random.default_rng(1)
    usable = [np.flatnonzero(data.event == event) for event in (0, 1)]
    drawn = [portfolio(data, usable, place, random) for _ in range(200)]
    found = [rows for rows in drawn if rows is not None]
    assert found
    for rows in found:
        assert 10 <= rows.size == np.unique(rows).size <= 50
        assert np.unique(data.event[rows]).size == 1
        sites, motions = (np.unique(label[rows]).size for label in (data.site, data.motion))
        sides = np.unique(data.polarity[rows]).size
        if place == "several sites":
            assert data.event[rows[0]] == 0
            assert motions >= 3  # of 4 or more drawn, of which one may have none of few blocks
        else:
            assert sites == 1
            assert place == "one site" or motions == sides == 1


def test_what_portfolios_are_judged_by() -> None:
    line = Line(
        event=np.array([0, 0, 1]),
        count=np.array([3.0, 1.0, 0.0]),
        mean=np.array([1.0, 1.0, 2.0]),
        variance=np.array([2.0, 2.0, 4.0]),
        alone=np.ones(3),
        inside=np.ones(3, dtype=bool),
        any_by={"one": np.array([1.0, 0.5, 0.5])},
    )
    assert line.ratio(line.variance) == 1.0
    assert line.ratio(line.alone) == pytest.approx(8.0 / 3.0)
    low, high = line.ratio_range()
    assert (low, high) == (1.0, 1.0)
    mean, loss, brier = line.scores()["one"]
    assert mean == pytest.approx(2.0 / 3.0, abs=1e-4)
    assert loss == pytest.approx(2.0 / 3.0 * np.log(2.0), abs=1e-3)
    assert brier == pytest.approx(0.5 / 3.0, abs=1e-3)


def test_every_model_has_an_earlier_copula() -> None:
    assert list(MODELS) == list(PUBLISHED)
