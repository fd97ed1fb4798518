"""A block that rocks about its toe (eqs. 4.1 to 4.19).

    θ'' = p² cos(θc - θ) [k_h - (1 + k_v) tan(θc - θ)],    tan θc = k_r

It has a kernel of its own, `rbfrag.solver.integrator.single_run`, which campaigns and searches
call by the
million, and whose results are stored.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rbfrag.errors import InputError
from rbfrag.solver.kind import BlockOnPlanes, Shaking
from rbfrag.solver.results import Response
from rbfrag.solver.stability.modes import ModeName

if TYPE_CHECKING:
    from rbfrag.solver.excitation import Excitation
    from rbfrag.solver.run_end import Runner


@dataclass(frozen=True)
class Toppling:
    """The toppling model, behind the interface that all models have."""

    kind: str = "toppling"
    mode: ModeName = "topple"
    settings: tuple[str, ...] = ("linear",)

    def respond(self, site: BlockOnPlanes, shaking: Shaking) -> Response:
        """Return what the block does."""
        from rbfrag.solver.toppling_run import respond

        assert site.block is not None
        answer = respond(
            shaking.motion,
            p2=site.block.p2,
            kr=_strength(site),
            vertical=shaking.vertical,
            polarity=shaking.polarity,
            linear=bool(site.settings.get("linear", False)),
            history=shaking.history,
        )
        return replace(answer, warnings=(*shaking.remarks, *answer.warnings))

    def runner(self, site: BlockOnPlanes) -> Runner:
        """Return a function that says what becomes of the block under an excitation."""
        from rbfrag.solver.run_end import Fate
        from rbfrag.solver.toppling_run import OUTCOMES, refuse_endless, simulate

        assert site.block is not None
        p2, kr = site.block.p2, _strength(site)
        linear = bool(site.settings.get("linear", False))

        def run(drive: Excitation) -> Fate:
            refuse_endless(drive, p2)
            found = simulate(drive, p2=p2, kr=kr, linear=linear)
            return Fate(
                outcome=OUTCOMES[found.outcome],
                moved=math.isfinite(found.started_s),
                peak_rad=found.peak_rad if math.isfinite(found.peak_rad) else None,
                peak_displacement_m=None,
                error=found.error_rad,
            )

        return run


def _strength(site: BlockOnPlanes) -> float:
    """Return k_r: the yield, or for a block of another mode the balance on its toe."""
    if site.yield_g is not None:
        return site.yield_g
    assert site.block is not None
    balance_deg = site.block.alpha3_deg - math.degrees(site.beta_rad)
    if not 0.0 < balance_deg < 90.0:
        raise InputError(
            f"alpha3 - beta = {balance_deg:.4g} degrees: a block can rock about its toe where it "
            "is between 0 and 90"
        )
    return math.tan(math.radians(balance_deg))


MODEL = Toppling()
