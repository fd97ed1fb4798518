"""Margins of a block to its next failure mode, and warnings about the answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.formulas import SCALAR, Elementwise
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import (
    AT_LIMIT,
    MODES,
    ModeName,
    StateName,
    mode_code,
    mode_code_without_back,
)

if TYPE_CHECKING:
    from rbfrag.solver.block.arrays import BlockArray

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
    """Inputs of the warnings; the fields are those of the answer.

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


_ROUNDING_DEG = 1e-9
"""Angles of single blocks and of arrays may differ by rounding; their warnings may not [deg]."""

_LIMIT = Diagnostic(
    "the block is stable at its limit: its yield acceleration is zero to rounding",
    "at_limit",
)
_WEDGED = Diagnostic(
    "gamma + phi + phi_back = {corner:.6g} degrees exceeds 180: pre-stress of a heel wedged "
    "between the planes, which could hold the block at any acceleration, is neglected "
    "(conservative)",
    "prestress_neglected",
)
_BACK_FRICTION = Diagnostic(
    "friction on the back face is neglected (conservative)", "back_friction_neglected"
)
_LEANS = Diagnostic(
    "at rest the block leans on the back plane (beta is below alpha1): after sliding it falls "
    "back, its angles grow, and it may become a slump",
    "leans_on_back_plane",
)
_ROUGH_BACK = Diagnostic(
    "phi_back = {phi_back:.6g} degrees exceeds phi + gamma: friction on a back plane so much "
    "rougher than the base could hold the block beyond this acceleration (conservative)",
    "rough_back_plane",
)
_FLAT_BACK = Diagnostic(
    "the back plane dips {steepness:.6g} degrees, less than the base: the base must be the set "
    "nearer to horizontal",
    "flat_back_plane",
)


def warnings_about(block: Block, finding: MarginFacts) -> tuple[Diagnostic, ...]:
    """Return the warnings about a block and its planes."""
    return tuple(_warnings(block, finding))


def _warnings(block: Block, finding: MarginFacts) -> Iterator[Diagnostic]:
    if finding.backward:
        yield Diagnostic(
            f"nothing supports the block from behind and its weight passes upslope of the heel "
            f"(beta = {finding.beta_deg:.6g} is below alpha1 = {block.alpha1_deg:.6g} degrees): it "
            "turns back about the heel at rest",
            "unstable_at_rest",
        )
    elif finding.untenable:
        yield Diagnostic(
            "the reaction at the back contact cannot hold the block, which turns back at rest",
            "unstable_at_rest",
        )
    elif finding.state == "unstable":
        yield Diagnostic(
            "the block fails at rest: its yield acceleration is negative", "unstable_at_rest"
        )
    if finding.state == "locked":
        yield Diagnostic(
            "the block is wedged: no horizontal acceleration moves it in this mode", "locked"
        )
    if finding.lifts:
        yield Diagnostic(
            "the bond of the base is so strong that the toe lifts off before it slides: the "
            "acceleration given is an upper bound",
            "toe_lifts",
        )
    for holds, warning, values in idealisations(
        block, finding.mode, finding.k, finding.beta_deg, finding.phi_deg, finding.phi_back_deg,
        finding.back_fracture, SCALAR,
    ):  # fmt: skip
        if holds:
            yield warning.replaced(text=warning.format(**values))


def idealisations(
    block: Block | BlockArray,
    mode: ModeName,
    k: Any,
    beta_deg: Any,
    phi_deg: Any,
    phi_back_deg: Any,
    backed: Any,
    functions: Elementwise[Any],
) -> Iterator[tuple[Any, Diagnostic, dict[str, Any]]]:
    """Yield the idealisations of the planes that apply, each text with its values.

    Args:
        block: a block, or several of one mode.
        mode: failure mode.
        k: yield acceleration [g].
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg].
        backed: whether, or behind which of them, a plane is.
        functions: for numbers or arrays.
    """
    gamma_deg = block.gamma_deg
    yield abs(k) <= AT_LIMIT, _LIMIT, {}
    if mode in ("slide", "confined_topple"):
        corner = gamma_deg + phi_deg + phi_back_deg
        yield (corner > 180.0 + _ROUNDING_DEG) & backed, _WEDGED, {"corner": corner}
    if mode == "topple":
        yield (gamma_deg + phi_back_deg > 90.0 + _ROUNDING_DEG) & backed, _BACK_FRICTION, {}
    if mode == "slide":
        yield (beta_deg < block.alpha1_deg - _ROUNDING_DEG) & backed, _LEANS, {}
    if mode in ("slide", "slump"):
        holds = phi_back_deg > phi_deg + gamma_deg + _ROUNDING_DEG
        yield holds & backed, _ROUGH_BACK, {"phi_back": phi_back_deg}
    dip = abs(gamma_deg + beta_deg) % 180.0
    steepness = functions.where(dip < 90.0, dip, 180.0 - dip)
    holds = steepness < abs(beta_deg) - _ROUNDING_DEG
    yield holds & backed, _FLAT_BACK, {"steepness": steepness}
