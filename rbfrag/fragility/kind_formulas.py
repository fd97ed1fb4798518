"""The formulas of blocks that slide or slump: how far from failure, in standard deviations.

    P = Φ(eta)

Sliding further than d on a level plane, with r = k_y/PGA:

    eta = [c + b1 ln(PGV²/(k_y g)) + b2 ln(1 - r) - ln d]/σ,       ln σ = s0 + s1 r

and, where PGA is not known, with u = ln(1 + k_y/(κ PGV)):

    eta = [c + b1 ln(PGV²/(k_y g)) - b2 u - ln d]/σ,               ln σ = s0 + s1 u

Slumping, with r = k_s/PGA and z = p_s PGV/(PGA g), and where PGA is not known with y = k_s g/p_s:

    eta = [ln((1 - r)/r) - c + b ln z]/σ,      eta = [ln PGV - c - b ln y]/σ,      ln σ = s0

(the PGV at which a block fails, and its PGA, scatter about a line in ln z or ln y).

A rectangular pulse gives the first with c = ln(1/2), b1 = b2 = 1. No library is loaded here;
numpy's functions in place of `math`'s make the same formulas work on arrays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


class Numbers(NamedTuple):
    """Logarithm and exponential, of single numbers or of arrays."""

    log: Callable[[Any], Any]
    exp: Callable[[Any], Any]


SINGLE = Numbers(math.log, math.exp)
"""For single numbers."""


class Eta(NamedTuple):
    """What a formula gives.

    Args:
        eta: standard deviations on the failing side.
        log_sigma: ln σ.
        slopes: derivatives of eta by the parameters.
        sigma_slopes: derivatives of ln σ by them.
    """

    eta: Any
    log_sigma: Any
    slopes: tuple[Any, ...]
    sigma_slopes: tuple[Any, ...]


class Formula(NamedTuple):
    """One formula.

    Args:
        parameters: names of its parameters, in order.
        inputs: names of what it reads.
        eta: returns :class:`Eta` from parameters, values and functions.
    """

    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    eta: Callable[[Sequence[float], Mapping[str, Any], Numbers], Eta]


def _sliding_pgv_pga(p: Sequence[float], v: Mapping[str, Any], f: Numbers) -> Eta:
    c, b1, b2, s0, s1 = p
    ky, pgv = v["ky"], v["pgv_m_s"]
    r = ky / v["pga_g"]
    size = f.log(pgv * pgv / (ky * STANDARD_GRAVITY_M_S2))
    left = f.log(1.0 - r)
    log_sigma = s0 + s1 * r
    per = f.exp(-log_sigma)
    eta = (c + b1 * size + b2 * left - f.log(v["displacement_m"])) * per
    return Eta(
        eta, log_sigma, (per, size * per, left * per, -eta, -eta * r), (0.0, 0.0, 0.0, 1.0, r)
    )


def _sliding_pgv(p: Sequence[float], v: Mapping[str, Any], f: Numbers) -> Eta:
    c, b1, b2, log_kappa, s0, s1 = p
    ky, pgv = v["ky"], v["pgv_m_s"]
    size = f.log(pgv * pgv / (ky * STANDARD_GRAVITY_M_S2))
    a = ky / (math.exp(log_kappa) * pgv)
    u = f.log(1.0 + a)
    w = a / (1.0 + a)
    log_sigma = s0 + s1 * u
    per = f.exp(-log_sigma)
    eta = (c + b1 * size - b2 * u - f.log(v["displacement_m"])) * per
    slope = (b2 * per + eta * s1) * w
    slopes = (per, size * per, -u * per, slope, -eta, -eta * u)
    return Eta(eta, log_sigma, slopes, (0.0, 0.0, 0.0, -s1 * w, 1.0, u))


def _slumping_pgv_pga(p: Sequence[float], v: Mapping[str, Any], f: Numbers) -> Eta:
    c, b, s0 = p
    r = v["ks"] / v["pga_g"]
    z = 0.5 * f.log(v["ps2"]) + f.log(v["pgv_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2))
    per = math.exp(-s0)
    eta = (f.log((1.0 - r) / r) - c + b * z) * per
    return Eta(eta, s0, (-per, z * per, -eta), (0.0, 0.0, 1.0))


def _slumping_pgv(p: Sequence[float], v: Mapping[str, Any], f: Numbers) -> Eta:
    c, b, s0 = p
    log_y = f.log(v["ks"] * STANDARD_GRAVITY_M_S2) - 0.5 * f.log(v["ps2"])
    per = math.exp(-s0)
    eta = (f.log(v["pgv_m_s"]) - c - b * log_y) * per
    return Eta(eta, s0, (-per, -log_y * per, -eta), (0.0, 0.0, 1.0))


_SLIDE = ("ky", "displacement_m")
_SLUMP = ("ks", "ps2")

FORMULAS: Mapping[tuple[str, str], Formula] = {
    ("sliding", "pgv_pga"): Formula(
        ("c", "b1", "b2", "s0", "s1"), (*_SLIDE, "pgv_m_s", "pga_g"), _sliding_pgv_pga
    ),
    ("sliding", "pgv"): Formula(
        ("c", "b1", "b2", "ln_kappa", "s0", "s1"), (*_SLIDE, "pgv_m_s"), _sliding_pgv
    ),
    ("slumping", "pgv_pga"): Formula(
        ("c", "b", "s0"), (*_SLUMP, "pgv_m_s", "pga_g"), _slumping_pgv_pga
    ),
    ("slumping", "pgv"): Formula(("c", "b", "s0"), (*_SLUMP, "pgv_m_s"), _slumping_pgv),
}
"""The formulas by kind and term."""

METHODS: Mapping[str, str] = {"sliding": "displacement", "slumping": "capacity"}
"""What the method of each kind is called in a stored model."""
