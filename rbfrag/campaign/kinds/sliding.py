"""Campaigns of sliding: displacements on a level plane, valid for every shape and dip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rbfrag.campaign.kind import Case, CaseRequest, CaseResult, Measures, Sequences, each_once
from rbfrag.solver.kind import Shaking, SupportedBlock
from rbfrag.solver.models.sliding import KY_OVER_PGA, THRESHOLDS_M, level_plane, slide_m
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import SEARCH_LIMIT, FloatArray
from rbfrag.solver.search.displacement import TOLERANCE, SlidingBlocks, critical_of

SEQUENCE_KY_G = (0.02, 0.05, 0.1, 0.2)
"""Yield accelerations of the blocks of sequences, whose motions are as recorded [g]."""

LEVEL_PLANE = {"plane": "level"}
"""The block of a campaign: on a base that dips, a displacement is a factor times its."""


class SlidingCampaign(Sequences):
    """Onset of sliding and every displacement limit, with the displacements of a grid."""

    options = ("displacements_m",)
    measure = "displacement_m"

    def cases(self, *, displacements_m: Sequence[float] = THRESHOLDS_M) -> tuple[Case, ...]:
        """Return the onset of sliding and every displacement limit [m]."""
        displacements = [positive(value, "displacement_m", "m") for value in displacements_m]
        each_once(displacements, "displacement_m")
        settings = {"search_limit": SEARCH_LIMIT, "tolerance": TOLERANCE}
        return tuple(
            Case(self.kind, None, LEVEL_PLANE, {**settings, "displacement_m": value})
            for value in (0.0, *displacements)
        )

    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return the stored strengths k_y/PGA."""
        return np.array(KY_OVER_PGA if measures.pga_g > 0.0 else (), dtype=np.float64)

    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return the critical strength and the displacements of every case under one motion."""
        excited = shaking.excitation
        # where 1 + k_v reaches zero the block leaves its base: no displacement is known
        leaves = excited.jump_node < excited.w.size
        strengths = () if leaves else tuple(self.grid(cases[0], shaking.motion).tolist())
        blocks = SlidingBlocks(excited, slide_m).points(strengths) if request.grid else None
        if not request.search:
            return [CaseResult(None, blocks) for _ in cases]
        results = []
        for case in cases:
            settings: dict[str, Any] = dict(case.settings)
            # each for itself, so that an answer does not depend on what else was asked for
            searched = critical_of(
                self.kind,
                SlidingBlocks(excited, slide_m),
                settings["displacement_m"],
                polarity=shaking.polarity,
                search_limit=settings["search_limit"],
                tolerance=settings["tolerance"],
                warnings=excited.warnings,
            )
            results.append(CaseResult(searched, blocks))
        return results

    def blocks(self, cases: Sequence[Case]) -> tuple[Mapping[str, object], ...]:
        """Return blocks of given yield accelerations on a level plane."""
        return tuple({**LEVEL_PLANE, "ky": ky} for ky in SEQUENCE_KY_G)

    def limits(self, cases: Sequence[Case]) -> tuple[float | None, ...]:
        """Return the displacement limits [m]."""
        limits: list[Any] = [case.settings["displacement_m"] for case in cases]
        return tuple(limit for limit in limits if limit > 0.0)

    def supported_block(self, block: Mapping[str, Any]) -> SupportedBlock:
        """Return the block on its level plane."""
        return level_plane(block["ky"])


CAMPAIGN = SlidingCampaign("sliding")
