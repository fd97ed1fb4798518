"""Free-standing block that rocks about both corners of its base.

    θ'' = p² [s k_h cos(θc - θ) - (1 + k_v) sin(θc - θ)],    s = 1 about the toe, -1 about the heel

θc and p are those of the corner. At every impact the pivot changes to the other corner, and
angular momentum about it leaves the speed times (I_C + r1·r3)/I of that corner (Housner 1963: 1 -
1.5 sin² α of a rectangle), or a stated part of it. What overturns is no interval of k_r, so that
there is no search (docs/theory/rocking.md).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import relative
from rbfrag.solver.block.formulas import moments_about_corners
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.rocking_kernel import RockingRun
from rbfrag.solver.integrator.state import Corner, corner
from rbfrag.solver.kind import Kind, RunEnd, Runner, Shaking, SupportedBlock
from rbfrag.solver.quantity import finite_or_none, number, positive
from rbfrag.solver.results import FloatArray, Outcome, Response, ResponseHistory
from rbfrag.solver.rocking_run import (
    MOST_IMPACTS,
    FreeBlock,
    corner_force,
    rocking_history,
    simulate,
)
from rbfrag.solver.stability.single import rectangle_r3_m
from rbfrag.solver.toppling_run import OUTCOMES, reject_endless

SENSITIVITY = 1e-6
"""Change of the motion whose effect on the outcome makes it a sensitive one."""

NOT_REPEATED = 0.01
"""Relative change of the peak under that change of the motion from which on it is said."""

CHAOTIC = 1e-3
"""Error over the critical angle from which on the size of a peak means nothing."""


def free_block(supported_block: SupportedBlock) -> FreeBlock:
    """Return the block with its corners.

    Args:
        supported_block: the block, its base, and `restitution` among its settings.

    Raises:
        InputError: a block that does not stand of itself, a restitution outside (0, 1].
    """
    restitution = supported_block.settings.get("restitution")
    if restitution is not None:
        restitution = number(restitution, "restitution", "the coefficient of restitution")
        if not 0.0 < restitution <= 1.0:
            raise InputError(
                f"restitution = {restitution:g}: give the coefficient of restitution, above 0 and "
                "up to 1"
            )
    if supported_block.block is None:
        assert supported_block.p2 is not None
        return rectangle(
            positive(supported_block.p2, "p2", "1/s²"),
            positive(supported_block.yield_g, "kr", "g"),
            restitution,
        )
    block, beta_rad = supported_block.block, supported_block.beta_rad
    balances = (
        ("forward over its toe", "alpha3 - beta", math.radians(block.alpha3_deg) - beta_rad),
        ("backward over its heel", "beta - alpha1", beta_rad - math.radians(block.alpha1_deg)),
    )
    for falls, name, balance in balances:
        if balance <= 0.0:
            raise InputError(
                f"the block overturns {falls} at rest: {name} = {math.degrees(balance):.6g} "
                "degrees is not above zero"
            )
    for _, name, balance in balances:
        if balance >= 0.5 * math.pi:
            raise InputError(
                f"{name} = {math.degrees(balance):.6g} degrees: a block rocks about a corner whose "
                "critical angle is below 90 degrees"
            )
    about_toe, about_heel, momentum = moments_about_corners(block.inertia_m2, block.heel, block.toe)
    return FreeBlock(
        toe=_corner(balances[0][2], block.r3_m, about_toe, momentum / about_heel, restitution),
        heel=_corner(balances[1][2], block.r1_m, about_heel, momentum / about_toe, restitution),
        toe_m=block.base_m,
        centroid_m=block.centroid,
        beta_rad=beta_rad,
    )


def rectangle(p2: float, kr: float, restitution: float | None) -> FreeBlock:
    """Return the rectangle on level ground with these parameters.

    Args:
        p2: frequency parameter p² [1/s²].
        kr: tangent of the critical angle.
        restitution: restitution; None for that of the rectangle (Housner 1963).
    """
    both = corner(
        kr, math.sqrt(p2), restitution_of_rectangle(kr) if restitution is None else restitution
    )
    # half of the sides: the base is level, and the centroid above its middle
    half, height = rectangle_r3_m(p2) * both.sin, rectangle_r3_m(p2) * both.cos
    return FreeBlock(both, both, 2.0 * half, (half, height), 0.0)


def restitution_of_rectangle(kr: float) -> float:
    """Return 1 - 1.5 sin² α of the rectangle with tan α = k_r (Housner 1963).

    Not above 0 for a block so stocky that an impact leaves it no speed.
    """
    return 1.0 - 1.5 * kr * kr / (1.0 + kr * kr)


def _corner(
    balance: float, arm_m: float, inertia_m2: float, calculated: float, restitution: float | None
) -> Corner:
    # p_i² = g r_i/I_i, as (4.27) for the toe
    p2 = STANDARD_GRAVITY_M_S2 * arm_m / inertia_m2
    return corner(
        math.tan(balance), math.sqrt(p2), calculated if restitution is None else restitution
    )


class Rocking(Kind):
    """The model of free-standing blocks."""

    def respond(self, supported_block: SupportedBlock, shaking: Shaking) -> Response:
        """Return the response of the block.

        Raises:
            InputError: a block that does not stand of itself, cohesion, a restitution outside
                (0, 1].
        """
        block = self._block(supported_block)
        excited = shaking.excitation
        reject_endless(excited, max(block.toe.p, block.heel.p) ** 2)
        run = simulate(excited, block)
        outcome = OUTCOMES[run.outcome]
        if math.isnan(error_of(run, outcome)):  # beyond any number: nothing is known of the end
            outcome = Outcome.UNDETERMINED
        # of a block that has overturned a peak is only where the run was stopped
        has_peak = outcome is Outcome.STABLE
        ended = outcome in (Outcome.STABLE, Outcome.TOPPLED)
        ratios = (run.forward.x / block.toe.theta_c, run.backward.x / block.heel.theta_c)
        traced = rocking_history(excited, block, run.impacts)
        sensitive, spread = repeated(excited, block, run)
        return Response(
            kind=self.kind,
            outcome=outcome,
            peak_theta_n=max(ratios) if has_peak else None,
            peak_theta_rad=max(run.forward.x, run.backward.x) if has_peak else None,
            critical_angle_deg=math.degrees(block.toe.theta_c),
            started_s=finite_or_none(run.started_s),
            toppled_s=finite_or_none(run.verdict_s) if outcome is Outcome.TOPPLED else None,
            error_estimate=finite_or_none(error_of(run, outcome)),
            steps=run.steps,
            samples_moved=run.samples_moved,
            samples_total=excited.samples_total,
            warnings=(
                *shaking.warnings,
                *_warnings(block, supported_block, run, outcome, sensitive, spread, traced),
            ),
            history=_posed(block, traced) if shaking.history else None,
            critical_backward_deg=math.degrees(block.heel.theta_c),
            peak_forward_rad=run.forward.x if ended and run.side <= 0 else None,
            peak_backward_rad=run.backward.x if ended and run.side >= 0 else None,
            impacts=run.impacts,
            sensitive=sensitive,
            peak_spread=spread if has_peak else None,
        )

    def runner(self, supported_block: SupportedBlock) -> Runner:
        """Return a function that gives the end of the block's run under an excitation."""
        block = self._block(supported_block)

        def run(excited: Excitation) -> RunEnd:
            reject_endless(excited, max(block.toe.p, block.heel.p) ** 2)
            end = simulate(excited, block)
            outcome = OUTCOMES[end.outcome]
            has_peak = outcome is Outcome.STABLE
            return RunEnd(
                outcome=outcome,
                moved=math.isfinite(end.started_s),
                peak_rad=max(end.forward.x, end.backward.x) if has_peak else None,
                peak_displacement_m=None,
                error=error_of(end, outcome),
            )

        return run

    def _block(self, supported_block: SupportedBlock) -> FreeBlock:
        if supported_block.cohesive:
            raise InputError(
                f"cohesion_pa cannot be combined with {self.kind}: the block lifts off its base"
            )
        return free_block(supported_block)


