"""Impulses of corners on planes: Coulomb's law and no interpenetration, whatever the state."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from rbfrag.solver.integrator.impulses import Corners, Velocity, after_impulses, work_of

TOLERANCE = 1e-13


@njit
def compiled(corners, work, active, per_inertia, free_standing, tolerance):
    return after_impulses(corners, work, active, per_inertia, free_standing, tolerance)


def test_impulses_push_and_rub_as_coulomb_says() -> None:
    random = np.random.default_rng(3)
    doing = {"open": 0, "stuck": 0, "slips": 0}
    for trial in range(600):
        m = 1 + trial % 2
        arms = random.uniform(-1.0, 1.0, (m, 2))
        # planes like base and back, with the block on the side that their normals point to
        turned = np.array([0.0, random.uniform(0.3, 1.2)])[:m]
        normals = np.stack([np.sin(turned), np.cos(turned)], axis=1)
        friction = random.uniform(0.0, 0.8, m)
        corners = Corners(*arms.T.copy(), *normals.T.copy(), np.zeros(m), friction, np.ones(m))
        inertia = random.uniform(0.2, 1.0)
        free_standing = Velocity(*random.normal(size=3) * 1e-3)
        work = work_of(corners)
        work.pair[:] = np.arange(m)
        work.friction[:] = friction
        work.moment_n[:] = arms[:, 0] * normals[:, 1] - arms[:, 1] * normals[:, 0]
        work.moment_t[:] = -arms[:, 0] * normals[:, 0] - arms[:, 1] * normals[:, 1]
        work.least[:] = random.choice([0.0, -1e-4], m)
        # a corner that its own friction can wedge has no unique impulse, by itself or at all
        if (1.0 + work.moment_n**2 / inertia
                <= friction * abs(work.moment_n * work.moment_t) / inertia).any():  # fmt: skip
            continue
        after = compiled(corners, work, m, 1.0 / inertia, free_standing, TOLERANCE)
        total = np.zeros(3)
        for i in range(m):
            (nx, ny), mn, mt = normals[i], work.moment_n[i], work.moment_t[i]
            push, grip = work.across[i], work.along[i]
            total += push * np.array([nx, ny, mn / inertia])
            total += grip * np.array([ny, -nx, mt / inertia])
            off = after.vx * nx + after.vy * ny + after.spin * mn - work.least[i]
            slip = after.vx * ny - after.vy * nx + after.spin * mt
            assert push >= 0.0
            assert abs(grip) <= friction[i] * push * (1.0 + 1e-12)
            assert off > -1e-10
            if push == 0.0:
                doing["open"] += 1
                continue
            assert abs(off) < 1e-10
            if abs(slip) < 1e-10:
                doing["stuck"] += 1
            else:
                doing["slips"] += 1
                assert math.isclose(grip, -math.copysign(friction[i] * push, slip), rel_tol=1e-9)
        assert np.allclose(np.array(free_standing) + total, after, rtol=0.0, atol=1e-15)
    assert min(doing.values()) > 50, doing


@pytest.mark.parametrize(
    ("momentum", "stops"), [((0.0, 0.0, 0.0), True), ((4.3e-4, -8e-6, -2.2e-4), False)]
)
def test_friction_at_two_corners_stops_a_block_that_leans(
    momentum: tuple[float, float, float], stops: bool
) -> None:
    # toe on the base and a corner on the back plane of a block that springs hold: 400 sweeps end
    # halfway, with the one corner sticking and the other slipping, which keeps the block creeping
    normals = np.array([[0.0, 1.0], [0.96864718, -0.24844041]])
    friction, per_inertia = np.array([0.69088655, 0.46140033]), 0.4407776
    corners = Corners(*np.zeros((2, 2)), *normals.T.copy(), np.zeros(2), friction, np.ones(2))
    work = work_of(corners)
    work.pair[:], work.friction[:] = [0, 1], friction
    work.moment_n[:], work.moment_t[:] = [-0.04410462, 2.31161677], [2.34752807, 1.66009085]
    dip, speed = 0.15339, 9.80665 * 2e-4
    free_standing = np.array([speed * math.sin(dip), -speed * math.cos(dip), 0.0]) + momentum
    after = compiled(corners, work, 2, per_inertia, Velocity(*free_standing), TOLERANCE * speed)
    assert (work.across > 0.0).all()
    for i, (nx, ny) in enumerate(normals):
        slip = after.vx * ny - after.vy * nx + after.spin * work.moment_t[i]
        assert abs(after.vx * nx + after.vy * ny + after.spin * work.moment_n[i]) < 1e-15
        assert abs(work.along[i]) <= friction[i] * work.across[i] * (1.0 + 1e-12)
        if stops:
            assert abs(slip) < 1e-15
        else:
            grip = -math.copysign(friction[i] * work.across[i], slip)
            assert math.isclose(work.along[i], grip, rel_tol=1e-9)
