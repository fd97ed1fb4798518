"""The lines of a drawing of one block on its planes, whatever draws them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rbfrag.solver.block.geometry import Block
from rbfrag.solver.block.polygon import Point
from rbfrag.solver.stability.single import Stability

_BAND, _REACH, _ARROW = 0.09, 0.30, 0.45
"""Thickness of the rock, reach of the planes and length of the arrow, over the block's size."""


@dataclass(frozen=True)
class BlockLines:
    """A block to scale on its base and back planes, out of the slope to the right.

    All points are (out of the slope, up) from the centroid [m].

    Args:
        outline: vertices of the block.
        contacts: the contacts by number: 1 heel, 2 back (where there is a back plane), 3 toe.
        planes: the line of the base plane, from the slope upwards, and of the back plane.
        rock: outline of a band of rock below and behind the planes.
        resultant: tip of an arrow from the centroid: the resultant of weight and inertia at the
            yield acceleration, or the weight of a block that no acceleration moves or that
            none holds.
    """

    outline: tuple[Point, ...]
    contacts: dict[str, Point]
    planes: tuple[Point, ...]
    rock: tuple[Point, ...]
    resultant: Point


def block_lines(block: Block, found: Stability) -> BlockLines:
    """Return what a drawing of the block consists of.

    Args:
        block: the block.
        found: its stability.
    """
    beta = math.radians(found.beta_deg)
    cosine, sine = math.cos(beta), math.sin(beta)

    def in_the_slope(point: Point) -> Point:
        x, y = point
        return x * cosine + y * sine, -x * sine + y * cosine

    size = max(math.dist(a, b) for a in block.outline for b in block.outline)
    planes, rock = _planes(block, found.back_fracture, _BAND * size, _REACH * size)
    contacts = {"1": block.heel, "2": block.back, "3": block.toe}
    if not found.back_fracture:
        del contacts["2"]
    return BlockLines(
        outline=tuple(in_the_slope(point) for point in block.outline),
        contacts={name: in_the_slope(point) for name, point in contacts.items()},
        planes=tuple(in_the_slope(point) for point in planes),
        rock=tuple(in_the_slope(point) for point in rock),
        resultant=_resultant(found, _ARROW * size),
    )


def _planes(
    block: Block, back_fracture: bool, band: float, reach: float
) -> tuple[list[Point], list[Point]]:
    """Return the planes and the rock along them, in the base frame."""
    end = (block.toe[0] + reach, block.toe[1])
    below = (end[0], end[1] - band)
    if not back_fracture:
        start = (block.heel[0] - reach, block.heel[1])
        return [end, start], [end, start, (start[0], start[1] - band), below]
    gamma = math.radians(block.gamma_deg)
    up = (-math.cos(gamma), math.sin(gamma))
    base_y = block.heel[1]
    # Where the planes meet; of a block without its heel's corner that is not the heel.
    corner = (block.back[0] + block.cot_gamma * (block.back[1] - base_y), base_y)
    along = math.dist(corner, block.back) + 0.6 * reach
    top = (corner[0] + up[0] * along, corner[1] + up[1] * along)
    behind = (top[0] - up[1] * band, top[1] + up[0] * band)
    shift = band * min(math.tan(0.5 * gamma), 4.0)
    line = [end, corner, top]
    return line, [*line, behind, (corner[0] - shift, corner[1] - band), below]


def _resultant(found: Stability, length: float) -> Point:
    k = found.yield_acceleration
    right, down = (k, 1.0 + found.kv) if math.isfinite(k) else (0.0, 1.0)
    scale = length / math.hypot(right, down)
    return right * scale, -down * scale
