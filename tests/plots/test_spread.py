"""Labels that would touch: moved apart, and no further than they must."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.plots.canvas import spread_out


def test_what_does_not_touch_stays() -> None:
    assert spread_out([0.0, 0.5, 2.0], 0.5) == pytest.approx([0.0, 0.5, 2.0])
    assert spread_out([], 0.5) == []


def test_a_group_keeps_its_middle() -> None:
    assert spread_out([1.0, 1.0, 1.0], 0.2) == pytest.approx([0.8, 1.0, 1.2])
    # the first two push each other into the third
    assert spread_out([0.0, 0.0, 0.6], 1.0) == pytest.approx([-0.8, 0.2, 1.2])


def test_a_group_at_an_edge_stays_inside() -> None:
    assert spread_out([0.0, 0.9, 0.95], 0.2, 0.0, 1.0) == pytest.approx([0.0, 0.8, 1.0])
    assert spread_out([0.0, 0.0], 0.2, 0.1, 1.0) == pytest.approx([0.1, 0.3])


def test_nothing_moves_less() -> None:
    from scipy.optimize import minimize

    rng = np.random.default_rng(1)
    for _ in range(20):
        positions = np.sort(rng.uniform(0.0, 1.0, 6))
        result = np.array(spread_out(positions.tolist(), 0.2))
        assert np.diff(result).min() > 0.2 - 1e-12
        least = minimize(
            lambda x, positions=positions: ((x - positions) ** 2).sum(),
            result,
            constraints={"type": "ineq", "fun": lambda x: np.diff(x) - 0.2},
            method="SLSQP",
            options={"ftol": 1e-12},
        )
        assert ((result - positions) ** 2).sum() <= least.fun + 1e-8
