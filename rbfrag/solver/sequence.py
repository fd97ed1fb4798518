"""Several motions in sequence: each finds the block where the previous one has left it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.results.diagnostic import Diagnostic, with_prefix
from rbfrag.solver.quantity import not_negative
from rbfrag.solver.results import (
    BlockState,
    FloatArray,
    ModeChange,
    Outcome,
    Part,
    Response,
    ResponseHistory,
)

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


@dataclass(frozen=True, eq=False)
class Motions:
    """The motions of a sequence.

    Args:
        horizontal: horizontal motions, one or more.
        vertical: the vertical motion of each, or None.
        gap_s: rest between the end of one and the beginning of the next [s]; None for as long as
            the block takes to come to rest.

    Raises:
        InputError: no motion, or not one vertical motion for each; a gap below zero.
    """

    horizontal: Sequence[GroundMotion]
    vertical: Sequence[GroundMotion | None] = ()
    gap_s: float | None = None

    def __post_init__(self) -> None:
        if not self.horizontal:
            raise InputError("no motion: give one accelerogram or more")
        if self.vertical and len(self.vertical) != len(self.horizontal):
            raise InputError(
                f"{len(self.horizontal)} motions and {len(self.vertical)} vertical motions: give "
                "one for each motion (or None), or none"
            )
        if self.gap_s is not None:
            not_negative(self.gap_s, "gap_s", "s")


def respond_in_sequence(
    run: Run, motions: Motions, *, carries_state: bool, start: BlockState | None = None
) -> Response:
    """Return the response of a block to several motions in sequence.

    Args:
        run: answers one motion.
        carries_state: whether the next motion finds the block where the last one left it.
        start: the state that the first of them finds.
    """
    verticals = motions.vertical or [None] * len(motions.horizontal)
    parts: list[Part] = []
    warnings: list[str] = []
    if not carries_state:
        warnings.append(Diagnostic(f"{STARTS_ANEW}. {NOT_YET_AT_REST}", "sequence"))
    state, begins_s, overlaps_s = start, 0.0, 0.0
    for number, (motion, vertical) in enumerate(
        zip(motions.horizontal, verticals, strict=True), start=1
    ):
        if parts and _is_over(parts[-1].response, carries_state):
            text = f"motion {number} and later ones are left out: {_why(parts[-1])}"
            warnings.append(Diagnostic(text, "sequence"))
            break
        if overlaps_s > 0.0:
            warnings.append(Diagnostic(_too_short(overlaps_s, number - 1), "sequence"))
        answer = run(motion, vertical, state)
        first_s, last_s = float(motion.time_s[0]), float(motion.time_s[-1])
        begins_s = begins_s if parts else first_s
        parts.append(Part(begins_s, first_s, motion.label, state, answer))
        moves_on_s = max(last_s, answer.stopped_s or last_s) - last_s
        gap_s = moves_on_s if motions.gap_s is None else motions.gap_s
        overlaps_s = moves_on_s - gap_s
        begins_s += last_s - first_s + max(gap_s, moves_on_s)
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


def _is_over(response: Response, carries_state: bool) -> bool:
    """Return whether the response to the next motion is undefined."""
    if carries_state:
        return response.state is None
    return response.outcome in (Outcome.TOPPLED, Outcome.JUMP)


def _why(part: Part) -> str:
    outcome = part.response.outcome
    if outcome is Outcome.STABLE:
        return "where the one before leaves the block is not known"
    return f"the one before ends as {outcome.value}: {outcome.advice}"


def _together(parts: Sequence[Part], warnings: Sequence[str]) -> Response:
    """Return the values of the complete sequence."""
    answers = [part.response for part in parts]
    outcome = max((answer.outcome for answer in answers), key=WORST_LAST.index)
    of_parts = (
        with_prefix(f"motion {number}: ", text)
        for number, answer in enumerate(answers, start=1)
        for text in answer.warnings
    )

    def greatest(name: str) -> Any:
        values = [getattr(answer, name) for answer in answers]
        # of a block that has failed a peak is not known
        return None if None in values and outcome is not Outcome.STABLE else _most(values)

    def clock(name: str) -> list[float]:
        times = [(_on_clock(part, getattr(part.response, name))) for part in parts]
        return [time_s for time_s in times if time_s is not None]

    worst = max(parts, key=lambda part: part.response.toe_needs_deg or 0.0)
    errors = [answer.error_estimate for answer in answers]
    slips = [answer.displacement_m for answer in answers]
    known_slips = [slip for slip in slips if slip is not None]
    return replace(
        answers[-1],
        outcome=outcome,
        **{name: greatest(name) for name in _GREATEST},
        final_mode=next((a.final_mode for a in reversed(answers) if a.final_mode), None),
        toe_needs_s=_on_clock(worst, worst.response.toe_needs_s),
        error_estimate=None if None in errors else _most(errors),
        started_s=min(clock("started_s"), default=None),
        toppled_s=min(clock("toppled_s"), default=None),
        stopped_s=max(clock("stopped_s"), default=None),
        **{name: sum(getattr(answer, name) for answer in answers) for name in _SUMS},
        displacement_m=math.fsum(known_slips) if len(known_slips) == len(slips) else None,
        impacts=_total([answer.impacts for answer in answers]),
        sensitive=_any([answer.sensitive for answer in answers]),
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


def _most(values: Sequence[float | None]) -> float | None:
    return max((value for value in values if value is not None), default=None)


def _total(values: Sequence[int | None]) -> int | None:
    numbers = [value for value in values if value is not None]
    return sum(numbers) if numbers else None


def _any(values: Sequence[bool | None]) -> bool | None:
    answers = [value for value in values if value is not None]
    return any(answers) if answers else None


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
