"""Yield accelerations of a block that has already turned by an angle θ.

Lengths and γ keep their values at rest; only the arms turn. In terms of the block angles: a
slump has α + θ, a topple α - θ, but γ must not be computed anew from them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, overload

from rbfrag.errors import InputError
from rbfrag.solver.block.formulas import SCALAR, Elementwise, array_elementwise, tan_deg
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.block.polygon import Point
from rbfrag.solver.quantity import angle, friction_angle, number, vertical_g
from rbfrag.solver.stability.modes import (
    confined_topple,
    on_its_branch,
    slump,
    wedges,
    yield_coefficient,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]


@overload
def kr_after_rotation(
    block: Block, theta_deg: float, *, beta_deg: float, kv: float = ...
) -> float: ...


@overload
def kr_after_rotation(
    block: Block, theta_deg: FloatArray, *, beta_deg: float, kv: float = ...
) -> FloatArray: ...


def kr_after_rotation(
    block: Block, theta_deg: float | FloatArray, *, beta_deg: float, kv: float = 0.0
) -> float | FloatArray:
    """Return k_r(θ) = (1 + k_v) tan(α3 - θ - β) of a block that has turned about its toe.

    Args:
        block: the block.
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

    def formula(cosine: Any, sine: Any, functions: Elementwise[Any]) -> Any:
        toe_x, toe_y = _turned(block.arms.toe, cosine, -sine)
        return yield_coefficient(toe_x, -toe_y, tb, weight, functions)

    limit_deg = 180.0 - block.gamma_deg
    k: float | FloatArray = _over(theta_deg, formula, limit_deg, "the front face meets the base")
    return k


@overload
def ks_after_rotation(
    block: Block,
    theta_deg: float,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = ...,
    kv: float = ...,
) -> float: ...


@overload
def ks_after_rotation(
    block: Block,
    theta_deg: FloatArray,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = ...,
    kv: float = ...,
) -> FloatArray: ...


def ks_after_rotation(
    block: Block,
    theta_deg: float | FloatArray,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kv: float = 0.0,
) -> float | FloatArray:
    """Return k_s(θ) of a slump that has turned backward (eqs. 3.24, 3.25 with turned arms).

    Args:
        block: the block, with α1 of at least phi_deg.
        theta_deg: backward rotation, from 0 to γ, where the back edge meets the base plane
            [deg]; scalar or array.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        kv: vertical acceleration of the ground, up positive [g].

    Returns:
        The yield [g]; -inf where nothing holds the block.

    Raises:
        InputError: a value outside its range, or a block that does not slump.
    """
    tb, mu1, mu2, weight = _surroundings(beta_deg, phi_deg, phi_back_deg, kv)
    if block.tan_alpha1 < mu1:
        raise InputError(
            f"alpha1 = {block.alpha1_deg:.6g} degrees is below phi_deg = {phi_deg:.6g}: the block "
            "does not slump, so that it has no k_s"
        )

    def formula(cosine: Any, sine: Any, functions: Elementwise[Any]) -> Any:
        heel = _turned(block.arms.heel, cosine, sine)
        back = _turned(block.arms.back, cosine, sine)
        x, y, r_base, _ = slump(*heel, *back, block.cot_gamma, mu1, mu2)
        k = yield_coefficient(x, y, tb, weight, functions)
        return functions.where(r_base <= 0.0, -math.inf, k)

    why = "the back edge meets the base plane"
    k: float | FloatArray = _over(theta_deg, formula, block.gamma_deg, why)
    return k


@overload
def kct_after_rotation(
    block: Block,
    theta_deg: float,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = ...,
    kv: float = ...,
) -> float: ...


@overload
def kct_after_rotation(
    block: Block,
    theta_deg: FloatArray,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = ...,
    kv: float = ...,
) -> FloatArray: ...


