"""Where a trajectory is in a record, and the state of the block there."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.compiled import bare_kernel, within
from rbfrag.solver.results import FloatArray


class Place(NamedTuple):
    """A position in a record.

    Args:
        interval: number of the sample interval; that of node i is i.
        fraction: fraction of it, from 0 at its node up to 1.
    """

    interval: int
    fraction: float


class State(NamedTuple):
    """The state of a block.

    Args:
        theta: rotation about the toe [rad].
        rate: theta'/p.
        sin: sin(phi), phi = theta_c - theta the angle that is left to the balance point.
        cos: cos(phi).
    """

    theta: float
    rate: float
    sin: float
    cos: float


class StepExcitation(NamedTuple):
    """The excitation over one step, in which it is a straight line.

    Args:
        k_h: driving acceleration at the start of the step [g].
        dk_h: its change over the step.
        w: effective gravity 1 + k_v at the start.
        dw: its change over the step.
    """

    k_h: float
    dk_h: float
    w: float
    dw: float


@within
def excitation_over(
    k_h: FloatArray, w: FloatArray, i: int, at: float, part: float
) -> StepExcitation:
    """Return the excitation over a `part` of interval i that begins at the fraction `at`."""
    # from the nodes, not from where the part before ended: parts of an interval add no rounding
    dk = k_h[i + 1] - k_h[i]
    dw = w[i + 1] - w[i]
    return StepExcitation(k_h[i] + dk * at, dk * part, w[i] + dw * at, dw * part)


@within
def time_of_jump(time_s: FloatArray, interval_s: FloatArray, w: FloatArray, last: int) -> float:
    """Return when 1 + k_v reaches zero [s], after the last node above it; -1 for none."""
    jump_s: float = time_s[max(last, 0)]
    if last >= 0:  # 1 + k_v is a straight line to its zero
        jump_s += interval_s[last] * w[last] / (w[last] - w[last + 1])
    return jump_s


@bare_kernel
def at_rest(kr: float) -> State:
    """Return the state of rest, where tan(phi) = tan(theta_c) = k_r."""
    # from k_r itself: by way of the angle both would be rounded twice
    cos = 1.0 / math.sqrt(1.0 + kr * kr)
    return State(0.0, 0.0, kr * cos, cos)
