"""Blocks with a mechanism of one degree of freedom: their simulation to the end, by the mechanism
and step by step after that ends, and the models that such a mechanism defines.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.free_motion import (
    MODES_OF,
    ROCKS,
    FreeError,
    FreeMotion,
    Kinematics,
    Release,
    free_motion,
    gap_m,
    released,
    touching,
)
from rbfrag.solver.integrator.one_freedom.equation import Mechanism, Pose
from rbfrag.solver.integrator.one_freedom.follow import MechanismRun, follow
from rbfrag.solver.kind import Kind, RunEnd, Runner, Shaking, SupportedBlock
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import (
    BlockState,
    FloatArray,
    ModeChange,
    Outcome,
    Response,
    ResponseHistory,
)
from rbfrag.solver.stability.modes import ModeName, words_of_mode
from rbfrag.solver.stability.single import require_stable, stability


@dataclass(frozen=True, eq=False)
class Simulation:
    """Simulated motion of a block: by its mechanism, then step by step after that ends.

    Args:
        mechanism: the block as its model describes it.
        start: the state that it started from; None for its first place.
        run: what its mechanism did; None where it is followed step by step from the beginning.
        free_motion: what the block did after it; None where the mechanism goes to the end.
    """

    mechanism: Mechanism
    supported_block: SupportedBlock
    start: BlockState | None
    run: MechanismRun | None
    free_motion: FreeMotion | None

    @property
    def outcome(self) -> Outcome:
        """Outcome of the simulation."""
        return self._last.outcome

    @property
    def _last(self) -> MechanismRun | FreeMotion:
        last = self.run if self.free_motion is None else self.free_motion
        assert last is not None
        return last

    @property
    def pose(self) -> Pose:
        """Position of the block at the end."""
        return self._last.pose

    @property
    def ending(self) -> str:
        """Text on the end of the motion; empty where there is none."""
        if self.free_motion is not None:
            return self.free_motion.sentence
        assert self.run is not None
        return self.run.ending

    @property
    def started_s(self) -> float | None:
        """First motion [s]."""
        of_free = None if self.free_motion is None else self.free_motion.started_s
        return of_free if self.run is None or self.run.started_s is None else self.run.started_s

    @property
    def ended_s(self) -> float | None:
        """Last standstill, or the end of the model's validity [s]; None without motion."""
        if self.free_motion is None:
            assert self.run is not None
            return self.run.ended_s
        moved = self.started_s is not None or self.outcome is Outcome.JUMP
        return self.free_motion.time_s if moved else None

    @property
    def peak_rad(self) -> float | None:
        """Peak rotation [rad]; None for a block that only slides."""
        peak = self.run.peak if self.run is not None and self.mechanism.rotates else None
        if self.free_motion is None:
            return peak
        return max(peak or 0.0, self.free_motion.backward_rad, self.free_motion.forward_rad)

    @property
    def peak_displacement_m(self) -> float:
        """Peak displacement along the base [m]."""
        slips = [self.run.peak_displacement_m] if self.run is not None else []
        return max([*slips, self.free_motion.slip_m] if self.free_motion is not None else slips)

    @property
    def step_error(self) -> float:
        """Bound on the error of the integration: of the peak rotation [rad], of a slide [m].

        Infinite where the error of the state that it started from is not known.
        """
        return self._error(None if self.free_motion is None else self.free_motion.step_error)

    @property
    def error(self) -> float:
        """The same including the spread of the laws of impact and friction after a lost contact.

        Infinite also where some of them let the block fail and others do not.
        """
        if self.free_motion is None:
            return self.step_error
        return math.inf if self.free_motion.error is None else self._error(self.free_motion.error)

    def _error(self, of_free: FreeError | None) -> float:
        # where each law goes on from its own place, the spread of this motion has that of the last
        before = 0.0 if self.start is None or self.start.by_law else self.start.error
        if self.run is not None:
            before = self.run.error
        if of_free is None:
            return before
        return before + (of_free.rotation_rad if self.mechanism.rotates else of_free.displacement_m)

    @property
    def changes(self) -> tuple[ModeChange, ...]:
        """Changes of mode after the first motion."""
        changes = () if self.run is None else self.run.changes
        return changes if self.free_motion is None else (*changes, *self.free_motion.changes)

    @property
    def final_mode(self) -> ModeName | None:
        """Failure mode of the last motion that is one of a mode; None for no motion.

        A block that has turned over backward ends in a slump, whatever it turned about. A
        slide that rocks about its toe as it lands has not toppled, unless it fails.
        """
        if self.started_s is None:
            return None
        motion = self.free_motion
        failed = self.outcome is Outcome.TOPPLED
        rocks_count = failed or self.mechanism.rotates
        if motion and failed and motion.backward_rad > motion.forward_rad:
            return "slump"
        first = () if self.run is None else (self.mechanism.first.name,)
        names = (*first, *(change.motion for change in self.changes))
        modes = (
            MODES_OF[name]
            for name in reversed(names)
            if name in MODES_OF and (rocks_count or name != ROCKS)
        )
        return next(modes, None)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Assumptions of the answer, and the limit of the model."""
        sentences = () if self.run is None else self.run.sentences
        if self.free_motion is None:
            return sentences
        # the end of its mechanism is not the end of the block any more
        if self.run is not None and self.run.ending:
            sentences = sentences[:-1]
        if self.free_motion.landed_s:
            sentences = (*sentences, FALLS_ON_ITS_BASE.format(self.free_motion.landed_s))
        return (*sentences, self.free_motion.sentence) if self.free_motion.sentence else sentences

    def state(self, error: float, *, laws: bool) -> BlockState | None:
        """Return the state in which the block is left at rest; None if it is not.

        Args:
            error: bound on its error.
            laws: whether it keeps where other laws of impact leave the block.
        """
        pose, block = self.pose, self.supported_block.block
        if self.outcome is not Outcome.STABLE:
            return None
        position = None
        # only the first phase can be entered at rest: what comes after it goes on step by step
        if (
            self.free_motion is None
            and self.run is not None
            and self.run.phase is self.mechanism.first
        ):
            position = self.run.x
        return BlockState(
            turned_rad=pose.turned_rad,
            centroid_m=pose.centroid_m,
            displacement_m=pose.displacement_m,
            gap_m=gap_m(block, pose) if block is not None else pose.displacement_m,
            touching=touching(self.supported_block, pose) if block is not None else ("base",),
            position=position,
            # in its first place it is exactly
            error=0.0 if position == 0.0 else error,
            by_law=self.free_motion.by_law if self.free_motion is not None and laws else (),
        )


FALLS_ON_ITS_BASE = (
    "at {:.3f} s, and perhaps later, the block falls on its whole base: how far such impacts push "
    "it depends on how its corners rebound and rub, which rigid contact does not decide, so that "
    "the displacement may be off by up to some tens of per cent, one of millimetres by more"
)

FAILS_BY_SOME_LAWS = (
    "whether the block fails hangs on how its corners rebound and rub in impacts, which rigid "
    "contact does not decide: treat it as critical; there is no error estimate"
)


def simulate_block(
    mechanism: Mechanism,
    supported_block: SupportedBlock,
    excited: Excitation,
    *,
    history: bool = False,
    start: BlockState | None = None,
    stepwise: bool = True,
) -> Simulation:
    """Simulate a block to its end.

    Args:
        mechanism: the block as its model describes it.
        history: keep the motion in time.
        start: the state that the motion finds; None for the first place.
        stepwise: whether a record that drives the block up its back plane is followed step by step
            from its beginning. Campaigns stay with the mechanism: of 304 such runs of slumps under
            scaled records 2 differ by more than 1 %, and all take 60 % longer.
    """
    run, release = None, None
    # a start without a coordinate is one that no mechanism describes, nor does it describe a block
    # that the record drives up its back plane
    in_mechanism = start is None or start.position is not None
    if in_mechanism and not (stepwise and excited.min_q < mechanism.stepwise_below):
        at = (0.0, 0.0) if start is None or not start.position else (start.position, start.error)
        run = follow(mechanism, excited, history=history, start=at)
        if not (mechanism.goes_on and run.outcome is Outcome.CONTACT_LOST):
            return Simulation(mechanism, supported_block, start, run, None)
        assert run.ended_s is not None
        release = released(run.ended_s, run.phase.pose, run.x, run.rate)
    else:
        pose = mechanism.first.pose(0.0)
        if start is not None:
            pose = Pose(start.turned_rad, start.centroid_m, start.displacement_m)
        release = Release(float(excited.time_s[0]), pose)
    by_law = () if start is None or run is not None else start.by_law
    after_release = free_motion(
        supported_block, excited, release, at_toe=mechanism.at_toe, by_law=by_law
    )
    return Simulation(mechanism, supported_block, start, run, after_release)


def end_of(simulation: Simulation, mode: ModeName | None, about_block: tuple[str, ...]) -> RunEnd:
    """Return the end of a simulation, without its history.

    Args:
        mode: failure mode of its model, in which it ends where no other motion is that of a mode.
        about_block: what its model takes for granted.
    """
    # of a block that has failed a peak is only where the run was stopped
    failed = simulation.outcome is Outcome.TOPPLED
    moved = simulation.started_s is not None
    return RunEnd(
        outcome=simulation.outcome,
        moved=moved,
        peak_rad=None if failed else simulation.peak_rad,
        peak_displacement_m=None if failed else simulation.peak_displacement_m,
        error=simulation.step_error,
        final_mode=(simulation.final_mode or mode) if moved else None,
        about_block=about_block,
    )


def response_of(kind: str, simulation: Simulation, shaking: Shaking) -> Response:
    """Return the response of a simulated block.

    Args:
        kind: name of its model.
    """
    excited = shaking.excitation
    failed = simulation.outcome is Outcome.TOPPLED
    peak_rad = None if failed else simulation.peak_rad
    critical = simulation.mechanism.critical
    first = simulation.mechanism.first.pose(0.0)
    before_m = 0.0 if simulation.start is None else simulation.start.displacement_m
    at_end = None if failed else simulation.pose
    run = simulation.run
    certain_s = None if run is None else run.certain_s
    steps, moved = (0, 0) if run is None else (run.steps, run.samples_moved)
    if simulation.free_motion is not None:
        steps += simulation.free_motion.steps
        # the sample intervals that were integrated step by step
        history = simulation.free_motion.history
        is_moving = (history.rate_rad_s != 0.0) | (history.slip_m_s != 0.0)
        moving_s = history.time_s[is_moving]
        moved += int(np.unique(np.searchsorted(excited.time_s, moving_s)).size)
    error = simulation.error if shaking.laws else simulation.step_error
    sentences = simulation.sentences
    if error == math.inf:
        sentences = (*sentences, FAILS_BY_SOME_LAWS)
    return Response(
        kind=kind,
        outcome=simulation.outcome,
        peak_theta_n=None if peak_rad is None or not critical else peak_rad / critical,
        peak_theta_rad=peak_rad,
        critical_angle_deg=None if critical is None else math.degrees(critical),
        started_s=simulation.started_s,
        toppled_s=(certain_s or simulation.ended_s) if failed else None,
        error_estimate=finite_or_none(error),
        steps=steps,
        samples_moved=moved,
        samples_total=excited.samples_total,
        warnings=(*shaking.warnings, *(Diagnostic(text, "model_limits") for text in sentences)),
        history=_history(simulation, excited) if shaking.history else None,
        final_theta_rad=abs(at_end.turned_rad) if peak_rad is not None and at_end else None,
        displacement_m=at_end.displacement_m - before_m if at_end else None,
        peak_displacement_m=None if failed else simulation.peak_displacement_m,
        centroid_displacement_m=math.dist(at_end.centroid_m, first.centroid_m) if at_end else None,
        stopped_s=simulation.ended_s,
        mode_changes=simulation.changes,
        final_mode=simulation.final_mode,
        state=simulation.state(error, laws=shaking.laws),
    )


def _history(simulation: Simulation, excited: Excitation) -> ResponseHistory:
    """Insert the nodes of rest, which the kernels skip, between those of motion."""
    mechanism = simulation.mechanism
    parts = []
    if simulation.run is not None and simulation.run.history is not None:
        of_run = simulation.run.history
        nothing = np.zeros_like(of_run.rate)
        parts.append(
            Kinematics(
                of_run.time_s,
                np.array([pose.turned_rad for pose in of_run.poses]),
                of_run.rate if mechanism.rotates else nothing,
                np.array([pose.centroid_m for pose in of_run.poses]),
                np.array([pose.displacement_m for pose in of_run.poses]),
                nothing if mechanism.rotates else of_run.rate,
                of_run.strength_g,
            )
        )
    if simulation.free_motion is not None:
        parts.append(simulation.free_motion.history)
    trajectory = Kinematics(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    time_s = trajectory.time_s
    nodes_s = excited.time_s
    # a block that has not come to rest has failed, or left the model: nothing follows
    if time_s.size and (
        time_s[-1] >= nodes_s[-1] or trajectory.rate_rad_s[-1] or trajectory.slip_m_s[-1]
    ):
        nodes_s = nodes_s[nodes_s < time_s[-1]]
    rest = nodes_s[~np.isin(nodes_s, time_s)]
    order = np.argsort(np.concatenate([time_s, rest]), kind="stable")
    at_s = np.concatenate([time_s, rest])[order]
    last = np.searchsorted(time_s, rest, side="right") - 1

    def merged(moving: FloatArray, before: float | tuple[float, float]) -> FloatArray:
        """Return values at all times: at rest those of the motion before, or of the first place."""
        resting = np.full((rest.size, *moving.shape[1:]), before, dtype=np.float64)
        if moving.size:
            has_begun = last >= 0 if moving.ndim == 1 else (last >= 0)[:, None]
            resting = np.where(has_begun, moving[np.maximum(last, 0)], resting)
        together: FloatArray = np.concatenate([moving, resting])[order]
        return together

    spin, speed = (
        np.concatenate([values, np.zeros(rest.size)])[order]
        for values in (trajectory.rate_rad_s, trajectory.slip_m_s)
    )
    # position of the block at the start, and its strength there; NaN if undefined
    state, first = simulation.start, mechanism.first
    at_start, strength = first.pose(0.0), first.forward.threshold(0.0)
    if state is not None:
        at_start = Pose(state.turned_rad, state.centroid_m, state.displacement_m)
        strength = math.nan if state.position is None else first.forward.threshold(state.position)
    k_h, k_v = _accelerations(excited, at_s)
    turned = merged(trajectory.turned_rad, at_start.turned_rad)
    return ResponseHistory(
        time_s=at_s,
        theta_rad=np.abs(turned),
        theta_dot_rad_s=spin,
        k_h=k_h,
        k_v=k_v,
        displacement_m=merged(trajectory.slip_m, at_start.displacement_m),
        velocity_m_s=None if mechanism.rotates else speed,
        centroid_m=merged(trajectory.centroid_m, at_start.centroid_m),
        turned_rad=turned,
        strength_g=merged(trajectory.strength_g, strength),
    )


def _accelerations(excited: Excitation, at_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return k_h and k_v [g] at times of which each jump has two."""
    k_h = np.interp(at_s, excited.time_s, excited.k_h, right=0.0)
    k_v = np.interp(at_s, excited.time_s, excited.w - 1.0, right=0.0)
    # of a jump, the first entry at its time shows what was before
    for jump in np.flatnonzero(excited.interval_s == 0.0):
        before = int(np.searchsorted(at_s, excited.time_s[jump]))
        if before + 1 < at_s.size and at_s[before] == at_s[before + 1] == excited.time_s[jump]:
            k_h[before], k_v[before] = excited.k_h[jump], excited.w[jump] - 1.0
    return k_h, k_v