def kct_after_rotation(
    block: Block,
    theta_deg: float | FloatArray,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kv: float = 0.0,
) -> float | FloatArray:
    """Return k_ct(θ) of a confined topple that has turned forward (eqs. 3.28, 3.29 corrected).

    Args:
        block: the block, with γ above 90° and α3 of at most phi_deg.
        theta_deg: forward rotation, from 0 to γ - 90, where the base edge stands normal to
            the back plane and the block topples freely [deg]; scalar or array.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        kv: vertical acceleration of the ground, up positive [g].

    Returns:
        The yield [g]; +inf where the block is wedged.

    Raises:
        InputError: a value outside its range, or a block that is not confined.
    """
    tb, mu1, mu2, weight = _surroundings(beta_deg, phi_deg, phi_back_deg, kv)
    ky = yield_coefficient(mu1, 1.0, tb, weight, SCALAR)
    wedged = wedges(block.cot_gamma, mu1, mu2)
    if not block.confines or block.tan_alpha3 > mu1:
        raise InputError(
            f"alpha3 = {block.alpha3_deg:.6g}, gamma = {block.gamma_deg:.6g} and phi_deg = "
            f"{phi_deg:.6g} degrees: the block does not topple against its back plane (that takes "
            "gamma above 90 and alpha3 not above phi_deg), so that it has no k_ct"
        )

    def formula(cosine: Any, sine: Any, functions: Elementwise[Any]) -> Any:
        toe = _turned(block.arms.toe, cosine, -sine)
        low = _turned(block.arms.lowest_on_back, cosine, -sine)
        x, y, r_base, _ = confined_topple(*toe, *low, block.cot_gamma, mu1, mu2)
        k = yield_coefficient(x, y, tb, weight, functions)
        k = on_its_branch(k, ky, wedged, functions)
        return functions.where(r_base <= 0.0, math.inf, k)

    why = "the base edge stands normal to the back plane"
    k: float | FloatArray = _over(theta_deg, formula, block.gamma_deg - 90.0, why)
    return k


def _surroundings(
    beta_deg: float, phi_deg: float, phi_back_deg: float | None, kv: float
) -> tuple[float, float, float, float]:
    tb = tan_deg(angle(beta_deg, "beta_deg", -90.0, 90.0), SCALAR)
    mu1 = tan_deg(friction_angle(phi_deg, "phi_deg"), SCALAR)
    if phi_back_deg is None:
        return tb, mu1, mu1, 1.0 + vertical_g(kv)
    mu2 = tan_deg(friction_angle(phi_back_deg, "phi_back_deg"), SCALAR)
    return tb, mu1, mu2, 1.0 + vertical_g(kv)


def _turned(arm: Point, cosine: Any, sine: Any) -> tuple[Any, Any]:
    """Return an arm turned counter-clockwise."""
    x, y = arm
    return x * cosine - y * sine, x * sine + y * cosine


def _over(theta_deg: Any, formula: Callable[..., Any], limit_deg: float, why: str) -> Any:
    what = f"a rotation from 0 to {limit_deg:.6g} degrees, where {why}"
    if isinstance(theta_deg, int | float | str) or not hasattr(theta_deg, "__len__"):
        theta = number(theta_deg, "theta_deg", what)
        if not 0.0 <= theta <= limit_deg:
            raise InputError(f"theta_deg = {theta:g} is out of range: give {what}")
        turn = math.radians(theta)
        return float(formula(math.cos(turn), math.sin(turn), SCALAR))
    # Kept apart so that single numbers do not load numpy.
    import numpy as np

    thetas = np.asarray(theta_deg, dtype=np.float64)
    outside = ~((thetas >= 0.0) & (thetas <= limit_deg))
    if outside.any():
        raise InputError(f"theta_deg = {thetas[outside][0]:g} is out of range: give {what}")
    turns = np.radians(thetas)
    with np.errstate(invalid="ignore", divide="ignore"):
        return formula(np.cos(turns), np.sin(turns), array_elementwise())
