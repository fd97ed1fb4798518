"""Interface of campaign kinds: combinations, outcome grids and sequences.

What a block of the kind does is physics, and in `rbfrag/solver/models`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Protocol

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.kind import Shaking, SupportedBlock
from rbfrag.solver.results import (
    MAP_DEPTH,
    POLARITIES,
    FloatArray,
    Polarity,
    Response,
    SearchPoints,
)


@dataclass(frozen=True)
class Case:
    """One combination of a campaign, independent of the motion.

    Args:
        p2: frequency parameter of the block [1/s²]; None where it has none.
        block: what else describes the block, as it is stored; None where p² is all.
        settings: what else decides the answer, as it goes into the natural key.
        yield_g: yield acceleration of that block [g]; None where the case is of blocks of any
            strength.
    """

    kind: str
    p2: float | None
    block: Mapping[str, object] | None = None
    settings: Mapping[str, object] = field(default_factory=dict)
    yield_g: float | None = None

    @property
    def size(self) -> float:
        """p² [1/s²], for kinds whose blocks have one."""
        assert self.p2 is not None
        return self.p2


@dataclass(frozen=True)
class CaseRequest:
    """Requested results of a case.

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
    """Results of the blocks of a case under one motion.

    Args:
        critical: the critical value; None of a kind without a search.
        grid: the blocks of the outcome grid, entry i that of strength i of
            :meth:`CampaignKind.grid`. ``toppled`` says that a block fails by the measure of its
            case. Without entries where the motion has no acceleration.
    """

    critical: CriticalResult | None
    grid: SearchPoints | None


class Measures(Protocol):
    """Intensity measures that an outcome grid uses."""

    @property
    def pga_g(self) -> float:
        """PGA [g]."""

    @property
    def pgv_m_s(self) -> float:
        """PGV [m/s]."""


class CampaignKind(ABC):
    """Combinations and results that campaigns of a kind store.

    Attributes:
        options: what they may be asked.
        polarities: those that they run; one alone where the other is its mirror image.
    """

    options: ClassVar[tuple[str, ...]] = ()
    polarities: ClassVar[tuple[Polarity, ...]] = POLARITIES

    def __init__(self, kind: str) -> None:
        self.kind = kind

    @abstractmethod
    def cases(self, *args: Any, **request: Any) -> tuple[Case, ...]:
        """Return the combinations of a campaign, independent of the motion.

        Args:
            request: options that describe blocks, by name.

        Raises:
            InputError: a list that is empty or names a value twice, a value out of its range.
        """

    @abstractmethod
    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return the strengths k/PGA of the outcome grid, independent of the outcomes.

        Empty where the motion has no acceleration.
        """

    @abstractmethod
    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return the critical value and the outcome grid of every case under one motion."""


class SingleBlockCampaign(CampaignKind):
    """Campaign kind that also runs single blocks: options `grid` and `store_responses`."""

    @abstractmethod
    def run_blocks(self, shaking: Shaking, case: Case, k_over_pga: Sequence[float]) -> SearchPoints:
        """Run blocks at given strengths k/PGA, in decreasing order."""

    @abstractmethod
    def history(self, shaking: Shaking, case: Case, k_over_pga: float) -> Response:
        """Return the response history of one block."""


class Sequences(CampaignKind):
    """Kind whose blocks keep their state from one motion to the next.

    Attributes:
        measure: what counts as failure: where the block is left [m], or its greatest rotation
            [rad].
    """

    measure: ClassVar[Literal["displacement_m", "peak_rad"]]

    @abstractmethod
    def blocks(self, cases: Sequence[Case]) -> tuple[Mapping[str, object], ...]:
        """Return the blocks to simulate, in their stored form.

        Args:
            cases: what the campaign is asked for.
        """

    @abstractmethod
    def limits(self, cases: Sequence[Case]) -> tuple[float | None, ...]:
        """Return the failure limits, in the unit of the measure; None for loss of stability.

        Args:
            cases: what the campaign is asked for.
        """

    @abstractmethod
    def supported_block(self, block: Mapping[str, Any]) -> SupportedBlock:
        """Return a block of :meth:`blocks` with its planes."""


def strengths_at(p2: float, measures: Measures, y_over_pgv: FloatArray) -> FloatArray:
    """Return k_r/PGA of blocks of a size at given ratios of toppling velocity to PGV.

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
    """Reject an empty list and repeated values.

    Args:
        option: their name, for the message.
        for_none: what None is called there.
    """
    if not values:
        raise InputError(f"{option}: the list is empty: give at least one value", fields=(option,))
    for value in values:
        if values.count(value) > 1:
            word = for_none if value is None else f"{value:g}"
            raise InputError(
                f"{option}: {word} is in the list twice: give each value once", fields=(option,)
            )
