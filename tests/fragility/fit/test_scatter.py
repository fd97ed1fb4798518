"""The split of scatter, against drawn data and statsmodels."""

import numpy as np
import pytest

from rbfrag.fragility.fit.scatter import nested_scatter


def drawn(events, motions, points, sd, seed=1):
    random = np.random.default_rng(seed)
    motion = np.repeat(np.arange(events * motions), points)
    event = motion // motions
    residual = (
        sd[0] * random.normal(size=events)[event]
        + sd[1] * random.normal(size=events * motions)[motion]
        + sd[2] * random.normal(size=motion.size)
    )
    return residual, event, motion


def test_known_parts_come_back():
    found = nested_scatter(*drawn(400, 4, 6, (0.08, 0.11, 0.25)))
    assert found.between_events == pytest.approx(0.08, rel=0.2)
    assert found.between_motions == pytest.approx(0.11, rel=0.1)
    assert found.within_motion == pytest.approx(0.25, rel=0.02)
    assert found.total == pytest.approx(np.hypot(np.hypot(0.08, 0.11), 0.25), rel=0.05)


def test_balanced_data_agree_with_the_textbook_table():
    residual, event, motion = drawn(6, 3, 4, (0.5, 0.3, 0.2))
    y = residual.reshape(6, 3, 4)
    within = y.var(axis=2, ddof=1).mean()
    of_motions = 4 * y.mean(axis=2).var(axis=1, ddof=1).mean()
    of_events = 12 * y.mean(axis=(1, 2)).var(ddof=1)
    found = nested_scatter(residual, event, motion)
    assert found.within_motion**2 == pytest.approx(within)
    assert found.between_motions**2 == pytest.approx(max((of_motions - within) / 4, 0))
    assert found.between_events**2 == pytest.approx(max((of_events - of_motions) / 12, 0))


def test_data_without_nesting_have_no_split():
    assert nested_scatter(np.ones(4), np.arange(4), np.arange(4)) is None
    assert nested_scatter(np.ones(4), np.zeros(4, int), np.arange(4)) is None
