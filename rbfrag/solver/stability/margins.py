"""How far a block is from another failure mode."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from rbfrag.solver.block.elementwise import SCALAR
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import MODES, ModeName, mode_code, mode_code_without_back

Variable = Literal["phi", "alpha1", "alpha3"]


@dataclass(frozen=True)
class Margin:
    """The nearest boundary to another mode when one angle changes and the others stay.

    Args:
        variable: ``phi`` (friction angle of the base), ``alpha1`` or ``alpha3``.
        change_deg: how far it is, with its sign [deg]; 0 on the boundary.
        mode: the mode beyond it.
    """

    variable: Variable
    change_deg: float
    mode: ModeName


@dataclass(frozen=True)
class Surroundings:
    """What the mode of a block depends on besides its own angles.

    Args:
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        limit_deg: angle of the resultant at which the base slides [deg]; phi_deg unless a
            bond helps.
        back_fracture: whether there is a back plane.
        phi_for: the friction angle [deg] with which the base slides at a given angle of the
            resultant [deg].
    """

    beta_deg: float
    phi_deg: float
    limit_deg: float
    back_fracture: bool
    phi_for: Callable[[float], float]


def margins(block: Block, around: Surroundings) -> tuple[Margin, ...]:
    """Return the nearest boundaries in both directions of φ, α1 and α3, nearest first.

    A parallelogram stays one when an angle changes, so that γ changes with it; a polygon keeps
    its γ.

    Args:
        block: the block.
        around: friction, dip and back plane.
    """
    a1, a3, limit = block.alpha1_deg, block.alpha3_deg, around.limit_deg
    confined = block.confines

    def mode(alpha1: float, alpha3: float, limit_deg: float) -> int:
        if not around.back_fracture:
            beta = around.beta_deg
            return int(mode_code_without_back(alpha1, alpha3, limit_deg, beta, SCALAR))
        closed = alpha1 + alpha3 < 0.0 if block.is_parallelogram else confined
        return int(mode_code(alpha1, alpha3, limit_deg, closed, SCALAR))

    now = mode(a1, a3, limit)
    normal1 = [-a3] if block.is_parallelogram and around.back_fracture else []
    normal3 = [-a1] if block.is_parallelogram and around.back_fracture else []
    beta = [] if around.back_fracture else [around.beta_deg]

    found = [
        *_both_ways("alpha1", a1, [limit, *normal1, *beta], -90.0, a3, now,
                    lambda value: mode(value, a3, limit)),
        *_both_ways("alpha3", a3, [limit, *normal3], a1, 90.0, now,
                    lambda value: mode(a1, value, limit)),
    ]  # fmt: skip
    # In φ the boundaries lie where the base slides at α1 and at α3; only the order counts.
    phi1, phi3 = around.phi_for(a1), around.phi_for(a3)

    def mode_at_phi(phi_deg: float) -> int:
        if phi_deg < phi1:
            return mode(a1, a3, -91.0)
        return mode(a1, a3, 0.5 * (a1 + a3) if phi_deg < phi3 else 91.0)

    found += _both_ways("phi", around.phi_deg, [phi1, phi3], 0.0, 90.0, now, mode_at_phi)
    return tuple(sorted(found, key=lambda margin: abs(margin.change_deg)))


def _both_ways(
    variable: Variable,
    value: float,
    edges: Sequence[float],
    low: float,
    high: float,
    now: int,
    mode: Callable[[float], int],
) -> list[Margin]:
    found = []
    inside = [edge for edge in edges if low <= edge < high]
    up = [*sorted(edge for edge in inside if edge >= value), high]
    down = [*sorted((edge for edge in inside if edge <= value), reverse=True), low]
    for path in (up, down):
        for edge, after in pairwise(path):
            if edge == after:
                continue
            there = mode(0.5 * (edge + after))
            if there != now:
                found.append(Margin(variable, edge - value, MODES[there]))
                break
    return found


def degrees_of(tangent: float) -> float:
    """Return the angle between -90 and 90 degrees with this tangent [deg]."""
    return math.degrees(math.atan(tangent))
