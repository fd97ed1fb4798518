"""The study of joint failures: which blocks its portfolios hold, and how they are judged."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from benchmarks.joint_failures import PLACEMENTS, Line, placement_of, portfolio


def blocks() -> pd.DataFrame:
    """Return three sites with two components each in one earthquake."""
    component = np.repeat(np.arange(6), 60)
    return pd.DataFrame({
        "site": component // 2, "component": component, "polarity": np.tile((-1, 1), 180),
        "p2": 4.0, "y_m_s": np.linspace(0.1, 0.9, 360),
    })  # fmt: skip


@pytest.mark.parametrize("place", PLACEMENTS)
def test_portfolios_hold_blocks_of_one_place(place: str) -> None:
    sample, random = blocks(), np.random.default_rng(1)
    drawn = [rows for _ in range(200) if (rows := portfolio(sample, place, random)) is not None]
    assert len(drawn) > 50
    for rows in drawn:
        assert 10 <= len(rows) == rows.index.nunique() <= 50
        sites, components, sides = (rows[n].nunique() for n in ("site", "component", "polarity"))
        if place == "several sites":
            assert components >= 3  # of 4 or more drawn, of which one may have none of few blocks
        else:
            assert sites == 1
            assert place == "one site" or components == sides == 1
        where = placement_of(rows)
        assert np.unique(where.component).size == components
        np.testing.assert_allclose(np.exp(where.ln_y), rows["y_m_s"])
        np.testing.assert_allclose(where.l, np.log(2.0))


def test_what_portfolios_are_judged_by() -> None:
    line = Line(
        event=np.array([0, 0, 1]),
        count=np.array([3.0, 1.0, 0.0]),
        mean=np.array([1.0, 1.0, 2.0]),
        variance=np.array([2.0, 2.0, 4.0]),
        any_by=(np.array([0.9, 0.5, 0.5]), np.full(3, 0.5)),
    )
    assert line.ratio() == (1.0, 1.0, 1.0)
    gain, low, high = line.gain()
    assert gain == pytest.approx(np.log(1.8) / 3.0)
    assert low == 0.0  # of the second earthquake alone
    assert high == pytest.approx(np.log(1.8) / 2.0)
