"""The rectangular block on level ground that has a given p² and k_r."""

from __future__ import annotations

import math

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.quantity import positive
from rbfrag.solver.stability.single import Stability, stability


def rectangle_r3_m(p2: float) -> float:
    """Return the distance from centroid to toe of a rectangle, r3 = 3g/(4p²) [m].

    Args:
        p2: frequency parameter p² [1/s²], above 0.

    Raises:
        InputError: p2 is not above 0.
    """
    return 0.75 * STANDARD_GRAVITY_M_S2 / positive(p2, "p2", "1/s²")


def level_rectangle(p2: float, kr: float) -> tuple[Block, Stability]:
    """Return a rectangle that stands free on level ground, rough enough to topple.

    Args:
        p2: its frequency parameter p² [1/s²], above 0.
        kr: its yield acceleration coefficient k_r = tan(critical angle), above 0.

    Raises:
        InputError: a value that is not above 0.
    """
    slender_deg = math.degrees(math.atan(positive(kr, "kr", "")))
    block = Block.from_angles(-slender_deg, slender_deg, rectangle_r3_m(p2))
    rough_deg = 0.5 * (slender_deg + 90.0)
    return block, stability(block, beta_deg=0.0, phi_deg=rough_deg, back_fracture=False)
