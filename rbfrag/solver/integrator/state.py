"""Position of a trajectory in a record, state of the block, and history."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.excitation import Nodes
from rbfrag.solver.integrator.compiled import bare_kernel, within
from rbfrag.solver.results import FloatArray

EVENT = -1
"""What stands in a history for the node of an event between nodes."""


class Place(NamedTuple):
    """A position in a record.

    Args:
        interval: number of the sample interval; that of node i is i.
        fraction: fraction of it, from 0 at its node up to 1.
    """

    interval: int
    fraction: float


class Corner(NamedTuple):
    """A corner that the block turns about.

    Args:
        kr: tangent of its critical angle: k_h that lifts the block where 1 + k_v = 1.
        theta_c: critical angle [rad].
        sin: sine of it.
        cos: cosine of it.
        p: frequency parameter [1/s].
        passed_on: part of the speed that an impact leaves, where the pivot changes from this
            corner to another; 0 where the block is backed and comes to rest.
    """

    kr: float
    theta_c: float
    sin: float
    cos: float
    p: float
    passed_on: float


def corner(kr: float, p: float, passed_on: float = 0.0) -> Corner:
    """Return the corner of a critical angle of tangent `kr`; arguments as there."""
    # from k_r itself: by way of the angle both would be rounded twice
    cos = 1.0 / math.sqrt(1.0 + kr * kr)
    return Corner(kr, math.atan(kr), kr * cos, cos, p, passed_on)


kernel_corner = within(corner)
"""The same within a kernel."""


class State(NamedTuple):
    """The state of a block.

    Args:
        theta: rotation about the toe [rad].
        rate: theta'/p.
        sin: sin(psi), psi = theta_c - theta the angle that is left to the balance point.
        cos: cos(psi).
    """

    theta: float
    rate: float
    sin: float
    cos: float


class Peak(NamedTuple):
    """Peak position so far, and the bound on its error."""

    x: float
    error: float


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


class Line(NamedTuple):
    """An interval, over which both accelerations are straight lines.

    Args:
        start_s: where it begins [s].
        h: its length [s].
        a0: driving acceleration at its start [g].
        a1: the same at its end.
        w0: effective gravity 1 + k_v at its start.
        w1: the same at its end.
    """

    start_s: float
    h: float
    a0: float
    a1: float
    w0: float
    w1: float


@within
def line_at(nodes: Nodes, node: int, free_s: float, free_h: float) -> Line:
    """Return the interval after a node, or `free_h` seconds of rest after the nodes."""
    # after its last sample the ground is at rest (docs/reference/units-and-signs.md)
    if node >= nodes.last:
        return Line(nodes.time_s[-1] + free_s, free_h, 0.0, 0.0, 1.0, 1.0)
    k_h, w = nodes.k_h, nodes.w
    return Line(
        nodes.time_s[node], nodes.interval_s[node], k_h[node], k_h[node + 1], w[node], w[node + 1]
    )


@within
def time_of_jump(time_s: FloatArray, interval_s: FloatArray, w: FloatArray, last: int) -> float:
    """Return when 1 + k_v reaches zero [s], after the last node above it; -1 for none."""
    jump_s: float = time_s[max(last, 0)]
    if last >= 0:  # 1 + k_v is a straight line to its zero
        jump_s += interval_s[last] * w[last] / (w[last] - w[last + 1])
    return jump_s


@bare_kernel
def at_rest(kr: float) -> State:
    """Return the state of rest, where tan(psi) = tan(theta_c) = k_r."""
    # from k_r itself: by way of the angle both would be rounded twice
    cos = 1.0 / math.sqrt(1.0 + kr * kr)
    return State(0.0, 0.0, kr * cos, cos)


@within
def higher(peak: Peak, x: float, error: float) -> Peak:
    """Return the peak, updated for a block that has reached x."""
    # the first of equal peaks is kept, whose error is the least
    if x > peak.x:
        return Peak(x, error)
    return peak


@within
def append_history(
    history: FloatArray, filled: int, time_s: float, x: float, rate: float, node: int
) -> int:
    """Append one column to a history that is not full; return the number of filled columns."""
    # a run that keeps no history has one without columns: no second kernel is compiled for it
    if filled >= history.shape[1]:
        return filled
    history[0, filled] = time_s
    history[1, filled] = x
    history[2, filled] = rate
    # the node lets a reader tell samples from events without comparing times
    history[3, filled] = node
    return filled + 1
