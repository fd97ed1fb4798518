"""Whether the toe of a block that turns about it holds: the printed oracle and the equation."""

from __future__ import annotations

import math

import pytest

import rbfrag
from rbfrag import Block, stability
from rbfrag.solver.stability.toe import about_toe, toe_needs_deg, toe_slips_g


def test_printed_oracle() -> None:
    block = Block.rectangle(4.0, 1.0)
    slips = toe_slips_g(block, 0.0, 16.0)
    assert slips == pytest.approx(0.4009, abs=6e-5)
    assert slips / 0.25 == pytest.approx(1.60, abs=5e-3)
    assert stability(block, beta_deg=0.0, phi_deg=16.0).toe_slips_g == slips


@pytest.mark.parametrize("beta", [-5.0, 0.0, 6.0])
def test_both_forms_agree_and_forces_balance(beta: float) -> None:
    block = Block.from_fractures(3.0, 0.8, 80.0)
    slips = toe_slips_g(block, beta, 25.0)
    assert slips is not None
    assert toe_needs_deg(block, beta, slips) == pytest.approx(25.0, abs=1e-9)
    # moments about the toe give the rotation, and Newton's law for the centroid the reaction
    b = math.radians(beta)
    along, down = math.sin(b) + slips * math.cos(b), math.cos(b) - slips * math.sin(b)
    x, y = -block.toe[0], -block.toe[1]
    clockwise = (along * y + down * x) / block.inertia_toe_m2
    thrust, pressure = clockwise * y - along, -clockwise * x + down
    assert abs(thrust) / pressure == pytest.approx(math.tan(math.radians(25.0)))


def test_predict_says_so() -> None:
    asked = {"height_m": 4.0, "width_m": 1.0, "phi_deg": 16.0, "pgv_m_s": 0.6}
    said = rbfrag.predict(**asked, pga_g=0.5).warnings
    assert about_toe(Block.rectangle(4.0, 1.0), 0.0, 16.0, 0.5) in said
    assert any("slide-rock" in text for text in said)
