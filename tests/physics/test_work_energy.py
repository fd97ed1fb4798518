"""Work and energy: what the ground and gravity put in is what friction and motion take out.

Forces and accelerations are solved for anew here, from the equilibrium of a free body with
two sliding contacts. Between the nodes of a run the motion is interpolated by quintics through
position, rate and acceleration, on a record that is sampled finely enough for 1e-9.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2 as G
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.one_freedom.equation import Mechanism
from rbfrag.solver.integrator.one_freedom.follow import follow
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.models import confined_toppling, sliding, slumping
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome
from tests.on_planes import on_planes

FloatArray = NDArray[np.float64]

# (x, rate, k_h, w, sense) -> acceleration, kinetic energy, power of gravity and ground, of friction
Laws = Callable[
    [FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
    tuple[FloatArray, FloatArray, FloatArray, FloatArray],
]


def shaking(seed: int, amplitude_g: float, vertical_g: float) -> Excitation:
    """Smooth random shaking of 3 s in both directions, sampled at 0.5 ms."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 3.0, 6001)
    parts = []
    for _ in range(2):
        waves = [
            rng.normal() * np.sin(2.0 * np.pi * f * time + rng.uniform(0.0, 6.0))
            for f in (0.7, 1.1, 2.3, 3.7)
        ]
        wave = np.sum(waves, axis=0) * np.sin(np.pi * time / 3.0)
        parts.append(wave / np.abs(wave).max())
    return Excitation(
        time_s=time,
        interval_s=np.diff(time),
        k_h=amplitude_g * parts[0],
        w=1.0 + vertical_g * parts[1],
        pga_g=amplitude_g,
    )


