"""Toes of blocks that turn about them: the printed oracle and the equation."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

import rbfrag
from rbfrag import Block, stability
from rbfrag.motions.polarity import Polarity
from rbfrag.solver.stability.validity import toe_needs_deg, toe_needs_in_time, toe_slips_g
from tests.physics.pulses import half_sines


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
    assert toe_needs_deg(block, beta, slips) == pytest.approx(25.0, abs=1e-9)
    # moments about the toe give the rotation, and Newton's law for the centroid the reaction
    b = math.radians(beta)
    along, down = math.sin(b) + slips * math.cos(b), math.cos(b) - slips * math.sin(b)
    x, y = -block.toe[0], -block.toe[1]
    clockwise = (along * y + down * x) / block.inertia_toe_m2
    thrust, pressure = clockwise * y - along, -clockwise * x + down
    assert abs(thrust) / pressure == pytest.approx(math.tan(math.radians(25.0)))


def test_predict_says_so() -> None:
    inputs = {"height_m": 4.0, "width_m": 1.0, "phi_deg": 16.0, "pgv_m_s": 0.6}
    message = rbfrag.predict(**inputs, pga_g=0.5).warnings
    assert any("the toe slips above 0.40 g: P(toppling) changes little" in text for text in message)
    assert not any("the toe" in text for text in rbfrag.predict(**inputs, pga_g=0.4).warnings)


@pytest.mark.parametrize(
    ("polarity", "needs_deg", "at_s"), [("forward", 17.985, 13.840), ("reverse", 16.551, 14.035)]
)
def test_printed_needs_of_a_record(
    records_dir: Path, polarity: Polarity, needs_deg: float, at_s: float
) -> None:
    record = records_dir / "slammer_csv" / "Chi-Chi_1999_TCU068-090.csv"
    if not record.exists():
        pytest.skip(f"{record} is not there")
    block = Block.rectangle(4.0, 1.0)
    on = {"block": block, "beta_deg": 0.0, "phi_deg": 16.0}
    answer = rbfrag.respond(str(record), polarity=polarity, **on)
    assert answer.toe_needs_deg == pytest.approx(needs_deg, abs=6e-4)
    assert answer.toe_needs_s == pytest.approx(at_s, abs=6e-4)
    assert answer.toe_slips_g == pytest.approx(0.4009, abs=6e-5)
    (message,) = (text for text in answer.warnings if "at the toe" in text)
    assert message.startswith(f"rotation without slip needs {needs_deg:.1f} deg at the toe at ")
    assert "phi = 16 gives way at 0.40 g: the slip of the toe is followed" in message
    assert answer.peak_displacement_m is not None
    pga_g = rbfrag.read_motions(record)[0].pga_g
    assert toe_needs_deg(block, 0.0, pga_g) == pytest.approx(17.995, abs=6e-4)
    rough = rbfrag.respond(str(record), polarity=polarity, **{**on, "phi_deg": 20.0})
    assert rough.toe_needs_deg == answer.toe_needs_deg
    assert not any("at the toe" in text for text in rough.warnings)


@pytest.mark.parametrize(
    ("pulses", "peak_rad", "estimate_rad", "toe_m"),
    [
        (((0.8, 0.25), (-0.4, 0.3)), 0.0984, 0.00074, 0.0001),  # P29
        (((0.9, 0.2), (-0.9, 0.2), (0.9, 0.2)), 0.0571, 0.00070, 0.0180),  # P30
    ],
)
def test_a_toe_that_slips_against_a_body_on_springs(
    pulses: tuple[tuple[float, float], ...], peak_rad: float, estimate_rad: float, toe_m: float
) -> None:
    """Reference rotations are those of springs, toe displacements those of the first code."""
    answer = rbfrag.respond(
        half_sines(pulses), block=Block.rectangle(3.0, 1.2), beta_deg=12.0, phi_deg=28.0,
        phi_back_deg=0.0, history=True,
    )  # fmt: skip
    assert answer.error_estimate is not None
    assert answer.error_estimate <= 1.5 * estimate_rad
    assert answer.peak_theta_rad == pytest.approx(peak_rad, abs=answer.error_estimate)
    assert answer.displacement_m == pytest.approx(toe_m, abs=1e-4)
    assert answer.final_mode == "topple"
    assert answer.history is not None
    assert answer.history.theta_rad.max() == pytest.approx(answer.peak_theta_rad, rel=1e-3)


@pytest.mark.parametrize("beta", [-5.0, 0.0, 6.0])
@pytest.mark.parametrize("k", [0.6, 0.9])
def test_the_history_begins_with_the_closed_form(beta: float, k: float) -> None:
    """A pulse that starts at k turns the block from rest: the form of the start is its limit."""
    block = Block.from_fractures(3.0, 0.8, 80.0)
    pulse = rbfrag.GroundMotion.from_nodes(
        [0.0, 0.0, 1e-4, 1e-3, 1e-3, 2e-3], [0.0, k, k, k, 0.0, 0.0]
    )
    answer = rbfrag.respond(pulse, block=block, beta_deg=beta, phi_deg=40.0, history=True)
    assert answer.history is not None
    start = (answer.history.theta_rad > 0.0) & (answer.history.time_s < 5e-4)
    first = replace(answer.history, **{
        name: value[start] for name, value in vars(answer.history).items() if value is not None
    })  # fmt: skip
    result = toe_needs_in_time(block, beta, first)
    assert result is not None
    assert result[0] == pytest.approx(toe_needs_deg(block, beta, k), abs=1e-2)
    still = rbfrag.respond(pulse.scaled(0.01), block=block, beta_deg=beta, phi_deg=40.0)
    assert still.toe_needs_deg is None
    assert still.toe_slips_g is not None
