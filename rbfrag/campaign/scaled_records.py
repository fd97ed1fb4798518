"""Campaigns under scaled records: a family of blocks, simulated to rest or failure.

Strength and frequency do not fix the motion of such a block: shape, friction and dip do. Each block
of a family is therefore followed to its end under the record scaled to k/PGA of a grid.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np

from rbfrag.campaign.kind import Case, CaseRequest, CaseResult, Measures, Sequences, each_once
from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kind import Shaking, SupportedBlock
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import FloatArray
from rbfrag.solver.search.incremental_scaling import (
    critical_rad,
    grid_points,
    rotation_rad,
    scaled_run,
)
from rbfrag.solver.simulation import ShakenMechanism, shaken_mechanism


@dataclass(frozen=True)
class BlockClass:
    """Parallelogram and its planes, which determine its motion.

    Args:
        s1_m: thickness normal to the base [m].
        s2_m: thickness normal to the back plane [m].
        gamma_deg: dip of the back plane less dip of the base [deg].
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of both planes [deg].
    """

    s1_m: float
    s2_m: float
    gamma_deg: float
    beta_deg: float
    phi_deg: float

    @property
    def block(self) -> Block:
        """Geometry of the block."""
        return Block.from_fractures(self.s1_m, self.s2_m, self.gamma_deg)

    def as_dict(self) -> dict[str, float]:
        """Return the block in stored form."""
        return asdict(self)


class ScaledRecords(Sequences):
    """Outcome grid of every block of a family and every rotation limit.

    Attributes:
        rotations_deg: the rotations where none are asked for [deg]; None for failure past
            recovery, and alone where there is no other criterion.
        ratios: k/PGA of the outcome grid: the record is scaled to them.
    """

    options: ClassVar[tuple[str, ...]] = ("family",)
    measure = "peak_rad"
    rotations_deg: tuple[float | None, ...] = (None,)
    ratios = np.geomspace(0.02, 0.95, 13)

    def __init__(self, kind: str, family: Sequence[BlockClass]) -> None:
        super().__init__(kind)
        self.family = tuple(family)

    def cases(
        self,
        *,
        rotations_deg: Sequence[float | None] | None = None,
        family: Sequence[BlockClass] | None = None,
    ) -> tuple[Case, ...]:
        """Return every block of the family with every rotation limit [deg].

        Raises:
            InputError: no rotation, or one that repeats; a block of another mode.
        """
        rotations = [
            None if value is None else positive(value, "rotation_deg", "degrees")
            for value in (self.rotations_deg if rotations_deg is None else rotations_deg)
        ]
        each_once(rotations, "rotation_deg", for_none="recovery")
        blocks = self.family if family is None else family
        shaken = [(block, self._shaken(block)) for block in blocks]
        return tuple(
            Case(self.kind, its.p2, block.as_dict(), {"rotation_deg": rotation}, its.yield_g)
            for block, its in shaken
            for rotation in rotations
        )

    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return the k/PGA to which the record is scaled."""
        return self.ratios if measures.pga_g > 0.0 else np.empty(0)

    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return the outcome grid of every case under one motion; cases of one block share runs.

        Raises:
            InputError: a case of an rbfrag that did not follow its blocks past a lost contact.
        """
        excited = shaking.excitation
        together: defaultdict[BlockClass, list[int]] = defaultdict(list)
        for number, case in enumerate(cases):
            together[_class_of(case)].append(number)
        results = [CaseResult(None, None)] * len(cases)
        for block, numbers in together.items() if request.grid else ():
            shaken = self._shaken(block)
            ratios = self.grid(cases[numbers[0]], shaking.motion)
            scales = [shaken.yield_g / (k * excited.pga_g) for k in ratios.tolist()]
            ends = [shaken.run(excited.scaled(scale), stepwise=False) for scale in scales]
            for i in numbers:
                rotation: Any = cases[i].settings["rotation_deg"]
                fails = rotation_rad(rotation)
                runs = [scaled_run(*pair, fails) for pair in zip(ends, scales, strict=True)]
                results[i] = CaseResult(None, grid_points(ratios, runs, critical_rad(shaken)))
        return results

    def blocks(self, cases: Sequence[Case]) -> tuple[Mapping[str, object], ...]:
        """Return the blocks of the family."""
        return tuple(block.as_dict() for block in dict.fromkeys(map(_class_of, cases)))

    def limits(self, cases: Sequence[Case]) -> tuple[float | None, ...]:
        """Return the rotation limits [rad]."""
        rotations: list[Any] = [case.settings["rotation_deg"] for case in cases]
        return tuple(
            None if rotation is None else math.radians(rotation)
            for rotation in dict.fromkeys(rotations)
        )

    def supported_block(self, block: Mapping[str, Any]) -> SupportedBlock:
        """Return the block with its planes."""
        return self._shaken(BlockClass(**block)).supported_block

    def _shaken(self, block: BlockClass) -> ShakenMechanism:
        return shaken_mechanism(
            model_of_kind(self.kind), block.block, beta_deg=block.beta_deg, phi_deg=block.phi_deg
        )


def _class_of(case: Case) -> BlockClass:
    if case.settings.keys() != {"rotation_deg"}:
        raise InputError(
            "it was stored by an older rbfrag and ends where the block leaves its back plane: "
            "simulate it again"
        )
    try:
        return BlockClass(**case.block)  # type: ignore[arg-type]
    except TypeError:
        raise InputError(f"its block {case.block} is not described as its kind's are") from None
