"""Campaigns of confined toppling.

The family spans back planes that overhang by 5 and by 25 degrees, two pairs of dip and friction and
two sizes. Every block of it topples confined and is stable at rest.
"""

from __future__ import annotations

from itertools import product

from rbfrag.campaign.scaled_records import BlockClass, ScaledRecords

GAMMA_DEG = (95.0, 115.0)
SPACING_RATIO = 0.3
"""S2/S1: slender between the back planes, or the blocks slide."""
PLANES_DEG = ((5.0, 25.0), (10.0, 35.0))
"""Dip of the base and friction angle."""
SIZES_M = (0.5, 2.0)

FAMILY = tuple(
    BlockClass(size, SPACING_RATIO * size, gamma, beta, phi)
    for gamma, (beta, phi), size in product(GAMMA_DEG, PLANES_DEG, SIZES_M)
)
"""Two shapes, two pairs of dip and friction, two sizes."""


class ConfinedCampaign(ScaledRecords):
    """Outcome grid of every block of a family."""

    # every second: a run takes some four times as long as of a slumping block
    ratios = ScaledRecords.ratios[::2]


CAMPAIGN = ConfinedCampaign("confined_toppling", FAMILY)
