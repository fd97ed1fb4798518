"""Rocking about both corners on ground at rest: closed form, by energy."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.compiled import inner_kernel, within
from rbfrag.solver.integrator.events import left_at_turn, upright_rate
from rbfrag.solver.integrator.state import Corner, Peak, State, higher

STABLE, TOPPLED = 0, 1

IMPACTS_THAT_DECIDE = 2
"""Impacts after which speeds about each corner only fall: the product of both ratios is <= 1."""


class Offset(NamedTuple):
    """Estimated error of the rotation [rad] and of theta'/p, with its sign."""

    theta: float
    rate: float


class FreeEnd(NamedTuple):
    """Outcome of the motion after the record.

    Args:
        outcome: STABLE or TOPPLED.
        side: on which it overturns, 1 or -1; 0 if it does not.
        forward: greatest rotation about the toe after the record, and its error.
        backward: the same about the heel.
    """

    outcome: int
    side: int
    forward: Peak
    backward: Peak


@within
def free_peak(corner: Corner, border: float, rate: float, error: float) -> Peak:
    """Return the rotation at which motion turns back that lacks the energy to overturn.

    Args:
        border: rate that would just bring the block upright from here; above `rate`.
        rate: theta'/p, above 0.
        error: of the rate.
    """
    x_top = left_at_turn(border, rate)
    return Peak(corner.theta_c - x_top, min(1.0, error * (border + rate) / math.sin(x_top)))


@inner_kernel
def after_record(
    toe: Corner, heel: Corner, side: int, state: State, off: Offset, slowest: float
) -> FreeEnd:
    """Return outcome and peak rotations of the free motion, impact by impact.

    Args:
        toe: the corner of forward rotation.
        heel: that of backward rotation.
        side: the present one, 1 or -1.
        state: of the block.
        off: its error.
        slowest: speed after an impact below which the block rests [rad/s].
    """
    # energy alone decides: (theta'/p)²/2 - (1 - cos x) is conserved about one corner
    forward, backward = Peak(0.0, 0.0), Peak(0.0, 0.0)
    corner = toe if side > 0 else heel
    rate, error = state.rate, abs(off.theta) + abs(off.rate)
    border = upright_rate(state.sin, state.cos)
    for number in range(IMPACTS_THAT_DECIDE + 1):
        # upright with a rate left, or past it without the rate to come back
        if rate >= border:
            return FreeEnd(TOPPLED, side, forward, backward)
        if rate > 0.0:
            peak = free_peak(corner, border, rate, error)
            if side > 0:
                forward = higher(forward, peak.x, peak.error)
            else:
                backward = higher(backward, peak.x, peak.error)
        if number == IMPACTS_THAT_DECIDE:
            break
        # it comes down with the energy it has: rate² + 2 (cos x - cos theta_c)
        full = 2.0 * math.sin(0.5 * corner.theta_c)
        hit = math.sqrt(max(0.0, full * full - (border - rate) * (border + rate)))
        speed = hit * corner.p * corner.passed_on
        if speed < slowest:  # it rests, and nothing drives it any more
            break
        side = -side
        corner = toe if side > 0 else heel
        rate = speed / corner.p
        border = 2.0 * math.sin(0.5 * corner.theta_c)
    return FreeEnd(STABLE, 0, forward, backward)
