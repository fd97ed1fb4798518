"""Validity of a yield acceleration: margins to other modes, idealisations, toe and heel.

The toe of a block that rotates about it bears, at the start of the rotation (Gibson's dissertation,
4.3.1), R/m = r3 θ'' t - g G, with θ'' = p² q/F_s, so that, with q = F_s (k cos θc - sin θc + m0),
θc = α3 - β and friction alone,

    tan φ = (sin β + k cos β + e_x - q cos α3)/(cos β - k sin β - e_y + q sin α3),

where e is the push of water over the weight, down the base and off it, and m0 its forward moment
about the toe over m g r3. Blocks are single ones, or arrays with pushes and angles of their shape.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.formulas import SCALAR, Elementwise
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import (
    AT_LIMIT,
    DRY,
    MODES,
    ModeName,
    Push,
    StateName,
    mode_code,
    mode_code_without_back,
)

if TYPE_CHECKING:
    from rbfrag.solver.block.arrays import BlockArray
    from rbfrag.solver.results import ResponseHistory

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


def warnings_about(block: Block, finding: MarginFacts) -> Iterator[Diagnostic]:
    """Yield the warnings about a block and its planes."""
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


# of 2,652 random blocks 16 % slip at the toe below their critical amplitude, ln of which then
# differs by 0.036 +- 0.10 from that of pure toppling
TOE_SLIPS = Diagnostic(
    "the toe slips above {threshold:.2f} g: P(toppling) changes little (critical amplitude ±10 %), "
    "but the toe may move by centimetres",
    "toe_slips",
)
# followed blocks of a rock mass over Newmark's: 10, 90 % and geometric mean
HEEL_TIPS = Diagnostic(
    "pulses into the slope above {threshold:.2f} g tip the block: it slides 1.4 times as far on "
    "average (1.0–2.7), so P is too low; rbfrag respond follows it",
    "heel_tips",
)
TOE_FOLLOWED = "the toe gives way: its slip is followed step by step"


def _functions(block: Block | BlockArray) -> tuple[ModuleType, Callable[..., Any]]:
    """Return the module of trigonometry for a single block, or for arrays, and its `where`."""
    if isinstance(block, Block):
        return math, SCALAR.where
    import numpy as np

    return np, np.where


def moment_about_toe(block: Block | BlockArray, push: Push | None) -> Any:
    """Return the forward moment of water about the toe over m g r3, m0."""
    if push is None:
        return 0.0
    along, off, moment_m = push
    return (block.toe[0] * off - block.toe[1] * along - moment_m) / block.r3_m


def _balance(block: Block | BlockArray, beta_deg: Any, push: Push | None) -> tuple[Any, ...]:
    """Return thrust and pressure at the toe over the weight, each a constant and per k."""
    m, _ = _functions(block)
    beta, alpha3 = m.radians(beta_deg), m.radians(block.alpha3_deg)
    turns, factor = alpha3 - beta, block.shape_factor
    along, off, _ = push or DRY
    up = factor * m.cos(turns)
    down = factor * (moment_about_toe(block, push) - m.sin(turns))
    return (
        m.sin(beta) + along - down * m.cos(alpha3), m.cos(beta) - up * m.cos(alpha3),
        m.cos(beta) - off + down * m.sin(alpha3), -m.sin(beta) + up * m.sin(alpha3),
    )  # fmt: skip


def toe_needs_deg(block: Block, beta_deg: float, k: float, push: Push | None = None) -> float:
    """Return the friction angle required at the toe at the start of a rotation [deg].

    Args:
        block: the block.
        beta_deg: dip of the base [deg].
        k: greatest acceleration out of the slope, above k_r [g].
        push: of water, as :class:`rbfrag.solver.stability.single.Stability` has it.
    """
    thrust, per_k, pressure, pressed_per_k = _balance(block, beta_deg, push)
    return math.degrees(math.atan2(abs(thrust + per_k * k), pressure + pressed_per_k * k))


def toe_slips_g(
    block: Block | BlockArray, beta_deg: Any, phi_deg: Any, push: Push | None = None
) -> Any:
    """Return the acceleration at which the toe slips at the start of a rotation [g].

    +inf where it holds at any.

    Args:
        block: a block that topples, or several.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        push: of water.
    """
    m, where = _functions(block)
    thrust, per_k, pressure, pressed_per_k = _balance(block, beta_deg, push)
    friction = m.tan(m.radians(phi_deg))
    rises = per_k - friction * pressed_per_k
    return where(
        rises > 0.0, (friction * pressure - thrust) / where(rises > 0.0, rises, 1.0), math.inf
    )


def heel_tips_g(
    block: Block | BlockArray, beta_deg: Any, phi_deg: Any, push: Push | None = None
) -> Any:
    """Return the acceleration into the slope above which a block that has slid tips back [g].

    tan(β - α1) less the backward moment of water; 0 for a block that leans at rest, and +inf for
    one that slides up its base first, α1 <= -φ.

    Args:
        block: a block that slides, or several.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        push: of water.
    """
    m, where = _functions(block)
    tips = (block.alpha1_deg > -phi_deg) & (beta_deg - block.alpha1_deg < 90.0)
    past_heel = m.radians(where(tips, beta_deg - block.alpha1_deg, 0.0))
    along, off, about_centroid = push or DRY
    moment_m: Any = about_centroid + block.heel[1] * along - block.heel[0] * off
    threshold = m.tan(past_heel) - moment_m / (block.r1_m * m.cos(past_heel))
    return where(tips, where(threshold > 0.0, threshold, 0.0), math.inf)


def slides_at_toe(need_deg: float, where: str, phi_deg: float, slips_g: float) -> Diagnostic:
    """Return the sentence on a slipping toe: the friction required, and from what time on."""
    at = "" if slips_g == math.inf else f" at {slips_g:.2f} g"
    return Diagnostic(
        f"rotation without slip needs {need_deg:.1f} deg at the toe at {where}; phi = {phi_deg:g} "
        f"gives way{at}: the slip of the toe is followed step by step",
        "toe_followed",
    )


def toe_needs_in_time(
    block: Block, beta_deg: float, history: ResponseHistory, push: Push | None = None
) -> tuple[float, float] | None:
    """Return the maximum friction angle required at the toe during a rotation [deg], and its time
    [s].

    max atan(|Rx|/Ry) of R/m = r3 (θ'' t - θ'² e) - g G, e from the toe to the centroid, t along its
    path, θ'' of eq. (4.13). None for a block that does not turn.

    Args:
        block: the block.
        beta_deg: dip of the base [deg].
        history: its motion in time.
        push: of water, which turns with the block.
    """
    import numpy as np

    turns = history.theta_rad > 0.0
    if not turns.any():
        return None
    beta, alpha3 = math.radians(beta_deg), math.radians(block.alpha3_deg)
    at = alpha3 - history.theta_rad[turns]
    k, w = history.k_h[turns], 1.0 + history.k_v[turns]
    along, off, _ = push or DRY
    theta, m0 = history.theta_rad[turns], moment_about_toe(block, push)
    turning = block.r3_m * block.p2 * (k * np.cos(at - beta) - w * (np.sin(at - beta) - m0))
    inward = block.r3_m * history.theta_dot_rad_s[turns] ** 2
    thrust = turning * np.cos(at) + inward * np.sin(at)
    thrust -= STANDARD_GRAVITY_M_S2 * (w * math.sin(beta) + k * math.cos(beta))
    thrust -= STANDARD_GRAVITY_M_S2 * w * (along * np.cos(theta) + off * np.sin(theta))
    pressure = turning * np.sin(at) - inward * np.cos(at)
    pressure += STANDARD_GRAVITY_M_S2 * (w * math.cos(beta) - k * math.sin(beta))
    pressure -= STANDARD_GRAVITY_M_S2 * w * (off * np.cos(theta) - along * np.sin(theta))
    needs = np.degrees(np.arctan2(np.abs(thrust), pressure))
    worst = int(np.argmax(needs))
    return float(needs[worst]), float(history.time_s[turns][worst])
