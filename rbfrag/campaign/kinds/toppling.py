"""Campaigns of toppling: every size p², with blocks at fixed ratios of toppling velocity to PGV."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rbfrag.campaign.kind import (
    Case,
    CaseRequest,
    CaseResult,
    Measures,
    SingleBlockCampaign,
    each_once,
    strengths_at,
)
from rbfrag.solver.critical import critical
from rbfrag.solver.excitation import kept_excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.kind import Shaking
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import DEFAULT_P2, SEARCH_LIMIT, FloatArray, Response, SearchPoints
from rbfrag.solver.toppling_run import OUTCOMES, respond

Y_OVER_PGV = np.concatenate([0.1 * 40.0 ** (np.arange(-10, 0) / 24.0), np.geomspace(0.1, 4.0, 25)])
"""Toppling velocity of the blocks of the outcome grid over PGV: 35 values in steps of ln(40)/24."""


class TopplingCampaign(SingleBlockCampaign):
    """Critical strength and outcome grid of every size."""

    options = ("p2", "grid", "store_responses", "full_map")

    def cases(self, *, p2: Sequence[float] = DEFAULT_P2) -> tuple[Case, ...]:
        """Return the block sizes [1/s²]."""
        sizes = [positive(value, "p2", "1/s²") for value in p2]
        each_once(sizes, "p2")
        settings = {"search_limit": SEARCH_LIMIT}
        return tuple(Case(self.kind, size, settings=settings) for size in sizes)

    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return k_r/PGA of blocks at fixed ratios of toppling velocity to PGV."""
        return strengths_at(case.size, measures, Y_OVER_PGV)

    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return the critical strength and the outcome grid of every case under one motion."""
        results = []
        for case in cases:
            settings: dict[str, Any] = dict(case.settings)
            searched = blocks = None
            if request.search:
                searched = critical(
                    shaking.motion,
                    kind=self.kind,
                    p2=case.size,
                    vertical=shaking.vertical,
                    polarity=shaking.polarity,
                    search_limit=settings["search_limit"],
                    full_map=request.full_map,
                    map_depth=request.map_depth,
                )
            if request.grid:
                blocks = self.run_blocks(shaking, case, self.grid(case, shaking.motion).tolist())
            results.append(CaseResult(searched, blocks))
        return results

    def run_blocks(self, shaking: Shaking, case: Case, k_over_pga: Sequence[float]) -> SearchPoints:
        """Run one block at each k_r/PGA, in the given order; the PGA must be positive."""
        # that of the search: what it has worked out about the record is kept with it
        excited = kept_excitation(shaking.motion, shaking.vertical, shaking.polarity)
        strengths = np.array(k_over_pga, dtype=np.float64)
        runs = simulate_many(excited, p2=case.size, kr=strengths * excited.pga_g)
        return SearchPoints(
            kr_over_pga=strengths,
            theta_n=runs.theta_n,
            outcome=tuple(OUTCOMES[code].value for code in runs.outcome.tolist()),
        )

    def history(self, shaking: Shaking, case: Case, k_over_pga: float) -> Response:
        """Return the response history of the block with this k_r/PGA."""
        return respond(
            shaking.motion,
            p2=case.size,
            kr=k_over_pga * shaking.motion.pga_g,
            vertical=shaking.vertical,
            polarity=shaking.polarity,
            history=True,
        )


CAMPAIGN = TopplingCampaign("toppling")
