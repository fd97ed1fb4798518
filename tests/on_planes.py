"""A block between its planes, as the models take it."""

from __future__ import annotations

import math

from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kind import SupportedBlock


def on_planes(
    block: Block, beta_deg: float, phi_deg: float, back_deg: float, **settings: object
) -> SupportedBlock:
    return SupportedBlock(
        block=block,
        beta_rad=math.radians(beta_deg),
        phi_rad=math.radians(phi_deg),
        phi_back_rad=math.radians(back_deg),
        back_fracture=True,
        cohesive=False,
        yield_g=None,
        settings=settings,
    )
