"""Ground motion from magnitude, distance and Vs30: the model of Boore et al. (2014), BSSA14.

Boore, D. M., Stewart, J. P., Seyhan, E. & Atkinson, G. M. (2014): NGA-West2 equations for
predicting PGA, PGV, and 5% damped PSA for shallow crustal earthquakes. Earthquake Spectra 30(3),
1057-1085. Global, without the term of basins; measures are those of RotD50, the median over all
directions. Formulas are written once for numbers and arrays; no library is loaded.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from rbfrag.fragility.method import ArrayNamespace


class _Coefficients(NamedTuple):
    """Coefficients of one intensity measure, named as in the paper; e0 to e3 are those of the
    mechanisms, in the order of :data:`~rbfrag.vocabulary.quantities.MECHANISMS`.
    """

    e0: float
    e1: float
    e2: float
    e3: float
    e4: float
    e5: float
    e6: float
    mh: float
    c1: float
    c2: float
    c3: float
    h: float
    c: float
    vc: float
    f4: float
    f5: float
    r1: float
    r2: float
    d_phi_r: float
    d_phi_v: float
    phi1: float
    phi2: float
    tau1: float
    tau2: float


PERIODS_S = (
    0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0,
)  # fmt: skip
"""Periods [s] of the spectral accelerations: further ones change the block-relative spectral
velocity of the median spectrum by less than 1 %.
"""

MEASURES = ("pgv_m_s", "pga_g", *(f"sa({period_s:g})" for period_s in PERIODS_S))
"""Intensity measures of the model."""

# Table of the paper's electronic supplement, in the order of MEASURES and _Coefficients: lines of
# the source, of the path and site, and of the standard deviations.
_ROWS = (
    (5.037, 5.078, 4.849, 5.033, 1.073, -0.1536, 0.2252, 6.2,
     -1.243, 0.1489, -0.00344, 5.3, -0.84, 1300.0, -0.1, -0.00844,
     105.0, 272.0, 0.082, 0.08, 0.644, 0.552, 0.401, 0.346),
    (0.4473, 0.4856, 0.2459, 0.4539, 1.431, 0.05053, -0.1662, 5.5,
     -1.134, 0.1917, -0.008088, 4.5, -0.6, 1500.0, -0.15, -0.00701,
     110.0, 270.0, 0.1, 0.07, 0.695, 0.495, 0.398, 0.348),
    (1.1268, 1.1669, 0.8871, 1.1454, 1.4293, 0.055231, -0.19838, 5.54,
     -1.0652, 0.17203, -0.0102, 4.13, -0.48724, 1479.12, -0.24916, -0.0056,
     79.59, 270.09, 0.087, 0.014, 0.728, 0.541, 0.415, 0.458),
    (1.3095, 1.3481, 1.0648, 1.3324, 1.2844, -0.042065, -0.18234, 5.74,
     -1.0532, 0.15401, -0.008977, 4.39, -0.57962, 1442.85, -0.25713, -0.00585,
     81.33, 270.16, 0.12, 0.015, 0.72, 0.537, 0.354, 0.388),
    (1.3255, 1.359, 1.122, 1.3414, 1.1349, -0.11096, -0.15852, 5.92,
     -1.0607, 0.14489, -0.007717, 4.61, -0.68762, 1392.61, -0.24658, -0.00614,
     90.91, 270.0, 0.136, 0.045, 0.711, 0.539, 0.344, 0.309),
    (1.2766, 1.3017, 1.0828, 1.3052, 1.0166, -0.16213, -0.12784, 6.05,
     -1.0773, 0.13925, -0.006517, 4.78, -0.77177, 1356.21, -0.23574, -0.00644,
     97.04, 269.45, 0.141, 0.055, 0.698, 0.547, 0.35, 0.266),
    (1.2217, 1.2401, 1.0246, 1.2653, 0.95676, -0.1959, -0.092855, 6.14,
     -1.0948, 0.13388, -0.005475, 4.93, -0.84165, 1308.47, -0.21912, -0.0067,
     103.15, 268.59, 0.138, 0.05, 0.675, 0.561, 0.363, 0.229),
    (1.1046, 1.1214, 0.89765, 1.1552, 0.96766, -0.22608, -0.023189, 6.2,
     -1.1243, 0.12512, -0.004053, 5.16, -0.91092, 1252.66, -0.19582, -0.00713,
     106.02, 266.54, 0.122, 0.049, 0.643, 0.58, 0.381, 0.21),
    (0.96991, 0.99106, 0.7615, 1.012, 1.0384, -0.23522, 0.029119, 6.2,
     -1.1459, 0.12015, -0.00322, 5.34, -0.9693, 1203.91, -0.175, -0.00744,
     105.54, 265.0, 0.109, 0.06, 0.615, 0.599, 0.41, 0.224),
    (0.66903, 0.69737, 0.47523, 0.69173, 1.2871, -0.21591, 0.10829, 6.2,
     -1.1777, 0.11054, -0.001931, 5.6, -1.0154, 1147.59, -0.13866, -0.00812,
     108.39, 266.51, 0.1, 0.07, 0.581, 0.622, 0.457, 0.266),
    (0.3932, 0.4218, 0.207, 0.4124, 1.5004, -0.18983, 0.17895, 6.2,
     -1.193, 0.10248, -0.00121, 5.74, -1.05, 1109.95, -0.10521, -0.00844,
     116.39, 270.0, 0.098, 0.02, 0.553, 0.625, 0.498, 0.298),
    (-0.14954, -0.11866, -0.3138, -0.1437, 1.7622, -0.1467, 0.33896, 6.2,
     -1.2063, 0.096445, -0.000365, 6.18, -1.0454, 1072.39, -0.062, -0.00771,
     125.38, 262.41, 0.104, 0.01, 0.532, 0.619, 0.525, 0.315),
    (-0.58669, -0.55003, -0.71466, -0.60658, 1.9152, -0.11237, 0.44788, 6.2,
     -1.2159, 0.096361, 0.0, 6.54, -1.0392, 1009.49, -0.036136, -0.00479,
     130.37, 240.14, 0.105, 0.008, 0.526, 0.618, 0.532, 0.329),
    (-1.1898, -1.142, -1.23, -1.2664, 2.1323, -0.04332, 0.62694, 6.2,
     -1.2179, 0.097638, 0.0, 6.93, -1.0112, 922.43, -0.013577, -0.00183,
     130.36, 195.0, 0.088, 0.0, 0.534, 0.619, 0.537, 0.344),
    (-1.6388, -1.5748, -1.6673, -1.7516, 2.204, -0.014642, 0.76303, 6.2,
     -1.2162, 0.10218, -5.2e-05, 7.32, -0.96938, 844.48, -0.0032123, -0.00152,
     129.49, 199.45, 0.07, 0.0, 0.536, 0.616, 0.543, 0.349),
    (-1.966, -1.8882, -2.0245, -2.0928, 2.2299, -0.014855, 0.87314, 6.2,
     -1.2189, 0.10353, 0.0, 7.78, -0.91954, 793.13, -0.0002548, -0.00144,
     130.22, 230.0, 0.061, 0.0, 0.528, 0.622, 0.532, 0.335),
    (-2.5865, -2.4874, -2.8176, -2.6854, 2.1187, -0.081606, 1.0121, 6.2,
     -1.2543, 0.12507, 0.0, 9.48, -0.77665, 771.01, -5.46e-05, -0.00137,
     130.72, 250.39, 0.058, 0.0, 0.512, 0.634, 0.511, 0.27),
    (-3.0702, -2.9537, -3.3776, -3.1726, 1.8837, -0.15096, 1.0651, 6.2,
     -1.3253, 0.15183, 0.0, 9.66, -0.65575, 775.0, 0.0, -0.00136,
     130.0, 210.0, 0.06, 0.0, 0.51, 0.604, 0.487, 0.239),
)  # fmt: skip
_OF = {name: _Coefficients(*row) for name, row in zip(MEASURES, _ROWS, strict=True)}

_CM_S = 0.01
_ROCK_M_S = 760.0


class Ordinate(NamedTuple):
    """Intensity measure of component RotD50 with a lognormal distribution.

    Args:
        median: its median in its unit.
        tau: standard deviation of what an earthquake's sites share.
        phi: that within an earthquake.
    """

    median: Any
    tau: Any
    phi: Any

    def sigma(self, ns: ArrayNamespace) -> Any:
        """Return the total standard deviation."""
        return ns.sqrt(self.tau * self.tau + self.phi * self.phi)


def bssa14(
    measure: str, magnitude: Any, rjb_km: Any, vs30_m_s: Any, mechanism: Any, ns: ArrayNamespace
) -> Ordinate:
    """Return the median of an intensity measure and its standard deviations.

    Args:
        measure: one of :data:`MEASURES`.
        magnitude: moment magnitude.
        rjb_km: distance from the surface projection of the rupture [km].
        vs30_m_s: mean velocity of shear waves in the upper 30 m [m/s].
        mechanism: index in :data:`MECHANISMS`, a number or an array.
        ns: functions for numbers or arrays.
    """
    of, rock = _OF[measure], _OF["pga_g"]
    pga = ns.exp(_on_rock(rock, magnitude, rjb_km, mechanism, ns))
    slow = ns.exp(of.f5 * (ns.minimum(vs30_m_s, _ROCK_M_S) - 360.0)) - math.exp(400.0 * of.f5)
    ground = of.c * ns.log(ns.minimum(vs30_m_s, of.vc) / _ROCK_M_S) + of.f4 * slow * ns.log(
        (pga + 0.1) / 0.1
    )
    median = ns.exp(_on_rock(of, magnitude, rjb_km, mechanism, ns) + ground)

    def within(value: Any) -> Any:
        return ns.minimum(ns.maximum(value, 0.0), 1.0)

    large = within(magnitude - 4.5)
    far = within(ns.log(ns.maximum(rjb_km, 1.0) / of.r1) / math.log(of.r2 / of.r1))
    soft = within(ns.log(300.0 / vs30_m_s) / math.log(300.0 / 225.0))
    tau = of.tau1 + (of.tau2 - of.tau1) * large
    phi = of.phi1 + (of.phi2 - of.phi1) * large
    return Ordinate(
        median * (_CM_S if measure == "pgv_m_s" else 1.0),
        tau, phi + of.d_phi_r * far - of.d_phi_v * soft,
    )  # fmt: skip


def _on_rock(
    of: _Coefficients, magnitude: Any, rjb_km: Any, mechanism: Any, ns: ArrayNamespace
) -> Any:
    """Return the natural logarithm of the median for Vs30 = 760 m/s."""
    d = magnitude - of.mh
    below, above = ns.minimum(d, 0.0), ns.maximum(d, 0.0)
    by_mechanism = of[:4]
    e0 = by_mechanism[mechanism] if isinstance(mechanism, int) else mechanism.choose(by_mechanism)
    source = e0 + (of.e4 + of.e5 * below) * below + of.e6 * above
    r = ns.sqrt(rjb_km * rjb_km + of.h * of.h)
    return source + (of.c1 + of.c2 * (magnitude - 4.5)) * ns.log(r) + of.c3 * (r - 1.0)
