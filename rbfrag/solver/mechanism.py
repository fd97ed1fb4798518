"""Kinds that state a mechanism of one degree of freedom: how they answer, and what is known of one
block's mechanism at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation, excitation, motion_remarks
from rbfrag.solver.integrator.one_freedom.equation import Mechanism
from rbfrag.solver.integrator.one_freedom.follow import MotionHistory, follow
from rbfrag.solver.kind import BlockOnPlanes, Kind, RunEnd, Runner, Shaking
from rbfrag.solver.kinds import model_of_kind
from rbfrag.solver.results import ModeChange, Outcome, Response, ResponseHistory
from rbfrag.solver.stability.modes import words_of_mode
from rbfrag.solver.stability.single import stability


class MechanismKind(Kind):
    """A kind that states a mechanism; the engine for one degree of freedom runs it.

    Attributes:
        one_phase: whether the model ends with the first phase of its mechanism.
        yield_name: symbol of its yield acceleration.
    """

    one_phase = False
    yield_name = "k"

    def mechanism(self, site: BlockOnPlanes) -> Mechanism:
        """Return the mechanism of a block."""
        raise NotImplementedError

    def respond(self, site: BlockOnPlanes, shaking: Shaking) -> Response:
        """Return what the block does.

        Raises:
            InputError: the base has cohesion.
        """
        return mechanism_response(self.kind, self._without_cohesion(site), shaking)

    def runner(self, site: BlockOnPlanes) -> Runner:
        """Return a function that says how the block ends under an excitation."""
        mechanism = self._without_cohesion(site)

        def run(excited: Excitation) -> RunEnd:
            end = follow(mechanism, excited)
            failed = end.outcome is Outcome.TOPPLED
            return RunEnd(
                outcome=end.outcome,
                moved=end.started_s is not None,
                peak_rad=end.peak if mechanism.rotates and not failed else None,
                peak_displacement_m=None if failed else end.peak_displacement_m,
                error=end.error,
                about_block=mechanism.warnings,
            )

        return run

    def _without_cohesion(self, site: BlockOnPlanes) -> Mechanism:
        if site.cohesive:
            raise InputError(
                f"cohesion_pa does not go with {self.kind} in time: a bond is broken by the first "
                "slip, which the model does not describe; its effect on the yield is told by  "
                "rbfrag block --cohesion"
            )
        return self.mechanism(site)


def mechanism_response(kind: str, mechanism: Mechanism, shaking: Shaking) -> Response:
    """Run a mechanism under a motion.

    Args:
        kind: name of the model, for the answer.
        mechanism: the block.
        shaking: the motion.
    """
    excited = excitation(shaking.motion, shaking.vertical, shaking.polarity)
    run = follow(mechanism, excited, history=shaking.history)
    failed = run.outcome is Outcome.TOPPLED
    turned = mechanism.rotates and not failed
    critical = mechanism.critical
    start = mechanism.first.pose(0.0).centroid_m
    at_end = None if failed else run.pose
    return Response(
        kind=kind,
        outcome=run.outcome,
        peak_theta_n=run.peak / critical if turned and critical else None,
        peak_theta_rad=run.peak if turned else None,
        critical_angle_deg=None if critical is None else math.degrees(critical),
        started_s=run.started_s,
        toppled_s=(run.certain_s or run.ended_s) if failed else None,
        error_estimate=run.error,
        steps=run.steps,
        samples_moved=run.samples_moved,
        samples_total=int(np.count_nonzero(excited.interval_s)),
        warnings=(
            *shaking.remarks,
            *motion_remarks(shaking.motion, shaking.vertical, excited),
            *run.sentences,
        ),
        history=_history(mechanism, excited, run.history) if run.history else None,
        final_theta_rad=abs(at_end.turned_rad) if turned and at_end else None,
        displacement_m=at_end.displacement_m if at_end else None,
        peak_displacement_m=None if failed else run.peak_displacement_m,
        centroid_displacement_m=math.dist(at_end.centroid_m, start) if at_end else None,
        stopped_s=run.ended_s,
        mode_changes=tuple(ModeChange(change.time_s, change.name) for change in run.changes),
    )


def _history(mechanism: Mechanism, excited: Excitation, history: MotionHistory) -> ResponseHistory:
    """Put the nodes of rest, which the kernel skips, back between those of motion."""
    time_s, rate = history.time_s, history.rate
    displacement = np.array([pose.displacement_m for pose in history.poses])
    centroid = np.array([pose.centroid_m for pose in history.poses])
    turned = np.array([pose.turned_rad for pose in history.poses])
    if excited.time_s[-1] > time_s[-1] and rate[-1] == 0.0:
        rest = excited.time_s
    else:
        rest = excited.time_s[excited.time_s < time_s[-1]]
    rest = rest[~np.isin(rest, time_s)]
    last = np.searchsorted(time_s, rest, side="right") - 1
    known = last >= 0
    start = mechanism.first.pose(0.0)

    def merged(moving: np.ndarray, before: float | tuple[float, float]) -> np.ndarray:
        resting = np.where(
            known if moving.ndim == 1 else known[:, None], moving[np.maximum(last, 0)], before
        )
        together: np.ndarray = np.concatenate([moving, resting])[order]
        return together

    order = np.argsort(np.concatenate([time_s, rest]), kind="stable")
    at_s = np.concatenate([time_s, rest])[order]
    speed = np.concatenate([rate, np.zeros(rest.size)])[order]
    nothing = np.zeros_like(speed)
    k_h = np.interp(at_s, excited.time_s, excited.k_h, right=0.0)
    k_v = np.interp(at_s, excited.time_s, excited.w - 1.0, right=0.0)
    # of a jump, the first entry at its time shows what was before
    for jump in np.flatnonzero(excited.interval_s == 0.0):
        first = int(np.searchsorted(at_s, excited.time_s[jump]))
        if first + 1 < at_s.size and at_s[first] == at_s[first + 1] == excited.time_s[jump]:
            k_h[first], k_v[first] = excited.k_h[jump], excited.w[jump] - 1.0
    return ResponseHistory(
        time_s=at_s,
        theta_rad=merged(np.abs(turned), 0.0),
        theta_dot_rad_s=speed if mechanism.rotates else nothing,
        k_h=k_h,
        k_v=k_v,
        displacement_m=merged(displacement, 0.0),
        velocity_m_s=None if mechanism.rotates else speed,
        centroid_m=merged(centroid, start.centroid_m),
        turned_rad=merged(turned, 0.0),
        strength_g=merged(history.strength_g, mechanism.first.forward.threshold(0.0)),
    )


@dataclass(frozen=True, eq=False)
class ShakenMechanism:
    """A stable block of a mechanism that rotates.

    Args:
        kind: name of the model.
        mechanism: its motion.
        yield_name: symbol of the yield acceleration.
        yield_g: acceleration that starts it where 1 + k_v = 1 [g].
        p2: frequency parameter p_s² at rest [1/s²].
        leaves_g: k_h at which a contact opens as the motion starts [g]; infinite where none does.
        most_rad: rotation at which the model ends whatever the motion [rad].
        remarks: what is known about the block that an answer should say.
    """

    kind: str
    mechanism: Mechanism
    yield_name: str
    yield_g: float
    p2: float
    leaves_g: float
    most_rad: float
    remarks: tuple[str, ...]


def shaken_mechanism(
    block: Block,
    *,
    kind: str,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
) -> ShakenMechanism:
    """Return the mechanism of a block whose failure mode is that of the kind.

    Args:
        block: shape and size.
        kind: a kind that rotates, whose records are scaled.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.

    Raises:
        InputError: another kind; a block of another mode, or one that no earthquake decides about.
    """
    model = model_of_kind(kind)
    if not isinstance(model, MechanismKind):
        raise InputError(f"kind {kind!r} is not one whose records are scaled")
    judged = stability(block, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_back_deg)
    if judged.mode != model.mode:
        raise InputError(
            f"the block is not of kind {kind}: its mode is {words_of_mode(judged.mode)} (yield "
            f"{judged.yield_acceleration:.4g} g, {judged.state})"
        )
    if judged.state != "stable" or not 0.0 < judged.yield_acceleration < math.inf:
        raise InputError(
            f"the block is {judged.state} in its mode, {words_of_mode(judged.mode)} (yield "
            f"{judged.yield_acceleration:.4g} g): no earthquake decides about it"
        )
    site = BlockOnPlanes(
        block=block,
        beta_rad=math.radians(judged.beta_deg),
        phi_rad=math.radians(judged.phi_deg),
        phi_back_rad=math.radians(judged.phi_back_deg),
        back_fracture=True,
        cohesive=False,
        yield_g=judged.yield_acceleration,
        settings={},
    )
    mechanism = model.mechanism(site)
    equation = mechanism.first.forward
    return ShakenMechanism(
        kind=kind,
        mechanism=mechanism,
        yield_name=model.yield_name,
        yield_g=equation.threshold(0.0),
        p2=equation.driving(0.0) / equation.inertia(0.0),
        leaves_g=_leaves_g(mechanism),
        most_rad=mechanism.first.highest if model.one_phase else math.inf,
        remarks=judged.warnings,
    )


def _leaves_g(mechanism: Mechanism) -> float:
    """Return the least k_h above the yield at which a contact opens at rest."""
    leaves = math.inf
    for condition in mechanism.first.forward.conditions:
        per_k_h, per_w = condition.per_k_h(0.0), condition.per_w(0.0)
        if per_k_h < 0.0:
            leaves = min(leaves, -per_w / per_k_h)
    return leaves
