"""A rigid block between two planes without a mechanism: three degrees of freedom, time steps.

Where a block has left the contacts of its mechanism, which corner touches which plane is part of
the question. A step of length h looks for the impulses of all corners that may touch within it:
of each corner that ends on its plane one that pushes, without rebound and with Coulomb friction
(Stewart and Trinkle 1996, International Journal for Numerical Methods in Engineering 39,
2673-2691; Moreau 1988). A block at rest costs next to nothing: the loads that its contacts bear
are a convex cone, so that it stays at rest under all that lies between two loads that leave it so.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.excitation import Nodes
from rbfrag.solver.integrator.compiled import bare_kernel, inner_kernel, within
from rbfrag.solver.integrator.impulses import (
    CONVERGED,
    LANDING_M_S,
    ContactArrays,
    Corners,
    Velocity,
    after_impulses,
)
from rbfrag.solver.results import FloatArray

GOES_ON = -1
"""A run that has not ended."""

AT_REST, BACKWARD, FORWARD, JUMPED, ENDLESS = range(5)
"""How a run ends: at rest to the end; on its back edge; on its front face; by a jump of the ground;
not within `FREE_MOST_S` of rest after the record."""

HEEL, TOE, ON_BASE, ON_BACK, LANDS = 1, 2, 4, 8, 16
"""Bits of what touches in a step: heel and toe on the base, another corner there, any corner on the
back plane; and that the block falls on its whole base."""

FREE_MOST_S = 60.0
"""Time after the record for which a motion that does not end is followed [s]."""

STANDSTILL = 1e-8
"""Velocity over g h below which a block is at rest."""

FREE_STEP_S = 0.05
"""Time after the record that is integrated between two looks at whether the block rests [s]."""

NEAR_M = 1e-9
"""Distance from its plane, above or below, within which a corner counts as on it: rounding leaves
as much, and to ask for its removal would keep a block moving that stands on corners of both planes
[m]."""

LET_OUT = 0.2
"""Part of the depth of a corner below its plane by which a step lets it out: all of it at once
would throw the block off."""

KEEP = 5
"""Steps between states that are kept."""


class Frame(NamedTuple):
    """Remaining parameters of the block and its slope, and its law of impact.

    Args:
        inertia_m2: moment of inertia about the centroid per mass [m²].
        sine: of the dip of the base.
        backward_rad: rotation at which the back edge lies on the base [rad].
        forward_rad: clockwise rotation at which the front face does [rad].
        restitution: speed of a corner from its plane after an impact over that towards it before.
        impact_friction: part of Coulomb's limit that an impact mobilises: 1 where corners give as
            little along their plane as across it; 0 where they give so much more along it that an
            impact is over before they grip.
        along: push of water down the base over the weight; it turns with the block.
        off: push of water off the base.
        moment_m: its moment about the centroid, counter-clockwise [m].
    """

    inertia_m2: float
    sine: float
    cosine: float
    backward_rad: float
    forward_rad: float
    restitution: float
    impact_friction: float
    along: float = 0.0
    off: float = 0.0
    moment_m: float = 0.0


class Motion(NamedTuple):
    """Position and velocity of the block: centroid, counter-clockwise rotation, and their rates."""

    x: float
    y: float
    turned: float
    vx: float
    vy: float
    spin: float


class FreeRun(NamedTuple):
    """The end of a run.

    Args:
        time_s: when it came to rest, or ended [s].
        motion: place and velocity then.
        steps: integration steps.
        filled: columns of the history that are filled.
        moved_s: first motion [s]; NaN for none.
        landed_s: first impact of the whole base [s]; NaN for none.
    """

    stop: int
    time_s: float
    motion: Motion
    steps: int
    filled: int
    moved_s: float
    landed_s: float


ROWS = 8
"""Rows of a history: time, the six numbers of :class:`Motion`, and what touches, as bits."""


@inner_kernel
def one_step(
    corners: Corners, frame: Frame, at: Motion, h: float, a: float, w: float, work: ContactArrays
) -> tuple[Motion, int]:
    """Take one step; return the new state and, as bits, the contacts that touched.

    Args:
        corners: pairs of corner and plane.
        frame: the block on its slope.
        at: motion at the start.
        h: length of the step [s].
        a: driving acceleration in its middle [g].
        w: 1 + k_v there.
        work: what the step writes to. Impulses begin at zero, not where the last step left them:
            planes that could hold the block by friction alone do so only where something presses
            it on them.
    """
    # Time stepping of Moreau (1988) in impulses P = h R per mass, for the velocity v = (x', y',
    # spin) of the centroid:
    #     v_free = v + h (G g + water),    v_end = v_free + sum over corners of J^T P,
    #     P_n >= 0,  n·v_end - least >= 0,  P_n (n·v_end - least) = 0,  |P_t| <= mu P_n
    # with n·v the speed of a corner away from its plane and mu its coefficient of friction. The
    # position follows as x + h v_end: rigid contact without a stiffness
    g = STANDARD_GRAVITY_M_S2
    c, s = math.cos(at.turned), math.sin(at.turned)
    # the velocity without contacts, under the resultant of weight, water and inertia
    push_x = frame.along * c - frame.off * s
    push_y = frame.along * s + frame.off * c
    vx = at.vx + h * g * (w * (frame.sine + push_x) + a * frame.cosine)
    vy = at.vy + h * g * (a * frame.sine - w * (frame.cosine - push_y))
    spin = at.spin + h * g * w * frame.moment_m / frame.inertia_m2
    active = 0
    for i in range(corners.arm_x.size):
        rx = corners.arm_x[i] * c - corners.arm_y[i] * s
        ry = corners.arm_x[i] * s + corners.arm_y[i] * c
        nx, ny = corners.normal_x[i], corners.normal_y[i]
        gap = (at.x + rx) * nx + (at.y + ry) * ny - corners.off_m[i]
        # the greatest approach of a corner within the step, with its speed before and after
        fastest = min((vx - spin * ry) * nx + (vy + spin * rx) * ny,
                      (at.vx - spin * ry) * nx + (at.vy + spin * rx) * ny)  # fmt: skip
        work.across[i] = 0.0
        work.along[i] = 0.0
        # twice: impulses on other corners may turn this one towards its plane
        if gap + 2.0 * h * fastest > 0.0 and gap > NEAR_M:
            continue
        k = active
        active += 1
        work.pair[k] = i
        # moments of a unit impulse along the normal, and along (n_y, -n_x) down the plane
        work.moment_n[k] = rx * ny - ry * nx
        work.moment_t[k] = -rx * nx - ry * ny
        work.approach[k] = -((at.vx - at.spin * ry) * nx + (at.vy + at.spin * rx) * ny)
        # a corner above its plane may come down to it; one that rounding put below it is let out
        if gap > NEAR_M:
            work.least[k] = -gap / h
        else:
            work.least[k] = LET_OUT * max(-gap - NEAR_M, 0.0) / h
        work.friction[k] = corners.friction[i]
        # an impact: it meets its plane within the step, at a speed that is more than rounding
        if work.approach[k] > LANDING_M_S and gap + h * fastest <= 0.0:
            work.friction[k] *= frame.impact_friction
            if frame.restitution > 0.0:
                work.least[k] = frame.restitution * work.approach[k]
    vx, vy, spin = after_impulses(
        corners, work, active, 1.0 / frame.inertia_m2, Velocity(vx, vy, spin), CONVERGED * g * h
    )
    # what pushes touches; two corners on the base that were not there before are its whole fall
    touch = on_base = 0
    hardest = 0.0
    for k in range(active):
        i = int(work.pair[k])
        if work.across[i] > 0.0:
            touch |= int(corners.bit[i])
            if corners.bit[i] != ON_BACK:
                on_base += 1
                hardest = max(hardest, work.approach[k])
    if on_base > 1 and hardest > LANDING_M_S:
        touch |= LANDS
    return Motion(at.x + h * vx, at.y + h * vy, at.turned + h * spin, vx, vy, spin), touch


class Loads(NamedTuple):
    """Range of k_h/(1 + k_v) within which a block at rest stays at rest."""

    low: float
    high: float


UNKNOWN = Loads(math.inf, -math.inf)
"""Of a block whose rest has not been looked at."""


@inner_kernel
def rests(
    corners: Corners,
    frame: Frame,
    at: Motion,
    h: float,
    a: float,
    w: float,
    loads: Loads,
    work: ContactArrays,
) -> tuple[bool, Loads]:
    """Return whether a block at rest stays at rest under two accelerations [g], and the range of
    loads so far.
    """
    q = a / w
    # the loads that contacts with friction bear are a convex cone: one between two that they bear
    if loads.low <= q <= loads.high:
        return True, loads
    after, _ = one_step(corners, frame, at, h, a, w, work)
    return at_standstill(after, frame, h), Loads(min(loads.low, q), max(loads.high, q))


@inner_kernel
def at_standstill(at: Motion, frame: Frame, h: float) -> bool:
    """Return whether the velocities are zero to rounding."""
    least = STANDSTILL * STANDARD_GRAVITY_M_S2 * h
    turning = abs(at.spin) * math.sqrt(frame.inertia_m2)
    return abs(at.vx) <= least and abs(at.vy) <= least and turning <= least


@within
def append_state(history: FloatArray, filled: int, now: float, at: Motion, touch: int) -> int:
    """Append one column to a history that is not full; return the number of filled columns."""
    if filled >= history.shape[1]:
        return filled
    history[0, filled] = now
    history[1, filled], history[2, filled], history[3, filled] = at.x, at.y, at.turned
    history[4, filled], history[5, filled], history[6, filled] = at.vx, at.vy, at.spin
    history[7, filled] = touch
    return filled + 1


@within
def stop_of(frame: Frame, at: Motion) -> int:
    """Return the reason why a run ends after a step, or that it goes on."""
    if at.turned >= frame.backward_rad:
        return BACKWARD
    return FORWARD if at.turned <= -frame.forward_rad else GOES_ON


@bare_kernel
def run_free(
    record: Nodes,
    corners: Corners,
    frame: Frame,
    start_s: float,
    at: Motion,
    h: float,
    work: ContactArrays,
    history: FloatArray,
) -> FreeRun:
    """Run a block from a time of the record until it comes to rest for good.

    Args:
        record: the excitation; a time may repeat.
        corners: pairs of corner and plane.
        frame: the block on its slope.
        start_s: where in the record the run begins [s].
        h: greatest step [s].
        work: what the steps write to.
        history: shape (8, k) for what is kept; (8, 0) for nothing.
    """
    time_s, k_h, w, last = record.time_s, record.k_h, record.w, record.last
    node = 0
    while node < last and time_s[node + 1] <= start_s:
        node += 1
    # Invariant of the loop: `at` is the motion at time `now`, inside the interval after `node`.
    # Steps end at the nodes, so that none crosses a kink of the record. At rest a step
    # is taken only for a load outside the range seen so far: the loads that the contacts can
    # carry form a convex cone, hence an interval of q = k_h/(1 + k_v), and q is monotone between
    # nodes
    now, steps, filled = start_s, 0, 0
    stopped_s, moved_s, landed_s = start_s, math.nan, math.nan
    resting = at_standstill(at, frame, h)
    end_s = time_s[-1]
    since_kept = 0
    loads = UNKNOWN
    while True:
        past_record = node >= last
        if past_record and last < time_s.size - 1:  # 1 + k_v <= 0 at the next node
            return FreeRun(JUMPED, now, at, steps, filled, moved_s, landed_s)
        if past_record and now > end_s + FREE_MOST_S:
            return FreeRun(ENDLESS, now, at, steps, filled, moved_s, landed_s)
        a0 = a1 = 0.0
        w0 = w1 = 1.0
        length = FREE_STEP_S
        begin = now
        if not past_record:
            begin, length = time_s[node], time_s[node + 1] - time_s[node]
            a0, a1, w0, w1 = k_h[node], k_h[node + 1], w[node], w[node + 1]
            if length <= 0.0 or now >= time_s[node + 1]:
                node += 1
                continue
        if resting:
            part = (now - begin) / length
            a, w_now = a0 + part * (a1 - a0), w0 + part * (w1 - w0)
            stays, loads = rests(corners, frame, at, h, a, w_now, loads, work)
            if stays and past_record:
                return FreeRun(AT_REST, stopped_s, at, steps, filled, moved_s, landed_s)
            if stays:
                # k_h/(1 + k_v) is monotone in the interval: rest at both ends is rest between
                stays, loads = rests(corners, frame, at, h, a1, w1, loads, work)
            if stays:
                node += 1
                now = time_s[node]
                continue
        loads = UNKNOWN
        parts = max(1, math.ceil((begin + length - now) / h - 1e-9))
        size = (begin + length - now) / parts
        first = now
        for n in range(parts):
            middle = (first + (n + 0.5) * size - begin) / length
            at, touch = one_step(
                corners, frame, at, size, a0 + middle * (a1 - a0), w0 + middle * (w1 - w0), work
            )
            steps += 1
            since_kept += 1
            was = resting
            resting = at_standstill(at, frame, size)
            now = first + (n + 1) * size
            if resting:
                at = Motion(at.x, at.y, at.turned, 0.0, 0.0, 0.0)
                if not was:
                    stopped_s = now
            elif math.isnan(moved_s):
                moved_s = now - size
            if touch & LANDS and math.isnan(landed_s):
                landed_s = now
            # standstills and starts, and the end of every interval, whatever is due
            if since_kept >= KEEP or resting != was or n == parts - 1:
                filled = append_state(history, filled, now, at, touch)
                since_kept = 0
            stop = stop_of(frame, at)
            if stop != GOES_ON:
                return FreeRun(stop, now, at, steps, filled, moved_s, landed_s)
        if not past_record:
            node += 1
            now = time_s[node]
