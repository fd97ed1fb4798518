"""Positions of the corners of a block, and their contacts with its planes."""

from __future__ import annotations

import math

import numpy as np

from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.free_body import HEEL, ON_BACK, ON_BASE, TOE
from rbfrag.solver.integrator.impulses import Corners
from rbfrag.solver.integrator.one_freedom.equation import Pose
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.results import FloatArray

TOUCHES = 1e-6
"""Distance from a plane, over the size of the block, at which a corner touches it: steps leave
a few times 1e-9 of it."""


def corner_at(
    centroid: tuple[float, float], turned_rad: float, arm: tuple[float, float]
) -> tuple[float, float]:
    """Return the position [m] of a corner from its arm about the centroid before rotation."""
    c, s = math.cos(turned_rad), math.sin(turned_rad)
    return centroid[0] + arm[0] * c - arm[1] * s, centroid[1] + arm[0] * s + arm[1] * c


def corners_of(supported_block: SupportedBlock, block: Block) -> Corners:
    """Return the pairs of corner and plane: those with the base first."""
    arms = np.array(block.outline)
    gamma = math.radians(block.gamma_deg)
    # of base and back plane, into the block; each plane touches its nearest corner at rest
    normals = [(0.0, 1.0), (math.sin(gamma), math.cos(gamma))]
    from_heel = arms - np.array(block.heel)
    planes = 2 if supported_block.back_fracture else 1
    offs = [float((from_heel @ np.array(normal)).min()) for normal in normals]
    n = len(arms)
    friction = (math.tan(supported_block.phi_rad), math.tan(supported_block.phi_back_rad))
    named = {block.heel: HEEL, block.toe: TOE}
    bits = [named.get(arm, ON_BASE) for arm in block.outline] + [ON_BACK] * (planes - 1) * n

    def both(values: list[float] | tuple[float, ...]) -> FloatArray:
        return np.repeat(np.array(values[:planes], dtype=np.float64), n)

    return Corners(
        np.tile(arms[:, 0], planes),
        np.tile(arms[:, 1], planes),
        both([x for x, _ in normals]),
        both([y for _, y in normals]),
        both(offs),
        both(friction),
        np.array(bits, dtype=np.float64),
    )


def gap_m(block: Block, pose: Pose) -> float:
    """Return the gap between the heel and its back plane, along the base [m]."""
    # normal distance of the heel from its plane, less that which a missing corner leaves at rest
    gamma = math.radians(block.gamma_deg)
    normal = (math.sin(gamma), math.cos(gamma))
    low = [a - b for a, b in zip(block.lowest_on_back, block.heel, strict=True)]
    off = low[0] * normal[0] + low[1] * normal[1]
    x, y = corner_at(pose.centroid_m, pose.turned_rad, block.heel)
    gap = (x * normal[0] + y * normal[1] - off) / normal[0]
    return gap if gap > 1e-12 * block.r3_m else 0.0


def touching(supported_block: SupportedBlock, pose: Pose) -> tuple[str, ...]:
    """Return the corners of a block that touch each plane."""
    block = supported_block.block
    assert block is not None
    corners = corners_of(supported_block, block)
    n = len(block.outline)
    names = {block.heel: "heel", block.toe: "toe", block.back: "upper back corner"}
    contacts = []
    for i in range(corners.arm_x.size):
        arm = block.outline[i % n]
        x, y = corner_at(pose.centroid_m, pose.turned_rad, arm)
        away = x * corners.normal_x[i] + y * corners.normal_y[i] - corners.off_m[i]
        if away <= TOUCHES * block.r3_m:
            plane = "base" if i < n else "back plane"
            contacts.append(f"{names.get(arm, 'another corner')} on the {plane}")
    return tuple(contacts)
