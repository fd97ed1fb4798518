"""Equations of motion of a block on its contacts: rocking about its toe, or sliding on two planes.

On two planes at once the contact forces have fixed directions u_a and u_b, because friction is
fully mobilised at both contacts. With M_a and M_b their moments about the centroid, C(θ) the path
of the centroid (dashes are derivatives by θ) and s = 1 for a rotation that is counter-clockwise, -1
for clockwise,

    R_a u_a + R_b u_b = C' θ'' + C'' θ'² - g G,        R_a M_a + R_b M_b = s (I_C/m) θ''

per mass, where G is the resultant of weight and inertia in units of g. With A = -s M_b, B = s M_a
and F = A u_a + B u_b, the two forces drop out:

    D θ'' = g (F_y G_x - F_x G_y) - (F_y C''_x - F_x C''_y) θ'²
    D     = F_y C'_x - F_x C'_y - (I_C/m) u_a x u_b

Water pushes with the force m g (1 + k_v) e, which turns with the block, and with the moment
m g (1 + k_v) mu about the centroid. Both add to D θ''

    g (1 + k_v) (F_y e_x - F_x e_y - s mu u_a x u_b).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.one_freedom.equation import (
    Condition,
    Equation,
    Vector,
    constant,
    constant_vector,
    cosine,
    sine,
    turning,
)
from rbfrag.solver.results import Outcome
from rbfrag.solver.stability.modes import DRY, Push
from rbfrag.solver.stability.validity import moment_about_toe


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


@dataclass(frozen=True, eq=False)
class Contact:
    """A point of the block that slides on a plane.

    Args:
        arm: from the centroid to the point [m].
        direction: unit direction of the contact force on the block.
        lost: what it means where the force would have to pull.
    """

    arm: Vector
    direction: tuple[float, float]
    lost: str


def two_contact_equation(
    *,
    base: Contact,
    back: Contact,
    path: Vector,
    clockwise: bool,
    inertia_m2: float,
    beta_rad: float,
    push: Push = DRY,
) -> Equation:
    """Return the equation of motion of a block on two contacts, with their conditions.

    Args:
        base: the contact on the base plane.
        back: the contact on the back plane.
        path: position of the centroid in the base frame [m].
        clockwise: whether the rotation is counted clockwise.
        inertia_m2: moment of inertia about the centroid per mass [m²].
        beta_rad: dip of the base [rad].
        push: of water over the weight: forces down the base and off it, and the moment [m].
    """
    g = STANDARD_GRAVITY_M_S2
    sense = -1.0 if clockwise else 1.0
    # A = -s M_b, B = s M_a, F = A u_a + B u_b, and the equation D θ'' of the module's docstring:
    # inertia is D, driving and resistance are its terms in k_h and -(1 + k_v), braking that in -θ'²
    # friction is mobilised in full: the directions of the contact forces do not change
    u_a, u_b = constant_vector(base.direction), constant_vector(back.direction)
    a = back.arm.cross(u_b) * -sense
    b = base.arm.cross(u_a) * sense
    force = u_a * a + u_b * b
    # C' and C'': dashes are derivatives by θ, not by time
    velocity = path.derivative()
    bend = velocity.derivative()
    # of the resultant G = per_k_h k_h + per_w (1 + k_v)
    per_k_h = constant_vector((math.cos(beta_rad), math.sin(beta_rad)))
    # the push of water turns with the block
    along, off, moment_m = push
    per_w = constant_vector((math.sin(beta_rad), -math.cos(beta_rad)))
    per_w += turning((along, off), -1 if clockwise else 1)
    twist = sense * g * moment_m
    # a contact force times D is one of these across the known part of the acceleration
    on_base = u_b * inertia_m2 + velocity * a
    on_back = velocity * b - u_a * inertia_m2
    return Equation(
        inertia=velocity.cross(force) - u_a.cross(u_b) * inertia_m2,
        driving=per_k_h.cross(force) * g,
        resistance=per_w.cross(force) * -g + u_a.cross(u_b) * twist,
        braking=bend.cross(force),
        conditions=tuple(
            Condition(
                per_k_h=lever.cross(per_k_h) * -g,
                per_w=lever.cross(per_w) * -g - twisted * twist,
                per_rate2=lever.cross(bend),
                outcome=Outcome.CONTACT_LOST,
                sentence=contact.lost,
            )
            for contact, lever, twisted in (
                (base, on_base, velocity.cross(u_b)),
                (back, on_back, u_a.cross(velocity)),
            )
        ),
    )
