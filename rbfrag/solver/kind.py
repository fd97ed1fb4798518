"""What a kind of failure is: how a block of it answers, what describes it, what is stored of it.

A kind is a line of facts in `rbfrag.solver.kinds` and one object, ``MODEL``, in the file of its
name in `rbfrag/solver/models`. Campaigns, the database and fits ask these, never for the name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib import import_module
from typing import Any, ClassVar, Literal, Protocol, Self

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation, excitation, motion_remarks
from rbfrag.solver.kinds import KindFacts, facts_of, kind_of_mode
from rbfrag.solver.results import (
    MAP_DEPTH,
    POLARITIES,
    BlockState,
    CriticalResult,
    FloatArray,
    Outcome,
    Polarity,
    Response,
    SearchPoints,
)
from rbfrag.solver.stability.modes import ModeName
from rbfrag.solver.stability.single import Stability

SHAKING = ("vertical", "polarity", "search_limit")
"""Options of every search."""


@dataclass(frozen=True)
class BlockOnPlanes:
    """A block, its planes and the settings of its motion, as a model sees them.

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

    @classmethod
    def of(
        cls, block: Block, judged: Stability, mode: ModeName | None, settings: Mapping[str, Any]
    ) -> BlockOnPlanes:
        """Return a block whose stability is known, as a model of a mode sees it."""
        return cls(
            block,
            math.radians(judged.beta_deg),
            math.radians(judged.phi_deg),
            math.radians(judged.phi_back_deg),
            judged.yield_acceleration if judged.mode == mode else None,
            judged.back_fracture,
            judged.cohesion is not None,
            settings,
        )

    @property
    def centroid_m(self) -> tuple[float, float]:
        """Centroid in the base frame with the heel as origin [m]; the origin without a block."""
        return (0.0, 0.0) if self.block is None else self.block.centroid


