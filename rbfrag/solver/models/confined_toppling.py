"""Confined toppling under an overhanging back plane: the toe slides out, the heel slides up that
plane.

The equation of two sliding contacts (`rbfrag.solver.integrator.one_freedom.contact_equations`)
holds up to the first standstill, or until the base edge stands at right angles to the back plane,
where the toe stops and free toppling follows. At a standstill the back plane holds the block only
while

    k_h > (1 + k_v) tan(α3 - θ - β);

below that the heel leaves the plane and the block rocks back about its toe, which stays
displaced. From where it lands on its base, with a gap at the heel, or its heel meets the plane
again, it is followed step by step (docs/theory/slide-to-slump.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.one_freedom.contact_equations import (
    Contact,
    rocking_equation,
    two_contact_equation,
)
from rbfrag.solver.integrator.one_freedom.equation import (
    Ending,
    Equation,
    Exit,
    Harmonics,
    Mechanism,
    Phase,
    Pose,
    Vector,
    constant,
    turning,
)
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.results import Outcome
from rbfrag.solver.search.incremental_scaling import ScaledKind


def equation(supported_block: SupportedBlock) -> Equation:
    """Return the equation of motion up to the first standstill."""
    block = supported_block.block
    assert block is not None
    gamma = math.radians(block.gamma_deg)
    # (3.28, 3.29): the toe slides out and the heel up, so that friction pulls both back
    phi1, phi2 = supported_block.phi_rad, supported_block.phi_back_rad
    return two_contact_equation(
        base=Contact(
            arm=turning(block.toe, -1),
            direction=(-math.sin(phi1), math.cos(phi1)),
            lost="the toe lifts off the base",
        ),
        back=Contact(
            arm=turning(block.lowest_on_back, -1),
            direction=(math.sin(gamma + phi2), math.cos(gamma + phi2)),
            lost="the heel leaves the back plane while the block topples",
        ),
        path=Vector(toe_slip(block), constant(0.0)) - turning(block.toe, -1),
        clockwise=True,
        inertia_m2=block.inertia_m2,
        beta_rad=supported_block.beta_rad,
        push=supported_block.push,
    )


def toe_slip(block: Block) -> Harmonics:
    """Return how far the toe has slid out [m], so that the heel stays on its plane."""
    gamma = math.radians(block.gamma_deg)
    off_plane = _base_off_plane(block)
    # what the rotation changes of the distance of the heel from its plane, the slip gives back
    return (constant(off_plane(0.0)) - off_plane) * (1.0 / math.sin(gamma))


def free_from(block: Block) -> float:
    """Return the rotation at which the toe stops and the heel loses contact (γ - 90° for an uncut
    heel).
    """
    # the slip of the toe is greatest where the derivative of a cos θ + b sin θ vanishes
    _, along, across, *_ = _base_off_plane(block).coefficients
    return math.atan2(-across, -along)


def _base_off_plane(block: Block) -> Harmonics:
    """Return the distance, normal to the back plane, from the toe to the contact on it [m]."""
    gamma = math.radians(block.gamma_deg)
    edge = turning(block.lowest_on_back, -1) - turning(block.toe, -1)
    return edge.x * math.sin(gamma) + edge.y * math.cos(gamma)


def _fallen(exit: Exit) -> Ending:
    return Ending(Outcome.TOPPLED, f"at {exit.time_s:.3f} s the block lies on its front face")


class ConfinedToppling(ScaledKind):
    """Toppling between a back plane and the base."""

    yield_name = "kct"

    def mechanism(self, supported_block: SupportedBlock) -> Mechanism:
        """Return the confined block."""
        block = supported_block.block
        assert block is not None
        if not supported_block.back_fracture or not block.confines:
            raise InputError(
                "without an overhanging plane the block topples freely: use kind toppling"
            )
        beta_rad, push = supported_block.beta_rad, supported_block.push
        rocking = rocking_equation(block, beta_rad, supported_block.phi_rad, push)
        # where the base edge is normal to the back plane, and where the front face lies on the base
        square, flat = free_from(block), block.on_front_face_rad
        slip = toe_slip(block)
        start = (block.base_m, 0.0)

        def pose_with(slipped: Harmonics) -> Callable[[float], Pose]:
            def pose(theta: float) -> Pose:
                # the centroid from the toe, which stays on the base
                arm = turning(block.toe, -1)
                out = slipped(theta)
                return Pose(-theta, (start[0] + out - arm.x(theta), -arm.y(theta)), out)

            return pose

        def after_confined(exit: Exit) -> Phase | Ending:
            # after a standstill, where k_h < (1 + k_v) tan(α3 - θ - β): the heel leaves its plane
            if exit.reason == "reverse":
                return rocks_back(exit)
            if flat <= square:
                return _fallen(exit)
            # here the toe has no speed: it stays, and is taken to hold (eq. 4.13 about it)
            stays = constant(slip(square))
            return Phase(
                name="topples freely about its toe",
                forward=rocking_equation(block, beta_rad, push=push),
                pose=pose_with(stays),
                after=after_free,
                # no contact slips: no friction holds the block at a standstill
                sticks=False,
                impact="leaves",
                lowest=square,
                highest=flat,
            )

        def after_free(exit: Exit) -> Ending:
            if exit.reason == "upper":
                return _fallen(exit)
            return Ending(
                Outcome.CONTACT_LOST,
                f"at {exit.time_s:.3f} s the heel comes back against its plane after a stretch of "
                "free toppling",
            )

        def rocks_back(exit: Exit) -> Phase:
            def after_rocking(exit: Exit) -> Ending:
                event = "the block falls back on its base"
                if exit.reason == "upper":
                    event = "the heel meets its plane again"
                return Ending(Outcome.CONTACT_LOST, f"at {exit.time_s:.3f} s {event}")

            return Phase(
                name="rocks back about its toe, the heel off its plane",
                forward=rocking,
                pose=pose_with(constant(slip(exit.x))),
                after=after_rocking,
                sticks=False,
                impact="leaves",
                lowest=0.0,
                highest=exit.x,
            )

        confined = equation(supported_block)
        critical_rad = math.radians(block.alpha3_deg) - beta_rad
        return Mechanism(
            first=Phase(
                name="topples against its back plane",
                forward=confined,
                # not followed in this phase: its onset ends it
                reverse=rocking,
                leaves_in_reverse=True,
                pose=pose_with(slip),
                after=after_confined,
                highest=min(square, flat),
            ),
            rotates=True,
            critical=critical_rad if critical_rad > 0.0 else None,
            goes_on=True,
            at_toe=True,
        )


MODEL = ConfinedToppling.named("confined_toppling")
