"""Yields of chapter 3 of the dissertation, on blocks drawn over its chart."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import Stability, stability


def at(a1: float, a3: float, phi: float, beta: float = 0.0) -> Stability:
    return stability(Block.from_angles(a1, a3, 1.0), beta_deg=beta, phi_deg=phi)


@pytest.mark.parametrize("phi", [30.0, 35.0, 40.0, 45.0])
def test_slumps_are_weakest_near_the_diagonal(phi: float) -> None:
    for a3 in np.arange(phi + 5.0, 86.0, 5.0).tolist():
        heels = np.arange(phi + 0.1, a3 - 0.05, 0.1)
        yields = [at(a1, a3, phi).ks for a1 in heels.tolist()]
        assert None not in yields
        assert a3 - heels[int(np.argmin(yields))] < 0.3  # type: ignore[arg-type]


@pytest.mark.parametrize(("a1", "phi"), [(40.0, 35.0), (50.0, 35.0), (60.0, 20.0)])
def test_slumps_tend_to_sliding_as_the_toe_angle_tends_to_the_right_angle(
    a1: float, phi: float
) -> None:
    shares = [at(a1, a3, phi).ks / math.tan(math.radians(phi)) for a3 in (80.0, 89.0, 89.99)]  # type: ignore[operator]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0, abs=2e-5)


def test_sliding_is_the_greatest_of_three_yields_and_confined_topples_exceed_it() -> None:
    random = np.random.default_rng(1)
    above = dict.fromkeys(("slide", "topple", "slump", "confined_topple"), 0)
    held = dict.fromkeys(above, 0)
    for _ in range(4000):
        a1, a3 = np.sort(random.uniform(-85.0, 85.0, 2)).tolist()
        phi, beta = random.uniform((20.0, -10.0), (60.0, 60.0)).tolist()
        if a3 - a1 < 1.0:
            continue
        result = at(a1, a3, phi, beta)
        sliding = math.tan(math.radians(phi - beta))
        above[result.mode] += result.yield_acceleration > sliding + 1e-9 * (1.0 + abs(sliding))
        held[result.mode] += beta > phi and result.state != "unstable"
    assert above.pop("confined_topple") == 1393
    assert set(above.values()) == {0}
    # where the base is steeper than friction, only a confined topple can stand
    assert held.pop("confined_topple") == 177
    assert set(held.values()) == {0}
