"""Block that rocks about its toe (eqs. 4.1 to 4.19).

    θ'' = p² cos(θc - θ) [k_h - (1 + k_v) tan(θc - θ)],    tan θc = k_r

It has a kernel of its own, `rbfrag.solver.integrator.toppling_kernel`, which campaigns and searches
call by the million. A block given by its shape whose toe does not hold is followed step by step
instead, with the slip of its toe.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.free_motion import corner_at
from rbfrag.solver.integrator.one_freedom.contact_equations import rocking_equation
from rbfrag.solver.integrator.one_freedom.equation import Ending, Mechanism, Phase, Pose
from rbfrag.solver.kind import SHAKING, Kind, RunEnd, Runner, Shaking, SupportedBlock
from rbfrag.solver.kinds import PLANES
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import Outcome, Response, ResponseHistory
from rbfrag.solver.simulation import Simulation, end_of, response_of, simulate_block
from rbfrag.solver.stability.validity import (
    TOE_FOLLOWED,
    slides_at_toe,
    toe_needs_in_time,
    toe_slips_g,
)
from rbfrag.solver.toppling_run import history_of, outcome_of, reject_endless, respond, simulate


class Toppling(Kind):
    """The toppling model."""

    def respond(self, supported_block: SupportedBlock, shaking: Shaking) -> Response:
        """Return the response of the block."""
        answer = respond(
            shaking.motion,
            p2=_size(supported_block),
            kr=_strength(supported_block),
            vertical=shaking.vertical,
            polarity=shaking.polarity,
            history=shaking.history or supported_block.block is not None,
        )
        if shaking.remarks:
            answer = answer.with_values(warnings=(*shaking.remarks, *answer.warnings))
        if supported_block.block is None or answer.history is None:
            return answer
        angles = supported_block.beta_rad, supported_block.phi_rad
        beta_deg, phi_deg = map(math.degrees, angles)
        slips_g = toe_slips_g(supported_block.block, beta_deg, phi_deg, supported_block.push)
        needs, is_followed = _toe_in_time(supported_block, answer.history)
        need, at_s = needs or (None, None)
        history = answer.history if shaking.history else None
        if need is not None and is_followed:
            simulation = _with_toe(supported_block, shaking.excitation, history=shaking.history)
            answer = response_of(self.kind, simulation, shaking).with_values(state=None)
            gives_way = slides_at_toe(need, f"{at_s:.2f} s", phi_deg, slips_g)
            answer = answer.with_values(warnings=(*answer.warnings, gives_way))
            history = answer.history
        slips = slips_g if slips_g < math.inf else None
        return answer.with_values(
            toe_needs_deg=need, toe_needs_s=at_s, toe_slips_g=slips, history=history
        )

    def runner(self, supported_block: SupportedBlock) -> Runner:
        """Return a function that gives the end of the block's run under an excitation."""
        p2, kr = _size(supported_block), _strength(supported_block)

        def run(excited: Excitation) -> RunEnd:
            reject_endless(excited, p2)
            end = simulate(excited, p2=p2, kr=kr)
            moved = math.isfinite(end.started_s)
            if moved and supported_block.block is not None:
                history = history_of(excited, p2=p2, kr=kr)
                if _toe_in_time(supported_block, history)[1]:
                    return end_of(_with_toe(supported_block, excited), self.mode, (TOE_FOLLOWED,))
            return RunEnd(
                outcome=outcome_of(end),
                moved=moved,
                peak_rad=finite_or_none(end.peak_rad),
                peak_displacement_m=None,
                error=end.error_rad,
                final_mode=self.mode if moved else None,
            )

        return run

    def critical(self, motion: GroundMotion, **options: Any) -> CriticalResult:
        """Return the maximum k_r/PGA that topples, for a p² [1/s²] or that of a block."""
        from rbfrag.solver.search.critical import critical

        self.reject_foreign(options, (*self.search_options, *SHAKING))
        block = options.pop("block", None)
        for name in PLANES:
            options.pop(name, None)
        if block is not None:
            options["p2"] = block.p2
        if "p2" not in options:
            raise InputError("p2 is missing: the critical strength is computed for one p² [1/s²]")
        return critical(motion, kind=self.kind, **options)


def _toe_in_time(
    supported_block: SupportedBlock, history: ResponseHistory
) -> tuple[tuple[float, float] | None, bool]:
    """Return the maximum friction angle that the toe requires [deg] with its time [s], and whether
    the slip of the toe is followed.

    That of a block of another mode, asked about as a topple, is not: it would slide or slump.
    """
    block, beta_deg = supported_block.block, math.degrees(supported_block.beta_rad)
    assert block is not None
    needs = toe_needs_in_time(block, beta_deg, history, supported_block.push)
    slips = needs is not None and needs[0] > math.degrees(supported_block.phi_rad)
    return needs, slips and supported_block.yield_g is not None


def _with_toe(
    supported_block: SupportedBlock, excited: Excitation, *, history: bool = False
) -> Simulation:
    """Follow the block with the slip of its toe, step by step."""
    block = supported_block.block
    assert block is not None
    toe = block.toe

    def pose(theta: float) -> Pose:
        # the arm from the toe to the centroid, turned clockwise about the toe, which stays
        x, y = corner_at((block.base_m, 0.0), -theta, (-toe[0], -toe[1]))
        return Pose(-theta, (x, y), 0.0)

    mechanism = Mechanism(
        first=Phase(
            name="topples about its toe",
            forward=rocking_equation(block, supported_block.beta_rad, push=supported_block.push),
            pose=pose,
            after=lambda _: Ending(Outcome.CONTACT_LOST),
        ),
        rotates=True,
        critical=math.radians(block.alpha3_deg) - supported_block.beta_rad,
        stepwise_below=math.inf,
        at_toe=True,
    )
    # friction on the back face is neglected, as it is in k_r
    smooth = replace(supported_block, phi_back_rad=0.0)
    return simulate_block(mechanism, smooth, excited, history=history)


def _size(supported_block: SupportedBlock) -> float:
    """Return p² [1/s²]."""
    if supported_block.block is not None:
        return supported_block.block.p2
    assert supported_block.p2 is not None
    return supported_block.p2


def _strength(supported_block: SupportedBlock) -> float:
    """Return k_r: the yield, or for a block of another mode the balance on its toe."""
    if supported_block.yield_g is not None:
        return supported_block.yield_g
    assert supported_block.block is not None
    # (3.16): θc = α3 - β is what is left to the balance on the toe
    balance_deg = supported_block.block.alpha3_deg - math.degrees(supported_block.beta_rad)
    if not 0.0 < balance_deg < 90.0:
        raise InputError(
            f"alpha3 - beta = {balance_deg:.4g} degrees: a block can rock about its toe where it "
            "is between 0 and 90"
        )
    return math.tan(math.radians(balance_deg))


MODEL = Toppling.named("toppling")
