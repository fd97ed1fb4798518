"""The family of blocks that slumping campaigns shake.

Strength and frequency do not fix a slump: shape, friction and dip do. The family spans those of
the slumping blocks of the dissertation's rock mass (its Table 3.4: base 20 and back 45 degrees,
spacings 1 and 0.6 m, friction 40 degrees) and of weaker ones. Every block of it slumps and is
stable at rest.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import product

from rbfrag.solver.block.geometry import Block


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