def driven_up_below(supported_block: SupportedBlock) -> float:
    """Return the k_h/(1 + k_v) below which the entire block slides up its back plane.

    -tan(γ + β + φ_back); minus infinity for a block that no pulse drives up it.
    """
    if supported_block.block is None or not supported_block.back_fracture:
        return -math.inf
    steepness = (
        math.radians(supported_block.block.gamma_deg)
        + supported_block.beta_rad
        + supported_block.phi_back_rad
    )
    return -math.tan(steepness) if steepness < 0.5 * math.pi else -math.inf


class MechanismKind(Kind):
    """A kind defined by a mechanism, which the engine for one degree of freedom integrates.

    Attributes:
        yield_name: symbol of its yield acceleration.
    """

    yield_name = "k"
    carries_state = True

    def mechanism(self, supported_block: SupportedBlock) -> Mechanism:
        """Return the mechanism of a block."""
        raise NotImplementedError

    def respond(self, supported_block: SupportedBlock, shaking: Shaking) -> Response:
        """Return the response of the block.

        Raises:
            InputError: the base has cohesion.
        """
        mechanism = self._without_cohesion(supported_block)
        excited = shaking.excitation
        simulation = simulate_block(
            mechanism, supported_block, excited, history=shaking.history, start=shaking.start,
            stepwise=shaking.stepwise,
        )  # fmt: skip
        return response_of(self.kind, simulation, shaking)

    def runner(self, supported_block: SupportedBlock) -> Runner:
        """Return a function that gives the end of the block's run under an excitation."""
        mechanism = self._without_cohesion(supported_block)

        def run(excited: Excitation) -> RunEnd:
            return end_of(
                simulate_block(mechanism, supported_block, excited), self.mode, mechanism.warnings
            )

        return run

    def _without_cohesion(self, supported_block: SupportedBlock) -> Mechanism:
        if supported_block.cohesive:
            raise InputError(
                f"cohesion_pa cannot be combined with {self.kind} in time: cohesion is lost at "
                "the first slip, which the model does not describe; see rbfrag block for its "
                "effect on the yield"
            )
        return self.mechanism(supported_block)


