"""Parameters at rest for predictions: p_s² of blocks on two sliding contacts, p², k_r and
restitution of free-standing ones.

Formulas for single numbers and for arrays; no numpy is loaded for a single number.
"""

from __future__ import annotations

import math
from typing import Any

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.formulas import Elementwise, N, corner_distance, moments_about_corners


def two_contacts_at_rest(
    *,
    confined: bool,
    alpha1_deg: N,
    alpha3_deg: N,
    gamma_deg: N,
    r1_m: N,
    r3_m: N,
    beta_deg: N,
    phis_deg: tuple[N, N],
    functions: Elementwise[N],
    trigonometry: Any,
) -> N:
    """Return p_s² of parallelograms at rest [1/s²].

    p_s² = g (F_y cos β - F_x sin β)/D with the contact forces of a slump, or a confined topple,
    that starts (docs/theory/slumping.md, docs/theory/confined-toppling.md); NaN where there is
    none.

    Args:
        confined: whether they topple confined, instead of slumping.
        alpha1_deg: angle of the heel [deg].
        alpha3_deg: angle of the toe [deg].
        gamma_deg: dip of the back plane less dip of the base [deg].
        r1_m: distance from centroid to heel [m].
        r3_m: distance from centroid to toe [m].
        beta_deg: dip of the base [deg].
        phis_deg: friction angles of the base and of the back plane [deg].
        functions: the functions for this kind of number.
        trigonometry: what has its ``sin``, ``cos`` and ``radians``: math, or numpy.
    """
    where, sin, cos = functions.where, trigonometry.sin, trigonometry.cos
    a1, a3, gamma, beta, phi1, phi2 = (
        trigonometry.radians(angle)
        for angle in (alpha1_deg, alpha3_deg, gamma_deg, beta_deg, *phis_deg)
    )
    pulls = gamma + phi2 if confined else gamma - phi2
    arms = _confined_arms if confined else _slump_arms
    on_base, on_back, path_x, path_y = arms(
        (a1, r1_m), (a3, r3_m), gamma, phi1, pulls, sin=sin, cos=cos
    )
    force_x = -on_base * sin(phi1) + on_back * sin(pulls)
    force_y = on_base * cos(phi1) + on_back * cos(pulls)
    inertia_m2 = (r1_m * r1_m + r3_m * r3_m) / 6.0
    inertia = force_y * path_x - force_x * path_y + inertia_m2 * sin(pulls + phi1)
    pull = STANDARD_GRAVITY_M_S2 * (force_y * cos(beta) - force_x * sin(beta))
    turns = (inertia > 0.0) & (pull > 0.0)
    p2: N = where(turns, pull / where(turns, inertia, 1.0), math.nan)
    return p2


def _slump_arms(
    heel: tuple[N, N], toe: tuple[N, N], gamma: N, phi1: N, pulls: N, *, sin: Any, cos: Any
) -> tuple[N, N, N, N]:
    """Return A, B and C' of docs/theory/slumping.md at rest."""
    (a1, r1_m), (a3, r3_m) = heel, toe
    back_edge = 2.0 * r1_m * cos(a1) / sin(gamma)
    path_x = back_edge / sin(gamma) - r1_m * cos(a1)
    return r3_m * sin(a3 + pulls), r1_m * sin(a1 - phi1), path_x, -r1_m * sin(a1)


def _confined_arms(
    heel: tuple[N, N], toe: tuple[N, N], gamma: N, phi1: N, pulls: N, *, sin: Any, cos: Any
) -> tuple[N, N, N, N]:
    """Return A, B and C' of docs/theory/confined-toppling.md at rest."""
    (a1, r1_m), (a3, r3_m) = heel, toe
    base_edge = r3_m * sin(a3) - r1_m * sin(a1)
    path_x = r3_m * cos(a3) - base_edge * cos(gamma) / sin(gamma)
    return r1_m * sin(a1 + pulls), r3_m * sin(phi1 - a3), path_x, r3_m * sin(a3)


def rocking_at_rest(
    *,
    tan_alpha1: N,
    tan_alpha3: N,
    half_s1_m: N,
    inertia_m2: N,
    tan_beta: N,
    functions: Elementwise[N],
) -> tuple[N, N, N, N, N]:
    """Return k_r of both senses, forward and backward, p², restitution, and 90° less the balance
    angles.

    Predictions are about symmetric blocks on level ground: of another block, about the one that is
    as weak as its weaker sense, whose p² [1/s²] is returned, and loses as much speed in two
    impacts, √(e31 e13) (Housner 1963).

    Args:
        tan_alpha1: tangent of the angle of the heel.
        tan_alpha3: tangent of the angle of the toe.
        half_s1_m: height of the centroid above the base, normal to it [m].
        inertia_m2: moment of inertia about the centroid per mass [m²].
        tan_beta: tangent of the dip of the base.
        functions: the functions for this kind of number.

    Returns:
        k_r about the toe and about the heel, at most 0 for a block that falls over it; p² of the
        weaker of the two; the restitution; and the least cosine of both critical angles up to a
        positive factor, at most 0 where one is 90° or more.
    """
    where, sqrt = functions.where, functions.sqrt
    steep = 1.0 + tan_alpha3 * tan_beta, 1.0 + tan_alpha1 * tan_beta
    least = where(steep[0] < steep[1], steep[0], steep[1])
    forward = (tan_alpha3 - tan_beta) / where(steep[0] > 0.0, steep[0], 1.0)
    backward = (tan_beta - tan_alpha1) / where(steep[1] > 0.0, steep[1], 1.0)
    heel, toe = ((half_s1_m * t, -half_s1_m) for t in (tan_alpha1, tan_alpha3))
    about_toe, about_heel, momentum = moments_about_corners(inertia_m2, heel, toe)
    per_moment = where(
        forward <= backward,
        corner_distance(half_s1_m, tan_alpha3, functions) / about_toe,
        corner_distance(half_s1_m, tan_alpha1, functions) / about_heel,
    )
    restitution = where(momentum > 0.0, momentum, 0.0) / sqrt(about_toe * about_heel)
    return forward, backward, STANDARD_GRAVITY_M_S2 * per_moment, restitution, least
