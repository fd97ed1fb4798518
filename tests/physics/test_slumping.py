"""Slumping and confined toppling: coefficients of the equations of motion."""

from __future__ import annotations

import math

import pytest

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2 as G
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.one_freedom.equation import Equation
from rbfrag.solver.models import confined_toppling, slumping
from rbfrag.solver.stability.single import stability
from tests.on_planes import on_planes

# r1 = 1 m, g = 9.81 m/s², both friction angles equal: an independent calculation by 3x3 equilibrium
# (angles, then k, p², q at rest, k in reverse, and k, p², q after a rotation of 0.1 rad)
SLUMPS = [
    (45, 65, 35, 0, 32.457575, 0.618285, 2.446054, 0.067301, -1.164813, 0.585120, 2.440395,
     -0.021493),
    (50, 72, 35, 5, 25.100545, 0.508818, 1.652443, 0.058504, -1.183515, 0.491557, 1.648870,
     -0.036460),
    (40, 75, 30, 20, 23.630658, 0.151813, 1.274048, 0.025892, -1.526405, 0.140389, 1.272262,
     -0.070187),
]  # fmt: skip
CONFINED = [
    (-60, 20, 35, 10, 124.373700, 0.516016, 8.579082, -0.976127, None, 0.538019, 9.611135,
     -1.214043),
    (-40, 20, 30, 5, 103.363728, 0.410337, 8.287584, -0.842494, None, 0.372013, 9.066749,
     -0.991544),
]  # fmt: skip


def coefficients(equation: Equation, theta: float) -> tuple[float, float, float]:
    """k, p² at g = 9.81 and q."""
    inertia = equation.inertia(theta)
    return (
        equation.threshold(theta),
        equation.driving(theta) / inertia * 9.81 / G,
        equation.braking(theta) / inertia,
    )


@pytest.mark.parametrize("row", [*SLUMPS, *CONFINED])
def test_coefficients_to_the_printed_digits(row: tuple[float, ...]) -> None:
    a1, a3, phi, beta, gamma, *rest, back = (*row[:8], *row[9:], row[8])
    r3 = math.cos(math.radians(a1)) / math.cos(math.radians(a3))
    site = on_planes(Block.from_angles(a1, a3, r3), beta, phi, phi)
    assert site.block is not None
    assert site.block.gamma_deg == pytest.approx(gamma, abs=1.01e-6)
    if back is None:
        equation = confined_toppling.equation(site)
    else:
        equation = slumping.equation(site, 1.0)
        assert slumping.equation(site, -1.0).threshold(0.0) == pytest.approx(back, abs=0.51e-6)
    result = (*coefficients(equation, 0.0), *coefficients(equation, 0.1))
    assert result == pytest.approx(rest, abs=0.51e-6)


@pytest.mark.parametrize(
    ("a1", "a3", "phi", "back", "beta"),
    [(45, 65, 35, 35, 0), (50, 80, 30, 45, 8), (40, 70, 35, 10, -5), (-40, 20, 30, 22, 5)],
)
def test_the_strength_at_rest_is_the_yield_of_the_mode(
    a1: float, a3: float, phi: float, back: float, beta: float
) -> None:
    block = Block.from_angles(a1, a3, 0.7)
    result = stability(block, beta_deg=beta, phi_deg=phi, phi_back_deg=back)
    site = on_planes(block, beta, phi, back)
    slumps = result.mode == "slump"
    equation = slumping.equation(site, 1.0) if slumps else confined_toppling.equation(site)
    assert equation.threshold(0.0) == pytest.approx(result.yield_acceleration, rel=1e-12)


def test_size_scales_time_alone() -> None:
    small = slumping.equation(on_planes(Block.from_angles(45, 65, 1.0), 3, 35, 30), 1.0)
    large = slumping.equation(on_planes(Block.from_angles(45, 65, 4.0), 3, 35, 30), 1.0)
    for theta in (0.0, 0.2):
        k1, p1, q1 = coefficients(small, theta)
        k4, p4, q4 = coefficients(large, theta)
        assert (k4, 4.0 * p4, q4) == pytest.approx((k1, p1, q1), rel=1e-12)
