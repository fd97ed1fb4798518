"""Equation of a block that rocks about its toe (4.13), with the forces at the toe."""

from __future__ import annotations

import math

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.one_freedom.equation import Condition, Equation
from rbfrag.solver.integrator.one_freedom.harmonics import constant, cosine, sine, turning
from rbfrag.solver.results import Outcome
from rbfrag.solver.stability.modes import DRY, Push
from rbfrag.solver.stability.toe_stability import moment_about_toe


def rocking_equation(
    block: Block, beta_rad: float, phi_rad: float | None = None, push: Push = DRY
) -> Equation:
    """Return θ'' = p² [k_h cos(θc - θ) - (1 + k_v) (sin(θc - θ) - m0)], θc = α3 - β, clockwise.

    m0 is the forward moment of water about the toe over m g r3. With `phi_rad` its conditions are
    that the toe presses on the base and does not slip.

    Args:
        beta_rad: dip of the base [rad].
        phi_rad: friction angle of the base [rad]; None for a toe that is held fast, as the
            toppling model takes it to be.
        push: of water, which turns with the block.
    """
    g = STANDARD_GRAVITY_M_S2
    alpha3 = math.radians(block.alpha3_deg)
    balance = alpha3 - beta_rad
    p2, r3 = block.p2, block.r3_m
    # (4.13): θ'' = p² [k_h cos(θc - θ) - (1 + k_v) sin(θc - θ)], θc - θ what is left to balance
    driving = cosine(balance, -1) * p2
    resistance = (sine(balance, -1) - moment_about_toe(block, push)) * p2
    # the centroid, as seen from the toe, is at r3 (-sin, cos) of α3 - θ
    along, across = cosine(alpha3, -1), sine(alpha3, -1)
    if phi_rad is None:
        return Equation(inertia=constant(1.0), driving=driving, resistance=resistance)
    # the force on the toe, docs/theory/confined-toppling.md: R/m = r3 (θ'' t - θ'² e) - g G, with
    # θ'' by the equation of motion
    friction = math.tan(phi_rad)
    wet = turning((push[0], push[1]), -1) * g
    # force on the toe per mass along the base and normal to it: its factors of k_h, w and θ'²
    shear = (
        driving * along * r3 - g * math.cos(beta_rad),
        resistance * along * -r3 - g * math.sin(beta_rad) - wet.x,
        across * r3,
    )
    normal = (
        driving * across * r3 - g * math.sin(beta_rad),
        resistance * across * -r3 + g * math.cos(beta_rad) - wet.y,
        along * -r3,
    )

    # N tan φ ± T > 0: the toe presses and slips in neither sense
    def holds(sign: float) -> Condition:
        per_k_h, per_w, per_rate2 = (
            across_base * friction - along_base * sign
            for along_base, across_base in zip(shear, normal, strict=True)
        )
        return Condition(
            per_k_h=per_k_h,
            per_w=per_w,
            per_rate2=per_rate2,
            outcome=Outcome.CONTACT_LOST,
            sentence="the toe slips or lifts while the block rocks about it, which no model here "
            "describes",
        )

    return Equation(
        inertia=constant(1.0),
        driving=driving,
        resistance=resistance,
        conditions=(holds(1.0), holds(-1.0)),
    )