@dataclass(frozen=True, eq=False)
class Shaking:
    """What a model is asked: which motion, and what to keep.

    Args:
        vertical: vertical motion of the same recording, upward positive.
        history: keep the motion in time.
        remarks: what is known about the block that the answer should say.
        start: the state that the motion finds; None for a block at rest in its first place.
    """

    motion: GroundMotion
    vertical: GroundMotion | None
    polarity: Polarity
    history: bool = False
    remarks: tuple[str, ...] = ()
    start: BlockState | None = None

    @cached_property
    def excitation(self) -> Excitation:
        """Both components at common nodes, polarity applied."""
        return excitation(self.motion, self.vertical, self.polarity)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What an answer should say about the block and about the motion."""
        return (*self.remarks, *motion_remarks(self.motion, self.vertical, self.excitation))


@dataclass(frozen=True)
class RunEnd:
    """The end of one run, without its history.

    Args:
        moved: whether the block moved at all.
        peak_rad: peak rotation [rad]; None for a block that slides, or that has failed.
        peak_displacement_m: greatest displacement of the contact on the base along it [m]; None
            for a block that rocks, or that has failed.
        error: bound on the error of the peak [rad], of a sliding block [m].
        about_block: what the model takes for granted about this block, whatever the motion.
    """

    outcome: Outcome
    moved: bool
    peak_rad: float | None
    peak_displacement_m: float | None
    error: float
    about_block: tuple[str, ...] = ()


Runner = Callable[[Excitation], RunEnd]
"""One block, made ready: says how it ends under an excitation."""


@dataclass(frozen=True)
class Case:
    """One combination of a campaign, whatever the motion.

    Args:
        p2: frequency parameter of the block [1/s²]; None where it has none.
        block: what else describes the block, as it is stored; None where p² is all.
        settings: what else decides the answer, as it goes into the natural key.
    """

    kind: str
    p2: float | None
    block: Mapping[str, object] | None = None
    settings: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class CaseRequest:
    """What of a case is to be computed.

    Args:
        search: look for the critical value; False where it is known.
        grid: run the outcome grid; False where it is known.
        full_map: map what fails and what does not, too.
        map_depth: width of k/PGA that a map may leave undecided at a border.
    """

    search: bool = True
    grid: bool = True
    full_map: bool = False
    map_depth: float = MAP_DEPTH


@dataclass(frozen=True, eq=False)
class CaseResult:
    """What one motion does to the blocks of a case.

    Args:
        critical: the critical value; None of a kind without a search.
        grid: the blocks of the outcome grid, entry i that of strength i of :meth:`Kind.grid`.
            ``toppled`` says that a block fails by the measure of its case. Without entries where
            the motion has no acceleration.
    """

    critical: CriticalResult | None
    grid: SearchPoints | None


class Measures(Protocol):
    """What an outcome grid reads of a motion."""

    @property
    def pga_g(self) -> float:
        """PGA [g]."""

    @property
    def pgv_m_s(self) -> float:
        """PGV [m/s]."""


class Kind(KindFacts):
    """Base of the kinds: the facts of one, and what it answers without search and campaign.

    Attributes:
        carries_state: whether a motion leaves a block somewhere else than it found it.
        polarities: those that campaigns run; one alone where the other is its mirror image.
        sequence_measure: what counts as failure in campaigns of sequences: where the block is left
            [m], or its greatest rotation [rad]; empty of kinds that have none.
    """

    carries_state = False
    polarities: ClassVar[tuple[Polarity, ...]] = POLARITIES
    sequence_measure: ClassVar[Literal["", "displacement_m", "peak_rad"]] = ""

    @classmethod
    def named(cls, kind: str) -> Self:
        """Return the model of a kind with the facts of it."""
        return cls(**vars(facts_of(kind)))

    def respond(self, site: BlockOnPlanes, shaking: Shaking) -> Response:
        """Return what the block does."""
        raise NotImplementedError

    def runner(self, site: BlockOnPlanes) -> Runner:
        """Return a function that says how the block ends under an excitation."""
        raise NotImplementedError

    def numbers_of(self, block: Block, beta_rad: float) -> tuple[dict[str, float], tuple[str, ...]]:
        """Return what predictions read of a free-standing block, by name, and warnings.

        Args:
            block: shape and size.
            beta_rad: dip of its base [rad].

        Raises:
            InputError: the block does not stand of itself.
        """
        raise NotImplementedError

    def critical(self, motion: GroundMotion, **options: Any) -> CriticalResult:
        """Return the critical value of one motion.

        Raises:
            InputError: there is no search, or an option is that of another kind.
        """
        why = f": {self.no_search}" if self.no_search else ""
        raise InputError(f"there is no search for the critical value of kind {self.kind}{why}")

    def cases(self, **request: Any) -> tuple[Case, ...]:
        """Return the combinations of a campaign, whatever the motion.

        Raises:
            InputError: campaigns do not store this kind, or an option is that of another one.
        """
        why = f": {self.no_search}" if self.no_search else ""
        raise InputError(f"campaigns of kind {self.kind} are not known to this rbfrag{why}")

    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return the strengths k/PGA of the outcome grid, which depend on no outcome.

        Empty where the motion has no acceleration.
        """
        return np.empty(0)

    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return critical value and outcome grid of every case under one motion."""
        raise NotImplementedError

    def run_blocks(self, shaking: Shaking, case: Case, k_over_pga: Sequence[float]) -> SearchPoints:
        """Run blocks of stated strengths k/PGA, falling: those of the campaign option `grid`."""
        raise InputError(
            f"no block of k/PGA {k_over_pga[0]!r} belongs to a campaign of {self.kind}"
        )

    def history(self, shaking: Shaking, case: Case, k_over_pga: float) -> Response:
        """Return the motion in time of one block: the campaign option `store_responses`."""
        raise InputError(f"campaigns of {self.kind} keep no histories")

    def sequence_blocks(self, cases: Sequence[Case]) -> tuple[Mapping[str, object], ...]:
        """Return the blocks that campaigns of sequences shake, as they are stored.

        Args:
            cases: what the campaign is asked for.
        """
        raise InputError(f"campaigns of sequences are not known of {self.kind}")

    def sequence_limits(self, cases: Sequence[Case]) -> tuple[float | None, ...]:
        """Return what counts as failure, in the unit of the measure; None for past recovery.

        Args:
            cases: what the campaign is asked for.
        """
        raise InputError(f"campaigns of sequences are not known of {self.kind}")

    def sequence_site(self, block: Mapping[str, Any]) -> BlockOnPlanes:
        """Return a block of :meth:`sequence_blocks` on its planes."""
        raise InputError(f"campaigns of sequences are not known of {self.kind}")

    def refuse_foreign(self, given: Iterable[str], own: Sequence[str]) -> None:
        """Refuse an option that is not among the kind's own."""
        foreign = sorted(set(given) - set(own))
        if foreign:
            raise InputError(
                f"{foreign[0]} does not go with {self.kind}, which knows "
                f"{' and '.join(own) or 'no such option'}"
            )


@cache
def model_of_kind(kind: str) -> Kind:
    """Return the model of the kind of that name, which is loaded with all that it needs."""
    model: Kind = import_module(f"rbfrag.solver.models.{facts_of(kind).kind}").MODEL
    return model


def model_of_mode(mode: ModeName, *, back_fracture: bool = True) -> Kind:
    """Return the model of blocks that fail in this mode; arguments as of `kind_of_mode`."""
    return model_of_kind(kind_of_mode(mode, back_fracture=back_fracture).kind)


def strengths_at(p2: float, measures: Measures, y_over_pgv: FloatArray) -> FloatArray:
    """Return k_r/PGA of the blocks of a size whose toppling velocities are given ratios of PGV.

    Args:
        p2: frequency parameter p² of the blocks [1/s²].
        measures: PGA and PGV of the motion.
        y_over_pgv: k_r g/(p PGV), shape (n,).

    Returns:
        Shape (n,); empty where the motion has no acceleration.
    """
    ground = measures.pga_g * STANDARD_GRAVITY_M_S2
    if not (ground > 0.0 and measures.pgv_m_s > 0.0):
        return np.empty(0)
    strengths: FloatArray = math.sqrt(p2) * measures.pgv_m_s / ground * y_over_pgv
    return strengths


def each_once(values: Sequence[float | None], option: str, for_none: str = "None") -> None:
    """Refuse an empty list, and one that names a value twice.

    Args:
        option: their name, for the message.
        for_none: what None is called there.
    """
    if not values:
        raise InputError(f"{option}: the list is empty: name at least one value", fields=(option,))
    for value in values:
        if values.count(value) > 1:
            word = for_none if value is None else f"{value:g}"
            raise InputError(
                f"{option}: {word} is in the list twice: name each value once", fields=(option,)
            )
