"""Slumping: the block rotates backward while its heel slides down the base and its back edge down
the back plane.

Friction is fully mobilised at both contacts, against the motion: forward (sense 1) or, when
the ground drives the block back up, in reverse (sense -1). The equation of two sliding contacts is
derived in `rbfrag.solver.integrator.one_freedom.contact_equations`; it has the form of toppling,

    θ'' = p_s²(θ) [k_h - (1 + k_v) k_s(θ)] - q(θ) θ'²

and reads, as all mechanisms here do,

    inertia θ'' = driving k_h - resistance (1 + k_v) - braking θ'².

The dissertation's own chapter on slumping is not available; this is derived from rigid-body
mechanics.

Strength and frequency do not fix a slump: shape, friction and dip do.
"""

from __future__ import annotations

import math

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.one_freedom.contact_equations import Contact, two_contact_equation
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
from rbfrag.solver.simulation import driven_up_below


def equation(supported_block: SupportedBlock, sense: float) -> Equation:
    """Return the equation of motion, forward (1) or in reverse (-1)."""
    block = supported_block.block
    assert block is not None
    gamma = math.radians(block.gamma_deg)
    # (3.24, 3.25): friction opposes the slip of both contacts, and changes sides with its sense
    phi1, phi2 = sense * supported_block.phi_rad, sense * supported_block.phi_back_rad
    return two_contact_equation(
        base=Contact(
            arm=turning(block.heel),
            direction=(-math.sin(phi1), math.cos(phi1)),
            lost="the heel lifts off the base",
        ),
        back=Contact(
            arm=turning(block.back),
            direction=(math.sin(gamma - phi2), math.cos(gamma - phi2)),
            lost="the block leaves its back plane",
        ),
        path=centroid_path(block),
        clockwise=False,
        inertia_m2=block.inertia_m2,
        beta_rad=supported_block.beta_rad,
        push=supported_block.push,
    )


def heel_slip(block: Block) -> Harmonics:
    """Return the slip of the heel down the base [m] for which contact 2 stays on its plane."""
    gamma = math.radians(block.gamma_deg)
    # distance of contact 2 from the back plane, if the heel stayed where it is
    edge = turning(block.back) - turning(block.heel)
    off_plane = edge.x * math.sin(gamma) + edge.y * math.cos(gamma)
    return (constant(off_plane(0.0)) - off_plane) * (1.0 / math.sin(gamma))


def centroid_path(block: Block) -> Vector:
    """Return the position of the centroid, from the heel at rest [m]."""
    return Vector(heel_slip(block), constant(0.0)) - turning(block.heel)


class Slumping(ScaledKind):
    """The slumping model."""

    yield_name = "ks"

    def mechanism(self, supported_block: SupportedBlock) -> Mechanism:
        """Return the slumping block.

        Raises:
            InputError: there is no back plane, or the corner at the heel is missing.
        """
        block = supported_block.block
        assert block is not None
        if not supported_block.back_fracture:
            raise InputError("a block without a back plane cannot slump")
        if block.lowest_on_back != block.heel:
            raise InputError(
                "slumping in time requires a block whose heel lies on the back plane: this outline "
                "has no corner at the heel"
            )
        # past recovery: the back edge lies on the base, with a forward angle α1 + γ > φ1
        flat = block.on_back_edge_rad
        slip = heel_slip(block)
        path = centroid_path(block)

        def pose(theta: float) -> Pose:
            return Pose(theta, (path.x(theta), path.y(theta)), slip(theta))

        def after(exit: Exit) -> Ending:
            return Ending(
                Outcome.TOPPLED,
                f"at {exit.time_s:.3f} s the back edge of the block lies on the base plane: it "
                "slides on from there, which is not followed",
            )

        forward = equation(supported_block, 1.0)
        return Mechanism(
            first=Phase(
                name="slumps",
                forward=forward,
                reverse=equation(supported_block, -1.0),
                pose=pose,
                after=after,
                highest=flat,
            ),
            rotates=True,
            critical=forward.first_without_strength(flat),
            if_impact="the block was driven back to where it had been: it is taken to stop there "
            "without rebound, whatever its speed",
            goes_on=True,
            stepwise_below=driven_up_below(supported_block),
        )


MODEL = Slumping.named("slumping")