def error_of(run: RockingRun, outcome: Outcome) -> float:
    """Return the estimated error of the larger peak [rad], or of the final rotation if there is no
    peak.
    """
    if outcome is not Outcome.STABLE:
        return run.error
    return max(run.forward, run.backward).error


def repeated(excited: Excitation, block: FreeBlock, run: RockingRun) -> tuple[bool, float | None]:
    """Repeat a run with the motion times 1 + 1e-6 and 1 - 1e-6.

    Returns:
        Whether the outcome changes, and the greatest relative change of the greater peak; None for
        the latter where the outcome changes, or where the block does not move.
    """
    repeats = [simulate(scaled, block) for scaled in _scaled_slightly(excited)]
    if any(repeat.outcome != run.outcome for repeat in repeats):
        return True, None
    peak = max(run.forward.x, run.backward.x)
    if not peak > 0.0:
        return False, None
    changes = [abs(max(repeat.forward.x, repeat.backward.x) - peak) for repeat in repeats]
    return False, max(changes) / peak


@lru_cache(maxsize=8)
def _scaled_slightly(excited: Excitation) -> tuple[Excitation, Excitation]:
    """Return the motion times 1 + 1e-6 and 1 - 1e-6, the same objects for the last few motions."""
    return excited.scaled(1.0 + SENSITIVITY), excited.scaled(1.0 - SENSITIVITY)


