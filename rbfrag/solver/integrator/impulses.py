"""Contact impulses of corners on planes within one time step.

Each corner that ends a step on its plane pushes, without rebound and with Coulomb friction
(Moreau 1988; Stewart and Trinkle 1996). Gauss-Seidel sweeps from zero find which of them push,
which stick and which slip, in a few sweeps; those known, the impulses are the solution of at most
three linear equations, one for each degree of freedom. Sweeps go on where that solution breaks
Coulomb's law, or where the equations do not decide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rbfrag.solver.integrator.compiled import inner_kernel
from rbfrag.solver.results import FloatArray

SWEEPS_MAX = 400
"""Gauss-Seidel sweeps of one step. All are taken only where friction at two corners is about to
stop a block between its planes (`_of_two`)."""

CONVERGED = 1e-10
"""Change of velocity in a sweep, over that by gravity in a step, at which they have converged."""

SINGULAR = 1e-9
"""Pivot at which the linear equations are taken not to decide."""

LANDING_M_S = 1e-3
"""Speed of a corner from which its impact counts as one."""

UNKNOWNS_MOST = 3
"""Impulses that are unknown at most: as many as there are degrees of freedom."""

OPEN, DOWN, UP, STUCK = range(4)
"""What a corner does: it does not push; it pushes and slips up or down its plane, so that
friction is down or up it; it pushes and sticks."""

_WAYS = 8
"""Ways for two corners to push: each slips down or up its plane or sticks, but not both stick."""


class Corners(NamedTuple):
    """Pairs of corner and plane that may touch; all arrays have shape (m,).

    Args:
        arm_x: from the centroid to the corner, block not turned, along the base [m].
        arm_y: the same normal to the base [m].
        normal_x: unit normal of the plane, into the block.
        normal_y: the other component.
        off_m: distance of the plane from the origin along its normal [m].
        friction: tangent of its friction angle.
        bit: what it means where they touch, as `rbfrag.solver.integrator.free_body` names it.
    """

    arm_x: FloatArray
    arm_y: FloatArray
    normal_x: FloatArray
    normal_y: FloatArray
    off_m: FloatArray
    friction: FloatArray
    bit: FloatArray


class ContactArrays(NamedTuple):
    """Work arrays of a step.

    Args:
        across: impulse of each pair along the normal of its plane, per mass [m/s], shape (m,).
        along: the same down the plane, along (n_y, -n_x), shape (m,).
        pair: places of the pairs that may touch within the step, shape (m,).
        moment_n: moment of a unit impulse along the normal about the centroid [m], of each of
            them, shape (m,).
        moment_t: the same of one down the plane, shape (m,).
        per_n: impulse along the normal that gives its corner unit speed along it, per mass,
            shape (m,).
        per_t: the same along the plane, shape (m,).
        least: speed from the plane that each must have at the end of the step [m/s], shape (m,).
        approach: speed towards it before the step [m/s], shape (m,).
        friction: tangent of the friction angle that holds for each in this step, shape (m,).
        does: what each does: `OPEN`, `DOWN`, `UP` or `STUCK`, shape (m,).
        equations: coefficients and right sides of the linear equations, shape (3, 4).
        columns: velocity and spin that the unknown impulses of them give, shape (3, 3).
    """

    across: FloatArray
    along: FloatArray
    pair: FloatArray
    moment_n: FloatArray
    moment_t: FloatArray
    per_n: FloatArray
    per_t: FloatArray
    least: FloatArray
    approach: FloatArray
    friction: FloatArray
    does: FloatArray
    equations: FloatArray
    columns: FloatArray


def work_of(corners: Corners) -> ContactArrays:
    """Return the work arrays of a run."""
    m = corners.arm_x.size
    shapes = [*11 * [(m,)], (3, 4), (3, 3)]
    return ContactArrays(*[np.zeros(shape) for shape in shapes])


class Velocity(NamedTuple):
    """Velocity of the centroid [m/s] and spin [rad/s]."""

    vx: float
    vy: float
    spin: float


@inner_kernel
def after_impulses(
    corners: Corners,
    work: ContactArrays,
    active: int,
    per_inertia: float,
    v_free: Velocity,
    tolerance: float,
) -> Velocity:
    """Return the velocity at the end of a step; the impulses are left in the work arrays.

    Args:
        corners: pairs of corner and plane.
        work: what is known of those that may touch; `across` and `along` are zero.
        active: how many may touch.
        per_inertia: mass over moment of inertia about the centroid [1/m²].
        v_free: velocity without impulses.
        tolerance: change of velocity in a sweep at which the impulses have converged [m/s].
    """
    # Per mass, impulses P_n and P_t at a corner change v by P_n n + P_t t and the spin by
    # (P_n M_n + P_t M_t)/(I_C/m), M_n and M_t their moments about the centroid. Conditions:
    #     P_n >= 0,  n·v - least >= 0,  P_n (n·v - least) = 0       (it pushes or it is open)
    #     |P_t| <= friction P_n,  with equality and opposed to the slip where it slips
    # Gauss-Seidel meets these conditions at one corner after the other, with v kept up to date
    if active == 1:
        decided, velocity = _of_one(corners, work, per_inertia, v_free)
        if decided:
            return velocity
    vx, vy, spin = v_free
    across, along = work.across, work.along
    for k in range(active):
        work.does[k] = -1.0
        work.per_n[k] = 1.0 / (1.0 + work.moment_n[k] ** 2 * per_inertia)
        work.per_t[k] = 1.0 / (1.0 + work.moment_t[k] ** 2 * per_inertia)
    tried = False
    for _ in range(SWEEPS_MAX):
        change = 0.0
        same = True
        for k in range(active):
            i = int(work.pair[k])
            nx, ny = corners.normal_x[i], corners.normal_y[i]
            mn, mt = work.moment_n[k], work.moment_t[k]
            # what this corner lacks of the least speed from its plane, as if it were alone
            speed = vx * nx + vy * ny + spin * mn
            push = max(across[i] - (speed - work.least[k]) * work.per_n[k], 0.0)
            part = push - across[i]
            across[i] = push
            vx += part * nx
            vy += part * ny
            spin += part * mn * per_inertia
            change = max(change, abs(part))
            # and what stops it along its plane, as far as Coulomb's law lets it
            speed = vx * ny - vy * nx + spin * mt
            limit = work.friction[k] * push
            grip = min(max(along[i] - speed * work.per_t[k], -limit), limit)
            part = grip - along[i]
            along[i] = grip
            vx += part * ny
            vy -= part * nx
            spin += part * mt * per_inertia
            change = max(change, abs(part))
            does = float(OPEN)
            if push > 0.0:
                does = float(DOWN if grip >= limit else UP if grip <= -limit else STUCK)
            same = same and does == work.does[k]
            work.does[k] = does
        if change <= tolerance:
            break
        # two sweeps agree on what each corner does: tried once for each such state
        tried = tried and same
        if same and not tried:
            tried = True
            decided, velocity = _solved(corners, work, active, per_inertia, v_free, tolerance)
            if decided:
                return velocity
    else:
        decided, velocity = _of_two(corners, work, active, per_inertia, v_free, tolerance)
        if decided:
            return velocity
    return Velocity(vx, vy, spin)


@inner_kernel
def _of_one(
    corners: Corners, work: ContactArrays, per_inertia: float, v_free: Velocity
) -> tuple[bool, Velocity]:
    """Solve for the impulse of the only corner that may touch.

    Returns:
        Whether there is one solution; and the velocity.
    """
    i = int(work.pair[0])
    nx, ny, friction = corners.normal_x[i], corners.normal_y[i], work.friction[0]
    mn, mt = work.moment_n[0], work.moment_t[0]
    # speed of the corner along and across its normal that unit impulses of both kinds give
    nn, nt = 1.0 + mn * mn * per_inertia, mn * mt * per_inertia
    tt = 1.0 + mt * mt * per_inertia
    # friction would drive the corner into its plane as fast as the push lifts it (Painlevé)
    if nn - friction * abs(nt) <= SINGULAR:
        return False, v_free
    off = work.least[0] - (v_free.vx * nx + v_free.vy * ny + v_free.spin * mn)
    if off <= 0.0:  # it parts from its plane by itself
        return True, v_free
    slips = v_free.vx * ny - v_free.vy * nx + v_free.spin * mt
    # it sticks if Coulomb's law allows: both speeds are those that are asked for
    push = (off * tt + slips * nt) / (nn * tt - nt * nt)
    grip = -(slips + nt * push) / tt
    if not abs(grip) <= friction * push:
        # it slips up its plane, friction down it; or the other way round
        push = off / (nn + friction * nt)
        grip = friction * push
        if slips + nt * push + tt * grip > 0.0:
            push = off / (nn - friction * nt)
            grip = -friction * push
    work.across[i], work.along[i] = push, grip
    return True, Velocity(
        v_free.vx + push * nx + grip * ny,
        v_free.vy + push * ny - grip * nx,
        v_free.spin + (push * mn + grip * mt) * per_inertia,
    )


@inner_kernel
def _of_two(
    corners: Corners,
    work: ContactArrays,
    active: int,
    per_inertia: float,
    v_free: Velocity,
    tolerance: float,
) -> tuple[bool, Velocity]:
    """Solve for the impulses of two corners in contact by trying all combinations of stick and
    slip.

    Where friction at both is about to stop the block between its planes, sweeps come ever closer to
    what the corners do, ever more slowly, and name it wrongly until then. That both stick is not
    tried: four impulses that bring three speeds to zero lie on a straight line, and Coulomb's law
    holds on a part of it, at whose ends one corner's friction is at its limit.

    Returns:
        Whether Coulomb's law holds for one of the ways; and the velocity.
    """
    # each combination of states turns Coulomb's law into equalities, that is linear equations;
    # its inequalities then tell whether the combination was the right one
    first = second = -1
    for k in range(active):
        if work.does[k] == OPEN:
            continue
        if work.approach[k] > LANDING_M_S and work.least[k] > 0.0:  # it rebounds
            return False, v_free
        if first < 0:
            first = k
        elif second < 0:
            second = k
        else:
            return False, v_free
    if second < 0:
        return False, v_free
    for way in range(2 * _WAYS):
        if way == _WAYS:
            # no velocity lets two corners that stick out of their planes: they stay there
            work.least[first] = min(work.least[first], 0.0)
            work.least[second] = min(work.least[second], 0.0)
        # DOWN, UP and STUCK of both in turn, without STUCK twice
        work.does[first], work.does[second] = 1 + way % _WAYS // 3, 1 + way % _WAYS % 3
        decided, velocity = _solved(corners, work, active, per_inertia, v_free, tolerance)
        if decided:
            return True, velocity
    return False, v_free


@inner_kernel
def _solved(
    corners: Corners,
    work: ContactArrays,
    active: int,
    per_inertia: float,
    v_free: Velocity,
    slack: float,
) -> tuple[bool, Velocity]:
    """Solve for the impulses of corners whose states of contact are given.

    Args:
        slack: slip with its friction that is rounding [m/s].

    Returns:
        Whether there is one solution, which keeps to Coulomb's law; and the velocity.
    """
    n = _fill_columns(corners, work, active, per_inertia)
    if n > UNKNOWNS_MOST:
        return False, v_free
    _fill_equations(corners, work, active, n, v_free)
    if not _eliminated(work.equations, n):
        return False, v_free
    velocity = _substituted(work, n, v_free)
    if not _keeps_coulomb(corners, work, active, velocity, slack):
        return False, v_free
    _put_impulses(work, active)
    return True, velocity


@inner_kernel
def _fill_columns(corners: Corners, work: ContactArrays, active: int, per_inertia: float) -> int:
    """Fill the velocity that each unknown impulse gives; return their number, 4 for too many."""
    columns = work.columns
    n = 0
    for k in range(active):
        if work.does[k] == OPEN:
            continue
        i = int(work.pair[k])
        nx, ny = corners.normal_x[i], corners.normal_y[i]
        mn, mt = work.moment_n[k], work.moment_t[k]
        stuck = work.does[k] == STUCK
        if n + (2 if stuck else 1) > UNKNOWNS_MOST:
            return UNKNOWNS_MOST + 1
        # a slipping corner pushes along its normal and rubs along its plane in one proportion
        rubs = 0.0
        if not stuck:
            rubs = work.friction[k] if work.does[k] == DOWN else -work.friction[k]
        columns[n, 0] = nx + rubs * ny
        columns[n, 1] = ny - rubs * nx
        columns[n, 2] = (mn + rubs * mt) * per_inertia
        n += 1
        if stuck:  # its friction is an unknown of its own
            columns[n, 0], columns[n, 1], columns[n, 2] = ny, -nx, mt * per_inertia
            n += 1
    return n


@inner_kernel
def _fill_equations(
    corners: Corners, work: ContactArrays, active: int, n: int, v_free: Velocity
) -> None:
    """Fill one equation for each unknown: the speed of its corner at the end of the step."""
    equations, columns = work.equations, work.columns
    row = 0
    for k in range(active):
        if work.does[k] == OPEN:
            continue
        i = int(work.pair[k])
        nx, ny = corners.normal_x[i], corners.normal_y[i]
        mn, mt = work.moment_n[k], work.moment_t[k]
        # across the plane the least that is permitted
        for j in range(n):
            equations[row, j] = columns[j, 0] * nx + columns[j, 1] * ny + columns[j, 2] * mn
        equations[row, 3] = work.least[k] - (v_free.vx * nx + v_free.vy * ny + v_free.spin * mn)
        row += 1
        if work.does[k] == STUCK:  # along it none
            for j in range(n):
                equations[row, j] = columns[j, 0] * ny - columns[j, 1] * nx + columns[j, 2] * mt
            equations[row, 3] = -(v_free.vx * ny - v_free.vy * nx + v_free.spin * mt)
            row += 1


@inner_kernel
def _eliminated(equations: FloatArray, n: int) -> bool:
    """Bring n equations to triangular form; False where they do not decide."""
    for j in range(n):
        # without friction they are symmetric and definite: pivots stay on the diagonal
        if not equations[j, j] > SINGULAR:
            return False
        for row in range(j + 1, n):
            factor = equations[row, j] / equations[j, j]
            for c in range(j + 1, n):
                equations[row, c] -= factor * equations[j, c]
            equations[row, 3] -= factor * equations[j, 3]
    return True


@inner_kernel
def _substituted(work: ContactArrays, n: int, v_free: Velocity) -> Velocity:
    """Solve triangular equations, in place of their right sides; return the velocity."""
    equations, columns = work.equations, work.columns
    vx, vy, spin = v_free
    for j in range(n - 1, -1, -1):
        impulse = equations[j, 3]
        for c in range(j + 1, n):
            impulse -= equations[j, c] * equations[c, 3]
        impulse /= equations[j, j]
        equations[j, 3] = impulse
        vx += impulse * columns[j, 0]
        vy += impulse * columns[j, 1]
        spin += impulse * columns[j, 2]
    return Velocity(vx, vy, spin)


@inner_kernel
def _keeps_coulomb(
    corners: Corners, work: ContactArrays, active: int, velocity: Velocity, slack: float
) -> bool:
    """Return whether impulses and velocity satisfy Coulomb's law at each corner in its assumed
    state.
    """
    vx, vy, spin = velocity
    row = 0
    for k in range(active):
        i = int(work.pair[k])
        nx, ny = corners.normal_x[i], corners.normal_y[i]
        does = work.does[k]
        if does == OPEN:
            # not pushed, it must not go below its plane
            if vx * nx + vy * ny + spin * work.moment_n[k] < work.least[k]:
                return False
            continue
        push = work.equations[row, 3]
        if push <= 0.0:  # planes do not pull
            return False
        if does == STUCK:
            if abs(work.equations[row + 1, 3]) > work.friction[k] * push:
                return False
        else:
            # friction opposes the slip
            slips = vx * ny - vy * nx + spin * work.moment_t[k]
            if slips > slack if does == DOWN else slips < -slack:
                return False
        row += 2 if does == STUCK else 1
    return True


@inner_kernel
def _put_impulses(work: ContactArrays, active: int) -> None:
    """Replace the impulses of the sweeps by the solution."""
    row = 0
    for k in range(active):
        i = int(work.pair[k])
        does = work.does[k]
        work.across[i] = work.along[i] = 0.0
        if does == OPEN:
            continue
        push = work.across[i] = work.equations[row, 3]
        if does == STUCK:
            row += 1
            work.along[i] = work.equations[row, 3]
        else:
            work.along[i] = work.friction[k] * (push if does == DOWN else -push)
        row += 1
