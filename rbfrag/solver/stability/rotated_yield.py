"""Yield accelerations of a block that has already rotated by an angle θ.

Lengths and γ keep their values at rest; only the arms turn. In terms of the block angles: a
slump has α + θ, a topple α - θ, but γ must not be computed again from them.

Where the rock behind the block gives way with it, the back plane turns by a share of the block's
rotation in the block's sense (Gibson's dissertation, Fig. 3.20b): γ - share θ behind a slump, which
makes the plane flatter, γ + share θ above a confined topple, which makes it overhang more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.solver.block.formulas import SCALAR, Elementwise, N, array_elementwise, tan_deg
from rbfrag.solver.block.geometry import Block, Point
from rbfrag.solver.quantity import angle, friction_angle, number, vertical_g
from rbfrag.solver.stability.modes import ModeName, Planes, yield_coefficient


def kr_after_rotation(block: Block, theta_deg: N, *, beta_deg: float, kv: float = 0.0) -> N:
    """Return k_r(θ) = (1 + k_v) tan(α3 - θ - β) of a block that has rotated about its toe.

    Args:
        theta_deg: forward rotation, from 0 to 180 - γ, where the front face meets the base
            plane [deg]; scalar or array.
        beta_deg: dip of the base [deg].
        kv: vertical acceleration of the ground, up positive [g].

    Returns:
        The yield [g], negative beyond balance and -inf from 90 degrees beyond it.

    Raises:
        InputError: a value outside its range; the message names the range.
    """
    tb = tan_deg(angle(beta_deg, "beta_deg", -90.0, 90.0), SCALAR)
    weight = 1.0 + vertical_g(kv)

    def formula(_turn: Any, cosine: Any, sine: Any, functions: Elementwise[Any]) -> Any:
        toe_x, toe_y = _turned(block.arms[2], cosine, -sine)
        return yield_coefficient(toe_x, -toe_y, tb, weight, functions)

    limit_deg = 180.0 - block.gamma_deg
    k: N = _over(theta_deg, formula, limit_deg, "the front face meets the base")
    return k


def ks_after_rotation(
    block: Block,
    theta_deg: N,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kv: float = 0.0,
    back_follows: float = 0.0,
) -> N:
    """Return k_s(θ) of a slump that has rotated backward (eqs. 3.24, 3.25 with rotated arms).

    Args:
        block: the block, with α1 of at least phi_deg.
        theta_deg: backward rotation, from 0 to γ, where the back edge meets the base plane
            [deg]; scalar or array.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        kv: vertical acceleration of the ground, up positive [g].
        back_follows: share of the rotation by which the back plane turns, from 0 to 1.

    Returns:
        The yield [g]; -inf where nothing holds the block.

    Raises:
        InputError: a value outside its range, or a block that does not slump.
    """
    planes = _planes(beta_deg, phi_deg, phi_back_deg, kv)
    share = _share(back_follows)
    if block.tan_alpha1 < planes.mu1:
        raise InputError(
            f"alpha1 = {block.alpha1_deg:.6g} degrees is below phi_deg = {phi_deg:.6g}: the block "
            "does not slump, so it has no k_s"
        )

    def formula(turn: Any, cosine: Any, sine: Any, functions: Elementwise[Any]) -> Any:
        heel, back = (_turned(arm, cosine, sine) for arm in block.arms[:2])
        cot = _cot_of_back(block, -share * turn, functions)
        return replace(planes, functions=functions).slump(*heel, *back, cot)[0]

    why = "the back edge meets the base plane"
    k: N = _over(theta_deg, formula, block.gamma_deg, why)
    return k


def kct_after_rotation(
    block: Block,
    theta_deg: N,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kv: float = 0.0,
    back_follows: float = 0.0,
) -> N:
    """Return k_ct(θ) of a confined topple that has rotated forward (eqs. 3.28, 3.29 corrected).

    Args:
        block: the block, with γ above 90° and α3 of at most phi_deg.
        theta_deg: forward rotation, from 0 to :func:`confined_limit_deg`, which is γ - 90 for a
            back plane that stays [deg]; scalar or array.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        kv: vertical acceleration of the ground, up positive [g].
        back_follows: share of the rotation by which the back plane turns, from 0 to 1.

    Returns:
        The yield [g]; +inf where the block is wedged.

    Raises:
        InputError: a value outside its range, or a block that is not confined.
    """
    planes = _planes(beta_deg, phi_deg, phi_back_deg, kv)
    share = _share(back_follows)
    if not block.confines or block.tan_alpha3 > planes.mu1:
        raise InputError(
            f"alpha3 = {block.alpha3_deg:.6g}, gamma = {block.gamma_deg:.6g} and phi_deg = "
            f"{phi_deg:.6g} degrees: the block does not topple against its back plane (that takes "
            "gamma above 90 and alpha3 not above phi_deg), so it has no k_ct"
        )

    def formula(turn: Any, cosine: Any, sine: Any, functions: Elementwise[Any]) -> Any:
        toe, low = (_turned(arm, cosine, -sine) for arm in block.arms[2:])
        cot = _cot_of_back(block, share * turn, functions)
        return replace(planes, functions=functions).confined_topple(*toe, *low, cot)[0]

    limit_deg = confined_limit_deg(block, back_follows=share)
    on_its_face = limit_deg == 180.0 - block.gamma_deg
    why = "the front face meets the base" if on_its_face else _EDGE_NORMAL
    k: N = _over(theta_deg, formula, limit_deg, why)
    return k


class RotatedYield(NamedTuple):
    """Yield of a mode as a function of the rotation against the back plane.

    Args:
        yield_g: function of the block and θ [deg] like :func:`ks_after_rotation`.
        limit_deg: the greatest θ, by block and `back_follows` [deg].
        end: what happens there.
    """

    yield_g: Callable[..., Any]
    limit_deg: Callable[..., float]
    end: str


_EDGE_NORMAL = "the base edge stands normal to the back plane"


def confined_limit_deg(block: Block, *, back_follows: float = 0.0) -> float:
    """Return the rotation up to which a confined topple is confined [deg].

    There the base edge stands normal to the back plane, θ = (γ - 90°)/(1 - share), and the block
    topples freely; or its front face meets the base, at 180° - γ, if that is first.

    Args:
        block: the block, with γ above 90°.
        back_follows: share of the rotation by which the back plane turns, from 0 to 1.
    """
    square, face = block.gamma_deg - 90.0, 180.0 - block.gamma_deg
    stays = 1.0 - _share(back_follows)
    if stays == 1.0:
        return square
    return min(square / stays, face) if stays > 0.0 else face


def slump_limit_deg(block: Block, *, back_follows: float = 0.0) -> float:
    """Return γ [deg], the rotation that lays the back edge of a slump on its base.

    Args:
        back_follows: share of the rotation by which the back plane turns, from 0 to 1, which does
            not change it.
    """
    _share(back_follows)
    return block.gamma_deg


BY_MODE: Mapping[ModeName, RotatedYield] = {
    "slump": RotatedYield(ks_after_rotation, slump_limit_deg, "its back edge lies on the base"),
    "confined_topple": RotatedYield(
        kct_after_rotation, confined_limit_deg, "it is free of its back plane, or on its face"
    ),
}
"""The modes in which a block turns against its back plane."""


def _share(back_follows: float) -> float:
    expected = "a share of the block's rotation from 0 to 1"
    share = number(back_follows, "back_follows", expected)
    if not 0.0 <= share <= 1.0:
        raise InputError(f"back_follows = {share:g} is out of range: give {expected}")
    return share


_FLAT = 1e-15
"""Least sine of the angle of a back plane: the formulas take its cotangent."""


def _cot_of_back(block: Block, turn: Any, functions: Elementwise[Any]) -> Any:
    """Return cot(γ + turn) [turn in rad], of the angle at rest where nothing turns."""
    cot = block.cot_gamma
    trigonometry: Any = math
    if not isinstance(turn, float):
        import numpy as np

        trigonometry = np
    # sine and cosine of γ + turn, over sin γ
    cosine, sine = trigonometry.cos(turn), trigonometry.sin(turn)
    along, across = cot * cosine - sine, cosine + cot * sine
    turned = along / functions.where(across < _FLAT, _FLAT, across)
    return functions.where(turn == 0.0, cot, turned)


def _planes(beta_deg: float, phi_deg: float, phi_back_deg: float | None, kv: float) -> Planes[Any]:
    tb = tan_deg(angle(beta_deg, "beta_deg", -90.0, 90.0), SCALAR)
    mu1 = mu2 = tan_deg(friction_angle(phi_deg, "phi_deg"), SCALAR)
    if phi_back_deg is not None:
        mu2 = tan_deg(friction_angle(phi_back_deg, "phi_back_deg"), SCALAR)
    return Planes(tb, mu1, mu2, 1.0 + vertical_g(kv), SCALAR)


def _turned(arm: Point, cosine: Any, sine: Any) -> tuple[Any, Any]:
    """Return an arm turned counter-clockwise."""
    x, y = arm
    return x * cosine - y * sine, x * sine + y * cosine


def _over(theta_deg: Any, formula: Callable[..., Any], limit_deg: float, why: str) -> Any:
    expected = f"a rotation from 0 to {limit_deg:.6g} degrees, where {why}"
    if isinstance(theta_deg, int | float | str) or not hasattr(theta_deg, "__len__"):
        theta = number(theta_deg, "theta_deg", expected)
        if not 0.0 <= theta <= limit_deg:
            raise InputError(f"theta_deg = {theta:g} is out of range: give {expected}")
        turn = math.radians(theta)
        return float(formula(turn, math.cos(turn), math.sin(turn), SCALAR))
    # Kept apart so that single numbers do not load numpy.
    import numpy as np

    thetas = np.asarray(theta_deg, dtype=np.float64)
    outside = ~((thetas >= 0.0) & (thetas <= limit_deg))
    if outside.any():
        raise InputError(f"theta_deg = {thetas[outside][0]:g} is out of range: give {expected}")
    turns = np.radians(thetas)
    with np.errstate(invalid="ignore", divide="ignore"):
        return formula(turns, np.cos(turns), np.sin(turns), array_elementwise())
