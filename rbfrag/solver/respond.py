"""Response of a block to a ground motion, or to several in sequence, for every kind of failure."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, cast

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.results.diagnostic import Diagnostic, with_prefix
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kind import Kind, Shaking, SupportedBlock
from rbfrag.solver.kinds import KINDS, NOT_BACKED, stands_free_of
from rbfrag.solver.models import model_of_kind, model_of_mode
from rbfrag.solver.quantity import angle, not_negative, positive
from rbfrag.solver.results import (
    BlockState,
    FloatArray,
    ModeChange,
    Outcome,
    Part,
    Polarity,
    Response,
    ResponseHistory,
)
from rbfrag.solver.stability.joint import IS_DRAINED, JOINT, STAYS_UNDRAINED
from rbfrag.solver.stability.modes import DrainedYield, ModeName, words_of_mode
from rbfrag.solver.stability.single import (
    Stability,
    after_first_slip,
    reject_before_slip,
    require_stable,
    stability,
)


def respond(
    motion: MotionLike | Sequence[MotionLike],
    *,
    p2: float | None = None,
    kr: float | None = None,
    ky: float | None = None,
    block: Block | None = None,
    beta_deg: float | None = None,
    phi_deg: float | None = None,
    phi_back_deg: float | None = None,
    back_fracture: bool = True,
    cohesion_pa: float = 0.0,
    density_kg_m3: float | None = None,
    vertical: MotionLike | Sequence[MotionLike | None] | None = None,
    polarity: Polarity = "forward",
    kind: str | None = None,
    gap_s: float | None = None,
    start: BlockState | None = None,
    two_way: bool = False,
    horizontal: bool = False,
    restitution: float | None = None,
    history: bool = False,
    **of_kind: Any,
) -> Response:
    """Return the response of a block to a ground motion, or to several in sequence.

    The block is given in one of three ways: `p2` and `kr` (it topples, or rocks on level ground if
    `kind` says so), `ky` (it slides), or `block` with `beta_deg` and `phi_deg`, whose failure mode
    chooses the model. It has more than ten parameters, because scripts name each quantity that a
    user states; a kind rejects those of another.

    Args:
        motion: horizontal ground motion, or its file; or a list of them: of slides and slumps each
            finds the block where the one before has left it.
        p2: frequency parameter p² of a toppling or rocking block [1/s²], > 0.
        kr: its rocking acceleration coefficient k_r = tan(critical angle), > 0.
        ky: yield acceleration coefficient tan(φ - β) of a block that slides, whatever its
            shape, on a plane that dips by `beta_deg` (default 0), > 0.
        block: shape and size.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg]; None where `kind` is ``rocking`` and the base
            is assumed not to slip.
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        back_fracture: False for a block without a plane behind it: one that topples rocks about
            both corners.
        cohesion_pa: cohesion of the base [Pa]; only a block that topples may have any.
        density_kg_m3: density of the rock [kg/m³]; None for 2,650 with a cohesion or water.
        vertical: vertical motion of the same recording, upward positive; of a list of motions, a
            list of as many, None where there is none.
        polarity: ``forward`` (positive samples drive forward motion) or ``reverse``.
        kind: ``toppling``, ``rocking``, ``sliding``, ``slumping`` or ``confined_toppling``; None
            for the model of the failure mode.
        gap_s: of a list of motions, rest between the end of one and the beginning of the next [s];
            None for as long as the block takes to come to rest.
        start: the state of the block before the motion, as an earlier answer has it; None for its
            first place.
        two_way: sliding up the base too, where the ground drives the block that way.
        horizontal: sliding without the factor cos(φ - β)/cos φ, as Newmark's horizontal block.
        restitution: coefficient of restitution of rocking, above 0 and up to 1; None for that of
            conservation of angular momentum at each corner.
        history: keep the motion in time.
        of_kind: further settings of a kind, as its line in `rbfrag.solver.kinds` names them; of a
            shape also ``water_m`` with ``drainage`` (``undrained``, the default: the water
            pressure keeps acting while the block moves; ``drained``: it vanishes), ``jrc``,
            ``jcs_mpa``, ``joint_length_m``, which end with the first slip, and
            ``phi_residual_deg``, on which it is then run.

    Raises:
        TypeError: a keyword that no kind knows.
        InputError: a value outside its range, a block given in no way or in two, a block that
            fails at rest or that nothing moves, an unknown kind or polarity, an option of
            another model, components that cannot be brought together, a start of a block that
            carries none.
    """
    joint = {name: of_kind.pop(name) for name in JOINT if name in of_kind}
    for name in of_kind:
        if "_sigma" in name:
            raise InputError(f"{name} requires draws: use rbfrag.respond_draws", fields=(name,))
        if not any(name in facts.settings for facts in KINDS.values()):
            raise TypeError(f"respond() got an unexpected keyword argument {name!r}")
    settings = {
        "two_way": two_way or None,
        "horizontal": horizontal or None,
        "restitution": restitution,
        **of_kind,
    }
    remarks: tuple[str, ...] = ()
    mode: ModeName | None = None
    drained: DrainedYield | None = None
    free_standing = kind is not None and model_of_kind(kind).free_standing
    conditions = {
        "beta_deg": beta_deg,
        "phi_deg": phi_deg,
        "phi_back_deg": phi_back_deg,
        "density_kg_m3": density_kg_m3,
        **joint,
    }
    if block is not None:
        for name, value in (("p2", p2), ("kr", kr), ("ky", ky)):
            if value is not None:
                raise InputError(
                    f"{name} cannot be combined with the geometry of a block", fields=(name,)
                )
        if beta_deg is None or (phi_deg is None and not free_standing):
            name = "beta_deg" if beta_deg is None else "phi_deg"
            raise InputError(
                f"{name} is missing: the mode of a block depends on dip and friction",
                fields=(name,),
            )
        planes = {**conditions, "back_fracture": back_fracture, "cohesion_pa": cohesion_pa}
        model, supported_block, assessment, remarks = known_by_shape(kind, block, planes, settings)
        mode, drained = assessment.mode, assessment.drained
        if drained is not None:
            remarks = (*remarks, IS_DRAINED if assessment.push is None else STAYS_UNDRAINED)
    else:
        numbers = {"p2": p2, "kr": kr, "ky": ky, **conditions}
        model, supported_block = known_by_numbers(kind, numbers, settings)
    if start is not None and not model.carries_state:
        raise InputError(f"start cannot be combined with {model.kind}: {STARTS_ANEW}")

    def run(
        motion: GroundMotion, vertical: GroundMotion | None, start: BlockState | None
    ) -> Response:
        shaking = Shaking(motion, vertical, polarity, history, remarks, start)
        answer = model.respond(supported_block, shaking)
        labels: dict[str, Any] = {"mode": mode or model.mode}
        if answer.started_s is not None and answer.final_mode is None:
            labels["final_mode"] = model.mode
        return answer.with_values(**labels)

    if not isinstance(motion, list | tuple):
        if gap_s is not None:
            raise InputError("gap_s requires a list of motions: it is the time between them")
        if isinstance(vertical, list | tuple):
            raise InputError("vertical is a list: give one vertical motion for one motion")
        answer = run(as_motion(cast("MotionLike", motion)), _vertical(vertical), start)
    else:
        if not (vertical is None or isinstance(vertical, list | tuple)):
            raise InputError("vertical is one motion: give a list for a list of motions")
        motions = [as_motion(item) for item in motion]
        verticals = [_vertical(item) for item in vertical or ()]
        answer = respond_in_sequence(
            run, motions, verticals, gap_s, carries_state=model.carries_state, start=start
        )
    return answer if drained is None else answer.with_values(drained=drained)


def known_by_shape(
    kind: str | None, block: Block, planes: Mapping[str, Any], settings: Mapping[str, Any]
) -> tuple[Kind, SupportedBlock, Stability, tuple[str, ...]]:
    """Return the model of a block defined by its geometry, the block on its planes, its stability
    and warnings about it.

    Args:
        kind: the model; None for that of the failure mode.
        block: shape and size.
        planes: keywords of :func:`rbfrag.stability`, and perhaps ``phi_residual_deg``; without
            ``phi_deg`` the block does not slip.
        settings: options of one model or another; None for what is not given.

    Raises:
        InputError: the block fails at rest or nothing moves it, or an option of another model.
    """
    free_standing = kind is not None and model_of_kind(kind).free_standing
    backed, phi_deg = planes.get("back_fracture", True), planes.get("phi_deg")
    on = {**planes, "back_fracture": backed and not free_standing}
    if phi_deg is None:
        on["phi_deg"] = 0.5 * (90.0 + max(block.alpha1_deg, block.alpha3_deg, 0.0))
    on, after = after_first_slip(block, on)
    reject_before_slip(block, on, kind)
    assessment = stability(block, **on)
    if kind is None:
        model = model_of_mode(assessment.mode, back_fracture=backed)
    else:
        model = model_of_kind(kind)
    options = _model_settings(model, settings)
    if not model.free_standing:
        require_stable(assessment)
    supported_block = SupportedBlock.of(block, assessment, model.mode, options)
    if phi_deg is None:
        supported_block = replace(supported_block, phi_rad=0.5 * math.pi)
    return model, supported_block, assessment, (*after, *_remarks(assessment, model))


def known_by_numbers(
    kind: str | None, numbers: Mapping[str, float | None], settings: Mapping[str, Any]
) -> tuple[Kind, SupportedBlock]:
    """Return a block defined by p2 and kr or by ky, and its model.

    Args:
        kind: the model; None for that of the mode which the numbers mean.
        numbers: ``p2`` and ``kr``, or ``ky`` and perhaps ``beta_deg``; None for what is not given.
        settings: options of one model or another; None for what is not given.

    Raises:
        InputError: a block given in no way or in two, or an option of another model.
    """
    inputs = {name: value for name, value in numbers.items() if value is not None}
    if "ky" in inputs:
        if "p2" in inputs or "kr" in inputs:
            raise InputError(
                "ky is for sliding, p2 and kr for toppling: give one or the other",
                fields=("ky", "p2", "kr"),
            )
        if extra := [name for name in inputs if name not in ("ky", "beta_deg")]:
            raise InputError(
                f"{extra[0]} cannot be combined with ky: it follows from ky and beta_deg",
                fields=(extra[0], "ky", "beta_deg"),
            )
        model = _by_numbers(kind, "slide", ("ky",))
        options = _model_settings(model, settings)
        ky = positive(inputs["ky"], "ky", "the yield acceleration coefficient of sliding, in g")
        beta_deg = angle(inputs.get("beta_deg", 0.0), "beta_deg", -90.0, 90.0)
        beta_rad = math.radians(beta_deg)
        phi_rad = beta_rad + math.atan(ky)
        if not 0.0 <= phi_rad < 0.5 * math.pi:
            raise InputError(
                f"ky = {ky:g} and beta_deg = {beta_deg:g} give a friction angle of "
                f"{math.degrees(phi_rad):.4g} degrees: it must be from 0 to below 90"
            )
        return model, SupportedBlock(
            None, beta_rad, phi_rad, phi_rad, ky, back_fracture=False, settings=options
        )
    for name in ("p2", "kr"):
        if name not in inputs:
            raise InputError(
                f"{name} is missing: give p2 and kr, or ky, or the geometry of a block with "
                "beta_deg and phi_deg",
                fields=("p2", "kr", "ky", "beta_deg", "phi_deg"),
            )
    if extra := [name for name in inputs if name not in ("p2", "kr")]:
        raise InputError(
            f"{extra[0]} cannot be combined with p2 and kr, which describe the block completely",
            fields=(extra[0], "p2", "kr"),
        )
    model = _by_numbers(kind, "topple", ("p2", "kr"))
    return model, block_of_numbers(inputs["p2"], inputs["kr"], _model_settings(model, settings))


def _vertical(vertical: Any) -> GroundMotion | None:
    return None if vertical is None else as_motion(vertical, "vertical")


def block_of_numbers(p2: float, kr: float, settings: Mapping[str, Any]) -> SupportedBlock:
    """Return a block defined by its frequency parameter [1/s²] and yield acceleration [g]."""
    rough_rad = 0.5 * math.pi
    return SupportedBlock(None, 0.0, rough_rad, rough_rad, kr, settings=settings, p2=p2)


def _remarks(assessment: Stability, model: Kind) -> tuple[str, ...]:
    """Return the warnings about the block for the answer of a model."""
    if model.mode == assessment.mode:
        unbacked = stands_free_of(model, assessment.back_fracture)
        note = Diagnostic(NOT_BACKED, "free_standing")
        return (*assessment.warnings, note) if unbacked else assessment.warnings
    return (
        *assessment.warnings,
        Diagnostic(
            f"the mode of the block is {words_of_mode(assessment.mode)}: it does not fail by "
            f"{model.kind.replace('_', ' ')}",
            "other_mode",
        ),
    )


def _by_numbers(kind: str | None, mode: ModeName, numbers: tuple[str, ...]) -> Kind:
    """Return the model for which numbers suffice, unless another one was requested."""
    if kind is None:
        return model_of_mode(mode)
    model = model_of_kind(kind)
    if not set(numbers) <= {*model.parameters}:
        raise InputError(
            f"{kind} requires the geometry of the block: give a block with beta_deg and phi_deg "
            f"instead of {' and '.join(numbers)}, which are for {model_of_mode(mode).kind}",
            fields=(*numbers, "beta_deg", "phi_deg"),
        )
    return model


def _model_settings(model: Kind, settings: Mapping[str, Any]) -> dict[str, Any]:
    inputs = {name: value for name, value in settings.items() if value is not None}
    unknown = sorted(set(inputs) - set(model.settings))
    if unknown:
        supported = " and ".join(model.settings)
        remedy = f"its options are {supported}" if supported else "omit it"
        raise InputError(
            f"{unknown[0]} cannot be combined with kind {model.kind}: {remedy}",
            fields=(unknown[0],),
        )
    return inputs


WORST_LAST = (
    Outcome.STABLE,
    Outcome.UNDETERMINED,
    Outcome.CONTACT_LOST,
    Outcome.INDETERMINATE,
    Outcome.JUMP,
    Outcome.TOPPLED,
)
"""Outcomes by how much they say against the block."""

STARTS_ANEW = (
    "a block that topples or rocks carries no state from one motion to the next but damage, which "
    "no law here describes: each motion finds it at rest in its place"
)

NOT_YET_AT_REST = (
    "A block that still rocks when the next motion begins may fail where this says that it stays: "
    "join such motions into one record"
)

Run = Callable[[GroundMotion, GroundMotion | None, BlockState | None], Response]
"""Answers one motion with its vertical one, from a state."""


def respond_in_sequence(
    run: Run,
    motions: Sequence[GroundMotion],
    verticals: Sequence[GroundMotion | None],
    gap_s: float | None,
    *,
    carries_state: bool,
    start: BlockState | None = None,
) -> Response:
    """Return the response of a block to several motions in sequence.

    Args:
        run: answers one motion.
        motions: horizontal motions, one or more.
        verticals: the vertical motion of each, or None; () for none.
        gap_s: rest between the end of one and the beginning of the next [s]; None for as long as
            the block takes to come to rest.
        carries_state: whether the next motion finds the block where the last one left it.
        start: the state that the first of them finds.

    Raises:
        InputError: no motion, or not one vertical motion for each; a gap below zero.
    """
    if not motions:
        raise InputError("no motion: give one accelerogram or more")
    if verticals and len(verticals) != len(motions):
        raise InputError(
            f"{len(motions)} motions and {len(verticals)} vertical motions: give one for each "
            "motion (or None), or none"
        )
    if gap_s is not None:
        not_negative(gap_s, "gap_s", "s")
    verticals = verticals or [None] * len(motions)
    parts: list[Part] = []
    warnings: list[str] = []
    if not carries_state:
        warnings.append(Diagnostic(f"{STARTS_ANEW}. {NOT_YET_AT_REST}", "sequence"))
    state, begins_s, overlaps_s = start, 0.0, 0.0
    for number, (motion, vertical) in enumerate(zip(motions, verticals, strict=True), start=1):
        if parts:
            before = parts[-1].response
            is_over = before.outcome in (Outcome.TOPPLED, Outcome.JUMP)
            if before.state is None if carries_state else is_over:
                why = f"the one before ends as {before.outcome.value}: {before.outcome.advice}"
                if before.outcome is Outcome.STABLE:
                    why = "where the one before leaves the block is not known"
                text = f"motion {number} and later ones are left out: {why}"
                warnings.append(Diagnostic(text, "sequence"))
                break
        if overlaps_s > 0.0:
            warnings.append(Diagnostic(_too_short(overlaps_s, number - 1), "sequence"))
        answer = run(motion, vertical, state)
        first_s, last_s = float(motion.time_s[0]), float(motion.time_s[-1])
        begins_s = begins_s if parts else first_s
        parts.append(Part(begins_s, first_s, motion.label, state, answer))
        moves_on_s = max(last_s, answer.stopped_s or last_s) - last_s
        rest_s = moves_on_s if gap_s is None else gap_s
        overlaps_s = moves_on_s - rest_s
        begins_s += last_s - first_s + max(rest_s, moves_on_s)
        state = answer.state if carries_state else None
    return _together(parts, warnings)


def _too_short(overlaps_s: float, number: int) -> str:
    """Return the warning that the next motion starts while the block still moves.

    The velocity of a slide grows with the velocity that it begins with, so both motions together
    slide it no less than the first by itself to its last sample and the second from rest: the sum
    is too great by no more than the slip after the first. It can be too small by any amount.
    """
    return (
        f"the block moves on after motion {number} for {overlaps_s:.3g} s longer than the gap: "
        f"motion {number + 1} is applied when it is at rest. Where motion {number + 1} pushes it "
        "on, displacement and rotation are too small (a slide under two equal pulses: half); where "
        f"it pushes back, a slide is too great by no more than the slip after motion {number}. "
        "Join the two into one record to have both at once"
    )


def _together(parts: Sequence[Part], warnings: Sequence[str]) -> Response:
    """Return the values of the complete sequence."""
    answers = [part.response for part in parts]
    outcome = max((answer.outcome for answer in answers), key=WORST_LAST.index)
    of_parts = (
        with_prefix(f"motion {number}: ", text)
        for number, answer in enumerate(answers, start=1)
        for text in answer.warnings
    )

    def values(name: str) -> list[Any]:
        return [value for a in answers if (value := getattr(a, name)) is not None]

    def complete(name: str) -> bool:
        return len(values(name)) == len(answers)

    def greatest(name: str) -> Any:
        # of a block that has failed a peak is not known
        is_known = complete(name) or outcome is Outcome.STABLE
        return max(values(name), default=None) if is_known else None

    def clock(name: str) -> list[float]:
        times = [(_on_clock(part, getattr(part.response, name))) for part in parts]
        return [time_s for time_s in times if time_s is not None]

    worst = max(parts, key=lambda part: part.response.toe_needs_deg or 0.0)
    return answers[-1].with_values(
        outcome=outcome,
        **{name: greatest(name) for name in _GREATEST},
        final_mode=next((a.final_mode for a in reversed(answers) if a.final_mode), None),
        toe_needs_s=_on_clock(worst, worst.response.toe_needs_s),
        error_estimate=max(values("error_estimate")) if complete("error_estimate") else None,
        started_s=min(clock("started_s"), default=None),
        toppled_s=min(clock("toppled_s"), default=None),
        stopped_s=max(clock("stopped_s"), default=None),
        **{name: sum(values(name)) for name in _SUMS},
        displacement_m=math.fsum(values("displacement_m")) if complete("displacement_m") else None,
        impacts=sum(values("impacts")) if values("impacts") else None,
        sensitive=any(values("sensitive")) if values("sensitive") else None,
        warnings=(*warnings, *of_parts),
        mode_changes=tuple(
            ModeChange(begun, change.motion)
            for part in parts
            for change in part.response.mode_changes
            if (begun := _on_clock(part, change.time_s)) is not None
        ),
        history=_histories(parts),
        parts=tuple(parts),
    )


_GREATEST = (
    "peak_theta_n", "peak_theta_rad", "peak_displacement_m", "peak_forward_rad",
    "peak_backward_rad", "peak_spread", "toe_needs_deg",
)  # fmt: skip
_SUMS = ("steps", "samples_moved", "samples_total")


def _on_clock(part: Part, time_s: float | None) -> float | None:
    """Return a time of one motion on the clock of the sequence [s]."""
    if time_s is None:
        return None
    return part.begins_s + time_s - part.first_s


def _histories(parts: Sequence[Part]) -> ResponseHistory | None:
    histories = [part.response.history for part in parts]
    if any(history is None for history in histories):
        return None
    joined: dict[str, FloatArray | None] = {}
    for field in fields(ResponseHistory):
        columns = [getattr(history, field.name) for history in histories]
        if any(column is None for column in columns):
            joined[field.name] = None
            continue
        if field.name in ("time_s", "impact_s"):
            columns = [
                column + (part.begins_s - part.first_s)
                for part, column in zip(parts, columns, strict=True)
            ]
        joined[field.name] = np.concatenate(columns)
    return ResponseHistory(**joined)  # type: ignore[arg-type]
