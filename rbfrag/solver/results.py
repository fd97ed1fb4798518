"""Results of the solver: plain frozen data."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rbfrag.motions.polarity import POLARITIES as POLARITIES
from rbfrag.motions.polarity import Polarity as Polarity
from rbfrag.results.numbers import percent, rounded
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.kinds import BY_MECHANICS, FOLLOWED, KINDS
from rbfrag.solver.stability.modes import DrainedYield, ModeName

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

NUMERICS_VERSION = "6"
"""Changes whenever a run of the same input may give other bits; part of every stored key."""

Status = Literal["found", "below_limit", "no_motion", "outside_model"]

SEARCH_LIMIT = 0.01
"""Smallest k_r/PGA that the critical search looks at (the dissertation's)."""

DEFAULT_P2 = (30.0, 10.0, 3.0, 1.0, 0.3, 0.1)
"""The dissertation's block sizes, as p² [1/s²]: 0.25 m to 74 m from centroid to toe."""

MAP_DEPTH = 1e-4
"""Width of k_r/PGA that a map leaves undecided below the critical value, at every border."""

RESOLUTION = 1e-6
"""Islands of k_r/PGA narrower than this are below the rounding of a recorded accelerogram."""


class Outcome(StrEnum):
    """Outcome of a run. Each member has a sentence that explains it."""

    advice: str

    def __new__(cls, value: str, advice: str) -> Outcome:
        """Attach the sentence to the member."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.advice = advice
        return member

    STABLE = "stable", "the block comes to rest"
    TOPPLED = "toppled", "the block is past recovery, whatever the rest of the record does"
    UNDETERMINED = (
        "undetermined",
        "the block is closer to its critical value than the numerical error: treat it as critical",
    )
    JUMP = (
        "jump",
        "the vertical ground motion throws the block off its base (1 + k_v <= 0): the model of "
        "a block in contact does not apply; use the horizontal motion alone or another method",
    )
    CONTACT_LOST = "contact_lost", "a contact opened: the motion after it is outside the model"
    INDETERMINATE = "indeterminate", "the rigid-body problem has no unique answer here"


@dataclass(frozen=True, eq=False)
class ResponseHistory:
    """A block's motion at the samples and events of one run.

    Args:
        time_s: times [s], shape (n,).
        theta_rad: forward rotation, of a rocking block backward rotation below zero [rad],
            shape (n,).
        theta_dot_rad_s: rotation rate [rad/s], shape (n,).
        k_h: driving horizontal acceleration, polarity applied [g], shape (n,).
        k_v: vertical acceleration, upwards positive [g], shape (n,).
        displacement_m: displacement along the base, of the sliding block, of the heel of a
            slumping one, of the toe of a confined one [m], shape (n,); None for toppling.
        velocity_m_s: rate of it [m/s], shape (n,), for sliding; None otherwise.
        centroid_m: position of the centroid in the base frame with the heel at rest as
            origin [m], shape (n, 2); None for toppling.
        turned_rad: rotation of the block, counter-clockwise positive with the slope falling to
            the right [rad], shape (n,); None for toppling, which turns by -theta_rad.
        strength_g: driving acceleration at which the block, where it is, neither speeds up nor
            slows down while 1 + k_v = 1 [g], shape (n,); None for toppling.
        impact_s: times of the impacts of a rocking block [s], shape (m,); None for other kinds.
    """

    time_s: FloatArray
    theta_rad: FloatArray
    theta_dot_rad_s: FloatArray
    k_h: FloatArray
    k_v: FloatArray
    displacement_m: FloatArray | None = None
    velocity_m_s: FloatArray | None = None
    centroid_m: FloatArray | None = None
    turned_rad: FloatArray | None = None
    strength_g: FloatArray | None = None
    impact_s: FloatArray | None = None


@dataclass(frozen=True)
class ModeChange:
    """A change of the block's mode of motion within one run.

    Args:
        time_s: when [s].
        motion: what it does from then on.
    """

    time_s: float
    motion: str


@dataclass(frozen=True)
class Pose:
    """Position of the block, in the base frame with the heel at rest as origin.

    Args:
        turned_rad: rotation, counter-clockwise [rad].
        centroid_m: position of the centroid (x, y) [m].
        displacement_m: how far the contact on the base has slipped along it, down the
            slope positive [m].
    """

    turned_rad: float
    centroid_m: tuple[float, float]
    displacement_m: float


@dataclass(frozen=True)
class BlockState:
    """A block at rest after a motion, from which another one may start.

    Args:
        turned_rad: rotation, counter-clockwise with the slope falling to the right [rad].
        centroid_m: position of the centroid in the base frame, the heel's first place as origin
            [m].
        displacement_m: how far its contact on the base has slipped along it since the first [m].
        gap_m: gap between the heel and its back plane, along the base [m].
        touching: corners that touch a plane.
        position: coordinate of its mechanism [rad] or [m]; None where no mechanism describes it.
        error: bound on the error of the rotation [rad], of a sliding block of the displacement [m];
            infinite where it is not known.
        by_law: where a run of twice the step and runs by each other law of impact leave the block,
            from where the next motion continues each of them; () for a block that no mechanism has
            left, or that fails by some of them.
    """

    turned_rad: float
    centroid_m: tuple[float, float]
    displacement_m: float
    gap_m: float
    touching: tuple[str, ...]
    position: float | None
    error: float
    by_law: tuple[Pose, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the state with the keys of the JSON contract."""
        return {
            "rotation_rad": self.turned_rad,
            "displacement_m": self.displacement_m,
            "gap_m": self.gap_m,
            "touching": list(self.touching),
        }


@dataclass(frozen=True, eq=False)
class Part:
    """One motion of a sequence.

    Args:
        begins_s: when it begins, on the clock of the sequence [s].
        first_s: time of its first sample on its own clock [s].
        motion: its label.
        start: the state that it finds; None for a block at rest in its first place.
        response: the answer to it alone, on its own clock.
    """

    begins_s: float
    first_s: float
    motion: str
    start: BlockState | None
    response: Response

    def as_dict(self) -> dict[str, Any]:
        """Return the answer to this motion alone, with the state of the block before and after."""
        end = self.response.state
        return {
            "motion": self.motion,
            "begins_s": self.begins_s,
            "start": None if self.start is None else self.start.as_dict(),
            **self.response.as_dict(),
            "end": None if end is None else end.as_dict(),
        }


RESPONSE_NUMBERS = (
    "peak_theta_n", "peak_theta_rad", "critical_angle_deg", "started_s", "toppled_s",
    "error_estimate", "steps", "samples_moved", "samples_total", "final_theta_rad",
    "displacement_m", "peak_displacement_m", "centroid_displacement_m", "stopped_s",
    "toe_needs_deg", "toe_needs_s", "toe_slips_g",
)  # fmt: skip
OF_TWO_CORNERS = (
    "critical_backward_deg", "peak_forward_rad", "peak_backward_rad", "impacts", "sensitive",
    "peak_spread",
)  # fmt: skip
"""Values of a response in its JSON answer; the latter of blocks that rock about two corners."""

OF_PART = (
    "motion", "begins_s", "outcome", "peak_theta_rad", "final_theta_rad", "displacement_m",
    "started_s", "stopped_s",
)  # fmt: skip
"""Values of each motion of a sequence in the table on a terminal."""


@dataclass(frozen=True, eq=False, repr=False)
class Response(Result):
    """The answer of one run.

    Args:
        kind: the model that was run (``toppling``).
        outcome: how it ended.
        peak_theta_n: peak rotation over the critical angle (rocking: the greater ratio of both
            senses, each to its own); None when the block topples.
        peak_theta_rad: peak rotation, of either sense [rad]; None when the block topples, and for
            sliding.
        critical_angle_deg: rotation at which the block at rest has no strength left: it
            balances on its toe, or slumps of itself [deg]; None where there is none.
        started_s: time of the first motion [s]; None if the block never moves.
        toppled_s: time at which failure became inevitable [s]; None unless it fails.
        error_estimate: estimated bound on the error of the peak rotation [rad] (sliding: of
            the peak displacement [m]); for a toppling block, on the rotation at the moment
            of the verdict. After a lost contact, the spread of laws of impact and friction; None
            where the block fails by some of them and not by others.
        steps: integration steps taken.
        samples_moved: sample intervals that had to be integrated.
        samples_total: sample intervals of the record.
        warnings: sentences about suspicious input.
        history: the motion in time, only if it was asked for.
        final_theta_rad: rotation that is left at the end of the run [rad]; None for toppling
            and sliding, and when the block fails.
        displacement_m: permanent displacement along the base by this motion, down the slope
            positive: of the sliding block, of the heel of a slumping one, of the toe of a confined
            one [m]; None for toppling, and when the block fails.
        peak_displacement_m: greatest displacement along the base, from the block's first place
            [m]; None likewise.
        centroid_displacement_m: distance of the centroid from where it was [m]; None likewise.
        stopped_s: time of the last standstill, or at which the model ended [s]; None if the
            block never moved, and for toppling.
        mode_changes: what the block did after its first motion, one entry a change.
        critical_backward_deg: rotation at which a rocking block balances on its heel [deg]; None
            for other kinds, as are the four that follow.
        peak_forward_rad: greatest rotation about the toe [rad]; None where it overturns that way.
        peak_backward_rad: greatest rotation about the heel [rad]; None likewise.
        impacts: impacts within the record; the free motion after it is decided in closed form.
        sensitive: whether the outcome is another one for the motion times 1 + 1e-6 or 1 - 1e-6.
        peak_spread: greatest relative change of `peak_theta_rad` for these motions; None where the
            outcome changes, where the block overturns or does not move, and for other kinds.
        state: where the block is left at rest; None where it is not, or not known.
        mode: failure mode of the block in its first place.
        final_mode: that of its last motion that is one of a mode; None for no motion.
        toe_needs_deg: greatest friction angle that a rotation without slip needs at the toe [deg];
            None for other kinds than toppling, for numbers without a shape, and without a rotation.
        toe_needs_s: when [s].
        toe_slips_g: acceleration at which the toe gives way as the block starts to turn [g]; None
            where it holds at any.
        parts: of a sequence, the answer to each motion; () for a single one.
        drained: yield acceleration of the drained block; None without water.
    """

    kind: str
    outcome: Outcome
    peak_theta_n: float | None
    peak_theta_rad: float | None
    critical_angle_deg: float | None
    started_s: float | None
    toppled_s: float | None
    error_estimate: float | None
    steps: int
    samples_moved: int
    samples_total: int
    warnings: tuple[str, ...] = ()
    history: ResponseHistory | None = None
    final_theta_rad: float | None = None
    displacement_m: float | None = None
    peak_displacement_m: float | None = None
    centroid_displacement_m: float | None = None
    stopped_s: float | None = None
    mode_changes: tuple[ModeChange, ...] = ()
    critical_backward_deg: float | None = None
    peak_forward_rad: float | None = None
    peak_backward_rad: float | None = None
    impacts: int | None = None
    sensitive: bool | None = None
    peak_spread: float | None = None
    state: BlockState | None = None
    mode: ModeName | None = None
    final_mode: ModeName | None = None
    toe_needs_deg: float | None = None
    toe_needs_s: float | None = None
    toe_slips_g: float | None = None
    parts: tuple[Part, ...] = ()
    drained: DrainedYield | None = None

    def with_values(self, **values: Any) -> Response:
        """Return the answer with other values, as :func:`dataclasses.replace`, which takes longer
        than a run.
        """
        answer = object.__new__(Response)
        vars(answer).update(vars(self) | values)
        return answer

    @property
    def how(self) -> str:
        """Source of the answer: ``followed in time``, or ``by mechanics`` without motion."""
        return BY_MECHANICS if self.started_s is None and not self.steps else FOLLOWED

    def sentences(self) -> Iterator[str]:
        """Yield the outcome with the peak rotation, and the displacement of a block that stays."""
        if self.started_s is None and self.outcome is Outcome.STABLE:
            yield "The block does not move: the motion never exceeds its yield acceleration"
            return
        facts = KINDS.get(self.kind)
        verb = "fails" if facts is None else facts.verb
        # a slide without a displacement limit has a length, not a verdict
        slides = facts is None or "displacement_m" in facts.parameters
        rotates = self.peak_theta_rad is not None
        if (
            self.outcome is Outcome.STABLE
            and self.displacement_m is not None
            and (slides or not rotates)
        ):
            way = "along" if self.displacement_m >= 0.0 else "up"
            slid = rounded(abs(self.displacement_m))
            tips = f", tips up to {self._peak()}" if rotates else ""
            yield f"The block slides {slid} m {way} its base{tips} and stops"
            return
        if self.outcome is Outcome.STABLE and rotates:
            yield f"The block does not {verb.removesuffix('s')}: peak rotation {self._peak()}"
        else:
            advice = self.outcome.advice
            if self.toppled_s is None:
                yield advice[0].upper() + advice[1:]
            else:
                advice = advice.removeprefix("the block is ")
                yield f"The block {verb} at {self.toppled_s:.2f} s: {advice}"
            if self.peak_theta_rad is not None:
                yield f"Peak rotation {self._peak()}"
        if self.displacement_m is not None:
            yield f"Displacement {rounded(self.displacement_m)} m"

    def _peak(self) -> str:
        """Return the peak rotation: "0.12° (1.1 % of the critical angle 11.3°)"."""
        assert self.peak_theta_rad is not None
        peak_deg, critical_deg = math.degrees(self.peak_theta_rad), self.critical_angle_deg
        text = f"{peak_deg:.2g}°"
        if self.peak_theta_n is None or critical_deg is None:
            return text
        # the ratio is that of the other corner where a rocking block comes closer to its limit
        is_of_toe = math.isclose(peak_deg, self.peak_theta_n * critical_deg, rel_tol=1e-6)
        limit = f"the critical angle {rounded(critical_deg)}°" if is_of_toe else "a critical angle"
        return f"{text} ({percent(self.peak_theta_n)} of {limit})"

    def lines(self) -> Iterator[TextLine]:
        """Yield the model, the time of the motion, the friction of the toe, the drained yield."""
        model = self.kind.replace("_", " ")
        if self.critical_angle_deg is not None:
            model += f", critical angle {rounded(self.critical_angle_deg)}°"
        yield TextLine("Model", model)
        if self.started_s is not None:
            times = f"starts at {self.started_s:.2f} s"
            if self.stopped_s is not None:
                times += f", stops at {self.stopped_s:.2f} s"
            if self.impacts is not None:
                times += f"; {self.impacts} impact{'' if self.impacts == 1 else 's'}"
            yield TextLine("Motion", times)
        for change in self.mode_changes:
            yield TextLine("", f"from {change.time_s:.2f} s it {change.motion}")
        if self.toe_needs_deg is not None:
            needs = f"no slip if the friction angle is at least {rounded(self.toe_needs_deg)}°"
            if self.toe_slips_g is not None:
                needs += f"; slips above {rounded(self.toe_slips_g)} g at the first motion"
            yield TextLine("Toe", needs)
        if self.drained is not None and self.drained.yield_acceleration is not None:
            drained = rounded(self.drained.yield_acceleration)
            yield TextLine("Drained", f"yield acceleration {drained} g")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield every value, if verbose, and the answer to each motion of a sequence."""
        values = self.as_dict()
        parts = values.pop("parts", [])
        if verbose:
            apart = ("warnings", "mode_changes", "drained")
            rows = [(name, value) for name, value in values.items() if name not in apart]
            yield TextTable((), [(name, value) for name, value in rows if value is not None])
        if parts:
            yield TextTable(OF_PART, [[part[name] for name in OF_PART] for part in parts])

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        document: dict[str, Any] = {
            "kind": self.kind,
            "mode": self.mode,
            "final_mode": self.final_mode,
            "outcome": self.outcome.value,
            "how": self.how,
            **{name: getattr(self, name) for name in RESPONSE_NUMBERS},
            "drained": None if self.drained is None else asdict(self.drained),
            "mode_changes": [asdict(change) for change in self.mode_changes],
            "warnings": list(self.warnings),
        }
        if self.impacts is not None:
            document |= {name: getattr(self, name) for name in OF_TWO_CORNERS}
        if self.parts:
            document["parts"] = [part.as_dict() for part in self.parts]
        return document


@dataclass(frozen=True, eq=False)
class SearchPoints:
    """Blocks simulated individually: those of a search by falling k_r/PGA, those of an outcome grid
    in its order.

    Args:
        kr_over_pga: block strength over PGA, shape (n,).
        theta_n: peak rotation over the critical angle, shape (n,); NaN where it toppled.
        outcome: :class:`Outcome` values as text, length n.
        displacement_m: displacement down a level plane of blocks that slide [m], shape (n,);
            None for other kinds.
        sensitive: of free-standing blocks, whether the outcome is another one for the motion times
            1 ± 1e-6, shape (n,); None for other kinds.
    """

    kr_over_pga: FloatArray
    theta_n: FloatArray
    outcome: tuple[str, ...]
    displacement_m: FloatArray | None = None
    sensitive: NDArray[np.bool_] | None = None


IntervalOutcome = Literal["topples", "safe", "undecided"]


@dataclass(frozen=True, eq=False)
class OutcomeIntervals:
    """Outcome of every block over a range of k_r: a partition, by rising k_r/PGA.

    Args:
        k_lo: lower ends, k_r/PGA, shape (n,); `k_lo[i + 1] == k_hi[i]`.
        k_hi: upper ends, k_r/PGA, shape (n,). Nothing above the last one ever lifts.
        outcome: ``topples`` (every block of the interval), ``safe`` (none) or ``undecided``,
            length n. The border between two of them lies in an undecided interval.
    """

    k_lo: FloatArray
    k_hi: FloatArray
    outcome: tuple[IntervalOutcome, ...]


def no_intervals() -> OutcomeIntervals:
    """Return the map of a search that made none."""
    return OutcomeIntervals(np.empty(0), np.empty(0), ())
