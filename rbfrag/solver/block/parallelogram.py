"""Formulas of the parallelogram block, for single numbers and arrays (eqs. 3.1-3.15).

Everything follows from the tangents of the block angles, t1 = tan α1 and t3 = tan α3, and
from half the thickness, h = S1/2 = r1 cos α1 = r3 cos α3.
"""

from __future__ import annotations

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.elementwise import Elementwise, N
from rbfrag.solver.block.tangent import cot_deg


def cot_gamma(tan_alpha1: N, tan_alpha3: N) -> N:
    """Return cot γ = (t1 + t3)/2 (eq. 3.12)."""
    return (tan_alpha1 + tan_alpha3) * 0.5


def tangents_from_spacings(
    s1_m: N, s2_m: N, gamma_deg: N, functions: Elementwise[N]
) -> tuple[N, N]:
    """Return (t1, t3) of the block that two fracture sets cut out (eq. 3.15).

    tan α = cot γ ∓ (S2/S1)/sin γ, with 1/sin γ = √(1 + cot² γ).

    Args:
        s1_m: spacing of the base fractures [m].
        s2_m: spacing of the back fractures [m].
        gamma_deg: dip of the back less dip of the base [deg].
        functions: the functions for this kind of number.
    """
    cot = cot_deg(gamma_deg, functions)
    half_base = s2_m / s1_m * functions.sqrt(cot * cot + 1.0)
    return cot - half_base, cot + half_base


def shape_factor(tan_alpha1: N, tan_alpha3: N) -> N:
    """Return F_s = m r3²/I_toe = 1/(7/6 + (cos α3/cos α1)²/6)."""
    ratio = (tan_alpha1 * tan_alpha1 + 1.0) / (tan_alpha3 * tan_alpha3 + 1.0)
    return 6.0 / (ratio + 7.0)


def frequency_parameter(factor: N, r3_m: N) -> N:
    """Return p² = F_s g/r3 [1/s²] (eq. 4.27) for a distance toe-centroid r3 [m]."""
    return factor * STANDARD_GRAVITY_M_S2 / r3_m