@dataclass(frozen=True, eq=False)
class ShakenMechanism:
    """A stable block with a rotational mechanism.

    Args:
        mechanism: its motion.
        yield_name: symbol of the yield acceleration.
        yield_g: acceleration that starts it where 1 + k_v = 1 [g].
        p2: frequency parameter p_s² at rest [1/s²].
        remarks: what is known about the block that an answer should say.
    """

    kind: str
    mechanism: Mechanism
    yield_name: str
    yield_g: float
    p2: float
    remarks: tuple[str, ...]
    supported_block: SupportedBlock

    def run(self, excited: Excitation, *, stepwise: bool = True) -> Simulation:
        """Simulate the block under an excitation; `stepwise` as of :func:`simulate_block`."""
        return simulate_block(self.mechanism, self.supported_block, excited, stepwise=stepwise)


def shaken_mechanism(
    model: Kind,
    block: Block,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    **water: Any,
) -> ShakenMechanism:
    """Return the mechanism of a block whose failure mode is that of the kind.

    Args:
        model: that of a kind that rotates, whose records are scaled.
        block: shape and size.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        water: ``water_m``, ``drainage`` and ``density_kg_m3`` of :func:`stability`.

    Raises:
        InputError: another kind; a block of another mode, or one that no earthquake decides about.
    """
    if not isinstance(model, MechanismKind):
        raise InputError(f"records are not scaled for kind {model.kind!r}")
    assessment = stability(
        block, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_back_deg, **water
    )
    require_stable(assessment)
    if assessment.mode != model.mode:
        raise InputError(
            f"the block is not of kind {model.kind}: its mode is {words_of_mode(assessment.mode)} "
            f"(yield {assessment.yield_acceleration:.4g} g, {assessment.state})"
        )
    supported_block = SupportedBlock.of(block, assessment, assessment.mode, {})
    mechanism = model.mechanism(supported_block)
    equation = mechanism.first.forward
    return ShakenMechanism(
        kind=model.kind,
        mechanism=mechanism,
        yield_name=model.yield_name,
        yield_g=equation.threshold(0.0),
        p2=equation.driving(0.0) / equation.inertia(0.0),
        remarks=assessment.warnings,
        supported_block=supported_block,
    )
