"""The failure modes and yield accelerations of many blocks at once: `stability_arrays`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.frames import Tabular
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.arrays import (
    REASONS,
    BlockArray,
    CodeArray,
    FloatArray,
    common_shape,
    in_chunks,
)
from rbfrag.solver.block.formulas import (
    SCALAR,
    array_elementwise,
    cot_gamma,
    frequency_parameter,
    shape_factor,
    tan_deg,
)
from rbfrag.solver.stability.modes import (
    CONFINED_TOPPLE,
    MODES,
    SLUMP,
    STATES,
    TOPPLE,
    confined_topple,
    mode_code,
    mode_code_without_back,
    on_its_branch,
    slump,
    state_code,
    wedges,
    yield_coefficient,
)

NOTHING = -1
"""Mode and state code of an element without an answer."""

_BETA, _PHI, _KV = 5, 6, 7


@dataclass(frozen=True, eq=False, repr=False)
class StabilityArray(Tabular):
    """Failure modes and yields of many blocks; all arrays have one shape.

    Args:
        mode_code: place of the mode in :data:`rbfrag.solver.stability.modes.MODES`; -1 for none.
        state_code: place of the state in :data:`rbfrag.solver.stability.modes.STATES`; -1 for none.
        yield_acceleration: of the governing mode [g]; +inf if locked, -inf if nothing holds the
            block, NaN for no answer.
        ky: of sliding [g].
        p2: frequency parameters p² [1/s²].
        reason_code: why there is no answer, a place in
            :data:`rbfrag.solver.block.arrays.REASONS`.
    """

    mode_code: CodeArray
    state_code: CodeArray
    yield_acceleration: FloatArray
    ky: FloatArray
    p2: FloatArray
    reason_code: CodeArray

    @property
    def mode(self) -> NDArray[np.str_]:
        """Names of the modes; empty for no answer."""
        return np.array([*MODES, ""])[self.mode_code]

    @property
    def state(self) -> NDArray[np.str_]:
        """Names of the states; empty for no answer."""
        return np.array([*STATES, ""])[self.state_code]

    @property
    def reason(self) -> NDArray[np.str_]:
        """Why there is no answer, as text; empty where there is one."""
        return np.array(REASONS)[self.reason_code]

    @property
    def kr(self) -> FloatArray:
        """Yield accelerations of toppling [g]; NaN for other modes."""
        return self._only(TOPPLE)

    @property
    def ks(self) -> FloatArray:
        """Yield accelerations of slumping [g]; NaN for other modes."""
        return self._only(SLUMP)

    @property
    def kct(self) -> FloatArray:
        """Yield accelerations of confined toppling [g]; NaN for other modes."""
        return self._only(CONFINED_TOPPLE)

    def _only(self, code: int) -> FloatArray:
        return np.where(self.mode_code == code, self.yield_acceleration, math.nan)


def stability_arrays(
    blocks: BlockArray,
    *,
    beta_deg: ArrayLike,
    phi_deg: ArrayLike,
    phi_back_deg: ArrayLike | None = None,
    kv: ArrayLike = 0.0,
    back_fracture: bool = True,
    nan: Literal["propagate", "raise"] = "propagate",
) -> StabilityArray:
    """Return the failure modes, states and yield accelerations of many parallelogram blocks.

    The formulas are those of :func:`rbfrag.solver.stability.single.stability`, and the answers are
    the
    same to the last bit. Cohesion is not taken into account.

    Args:
        blocks: the blocks; the other arguments broadcast with them.
        beta_deg: dip of the base planes, between -90 and 90 [deg].
        phi_deg: friction angles of the bases, from 0 and below 90 [deg].
        phi_back_deg: friction angles of the back planes [deg]; None for those of the bases.
        kv: vertical acceleration of the ground, up positive, above -1 [g].
        back_fracture: False for blocks that no plane supports or hinders from behind.
        nan: ``propagate`` answers NaN with its reason where the input cannot be used,
            ``raise`` refuses it.

    Raises:
        InputError: shapes that do not go together, or unusable input that was to be refused.
    """
    if nan not in ("propagate", "raise"):
        raise InputError(f"nan = {nan!r}: use 'propagate' or 'raise'")
    given = {"beta_deg": beta_deg, "phi_deg": phi_deg, "kv": kv}
    if phi_back_deg is not None:
        given["phi_back_deg"] = phi_back_deg
    arrays, shape = common_shape({"blocks": blocks.tan_alpha1, **given})
    functions = array_elementwise()

    def formula(
        t1: FloatArray, t3: FloatArray, h: FloatArray, bad: Any, *others: Any
    ) -> tuple[Any, ...]:
        beta, phi, kv_there, phi_back = (*others, None) if phi_back_deg is None else others
        reason = _reasons(bad, t1.size, beta, phi, kv_there, phi_back)
        if reason.any():
            ok = reason == 0
            t1, t3, h = (np.where(ok, value, math.nan) for value in (t1, t3, h))
            beta, phi, kv_there = (_harmless(value, ok) for value in (beta, phi, kv_there))
            phi_back = None if phi_back is None else _harmless(phi_back, ok)
        tb, mu1 = _tangent(beta), _tangent(phi)
        mu2 = mu1 if phi_back is None else _tangent(phi_back)
        weight = 1.0 + kv_there
        cot = cot_gamma(t1, t3)
        ky = yield_coefficient(mu1, 1.0, tb, weight, functions)
        if back_fracture:
            mode = mode_code(t1, t3, mu1, cot < 0.0, functions)
            sine, cosine = _direction(mode, t1, t3, cot, mu1, mu2)
            k = yield_coefficient(sine, cosine, tb, weight, functions)
            confined = mode == CONFINED_TOPPLE
            if confined.any():
                branch = on_its_branch(k, ky, wedges(cot, mu1, mu2), functions)
                k = np.where(confined, branch, k)
            state = state_code(k, functions)
        else:
            mode = mode_code_without_back(t1, t3, mu1, tb, functions)
            k = np.where(mode == TOPPLE, yield_coefficient(t3, 1.0, tb, weight, functions), ky)
            k = np.where(tb < t1, -math.inf, k)
            state = state_code(k, functions)
        r3 = h * np.sqrt(t3 * t3 + 1.0)
        p2 = frequency_parameter(shape_factor(t1, t3), r3)
        if reason.any():
            mode, state = np.where(ok, mode, NOTHING), np.where(ok, state, NOTHING)
            k, ky, p2 = (np.where(ok, value, math.nan) for value in (k, ky, p2))
        return mode, state, k, ky, p2, reason

    codes = [np.empty(shape, dtype=np.int8) for _ in range(3)]
    k, ky, p2 = (np.empty(shape) for _ in range(3))
    whole = (blocks.tan_alpha1, blocks.tan_alpha3, blocks.half_s1_m, blocks.reason_code)
    inputs: list[Any] = [np.broadcast_to(array, shape) for array in whole]
    inputs += [arrays[name] for name in given]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        in_chunks(formula, inputs, (codes[0], codes[1], k, ky, p2, codes[2]))
    result = StabilityArray(codes[0], codes[1], k, ky, p2, codes[2])
    if nan == "raise" and result.reason_code.any():
        first = np.flatnonzero(result.reason_code.ravel())[0]
        place = tuple(int(i) for i in np.unravel_index(first, shape))
        raise InputError(
            f"element {place[0] if len(place) == 1 else place}: {REASONS[codes[2][place]]}"
        )
    return result


def _tangent(angle_deg: Any) -> Any:
    if isinstance(angle_deg, float):
        return tan_deg(angle_deg, SCALAR)
    return tan_deg(angle_deg, array_elementwise())


def _direction(
    mode: NDArray[Any], t1: FloatArray, t3: FloatArray, cot: FloatArray, mu1: Any, mu2: Any
) -> tuple[FloatArray, FloatArray]:
    """Return sine and cosine of δ* of the governing mode; lengths in units of half the S1."""
    sine = np.where(mode == TOPPLE, t3, mu1)
    cosine = np.ones_like(sine)
    for code in (SLUMP, CONFINED_TOPPLE):
        here = mode == code
        if not here.any():
            continue
        if code == SLUMP:
            mechanism = slump(t1, -1.0, -t3, 1.0, cot, mu1, mu2)
        else:
            mechanism = confined_topple(t3, -1.0, t1, -1.0, cot, mu1, mu2)
        sine = np.where(here, mechanism[0], sine)
        cosine = np.where(here, mechanism[1], cosine)
    return sine, cosine


def _reasons(bad: CodeArray, size: int, beta: Any, phi: Any, kv: Any, phi_back: Any) -> CodeArray:
    reason = np.broadcast_to(bad, (size,)).astype(np.int8)
    checks = [
        (_BETA, np.abs(beta) < 90.0),
        (_PHI, (np.asarray(phi) >= 0.0) & (np.asarray(phi) < 90.0)),
        (_KV, (np.asarray(kv) > -1.0) & (np.asarray(kv) < math.inf)),
    ]
    if phi_back is not None:
        checks.append((_PHI, (np.asarray(phi_back) >= 0.0) & (np.asarray(phi_back) < 90.0)))
    for code, fine in checks:
        if not np.all(fine):
            reason[~fine & (reason == 0)] = code
    return reason


def _harmless(value: Any, ok: NDArray[np.bool_]) -> Any:
    return np.where(ok, value, 0.0)


def slumping_p2(
    *,
    alpha1_deg: FloatArray,
    alpha3_deg: FloatArray,
    gamma_deg: FloatArray,
    r1_m: FloatArray,
    r3_m: FloatArray,
    beta_deg: FloatArray,
    phi_deg: FloatArray,
    phi_back_deg: FloatArray,
) -> FloatArray:
    """Return p_s² of parallelograms at rest [1/s²], shape (n,); NaN where there is none.

    p_s² = g (F_y cos β - F_x sin β)/D with the contact forces of a slump that starts
    (docs/theory/slumping.md).

    Args:
        alpha1_deg: angle of the heel [deg], shape (n,), and so the others.
        alpha3_deg: angle of the toe [deg].
        gamma_deg: dip of the back plane less dip of the base [deg].
        r1_m: distance from centroid to heel [m].
        r3_m: distance from centroid to toe [m].
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg].
    """
    a1, a3, gamma, beta, phi1, phi2 = (
        np.radians(angle)
        for angle in (alpha1_deg, alpha3_deg, gamma_deg, beta_deg, phi_deg, phi_back_deg)
    )
    back_edge = 2.0 * r1_m * np.cos(a1) / np.sin(gamma)
    on_base = r3_m * np.sin(a3 + gamma - phi2)
    on_back = r1_m * np.sin(a1 - phi1)
    force_x = -on_base * np.sin(phi1) + on_back * np.sin(gamma - phi2)
    force_y = on_base * np.cos(phi1) + on_back * np.cos(gamma - phi2)
    path_x = back_edge / np.sin(gamma) - r1_m * np.cos(a1)
    path_y = -r1_m * np.sin(a1)
    inertia_m2 = (r1_m**2 + r3_m**2) / 6.0
    inertia = force_y * path_x - force_x * path_y + inertia_m2 * np.sin(gamma + phi1 - phi2)
    pull = STANDARD_GRAVITY_M_S2 * (force_y * np.cos(beta) - force_x * np.sin(beta))
    with np.errstate(divide="ignore", invalid="ignore"):
        p2 = pull / inertia
    return np.asarray(np.where((inertia > 0.0) & (p2 > 0.0), p2, np.nan))
