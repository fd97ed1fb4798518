"""A block that rocks about its toe (eqs. 4.1 to 4.19).

    θ'' = p² cos(θc - θ) [k_h - (1 + k_v) tan(θc - θ)],    tan θc = k_r

It has a kernel of its own, `rbfrag.solver.toppling`, which campaigns and searches call by the
million, and whose results are stored.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from rbfrag.errors import InputError
from rbfrag.solver.mechanism import ModeName
from rbfrag.solver.response_model import BlockOnPlanes, Shaking
from rbfrag.solver.results import Response


@dataclass(frozen=True)
class Toppling:
    """The toppling model, behind the interface that all models have."""

    kind: str = "toppling"
    mode: ModeName = "topple"
    settings: tuple[str, ...] = ("linear",)

    def respond(self, site: BlockOnPlanes, shaking: Shaking) -> Response:
        """Return what the block does."""
        from rbfrag.solver.respond import respond

        kr = site.yield_g
        assert site.block is not None
        if kr is None:
            balance_deg = site.block.alpha3_deg - math.degrees(site.beta_rad)
            if not 0.0 < balance_deg < 90.0:
                raise InputError(
                    f"alpha3 - beta = {balance_deg:.4g} degrees: a block can rock about its toe "
                    "where it is between 0 and 90"
                )
            kr = math.tan(math.radians(balance_deg))
        answer = respond(
            shaking.motion,
            p2=site.block.p2,
            kr=kr,
            vertical=shaking.vertical,
            polarity=shaking.polarity,
            linear=bool(site.settings.get("linear", False)),
            history=shaking.history,
        )
        return replace(answer, warnings=(*shaking.remarks, *answer.warnings))


MODEL = Toppling()
