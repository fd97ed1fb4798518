"""The linearised block of the closed forms: sin(x) is replaced by x, cos(x) by 1 (Gibson, 4.20).

    theta'' = p² [k_h - (1 + k_v) x],    x = theta_c - theta

An integrator of its own. It shares with the product the order of the step and the splitting of
intervals (`ORDER`, `PH_MAX`), the search for impacts and peaks inside a step (`examine_step`) and
the idea of a bound by excursions from rest, so that what the closed forms prove of these holds
there. That the step of the product is its equation's, is proven in
`tests/solver/integrator/test_taylor.py`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.events import examine_step
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX

FloatArray = NDArray[np.float64]

IMPACT, TOPPLED, IN_AIR = 0, 1, 2

SCAN_POINTS = 400
"""Blocks of the descending scan, equally spaced in the logarithm of the critical angle."""


class LinearRun(NamedTuple):
    """Response of one block: whether it toppled, and its peak rotation over the critical angle."""

    toppled: bool
    peak_theta_n: float


@kernel
def _step(
    u: FloatArray, x: FloatArray, ph: float, a0: float, da: float, w0: float, dw: float
) -> tuple[float, float, float]:
    """Fill u and x from u[0], x[0]; return theta(1) - theta(0), U(1), U'(1)."""
    for k in range(ORDER):
        pull = -w0 * x[k]
        if k > 0:
            pull -= dw * x[k - 1]
        if k == 0:
            pull += a0
        elif k == 1:
            pull += da
        u[k + 1] = ph * ph * pull / (k + 1)
        x[k + 1] = -u[k] / (k + 1)
    turned, u_end, v_end = 0.0, 0.0, 0.0
    for k in range(ORDER, -1, -1):
        turned += u[k] / (k + 1)
        u_end += u[k]
        v_end += k * u[k]
    return turned, u_end, v_end


@kernel
def _crossing(k0: float, k1: float, w0: float, w1: float, kr: float, tau: float) -> float:
    """Fraction of an interval, from tau on, at which k_h exceeds k_r first; -1 for never."""
    g0, g1 = k0 - w0 * kr, k1 - w1 * kr
    if g0 + (g1 - g0) * tau > 0.0:
        return tau
    if g1 <= 0.0:
        return -1.0
    return min(max(tau, -g0 / (g1 - g0)), 1.0)


@kernel
def _excursion(
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    tail_min_q: FloatArray,
    p: float,
    kr: float,
    i: int,
    tau: float,
) -> tuple[int, int, float, float]:
    """Follow an excursion from rest at (i, tau): event, place, peak rotation before it."""
    u, x = np.empty(ORDER + 1), np.empty(ORDER + 1)
    theta, rate, peak = 0.0, 0.0, 0.0
    lifting = k_h[i] - w[i] * kr <= 0.0 and tau > 0.0  # at a crossing: the first step has no impact
    while i < interval_s.size:
        remaining = p * interval_s[i] * (1.0 - tau)
        pieces = max(1, math.ceil(remaining / PH_MAX))
        part, ph = (1.0 - tau) / pieces, remaining / pieces
        if ph > 0.0:
            dk, dw = k_h[i + 1] - k_h[i], w[i + 1] - w[i]
            for piece in range(pieces):
                at = tau + piece * part
                u[0], x[0] = ph * rate, kr - theta
                turned, u_end, v_end = _step(
                    u, x, ph, k_h[i] + dk * at, dk * part, w[i] + dw * at, dw * part
                )
                theta_end = theta + turned
                if lifting:
                    lifting = False
                    theta_end = max(theta_end, 0.0)
                else:
                    touch, top, _, _ = examine_step(theta, u, ORDER, theta_end, u_end, v_end)
                    peak = max(peak, top)
                    if touch >= 0.0:
                        return IMPACT, i, min(at + part * touch, 1.0), peak
                theta, rate = theta_end, u_end / ph
        i += 1
        tau = 0.0
        if rate > 0.0 and kr - theta < min(tail_min_q[i], 0.0):
            return TOPPLED, i, tau, peak
    # x'' = p² x: the states with rate = x come to rest upright
    remaining = kr - theta
    if rate > remaining:
        return TOPPLED, i, tau, peak
    if rate > 0.0:
        peak = max(peak, kr - math.sqrt(remaining * remaining - rate * rate))
    return IN_AIR, i, tau, peak