def _warnings(
    block: FreeBlock,
    supported_block: SupportedBlock,
    run: RockingRun,
    outcome: Outcome,
    sensitive: bool,
    spread: float | None,
    motion: ResponseHistory,
) -> list[str]:
    warnings: list[str] = []

    def warn(code: str, text: str) -> None:
        warnings.append(Diagnostic(text, code))

    if outcome is Outcome.UNDETERMINED:
        text = f"after {MOST_IMPACTS} impacts the block still rocks: its outcome is not determined"
        warn("undetermined", text)
    if outcome is Outcome.JUMP:
        warn("vertical_jump", f"at {run.verdict_s:.3f} s: {outcome.advice}")
    if min(block.toe.passed_on, block.heel.passed_on) <= 0.0:
        warn(
            "model_limits",
            "the block is so stocky that angular momentum leaves it no speed after an impact: "
            "there it comes to rest",
        )
    if sensitive:
        warn(
            "sensitive_outcome",
            "the outcome is sensitive: it is another one for the motion times 1 + 1e-6 or 1 - 1e-6",
        )
    elif outcome is Outcome.STABLE and spread is not None and spread > NOT_REPEATED:
        warn(
            "sensitive_outcome",
            f"the peak rotation cannot be repeated: it changes by {relative(spread)} where the "
            "motion is scaled by 1 + 1e-6 or 1 - 1e-6",
        )
    elif error_of(run, outcome) > CHAOTIC * min(block.toe.theta_c, block.heel.theta_c):
        warn(
            "sensitive_outcome",
            "the response is chaotic: after so many impacts the size of its peaks is not "
            "determined by the motion as recorded",
        )
    tan_phi = (
        math.tan(supported_block.phi_rad) if supported_block.phi_rad < 0.5 * math.pi else math.inf
    )
    until_s = run.verdict_s if outcome is Outcome.TOPPLED else math.inf
    force = corner_force(block, motion, tan_phi, until_s)
    if force.lifts_s is not None:
        warn(
            "model_limits",
            f"at {force.lifts_s:.3f} s the corner would have to pull to stay on the base: the "
            "block bounces there, which is not followed",
        )
    if force.slips_s is not None:
        warn(
            "model_limits",
            f"at {force.slips_s:.3f} s friction does not hold the corner (it needs up to "
            f"{math.degrees(math.atan(force.friction)):.4g} degrees): the block slips there, which "
            "is not followed",
        )
    return warnings


def _posed(block: FreeBlock, traced: ResponseHistory) -> ResponseHistory:
    """Return the history with the position of the block, rotated about its toe or heel."""
    theta = traced.theta_rad
    # about the toe forward, about the heel backward, both at rest on the base
    pivot = np.where(theta >= 0.0, block.toe_m, 0.0)
    arm = block.centroid_m[0] - pivot
    rise = block.centroid_m[1]
    c, s = np.cos(theta), np.sin(theta)
    centroid: FloatArray = np.stack([pivot + arm * c + rise * s, rise * c - arm * s], axis=1)
    return replace(traced, centroid_m=centroid, turned_rad=-theta)


MODEL = Rocking.named("rocking")
