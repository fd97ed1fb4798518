"""The frequency parameter of many slumping blocks at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]


def slumping_p2(
    *,
    alpha1_deg: FloatArray,
    alpha3_deg: FloatArray,
    gamma_deg: FloatArray,
    r1_m: FloatArray,
    r3_m: FloatArray,
    beta_deg: FloatArray,
    phi_deg: FloatArray,
    phi_back_deg: FloatArray,
) -> FloatArray:
    """Return p_s² of parallelograms at rest [1/s²], shape (n,); NaN where there is none.

    p_s² = g (F_y cos β - F_x sin β)/D with the contact forces of a slump that starts
    (docs/theory/slumping.md).

    Args:
        alpha1_deg: angle of the heel [deg], shape (n,), and so the others.
        alpha3_deg: angle of the toe [deg].
        gamma_deg: dip of the back plane less dip of the base [deg].
        r1_m: distance from centroid to heel [m].
        r3_m: distance from centroid to toe [m].
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg].
    """
    a1, a3, gamma, beta, phi1, phi2 = (
        np.radians(angle)
        for angle in (alpha1_deg, alpha3_deg, gamma_deg, beta_deg, phi_deg, phi_back_deg)
    )
    back_edge = 2.0 * r1_m * np.cos(a1) / np.sin(gamma)
    on_base = r3_m * np.sin(a3 + gamma - phi2)
    on_back = r1_m * np.sin(a1 - phi1)
    force_x = -on_base * np.sin(phi1) + on_back * np.sin(gamma - phi2)
    force_y = on_base * np.cos(phi1) + on_back * np.cos(gamma - phi2)
    path_x = back_edge / np.sin(gamma) - r1_m * np.cos(a1)
    path_y = -r1_m * np.sin(a1)
    inertia_m2 = (r1_m**2 + r3_m**2) / 6.0
    inertia = force_y * path_x - force_x * path_y + inertia_m2 * np.sin(gamma + phi1 - phi2)
    pull = STANDARD_GRAVITY_M_S2 * (force_y * np.cos(beta) - force_x * np.sin(beta))
    with np.errstate(divide="ignore", invalid="ignore"):
        p2 = pull / inertia
    return np.asarray(np.where((inertia > 0.0) & (p2 > 0.0), p2, np.nan))