def two_contacts(
    block: Block,
    site: SupportedBlock,
    *,
    clockwise: bool,
    base: tuple[float, float],
    back: tuple[float, float],
) -> Laws:
    """A block that slides on a base contact and a back contact (from the centroid, at rest)."""
    gamma, beta = math.radians(block.gamma_deg), site.beta_rad
    up = np.array([-math.cos(gamma), math.sin(gamma)])  # along the back plane
    normal = np.array([math.sin(gamma), math.cos(gamma)])
    turn = -1.0 if clockwise else 1.0

    def at(x: FloatArray, arm: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
        c, s = np.cos(turn * x), np.sin(turn * x)
        return arm[0] * c - arm[1] * s, arm[0] * s + arm[1] * c

    def laws(
        x: FloatArray, rate: FloatArray, k: FloatArray, w: FloatArray, sense: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        ax, ay = at(x, base)
        bx, by = at(x, back)
        # speed of the base contact along x per rate, so that the back contact keeps to its plane:
        # normal . (slip, 0) + normal . d(b - a) = 0
        dx, dy = -turn * (by - ay), turn * (bx - ax)
        slip = -(normal[0] * dx + normal[1] * dy) / normal[0]
        slip_rate = turn**2 * (normal[0] * (bx - ax) + normal[1] * (by - ay)) / normal[0]
        cx, cy = slip + turn * ay, -turn * ax  # C' = (slip, 0) - d(arm)
        ddx, ddy = slip_rate + ax, ay  # C''
        back_x, back_y = slip + dx, dy  # velocity of the back contact per rate
        along = back_x * up[0] + back_y * up[1]
        mu1, mu2 = math.tan(site.phi_rad), math.tan(site.phi_back_rad)
        # friction opposes the slip of each contact
        u1 = np.stack([-mu1 * np.sign(slip * sense), np.ones_like(x)])
        grip = -mu2 * np.sign(along * sense)
        u2 = np.stack([normal[0] + grip * up[0], normal[1] + grip * up[1]])
        gx = w * math.sin(beta) + k * math.cos(beta)
        gy = -w * math.cos(beta) + k * math.sin(beta)
        matrix = np.empty((x.size, 3, 3))
        matrix[:, 0] = np.stack([u1[0], u2[0], -cx], axis=1)
        matrix[:, 1] = np.stack([u1[1], u2[1], -cy], axis=1)
        matrix[:, 2] = np.stack(
            [
                ax * u1[1] - ay * u1[0],
                bx * u2[1] - by * u2[0],
                np.full_like(x, -turn * block.inertia_m2),
            ],
            axis=1,
        )
        right = np.stack([ddx * rate**2 - G * gx, ddy * rate**2 - G * gy, 0.0 * x], axis=1)
        n1, n2, acceleration = np.linalg.solve(matrix, right[:, :, None])[:, :, 0].T
        kinetic = 0.5 * (cx**2 + cy**2 + block.inertia_m2) * rate**2
        load = G * (gx * cx + gy * cy) * rate
        friction = n1 * u1[0] * slip * rate + n2 * grip * along * rate
        assert np.all(n1 > 0.0)
        assert np.all(n2 > 0.0)
        return acceleration, kinetic, load, friction

    return laws


def slide_laws(site: SupportedBlock) -> Laws:
    beta, mu = site.beta_rad, math.tan(site.phi_rad)

    def laws(
        x: FloatArray, rate: FloatArray, k: FloatArray, w: FloatArray, sense: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        load = G * (w * math.sin(beta) + k * math.cos(beta))
        press = G * (w * math.cos(beta) - k * math.sin(beta))
        friction = -mu * press * sense
        return load + friction, 0.5 * rate**2, load * rate, friction * rate

    return laws


def quintic(
    p0: FloatArray, p1: FloatArray, v0: FloatArray, v1: FloatArray, b0: FloatArray, b1: FloatArray
) -> tuple[FloatArray, ...]:
    """Coefficients of the polynomial on 0..1 with these positions, rates and accelerations."""
    return (
        p0,
        v0,
        0.5 * b0,
        10 * (p1 - p0) - 6 * v0 - 4 * v1 - 1.5 * b0 + 0.5 * b1,
        -15 * (p1 - p0) + 8 * v0 + 7 * v1 + 1.5 * b0 - b1,
        6 * (p1 - p0) - 3 * (v0 + v1) - 0.5 * (b0 - b1),
    )


SLUMP_BLOCK = Block.from_angles(45, 70, 1.5)
SLUMP = on_planes(SLUMP_BLOCK, 6, 33, 28, two_way=True)
WEDGE_BLOCK = Block.from_angles(-60, 20, 1.0)
WEDGE = on_planes(WEDGE_BLOCK, 12, 35, 33, two_way=True)
SLIDE = on_planes(Block.from_angles(-20, 60, 1.0), 15, 30, 30, two_way=True)

CASES: dict[str, tuple[Mechanism, Laws, Excitation]] = {
    "sliding": (sliding.MODEL.mechanism(SLIDE), slide_laws(SLIDE), shaking(1, 0.6, 0.3)),
    "slumping": (
        slumping.MODEL.mechanism(SLUMP),
        two_contacts(
            SLUMP_BLOCK, SLUMP, clockwise=False, base=SLUMP_BLOCK.heel, back=SLUMP_BLOCK.back
        ),
        shaking(2, 1.0, 0.3),
    ),
    "confined toppling": (
        confined_toppling.MODEL.mechanism(WEDGE),
        two_contacts(
            WEDGE_BLOCK, WEDGE, clockwise=True, base=WEDGE_BLOCK.toe, back=WEDGE_BLOCK.heel
        ),
        shaking(3, 0.8, 0.2),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_work_balances_energy(name: str) -> None:
    mechanism, laws, excited = CASES[name]
    run = follow(mechanism, excited, history=True)
    assert run.started_s is not None
    travel = run.history
    assert travel is not None
    local = np.ones(travel.time_s.size, dtype=bool)
    if run.changes:
        # up to the first standstill, after which the block rocks about its toe
        local = travel.time_s <= run.changes[0].time_s
    else:
        assert run.outcome is Outcome.STABLE
    time, x, rate = travel.time_s[local], travel.x[local], travel.rate[local]
    h = np.diff(time)
    moving = (h > 0.0) & (np.diff(x) != 0.0)
    assert moving.sum() > 200

    start, end = np.flatnonzero(moving), np.flatnonzero(moving) + 1
    h = h[moving]
    sense = np.sign(x[end] - x[start])
    k0, k1 = (np.interp(time[i], excited.time_s, excited.k_h) for i in (start, end))
    w0, w1 = (np.interp(time[i], excited.time_s, excited.w) for i in (start, end))
    a0, e0, *_ = laws(x[start], rate[start], k0, w0, sense)
    a1, e1, *_ = laws(x[end], rate[end], k1, w1, sense)

    c = quintic(x[start], x[end], h * rate[start], h * rate[end], h**2 * a0, h**2 * a1)
    put_in = taken_out = 0.0
    for node, weight in zip(*np.polynomial.legendre.leggauss(5), strict=True):
        s = 0.5 * (node + 1.0)
        position = sum(c[n] * s**n for n in range(6))
        speed = sum(n * c[n] * s ** (n - 1) for n in range(1, 6)) / h
        k, w = k0 + s * (k1 - k0), w0 + s * (w1 - w0)
        _, _, load, friction = laws(position, speed, k, w, sense)
        assert np.all(friction * h <= 1e-15)
        put_in += 0.5 * weight * float((load * h).sum())
        taken_out -= 0.5 * weight * float((friction * h).sum())
    gained = float(e1.sum() - e0.sum())
    assert gained == pytest.approx(0.0, abs=1e-9 * taken_out)  # from rest to rest
    assert put_in - taken_out - gained == pytest.approx(0.0, abs=1e-9 * taken_out)


def test_work_balances_energy_while_a_block_rocks() -> None:
    excited = shaking(4, 0.5, 0.3)
    motion, up = (GroundMotion(a, 0.0005) for a in (excited.k_h, excited.w - 1.0))
    p2, kr = 4.0, 0.3
    answer = respond(motion, p2=p2, kr=kr, vertical=up, history=True)
    assert answer.outcome is Outcome.STABLE
    history = answer.history
    assert history is not None
    time, x, rate = history.time_s, history.theta_rad, history.theta_dot_rad_s
    h = np.diff(time)
    # re-seating takes energy out: the intervals that end in it are left out
    moving = (h > 0.0) & (x[1:] > 0.0)
    start, end = np.flatnonzero(moving), np.flatnonzero(moving) + 1
    h = h[moving]

    def pull(theta: FloatArray, k: FloatArray, w: FloatArray) -> FloatArray:
        remaining = math.atan(kr) - theta
        torque: FloatArray = p2 * (k * np.cos(remaining) - w * np.sin(remaining))
        return torque

    k0, k1, w0, w1 = (
        values[i] for values in (history.k_h, 1.0 + history.k_v) for i in (start, end)
    )
    c = quintic(
        x[start], x[end], h * rate[start], h * rate[end],
        h**2 * pull(x[start], k0, w0), h**2 * pull(x[end], k1, w1),
    )  # fmt: skip
    put_in = np.zeros_like(h)
    for node, weight in zip(*np.polynomial.legendre.leggauss(5), strict=True):
        s = 0.5 * (node + 1.0)
        position = sum(c[n] * s**n for n in range(6))
        speed = sum(n * c[n] * s ** (n - 1) for n in range(1, 6))
        put_in += 0.5 * weight * pull(position, k0 + s * (k1 - k0), w0 + s * (w1 - w0)) * speed
    gained = 0.5 * (rate[end] ** 2 - rate[start] ** 2)
    assert np.abs(put_in).sum() > 0.01
    assert np.abs(put_in - gained).sum() < 1e-9 * np.abs(put_in).sum()
