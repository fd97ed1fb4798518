"""An independent simulation of a block on two planes: a free body, and springs as contacts.

It knows nothing of mechanisms or modes. The block is a free rigid body; where a corner has
entered a plane, a stiff spring and a dashpot push it out, and a second spring along the plane
holds it until Coulomb's limit. It shares no code with rbfrag. The stiffer the springs, the nearer
it comes to rigid contact: its rotation lags by the compression of the springs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from rbfrag.solver.block.geometry import Block

FloatArray = NDArray[np.float64]

STIFFNESS = 2e8
"""Of each contact, per mass [1/s²]."""

DAMPING = 0.1
"""Part of critical damping of a contact's spring."""

STEP_S = 2e-6

SETTLE_S = 0.3

GRAVITY = 9.80665


@dataclass(frozen=True)
class Simulated:
    """Motion of the free block after it had settled under gravity.

    Args:
        time_s: times [s].
        turned_rad: counter-clockwise rotation since it settled [rad].
        heel_m: displacement of the heel down the base since then [m].
        toe_m: the same of the toe.
    """

    time_s: FloatArray
    turned_rad: FloatArray
    heel_m: FloatArray
    toe_m: FloatArray


def simulate(
    block: Block,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float,
    time_s: ArrayLike,
    k_h: ArrayLike,
    k_v: ArrayLike | None = None,
    until_s: float,
    keep: int = 250,
    stiffness: float = STIFFNESS,
    step_s: float = STEP_S,
    damping: float = DAMPING,
) -> Simulated:
    """Shake a block that has settled under gravity.

    Args:
        block: the block.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg].
        time_s: nodes of the motion [s]; a repeated time is a jump.
        k_h: driving acceleration at the nodes [g].
        k_v: vertical acceleration at the nodes [g].
        until_s: end of the simulation [s].
        keep: steps between states that are kept.
        stiffness: of a contact, per mass [1/s²].
        step_s: step of the integration [s].
        damping: of a contact, part of critical damping: 0.1 rebounds with 0.7 of the speed, 1 with
            a twentieth.
    """
    nodes = np.asarray(time_s, dtype=np.float64)
    horizontal = np.asarray(k_h, dtype=np.float64)
    vertical = np.zeros_like(horizontal) if k_v is None else np.asarray(k_v, dtype=np.float64)
    corners = np.array([block.heel, block.toe, block.back])
    retained = _shake(
        corners,
        block.inertia_m2,
        np.array(block.centroid),
        math.radians(block.gamma_deg),
        math.radians(beta_deg),
        math.tan(math.radians(phi_deg)),
        math.tan(math.radians(phi_back_deg)),
        nodes,
        horizontal,
        1.0 + vertical,
        until_s,
        stiffness,
        step_s,
        keep,
        damping,
    )
    return Simulated(retained[0], retained[1], retained[2], retained[3])


