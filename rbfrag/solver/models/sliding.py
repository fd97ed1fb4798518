"""A block that slides on its base (eqs. 4.15, 4.16).

    s'' = g cos(φ - β)/cos φ [k_h - (1 + k_v) tan(φ - β)]          down the base
    s'' = g cos(φ + β)/cos φ [k_h + (1 + k_v) tan(φ + β)]          up the base

while it moves. (4.15) lacks the factor, which comes from the normal force: the part of the
inertial force that is normal to the base changes the friction. The dissertation's form is the
horizontal one, whose factor is 1. Nothing depends on s, so that s is a cubic of time between
samples and the answer exact.

While the block slides, its base stays in touch whatever k_h, because the reaction then lies at
φ >= α1. At a standstill away from its back plane a pulse into the slope tips it about its heel when
the resultant falls behind that heel,

    k_h < (1 + k_v) tan(α1 - β),

whatever the sign of α1 - β; from there it is followed step by step (docs/theory/slide-to-slump.md).
A block with α1 <= -φ slides up its base before it tips, and is not followed beyond Newmark's block.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation, excitation, motion_remarks
from rbfrag.solver.integrator.one_freedom.equation import (
    Condition,
    Ending,
    Equation,
    Exit,
    Mechanism,
    Phase,
    Pose,
    constant,
)
from rbfrag.solver.integrator.one_freedom.follow import follow
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import SEARCH_LIMIT, FloatArray, Outcome, Polarity
from rbfrag.solver.search.displacement import TOLERANCE, SlidingBlocks, critical_of
from rbfrag.solver.simulation import MechanismKind, driven_up_below

THRESHOLDS_M = (0.01, 0.05, 0.15, 0.30)
"""Displacements that are asked about when nothing else is said [m]."""

KY_OVER_PGA = (
    0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6,
    0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95,
)  # fmt: skip
"""Strengths at which displacements are asked for when nothing else is said."""


KY_ALONE = (
    "a block given by its shape may be tipped by pulses into the slope and slide further "
    "(unconservative)"
)

MAY_TIP = (
    "pulses into the slope tip the block about its heel once it has slid; this option neglects "
    "that: it may slide further, slump or overturn (unconservative)"
)


MAY_SLIDE_UP = (
    "pulses into the slope slide the block up its base, which is neglected (conservative): "
    "two_way follows it"
)


def _tips_back(supported_block: SupportedBlock) -> Equation:
    """Return the equation of the start of a rotation backward about the heel."""
    assert supported_block.block is not None
    # moments about the heel over m g r1: k_h cos(α1 - β) against (1 + k_v) times sin(α1 - β) and
    # the backward moment of water; only their sign is read
    past_heel = math.radians(supported_block.block.alpha1_deg) - supported_block.beta_rad
    along, off, moment_m = supported_block.push
    heel_x, heel_y = supported_block.block.heel
    moment_m += heel_y * along - heel_x * off
    return Equation(
        inertia=constant(1.0),
        driving=constant(math.cos(past_heel)),
        resistance=constant(math.sin(past_heel) + moment_m / supported_block.block.r1_m),
    )


def _equation(supported_block: SupportedBlock, sense: float) -> Equation:
    """Return the equation of motion down (1) or up (-1) the base."""
    phi, beta = sense * supported_block.phi_rad, supported_block.beta_rad
    # (4.15) with the change of the normal force by the inertial one, N = m g (w cos β - k_h sin β)
    factor = math.cos(phi - beta) / math.cos(phi)
    horizontal = bool(supported_block.settings.get("horizontal", False))
    if horizontal:
        factor = 1.0
    driving = STANDARD_GRAVITY_M_S2 * factor
    # the push of water over the weight lessens the yield, and leaves the factor as it is
    along, off, _ = supported_block.push
    pushed = (along * math.cos(phi) + off * math.sin(phi)) / math.cos(phi - beta)
    contact = Condition(
        per_k_h=constant(-math.sin(beta)),
        per_w=constant(math.cos(beta) - off),
        per_rate2=constant(0.0),
        outcome=Outcome.CONTACT_LOST,
        sentence="the block loses contact with its base",
    )
    return Equation(
        # nothing depends on s: the engine solves such an equation exactly
        inertia=constant(1.0),
        driving=constant(driving),
        resistance=constant(driving * (math.tan(phi - beta) - pushed)),
        conditions=() if horizontal else (contact,),
    )


def sliding_displacements(
    motion: MotionLike,
    ky_over_pga: Sequence[float] = KY_OVER_PGA,
    *,
    vertical: MotionLike | None = None,
    polarity: Polarity = "forward",
) -> FloatArray:
    """Return the displacements of blocks that slide down a level plane, downslope only [m].

    On a base of dip beta the displacement is cos(phi - beta)/cos(phi) times this, k_y being
    tan(phi - beta).

    Args:
        motion: horizontal ground motion or its file; its PGA must be above zero.
        ky_over_pga: strengths over PGA, shape (n,).
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``.

    Returns:
        Displacements, shape (n,); NaN where the vertical motion throws the block off its base.

    Raises:
        InputError: a strength that is not above zero, a motion of no acceleration.
    """
    up = None if vertical is None else as_motion(vertical, "vertical")
    excited = excitation(as_motion(motion), up, polarity)
    positive(excited.pga_g, "PGA", "g")
    strengths = [positive(value, "ky_over_pga", "k_y/PGA") for value in ky_over_pga]
    slid = SlidingBlocks(excited, slide_m).points(strengths).displacement_m
    assert slid is not None
    return slid


def slide_m(excited: Excitation, ky: float) -> float:
    """Return the permanent displacement down a level plane [m]; NaN where k_v lifts it off."""
    run = follow(MODEL.mechanism(level_plane(ky)), excited)
    # downslope only: where it stops is the greatest displacement, too
    return run.x if run.outcome is Outcome.STABLE else math.nan


def level_plane(ky: float) -> SupportedBlock:
    """Return a block that slides on a level plane, of yield acceleration `ky` [g]."""
    friction_rad = math.atan(ky)
    return SupportedBlock(None, 0.0, friction_rad, friction_rad, ky, back_fracture=False)


class Sliding(MechanismKind):
    """The sliding model; its critical strength corresponds to a given displacement."""

    yield_name = "ky"

    def mechanism(self, supported_block: SupportedBlock) -> Mechanism:
        """Return the sliding block.

        Args:
            supported_block: the block, its planes, and the settings `two_way` and `horizontal`.
        """
        block, phi, beta = supported_block.block, supported_block.phi_rad, supported_block.beta_rad
        up = phi + beta
        two_way = bool(supported_block.settings.get("two_way", False))
        if two_way and not up < 0.5 * math.pi:
            raise InputError(
                f"phi + beta = {math.degrees(up):g} degrees: no acceleration slides the block up "
                "the base; omit two_way"
            )
        forward = _equation(supported_block, 1.0)
        start = supported_block.centroid_m
        # both settings are forms of Newmark's block, which has no rotation
        horizontal = bool(supported_block.settings.get("horizontal", False))
        newmark = two_way or horizontal
        # with α1 <= -φ it slides up its base first; with α1 - β <= -90° the heel is not below the
        # centroid, and no pulse into the slope turns the block about it
        may_tip = False
        if block is not None:
            alpha1 = math.radians(block.alpha1_deg)
            may_tip = alpha1 > -phi and alpha1 - beta > -0.5 * math.pi
        tips = may_tip and not newmark
        # k_h/(1 + k_v) below which an effect occurs that the model neglects
        least_q = -math.inf
        if may_tip and not tips:
            least_q = _tips_back(supported_block).threshold(0.0)
        elif block is not None and not (tips or two_way or up >= 0.5 * math.pi):
            least_q = -math.tan(up)

        def pose(s: float) -> Pose:
            return Pose(0.0, (start[0] + s, start[1]), s)

        def after(exit: Exit) -> Ending:
            return Ending(Outcome.CONTACT_LOST, f"at {exit.time_s:.3f} s the block tips back")

        reverse = None
        if tips:
            reverse = _tips_back(supported_block)
        elif two_way:
            reverse = _equation(supported_block, -1.0)
        return Mechanism(
            first=Phase(
                name="slides",
                forward=forward,
                reverse=reverse,
                leaves_in_reverse=tips,
                pose=pose,
                after=after,
                # with a plane behind it the block cannot go further up than it was
                lowest=0.0 if supported_block.back_fracture else -math.inf,
            ),
            rotates=False,
            critical=None,
            warnings=(KY_ALONE,) if block is None and not newmark else (),
            least_q=least_q,
            if_below=MAY_TIP if may_tip else MAY_SLIDE_UP,
            stepwise_below=-math.inf if newmark else driven_up_below(supported_block),
            goes_on=block is not None and not horizontal,
        )

    def critical(
        self,
        motion: GroundMotion,
        *,
        vertical: GroundMotion | None = None,
        polarity: Polarity = "forward",
        search_limit: float = SEARCH_LIMIT,
        **options: Any,
    ) -> CriticalResult:
        """Return the maximum k_y/PGA with which a block slides `displacement_m` on a level plane.

        It is that of any shape and any dip: on a base that dips, divide a displacement by
        cos(phi - beta)/cos(phi).
        """
        self.reject_foreign(options, self.search_options)
        if "displacement_m" not in options:
            raise InputError("displacement_m is missing: give the distance on a level plane [m]")
        excited = excitation(motion, vertical, polarity)
        return critical_of(
            self.kind,
            SlidingBlocks(excited, slide_m),
            options["displacement_m"],
            polarity=polarity,
            search_limit=search_limit,
            tolerance=options.get("tolerance", TOLERANCE),
            warnings=motion_remarks(motion, vertical, excited),
        )


MODEL = Sliding.named("sliding")
