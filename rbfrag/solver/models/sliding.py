"""A block that slides on its base (eqs. 4.15, 4.16).

    s'' = g cos(φ - β)/cos φ [k_h - (1 + k_v) tan(φ - β)]          down the base
    s'' = g cos(φ + β)/cos φ [k_h + (1 + k_v) tan(φ + β)]          up the base

while it moves. (4.15) lacks the factor, which comes from the normal force: the part of the
inertial force that is normal to the base changes the friction. The dissertation's form is the
horizontal one, whose factor is 1. Nothing depends on s, so that s is a cubic of time between
samples and the answer exact.
"""

from __future__ import annotations

import math

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.integrator.one_freedom.equation import (
    Condition,
    Ending,
    Equation,
    Exit,
    Mechanism,
    Phase,
    Pose,
)
from rbfrag.solver.integrator.one_freedom.harmonics import constant
from rbfrag.solver.kind import BlockOnPlanes, MechanismModel
from rbfrag.solver.results import Outcome


def mechanism(site: BlockOnPlanes) -> Mechanism:
    """Return the sliding block.

    Args:
        site: the block, its planes, and the settings `two_way` and `horizontal`.
    """
    phi, beta = site.phi_rad, site.beta_rad
    two_way = bool(site.settings.get("two_way", False))
    if two_way and not phi + beta < 0.5 * math.pi:
        raise InputError(
            f"phi + beta = {math.degrees(phi + beta):g} degrees: no acceleration slides the block "
            "up the base; leave two_way out"
        )
    forward = _equation(site, 1.0)
    start = site.centroid_m

    def pose(s: float) -> Pose:
        return Pose(0.0, (start[0] + s, start[1]), s)

    def after(exit: Exit) -> Ending:
        raise AssertionError(f"a sliding block has no end of its plane: {exit}")

    return Mechanism(
        first=Phase(
            name="slides",
            forward=forward,
            reverse=_equation(site, -1.0) if two_way else None,
            pose=pose,
            after=after,
            # with a plane behind it the block cannot go further up than it was
            lowest=0.0 if site.back_fracture else -math.inf,
        ),
        rotates=False,
        critical=None,
        warnings=_warnings(site),
    )


def _equation(site: BlockOnPlanes, sense: float) -> Equation:
    """Return the equation of motion down (1) or up (-1) the base."""
    phi, beta = sense * site.phi_rad, site.beta_rad
    factor = math.cos(phi - beta) / math.cos(phi)
    horizontal = bool(site.settings.get("horizontal", False))
    if horizontal:
        factor = 1.0
    drive = STANDARD_GRAVITY_M_S2 * factor
    contact = Condition(
        per_k_h=constant(-math.sin(beta)),
        per_w=constant(math.cos(beta)),
        per_rate2=constant(0.0),
        outcome=Outcome.CONTACT_LOST,
        sentence="the block loses contact with its base",
    )
    return Equation(
        inertia=constant(1.0),
        drive=constant(drive),
        resistance=constant(drive * math.tan(phi - beta)),
        conditions=() if horizontal else (contact,),
    )


def _warnings(site: BlockOnPlanes) -> tuple[str, ...]:
    block = site.block
    if block is None or not site.back_fracture or math.degrees(site.beta_rad) >= block.alpha1_deg:
        return ()
    return (
        "at rest the block leans on its back plane (beta is below alpha1): once it has slid away, "
        "it tips back against the plane and may slump later, which is not followed",
    )


MODEL = MechanismModel(
    kind="sliding",
    mode="slide",
    mechanism=mechanism,
    settings=("two_way", "horizontal"),
)
