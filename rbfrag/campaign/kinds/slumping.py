"""Campaigns of slumping: a family of blocks, and for each the scale of the record that fails it.

Strength and frequency do not fix a slump: shape, friction and dip do. The family spans the slumping
blocks of the dissertation's rock mass (its Table 3.4: base 20 and back 45 degrees, spacings 1 and
0.6 m, friction 40 degrees) and weaker ones. Every block of it slumps and is stable at rest.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from rbfrag.campaign.kind import Case, CaseRequest, CaseResult, Measures, Sequences, each_once
from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kind import BlockOnPlanes, Shaking
from rbfrag.solver.mechanism import ShakenMechanism, shaken_mechanism
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import SEARCH_LIMIT, CriticalResult, FloatArray, no_intervals
from rbfrag.solver.search.scale import (
    BRACKET,
    SCAN_RATIO,
    critical_rad,
    critical_scales,
    grid_points,
    rotation_rad,
    scaled_run,
    scan_rules,
)


@dataclass(frozen=True)
class BlockClass:
    """A parallelogram and its planes: all that decides how it slumps.

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
        """Shape and size."""
        return Block.from_fractures(self.s1_m, self.s2_m, self.gamma_deg)

    def as_dict(self) -> dict[str, float]:
        """Return the block as it is stored."""
        return asdict(self)


GAMMA_DEG = (20.0, 25.0, 30.0)
SPACING_RATIO = 0.4
"""S2/S1: thinner between the back planes than between the base planes, or the blocks slide."""
PLANES_DEG = ((20.0, 30.0), (20.0, 40.0), (10.0, 35.0))
"""Dip of the base and friction angle."""
SIZES_M = (0.25, 1.0)
"""S1: larger blocks leave their back plane before they have turned far."""

FAMILY = tuple(
    BlockClass(size, SPACING_RATIO * size, gamma, beta, phi)
    for gamma, (beta, phi), size in product(GAMMA_DEG, PLANES_DEG, SIZES_M)
)
"""Three shapes, three pairs of dip and friction, two sizes."""

ROTATIONS_DEG: tuple[float | None, ...] = (2.0, None)
"""Rotations that count as failure of a slump [deg]; None for failure past recovery."""

RATIOS = np.geomspace(0.02, 0.95, 25)
"""k_s/PGA of the outcome grid: the record is scaled to them."""

RULES = ("search_limit", "scan_ratio", "bracket")
"""Settings of a case that are the rules of its search."""


class SlumpingCampaign(Sequences):
    """Critical scale and outcome grid of every block of the family and rotation."""

    options = ("rotations_deg", "family", "full_map")
    measure = "peak_rad"

    def cases(
        self,
        *,
        rotations_deg: Sequence[float | None] = ROTATIONS_DEG,
        family: Sequence[BlockClass] = FAMILY,
    ) -> tuple[Case, ...]:
        """Return every block of the family with every rotation that counts as failure [deg].

        Raises:
            InputError: no rotation, one that repeats or that a block of the family cannot reach; a
                block that does not slump.
        """
        rotations = [
            None if value is None else positive(value, "rotation_deg", "degrees")
            for value in rotations_deg
        ]
        each_once(rotations, "rotation_deg", for_none="recovery")
        least = min(each.gamma_deg for each in family)
        for rotation in rotations:
            if rotation is not None and rotation >= least:
                raise InputError(
                    f"rotation_deg {rotation:g}: a block of the family lies on its back edge at "
                    f"{least:g} degrees; give less, or the word recovery for failure past recovery",
                    fields=("rotation_deg",),
                )
        settings = {"search_limit": SEARCH_LIMIT, "scan_ratio": SCAN_RATIO, "bracket": BRACKET}
        shaken = [(each, self._shaken(each)) for each in family]
        return tuple(
            Case(
                self.kind,
                its.p2,
                each.as_dict(),
                {**settings, "rotation_deg": rotation},
                its.yield_g,
            )
            for each, its in shaken
            for rotation in rotations
        )

    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return k_s/PGA to which the record is scaled."""
        return RATIOS if measures.pga_g > 0.0 else np.empty(0)

    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return critical scale and outcome grid of every case under one motion.

        Cases of one block share their runs. The map is what the search saw; it costs nothing.
        """
        excited = shaking.excitation
        together: defaultdict[BlockClass, list[int]] = defaultdict(list)
        for number, case in enumerate(cases):
            together[_class_of(case)].append(number)
        results: dict[int, CaseResult] = {}
        for block, numbers in together.items():
            settings: dict[str, Any] = dict(cases[numbers[0]].settings)
            rotations: list[Any] = [cases[i].settings["rotation_deg"] for i in numbers]
            shaken = self._shaken(block)
            searched: Sequence[CriticalResult | None] = [None] * len(numbers)
            if request.search:
                rules = scan_rules(*(settings[name] for name in RULES))
                searched = critical_scales(shaking, shaken, rotations, rules)
            ratios = self.grid(cases[numbers[0]], shaking.motion)[: None if request.grid else 0]
            scales = [shaken.yield_g / (k * excited.pga_g) for k in ratios.tolist()]
            ends = [shaken.run(excited.scaled(scale)) for scale in scales]
            for i, rotation, result in zip(numbers, rotations, searched, strict=True):
                fails = rotation_rad(rotation, shaken)
                runs = [scaled_run(*each, fails) for each in zip(ends, scales, strict=True)]
                if result is not None and not request.full_map:
                    result = replace(result, intervals=no_intervals())
                blocks = grid_points(ratios, runs, critical_rad(shaken)) if request.grid else None
                results[i] = CaseResult(result, blocks)
        return [results[i] for i in range(len(cases))]

    def blocks(self, cases: Sequence[Case]) -> tuple[Mapping[str, object], ...]:
        """Return the blocks of the family."""
        return tuple(block.as_dict() for block in dict.fromkeys(map(_class_of, cases)))

    def limits(self, cases: Sequence[Case]) -> tuple[float | None, ...]:
        """Return the stated rotations [rad]."""
        stated: list[Any] = [case.settings["rotation_deg"] for case in cases]
        return tuple(
            None if rotation is None else math.radians(rotation)
            for rotation in dict.fromkeys(stated)
        )

    def site(self, block: Mapping[str, Any]) -> BlockOnPlanes:
        """Return the block on its planes."""
        return self._shaken(BlockClass(**block)).site

    def _shaken(self, each: BlockClass) -> ShakenMechanism:
        return shaken_mechanism(
            model_of_kind(self.kind), each.block, beta_deg=each.beta_deg, phi_deg=each.phi_deg
        )


def _class_of(case: Case) -> BlockClass:
    try:
        return BlockClass(**case.block)  # type: ignore[arg-type]
    except TypeError:
        raise InputError(f"its block {case.block} is not described as slumping ones are") from None


CAMPAIGN = SlumpingCampaign("slumping")
