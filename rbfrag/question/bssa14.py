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
    """Coefficients of one intensity measure; e0 holds a value for each mechanism."""

    mh: float
    e0: tuple[float, float, float, float]
    e4: float
    e5: float
    e6: float
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
    tau: tuple[float, float]
    phi: tuple[float, float]


_OF = {
    "pgv_m_s": _Coefficients(
        6.2, (5.037, 5.078, 4.849, 5.033), 1.073, -0.1536, 0.2252, -1.243, 0.1489, -0.00344, 5.3,
        -0.84, 1300.0, -0.1, -0.00844, 105.0, 272.0, 0.082, 0.08, (0.401, 0.346), (0.644, 0.552),
    ),
    "pga_g": _Coefficients(
        5.5, (0.4473, 0.4856, 0.2459, 0.4539), 1.431, 0.05053, -0.1662, -1.134, 0.1917, -0.00809,
        4.5, -0.6, 1500.0, -0.15, -0.00701, 110.0, 270.0, 0.1, 0.07, (0.398, 0.348), (0.695, 0.495),
    ),
    "sa03_g": _Coefficients(
        6.14, (1.2217, 1.2401, 1.0246, 1.2653), 0.95676, -0.1959, -0.092855, -1.0948, 0.13388,
        -0.00548, 4.93, -0.8417, 1308.47, -0.2191, -0.0067, 103.15, 268.59, 0.138, 0.05,
        (0.363, 0.229), (0.675, 0.561),
    ),
    "sa10_g": _Coefficients(
        6.2, (0.3932, 0.4218, 0.207, 0.4124), 1.5004, -0.18983, 0.17895, -1.193, 0.10248, -0.00121,
        5.74, -1.05, 1109.95, -0.1052, -0.00844, 116.39, 270.0, 0.098, 0.02, (0.498, 0.298),
        (0.553, 0.625),
    ),
    "sa30_g": _Coefficients(
        6.2, (-1.1898, -1.142, -1.23, -1.2664), 2.1323, -0.04332, 0.62694, -1.2179, 0.09764, 0.0,
        6.93, -1.0112, 922.43, -0.0136, -0.00183, 130.36, 195.0, 0.088, 0.0, (0.537, 0.344),
        (0.534, 0.619),
    ),
}  # fmt: skip

MEASURES = tuple(_OF)
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
    tau, phi = (first + (second - first) * large for first, second in (of.tau, of.phi))
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
    e0 = of.e0[mechanism] if isinstance(mechanism, int) else mechanism.choose(of.e0)
    source = e0 + (of.e4 + of.e5 * below) * below + of.e6 * above
    r = ns.sqrt(rjb_km * rjb_km + of.h * of.h)
    return source + (of.c1 + of.c2 * (magnitude - 4.5)) * ns.log(r) + of.c3 * (r - 1.0)
