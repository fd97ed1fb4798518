"""How far a block is from its next mode, and what people should know about the answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.formulas import SCALAR
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import (
    AT_LIMIT,
    MODES,
    ModeName,
    StateName,
    mode_code,
    mode_code_without_back,
)

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


def margins(
    block: Block, finding: MarginFacts, limit_deg: float, phi_for: Callable[[float], float]
) -> tuple[Margin, ...]:
    """Return the nearest boundaries in both directions of φ, α1 and α3, nearest first.

    A parallelogram stays one when an angle changes, so that γ changes with it; a polygon keeps
    its γ.

    Args:
        limit_deg: angle of the resultant at which the base slides [deg]; phi_deg unless a
            bond helps.
        back_fracture: whether there is a back plane.
        phi_for: the friction angle [deg] with which the base slides at a given angle of the
            resultant [deg].
    """
    a1, a3, limit, backed = block.alpha1_deg, block.alpha3_deg, limit_deg, finding.back_fracture
    confined = block.confines

    def mode(alpha1: float, alpha3: float, limit_deg: float) -> int:
        if not backed:
            beta = finding.beta_deg
            return int(mode_code_without_back(alpha1, alpha3, limit_deg, beta, SCALAR))
        closed = alpha1 + alpha3 < 0.0 if block.is_parallelogram else confined
        return int(mode_code(alpha1, alpha3, limit_deg, closed, SCALAR))

    now = mode(a1, a3, limit)
    normal1 = [-a3] if block.is_parallelogram and backed else []
    normal3 = [-a1] if block.is_parallelogram and backed else []
    beta = [] if backed else [finding.beta_deg]

    result = [
        *_both_ways("alpha1", a1, [limit, *normal1, *beta], -90.0, a3, now,
                    lambda value: mode(value, a3, limit)),
        *_both_ways("alpha3", a3, [limit, *normal3], a1, 90.0, now,
                    lambda value: mode(a1, value, limit)),
    ]  # fmt: skip
    # In φ the boundaries lie where the base slides at α1 and at α3; only the order counts.
    phi1, phi3 = phi_for(a1), phi_for(a3)

    def mode_at_phi(phi_deg: float) -> int:
        if phi_deg < phi1:
            return mode(a1, a3, -91.0)
        return mode(a1, a3, 0.5 * (a1 + a3) if phi_deg < phi3 else 91.0)

    result += _both_ways("phi", finding.phi_deg, [phi1, phi3], 0.0, 90.0, now, mode_at_phi)
    return tuple(sorted(result, key=lambda margin: abs(margin.change_deg)))


def _both_ways(
    variable: Variable,
    value: float,
    edges: Sequence[float],
    low: float,
    high: float,
    now: int,
    mode: Callable[[float], int],
) -> list[Margin]:
    result = []
    inside = [edge for edge in edges if low <= edge < high]
    up = [*sorted(edge for edge in inside if edge >= value), high]
    down = [*sorted((edge for edge in inside if edge <= value), reverse=True), low]
    for path in (up, down):
        for edge, after in pairwise(path):
            if edge == after:
                continue
            there = mode(0.5 * (edge + after))
            if there != now:
                result.append(Margin(variable, edge - value, MODES[there]))
                break
    return result


def degrees_of(tangent: float) -> float:
    """Return the angle between -90 and 90 degrees with this tangent [deg]."""
    return math.degrees(math.atan(tangent))


@dataclass(frozen=True)
class MarginFacts:
    """What the warnings are about; the fields are those of the answer.

    Args:
        mode: failure mode.
        k: yield acceleration of the mode.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg].
        back_fracture: whether there is a back plane.
        backward: whether the block turns back about its heel for want of a back plane.
        untenable: whether the back contact cannot hold the block.
        lifts: whether the bond of the base would have to bear tension at the yield.
    """

    mode: ModeName
    state: StateName
    k: float
    beta_deg: float
    phi_deg: float
    phi_back_deg: float
    back_fracture: bool
    backward: bool
    untenable: bool
    lifts: bool


def warnings_about(block: Block, finding: MarginFacts) -> tuple[str, ...]:
    """Return one sentence for everything that the answer takes for granted."""
    return tuple(_sentences(block, finding))


def _sentences(block: Block, finding: MarginFacts) -> Iterator[str]:
    if abs(finding.k) <= AT_LIMIT:
        yield "the block is stable at its limit: its yield acceleration is zero to rounding"
    if finding.backward:
        yield (
            f"nothing supports the block from behind and its weight passes upslope of the heel "
            f"(beta = {finding.beta_deg:.6g} is below alpha1 = {block.alpha1_deg:.6g} degrees): it "
            "turns back about the heel at rest"
        )
    elif finding.untenable:
        yield "the reaction at the back contact cannot hold the block, which turns back at rest"
    elif finding.state == "unstable":
        yield "the block fails at rest: its yield acceleration is negative"
    if finding.state == "locked":
        yield "the block is wedged: no horizontal acceleration moves it in this mode"
    if finding.lifts:
        yield (
            "the bond of the base is so strong that the toe lifts off before it slides: the "
            "acceleration given is an upper bound"
        )
    if finding.back_fracture:
        yield from _about_back_plane(block, finding)


def _about_back_plane(block: Block, finding: MarginFacts) -> Iterator[str]:
    corner = block.gamma_deg + finding.phi_deg + finding.phi_back_deg
    if finding.mode in ("slide", "confined_topple") and corner > 180.0:
        yield (
            f"gamma + phi + phi_back = {corner:.6g} degrees exceeds 180: a heel wedged between the "
            "planes could hold the block at any acceleration; the answer takes the back plane to "
            "be free of pre-stress"
        )
    if finding.mode == "topple" and block.gamma_deg + finding.phi_back_deg > 90.0:
        yield Diagnostic(
            "friction on the back face is neglected (conservative)",
            "back_friction_neglected",
        )
    if finding.mode == "slide" and finding.beta_deg < block.alpha1_deg:
        yield (
            "at rest the block leans on the back plane (beta is below alpha1): after sliding it "
            "falls back, its angles grow, and it may become a slump"
        )
    if (
        finding.mode in ("slide", "slump")
        and finding.phi_back_deg > finding.phi_deg + block.gamma_deg
    ):
        yield (
            f"phi_back = {finding.phi_back_deg:.6g} degrees exceeds phi + gamma: friction on a "
            "back plane so much rougher than the base could hold the block beyond this acceleration"
        )
    dip = math.fmod(block.gamma_deg + finding.beta_deg, 180.0)
    steepness = min(abs(dip), 180.0 - abs(dip))
    if steepness < abs(finding.beta_deg):
        yield (
            f"the back plane dips {steepness:.6g} degrees, less than the base: the base must be "
            "the set nearer to horizontal"
        )