@kernel
def _run(
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    tail_min_q: FloatArray,
    p: float,
    kr: float,
) -> tuple[bool, float]:
    """Run a block over the record: whether it topples, and its peak rotation."""
    i, tau, peak = 0, 0.0, 0.0
    while i < interval_s.size:
        at = _crossing(k_h[i], k_h[i + 1], w[i], w[i + 1], kr, tau)
        if interval_s[i] == 0.0 or at < 0.0 or at >= 1.0:
            i, tau = i + 1, 0.0
            continue
        if at == tau and tau > 0.0 and k_h[i + 1] - k_h[i] < kr * (w[i + 1] - w[i]) and (
            k_h[i] + (k_h[i + 1] - k_h[i]) * tau - kr * (w[i] + (w[i + 1] - w[i]) * tau) < 1e-15
        ):  # fmt: skip
            i, tau = i + 1, 0.0  # pushed by less than rounding, and less and less
            continue
        event, i, tau, top = _excursion(interval_s, k_h, w, tail_min_q, p, kr, i, at)
        peak = max(peak, top)
        if event == TOPPLED:
            return True, peak
        if event == IN_AIR:
            break
    return False, peak


@kernel
def _any_excursion_fails(
    interval_s: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    tail_min_q: FloatArray,
    p: float,
    kr: float,
) -> bool:
    """Return whether an excursion from rest at any rise of the excitation above kr topples."""
    above = False
    for i in range(interval_s.size):
        if not above and interval_s[i] > 0.0:
            at = _crossing(k_h[i], k_h[i + 1], w[i], w[i + 1], kr, 0.0)
            if 0.0 <= at < 1.0 and (
                _excursion(interval_s, k_h, w, tail_min_q, p, kr, i, at)[0] == TOPPLED
            ):
                return True
        # in no time nothing lifts: a jump to above kr is a start of the next interval
        above = k_h[i + 1] - w[i + 1] * kr > 0.0 and (above or interval_s[i] > 0.0)
    return False


def respond(motion: GroundMotion, *, p2: float, kr: float) -> LinearRun:
    """Run a block of that p² [1/s²] and critical angle k_r [rad]."""
    toppled, peak = _run(*_arrays(excitation(motion)), math.sqrt(p2), kr)
    return LinearRun(bool(toppled), peak / kr)


def fails(excited: Excitation, p2: float, kr: float) -> bool:
    """Return whether a block at rest at any rise of the excitation above k_r topples."""
    return bool(_any_excursion_fails(*_arrays(excited), math.sqrt(p2), kr))


def largest_failing(excited: Excitation, p2: float, width: float = 1e-12) -> float:
    """Bisect, from all k_r, for the largest one with a failing excursion from rest."""
    low, high = 0.0, excited.max_q
    while high - low > width * high and high > 0.0:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fails(excited, p2, middle) else (low, middle)
    return low


def critical_angle(
    motion: GroundMotion, *, p2: float, limit: float = 1e-3, width: float = 1e-13
) -> float | None:
    """Return the largest critical angle [rad] that topples, down to `limit` times PGA.

    Nothing above the largest failing excursion from rest topples. Below it blocks are tried one
    by one until one does, then the border above that one is bisected.
    """
    excited = excitation(motion)
    arrays, p = _arrays(excited), math.sqrt(p2)
    top = largest_failing(excited, p2)
    bottom = limit * excited.pga_g
    if top <= bottom:
        return None
    above = top * (1.0 + 1e-11)
    for kr in [top, *np.geomspace(top, bottom, SCAN_POINTS)[1:].tolist()]:
        if _run(*arrays, p, kr)[0]:
            low, high = kr, above
            while high - low > width * high:
                middle = 0.5 * (low + high)
                low, high = (middle, high) if _run(*arrays, p, middle)[0] else (low, middle)
            return float(low)
        above = kr
    return None


def _arrays(excited: Excitation) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    return excited.interval_s, excited.k_h, excited.w, excited.tail_min_q
