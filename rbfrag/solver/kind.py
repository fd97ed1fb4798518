"""Interface of a kind of failure: response, run and critical value of its blocks.

A kind is a line of facts in `rbfrag.solver.kinds` and one object, ``MODEL``, in the file of its
name in `rbfrag/solver/models`. Who computes asks these, never for the name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation, kept_excitation, motion_remarks
from rbfrag.solver.kinds import KindSpec, facts_of
from rbfrag.solver.results import BlockState, Outcome, Polarity, Response
from rbfrag.solver.stability.modes import DRY, ModeName, Push
from rbfrag.solver.stability.single import Stability

SHAKING = ("vertical", "polarity", "search_limit")
"""Options of every search."""


@dataclass(frozen=True)
class SupportedBlock:
    """A block, its planes and the settings of its motion, as used by a model.

    Args:
        block: its shape and size; None where numbers describe it.
        beta_rad: dip of the base, out of the slope positive [rad].
        phi_rad: friction angle of the base [rad]; π/2 where it is not known and the kind does
            without.
        phi_back_rad: friction angle of the back plane [rad].
        back_fracture: whether there is a back plane.
        cohesive: whether the base has cohesion.
        yield_g: yield acceleration of the model's mode where 1 + k_v = 1 [g]; None if the
            block's mode is another one.
        settings: options of one model or another, by name.
        p2: frequency parameter p² of a block without a shape [1/s²].
        push: of water that keeps acting, as :class:`rbfrag.solver.stability.single.Stability` has
            it.
    """

    block: Block | None
    beta_rad: float
    phi_rad: float
    phi_back_rad: float
    yield_g: float | None
    back_fracture: bool = True
    cohesive: bool = False
    settings: Mapping[str, Any] = field(default_factory=dict)
    p2: float | None = None
    push: Push = DRY

    @classmethod
    def of(
        cls, block: Block, judged: Stability, mode: ModeName | None, settings: Mapping[str, Any]
    ) -> SupportedBlock:
        """Return the supported block of a model from a block and its stability."""
        return cls(
            block,
            math.radians(judged.beta_deg),
            math.radians(judged.phi_deg),
            math.radians(judged.phi_back_deg),
            judged.yield_acceleration if judged.mode == mode else None,
            judged.back_fracture,
            judged.cohesion is not None,
            settings,
            push=judged.push or DRY,
        )

    @property
    def centroid_m(self) -> tuple[float, float]:
        """Centroid in the base frame with the heel as origin [m]; the origin without a block."""
        return (0.0, 0.0) if self.block is None else self.block.centroid


@dataclass(frozen=True, eq=False)
class Shaking:
    """Excitation of one response, and the options of its result.

    Args:
        vertical: vertical motion of the same recording, upward positive.
        history: keep the motion in time.
        remarks: what is known about the block that the answer should say.
        start: the state that the motion finds; None for a block at rest in its first place.
        laws: whether the error after a lost contact includes what laws of impact and friction
            differ by, which takes as long as the motion itself.
        stepwise: whether a record that drives the block up its back plane is followed step by step.
    """

    motion: GroundMotion
    vertical: GroundMotion | None
    polarity: Polarity
    history: bool = False
    remarks: tuple[str, ...] = ()
    start: BlockState | None = None
    laws: bool = True
    stepwise: bool = True

    @cached_property
    def excitation(self) -> Excitation:
        """Both components at common nodes, polarity applied."""
        return kept_excitation(self.motion, self.vertical, self.polarity)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the block and about the motion."""
        return (*self.remarks, *motion_remarks(self.motion, self.vertical, self.excitation))


@dataclass(frozen=True)
class RunEnd:
    """The end of one run, without its history.

    Args:
        moved: whether the block moved at all.
        peak_rad: peak rotation [rad]; None for a block that slides, or that has failed.
        peak_displacement_m: greatest displacement of the contact on the base along it [m]; None
            for a block that rocks, or that has failed.
        error: bound on the error of the integration of the peak [rad], of a sliding block [m];
            what laws of impact leave open after a lost contact is not in it.
        about_block: what the model takes for granted about this block, whatever the motion.
        final_mode: failure mode of the last motion that is one of a mode; None for no motion.
    """

    outcome: Outcome
    moved: bool
    peak_rad: float | None
    peak_displacement_m: float | None
    error: float
    about_block: tuple[str, ...] = ()
    final_mode: ModeName | None = None


Runner = Callable[[Excitation], RunEnd]
"""One block, made ready: says how it ends under an excitation."""


class Kind(KindSpec):
    """Base class of the kinds: static facts, and answers without a search.

    Attributes:
        carries_state: whether a motion leaves a block somewhere else than it found it.
    """

    carries_state = False

    @classmethod
    def named(cls, kind: str) -> Self:
        """Return the model of a kind with its static facts."""
        return cls(**vars(facts_of(kind)))

    def respond(self, supported_block: SupportedBlock, shaking: Shaking) -> Response:
        """Return the response of the block."""
        raise NotImplementedError

    def runner(self, supported_block: SupportedBlock) -> Runner:
        """Return a function that gives the end of the block's run under an excitation."""
        raise NotImplementedError

    def critical(self, motion: GroundMotion, **options: Any) -> CriticalResult:
        """Return the critical value of one motion.

        Raises:
            InputError: there is no search, or an option is that of another kind.
        """
        why = f": {self.no_search}" if self.no_search else ""
        raise InputError(f"no critical values of kind {self.kind} are computed{why}")

    def reject_foreign(self, options: Iterable[str], allowed: Sequence[str]) -> None:
        """Reject an option that the kind does not support."""
        foreign = sorted(set(options) - set(allowed))
        if foreign:
            remedy = f"its options are {' and '.join(allowed)}" if allowed else "omit it"
            raise InputError(f"{foreign[0]} cannot be combined with {self.kind}: {remedy}")
