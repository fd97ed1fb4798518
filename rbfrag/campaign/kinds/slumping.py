"""Campaigns of slumping.

The family spans the slumping blocks of the dissertation's rock mass (its Table 3.4: base 20 and
back 45 degrees, spacings 1 and 0.6 m, friction 40 degrees) and weaker ones. Every block of it
slumps and is stable at rest.
"""

from __future__ import annotations

from itertools import product

from rbfrag.campaign.scaled_records import BlockClass, ScaledRecords

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


class SlumpingCampaign(ScaledRecords):
    """Outcome grid of every block of a family and every rotation limit."""

    options = ("rotations_deg", "family")
    rotations_deg = (2.0, None)


CAMPAIGN = SlumpingCampaign("slumping", FAMILY)