@njit(cache=True, error_model="numpy")
def _shake(
    corners: FloatArray,
    inertia: float,
    start: FloatArray,
    gamma: float,
    beta: float,
    mu_base: float,
    mu_back: float,
    nodes: FloatArray,
    k_h: FloatArray,
    w: FloatArray,
    until_s: float,
    stiffness: float,
    dt: float,
    keep: int,
    damping: float,
) -> FloatArray:
    settle = int(SETTLE_S / dt)
    steps = int(until_s / dt)
    retained = np.empty((4, steps // keep + 1))
    # which corner against which plane: heel and toe on the base, heel and back on the back plane
    corner = np.array([0, 1, 0, 2])
    normal_x = np.array([0.0, 0.0, math.sin(gamma), math.sin(gamma)])
    normal_y = np.array([1.0, 1.0, math.cos(gamma), math.cos(gamma)])
    mu = np.array([mu_base, mu_base, mu_back, mu_back])
    held = np.zeros(4)  # stretch of the springs along the planes
    dashpot = 2.0 * damping * math.sqrt(stiffness)
    x, y, turned = start[0], start[1], 0.0
    vx, vy, spin = 0.0, 0.0, 0.0
    turned0 = heel0 = toe0 = 0.0
    node = 0
    for n in range(-settle, steps + 1):
        t = n * dt
        a, weight = 0.0, 1.0
        if n >= 0:
            while node < nodes.size - 1 and nodes[node + 1] <= t:
                node += 1
            if node < nodes.size - 1:
                part = (t - nodes[node]) / (nodes[node + 1] - nodes[node])
                a = k_h[node] + part * (k_h[node + 1] - k_h[node])
                weight = w[node] + part * (w[node + 1] - w[node])
        force_x = GRAVITY * (weight * math.sin(beta) + a * math.cos(beta))
        force_y = GRAVITY * (-weight * math.cos(beta) + a * math.sin(beta))
        moment = 0.0
        c, s = math.cos(turned), math.sin(turned)
        for i in range(4):
            arm_x = corners[corner[i], 0] * c - corners[corner[i], 1] * s
            arm_y = corners[corner[i], 0] * s + corners[corner[i], 1] * c
            nx, ny = normal_x[i], normal_y[i]
            depth = -((x + arm_x) * nx + (y + arm_y) * ny)
            if depth <= 0.0:
                held[i] = 0.0
                continue
            px, py = vx - spin * arm_y, vy + spin * arm_x
            press = stiffness * depth - dashpot * (px * nx + py * ny)
            if press <= 0.0:
                held[i] = 0.0
                continue
            along = px * ny - py * nx  # along (n_y, -n_x), down the base
            held[i] += along * dt
            grip = -stiffness * held[i] - dashpot * along
            limit = mu[i] * press
            if abs(grip) > limit:
                grip = limit if grip > 0.0 else -limit
                held[i] = -grip / stiffness
            fx = press * nx + grip * ny
            fy = press * ny - grip * nx
            force_x += fx
            force_y += fy
            moment += arm_x * fy - arm_y * fx
        vx += force_x * dt
        vy += force_y * dt
        spin += moment / inertia * dt
        if n < 0:
            # settling is slowed down so that no corner bounces
            vx *= 0.99
            vy *= 0.99
            spin *= 0.99
        x += vx * dt
        y += vy * dt
        turned += spin * dt
        if n == -1:
            vx = vy = spin = 0.0
            turned0 = turned
            heel0 = x + corners[0, 0] * math.cos(turned) - corners[0, 1] * math.sin(turned)
            toe0 = x + corners[1, 0] * math.cos(turned) - corners[1, 1] * math.sin(turned)
        if n >= 0 and n % keep == 0:
            m = n // keep
            retained[0, m] = t
            retained[1, m] = turned - turned0
            heel = x + corners[0, 0] * math.cos(turned) - corners[0, 1] * math.sin(turned)
            toe = x + corners[1, 0] * math.cos(turned) - corners[1, 1] * math.sin(turned)
            retained[2, m] = heel - heel0
            retained[3, m] = toe - toe0
    return retained


RAMP_G_PER_S = 0.5
"""Rate of the ramp; a block with any yield is then some hundredths of a second behind it."""

NARROW = 0.4
"""Base over r3 below which springs are as stiff as elsewhere."""


def yield_on_ramp(
    block: Block, *, beta_deg: float, phi_deg: float, most_g: float = 2.5
) -> float | None:
    """Return the k_h at which a block that has settled starts to move on a slow ramp [g].

    A block that starts to move at t0 has gone as (t - t0)³ soon after, because the acceleration in
    excess of its yield grows with time: from the times t1, at a ten-thousandth of r3, and t2, at
    eight times that, t0 is 2 t1 - t2. A tenth of the usual stiffness suffices but for bases so
    narrow that the give of their springs turns the block by as much.

    Args:
        block: the block.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of both planes [deg].
        most_g: end of the ramp [g].

    Returns:
        k_h; below zero for a block that has not come to rest; None where it has not moved at the
        end of the ramp.
    """
    until_s = most_g / RAMP_G_PER_S
    soft = 1.0 if block.base_m < NARROW * block.r3_m else 0.1
    moved = simulate(
        block, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_deg, time_s=[0.0, until_s],
        k_h=[0.0, most_g], until_s=until_s, keep=50, stiffness=soft * STIFFNESS,
        step_s=STEP_S / math.sqrt(soft),
    )  # fmt: skip
    gone = np.maximum(abs(moved.turned_rad), np.maximum(abs(moved.heel_m), abs(moved.toe_m))
                      / block.r3_m)  # fmt: skip
    times = []
    for least in (1e-4, 8e-4):
        beyond = np.flatnonzero(gone > least)
        if not beyond.size:
            return None
        i = beyond[0]
        if i == 0:
            return -np.inf
        part = (least - gone[i - 1]) / (gone[i] - gone[i - 1])
        times.append(moved.time_s[i - 1] + part * (moved.time_s[i] - moved.time_s[i - 1]))
    return float(RAMP_G_PER_S * (2.0 * times[0] - times[1]))
