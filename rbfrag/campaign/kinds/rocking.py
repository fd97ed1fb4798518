"""Campaigns of rocking: free-standing rectangles on level ground, of every size and restitution."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rbfrag.campaign.kind import (
    CampaignKind,
    Case,
    CaseRequest,
    CaseResult,
    Measures,
    each_once,
    strengths_at,
)
from rbfrag.errors import InputError
from rbfrag.solver.kind import Shaking
from rbfrag.solver.models.rocking import SENSITIVITY, rectangle, restitution_of_rectangle
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import DEFAULT_P2, FloatArray, SearchPoints
from rbfrag.solver.rocking_run import MOST_IMPACTS, simulate_free
from rbfrag.solver.toppling_run import OUTCOMES, reject_endless

FACTOR = "restitution_factor"
"""Name of the factor on the restitution in what is stored of a block."""

RESTITUTION_FACTORS = (1.0, 0.95, 0.9, 0.8)
"""Factors of the outcome grid on the restitution of the rectangle."""

Y_OVER_PGV = np.geomspace(0.1, 8.0, 25)
"""Toppling velocity of the blocks of the outcome grid over PGV: all but the largest overturn at the
first of them, none does from 5.5 on."""


class RockingCampaign(CampaignKind):
    """Outcome grid of every size and restitution factor; the mirror image is the other polarity."""

    options = ("p2", "restitution_factors")
    polarities = ("forward",)

    def cases(
        self,
        *,
        p2: Sequence[float] = DEFAULT_P2,
        restitution_factors: Sequence[float] = RESTITUTION_FACTORS,
    ) -> tuple[Case, ...]:
        """Return every size [1/s²] with every factor on the restitution of the rectangle."""
        sizes = [positive(value, "p2", "1/s²") for value in p2]
        each_once(sizes, "p2")
        factors = [
            positive(value, FACTOR, "a factor on the restitution") for value in restitution_factors
        ]
        each_once(factors, FACTOR)
        for factor in factors:
            if factor > 1.0:
                raise InputError(
                    f"{FACTOR} = {factor:g}: slender blocks would gain speed at their impacts; "
                    "give factors above 0 and up to 1"
                )
        return tuple(
            Case(self.kind, size, {FACTOR: factor}) for size in sizes for factor in factors
        )

    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return k_r/PGA of blocks at fixed ratios of toppling velocity to PGV."""
        return strengths_at(case.size, measures, Y_OVER_PGV)

    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return the outcome grid of every case under one motion, in one call for all blocks."""
        strengths = [self.grid(case, shaking.motion) for case in cases]
        if not request.grid or not any(map(len, strengths)):
            return [CaseResult(None, None)] * len(cases)
        excited = shaking.excitation
        blocks = [
            rectangle(case.size, kr, _factor_of(case) * restitution_of_rectangle(kr))
            for case, ratios in zip(cases, strengths, strict=True)
            for kr in (ratios * excited.pga_g).tolist()
        ]
        reject_endless(excited, max(case.size for case in cases))
        outcome, theta_n, is_sensitive = simulate_free(
            excited,
            np.array([(block.toe, block.heel) for block in blocks]),
            np.array([block.rest_speed for block in blocks]),
            most_impacts=MOST_IMPACTS,
            change=SENSITIVITY,
        )
        words = [OUTCOMES[code].value for code in outcome.tolist()]
        results, start = [], 0
        for ratios in strengths:
            part = slice(start, start + len(ratios))
            start += len(ratios)
            sensitive = is_sensitive[part] > 0
            points = SearchPoints(ratios, theta_n[part], tuple(words[part]), sensitive=sensitive)
            results.append(CaseResult(None, points))
        return results


def _factor_of(case: Case) -> float:
    """Return the restitution factor of a case."""
    factor = (case.block or {}).get(FACTOR)
    if not isinstance(factor, int | float):
        raise InputError(f"its block {case.block} is not described as free-standing ones are")
    return float(factor)


CAMPAIGN = RockingCampaign("rocking")
