"""A block that rocks about its toe (eqs. 4.1 to 4.19).

    θ'' = p² cos(θc - θ) [k_h - (1 + k_v) tan(θc - θ)],    tan θc = k_r

It has a kernel of its own, `rbfrag.solver.integrator.single_run`, which campaigns and searches
call by the million, and whose results are stored.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import Excitation, kept_excitation
from rbfrag.solver.kind import (
    SHAKING,
    BlockOnPlanes,
    Case,
    CaseRequest,
    CaseResult,
    Kind,
    Measures,
    RunEnd,
    Runner,
    Shaking,
    each_once,
    strengths_at,
)
from rbfrag.solver.kinds import PLANES
from rbfrag.solver.quantity import finite_or_none, positive
from rbfrag.solver.results import (
    DEFAULT_P2,
    SEARCH_LIMIT,
    CriticalResult,
    FloatArray,
    Response,
    SearchPoints,
)
from rbfrag.solver.toppling_run import OUTCOMES, refuse_endless, respond, simulate

Y_OVER_PGV = np.concatenate([0.1 * 40.0 ** (np.arange(-10, 0) / 24.0), np.geomspace(0.1, 4.0, 25)])
"""Toppling velocity of the blocks of the outcome grid over PGV: 35 values in steps of ln(40)/24."""


class Toppling(Kind):
    """The toppling model."""

    def respond(self, site: BlockOnPlanes, shaking: Shaking) -> Response:
        """Return what the block does."""
        answer = respond(
            shaking.motion,
            p2=_size(site),
            kr=_strength(site),
            vertical=shaking.vertical,
            polarity=shaking.polarity,
            history=shaking.history,
        )
        return replace(answer, warnings=(*shaking.remarks, *answer.warnings))

    def runner(self, site: BlockOnPlanes) -> Runner:
        """Return a function that says how the block ends under an excitation."""
        p2, kr = _size(site), _strength(site)

        def run(excited: Excitation) -> RunEnd:
            refuse_endless(excited, p2)
            end = simulate(excited, p2=p2, kr=kr)
            return RunEnd(
                outcome=OUTCOMES[end.outcome],
                moved=math.isfinite(end.started_s),
                peak_rad=finite_or_none(end.peak_rad),
                peak_displacement_m=None,
                error=end.error_rad,
            )

        return run

    def critical(self, motion: GroundMotion, **options: Any) -> CriticalResult:
        """Return the largest k_r/PGA that topples; p² [1/s²] is given, or that of a block."""
        from rbfrag.solver.search.critical import critical

        self.refuse_foreign(options, (*self.search_options, *SHAKING))
        block = options.pop("block", None)
        for name in PLANES:
            options.pop(name, None)
        if block is not None:
            options["p2"] = block.p2
        if "p2" not in options:
            raise InputError("p2 is missing: the critical block is searched for one p² [1/s²]")
        return critical(motion, kind=self.kind, **options)

    def cases(self, **request: Any) -> tuple[Case, ...]:
        """Return the block sizes."""
        self.refuse_foreign(request, ("p2",))
        sizes = [positive(value, "p2", "1/s²") for value in request.get("p2", DEFAULT_P2)]
        each_once(sizes, "p2")
        settings = {"search_limit": SEARCH_LIMIT}
        return tuple(Case(self.kind, p2, settings=settings) for p2 in sizes)

    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return k_r/PGA of the blocks whose toppling velocities are fixed ratios of PGV."""
        assert case.p2 is not None
        return strengths_at(case.p2, measures, Y_OVER_PGV)

    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return critical block and outcome grid of every case under one motion."""
        results = []
        for case in cases:
            assert case.p2 is not None
            settings: dict[str, Any] = dict(case.settings)
            critical = blocks = None
            if request.search:
                critical = self.critical(
                    shaking.motion,
                    p2=case.p2,
                    vertical=shaking.vertical,
                    polarity=shaking.polarity,
                    search_limit=settings["search_limit"],
                    full_map=request.full_map,
                    map_depth=request.map_depth,
                )
            if request.grid:
                blocks = run_blocks_at(shaking, case.p2, self.grid(case, shaking.motion))
            results.append(CaseResult(critical, blocks))
        return results

    def run_blocks(self, shaking: Shaking, case: Case, k_over_pga: Sequence[float]) -> SearchPoints:
        """Run blocks of stated k_r/PGA."""
        assert case.p2 is not None
        return run_blocks_at(shaking, case.p2, np.array(k_over_pga, dtype=np.float64))

    def history(self, shaking: Shaking, case: Case, k_over_pga: float) -> Response:
        """Return the motion in time of the block of that k_r/PGA."""
        assert case.p2 is not None
        return respond(
            shaking.motion,
            p2=case.p2,
            kr=k_over_pga * shaking.motion.pga_g,
            vertical=shaking.vertical,
            polarity=shaking.polarity,
            history=True,
        )


def run_blocks_at(shaking: Shaking, p2: float, kr_over_pga: FloatArray) -> SearchPoints:
    """Run one block at each strength, in its order.

    Args:
        shaking: the motion; its PGA must be positive.
        p2: frequency parameter p² [1/s²].
    """
    from rbfrag.solver.integrator.batch import simulate_many

    # that of the search: what it has worked out about the record is kept with it
    excited = kept_excitation(shaking.motion, shaking.vertical, shaking.polarity)
    runs = simulate_many(excited, p2=p2, kr=kr_over_pga * excited.pga_g)
    return SearchPoints(
        kr_over_pga=kr_over_pga,
        theta_n=runs.theta_n,
        outcome=tuple(OUTCOMES[code].value for code in runs.outcome.tolist()),
    )


def _size(site: BlockOnPlanes) -> float:
    """Return p² [1/s²]."""
    if site.block is not None:
        return site.block.p2
    assert site.p2 is not None
    return site.p2


def _strength(site: BlockOnPlanes) -> float:
    """Return k_r: the yield, or for a block of another mode the balance on its toe."""
    if site.yield_g is not None:
        return site.yield_g
    assert site.block is not None
    # (3.16): θc = α3 - β is what is left to the balance on the toe
    balance_deg = site.block.alpha3_deg - math.degrees(site.beta_rad)
    if not 0.0 < balance_deg < 90.0:
        raise InputError(
            f"alpha3 - beta = {balance_deg:.4g} degrees: a block can rock about its toe where it "
            "is between 0 and 90"
        )
    return math.tan(math.radians(balance_deg))


MODEL = Toppling.named("toppling")
