"""The failure modes and yield accelerations of many blocks at once: `stability_arrays`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
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
    SLIDE,
    SLUMP,
    STATES,
    TOPPLE,
    confined_bond,
    confined_topple,
    mode_code,
    mode_code_without_back,
    on_its_branch,
    sliding_limit,
    slump,
    slump_bond,
    state_code,
    toe_lifts,
    wedges,
    yield_coefficient,
)

NOTHING = -1
"""Mode and state code of an element without an answer."""

_USABLE: dict[str, tuple[int, Callable[[FloatArray], NDArray[np.bool_]]]] = {
    "beta_deg": (5, lambda beta: np.abs(beta) < 90.0),
    "phi_deg": (6, lambda phi: (phi >= 0.0) & (phi < 90.0)),
    "kv": (7, lambda kv: (kv > -1.0) & (kv < math.inf)),
    "phi_back_deg": (6, lambda phi: (phi >= 0.0) & (phi < 90.0)),
    "cohesion_pa": (8, lambda cohesion: (cohesion >= 0.0) & (cohesion < math.inf)),
    "density_kg_m3": (8, lambda density: (density > 0.0) & (density < math.inf)),
}
"""Which values can be used, and the reason code of the others, by argument."""


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
        toe_lifts: where the bond of the base is so strong that the toe lifts off before it
            slides, so that the yield is an upper bound.
    """

    mode_code: CodeArray
    state_code: CodeArray
    yield_acceleration: FloatArray
    ky: FloatArray
    p2: FloatArray
    reason_code: CodeArray
    toe_lifts: NDArray[np.bool_]

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
    cohesion_pa: ArrayLike | None = None,
    density_kg_m3: ArrayLike | None = None,
    nan: Literal["propagate", "raise"] = "propagate",
) -> StabilityArray:
    """Return the failure modes, states and yield accelerations of many parallelogram blocks.

    The formulas are those of :func:`rbfrag.solver.stability.single.stability`, and the answers are
    the same to the last bit.

    Args:
        blocks: the blocks; the other arguments broadcast with them.
        beta_deg: dip of the base planes, between -90 and 90 [deg].
        phi_deg: friction angles of the bases, from 0 and below 90 [deg].
        phi_back_deg: friction angles of the back planes [deg]; None for those of the bases.
        kv: vertical acceleration of the ground, up positive, above -1 [g].
        back_fracture: False for blocks that no plane supports or hinders from behind.
        cohesion_pa: cohesions of the bases, from 0 [Pa]; None for none.
        density_kg_m3: densities of the rock, needed with a cohesion [kg/m³].
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
    if cohesion_pa is not None:
        if density_kg_m3 is None:
            raise InputError("cohesion_pa needs density_kg_m3, the density of the rock")
        given |= {"cohesion_pa": cohesion_pa, "density_kg_m3": density_kg_m3}
    arrays, shape = common_shape({"blocks": blocks.tan_alpha1, **given})
    functions = array_elementwise()

    def formula(
        t1: FloatArray, t3: FloatArray, h: FloatArray, bad: Any, *others: Any
    ) -> tuple[Any, ...]:
        there = dict(zip(given, others, strict=True))
        reason = _reasons(bad, t1.size, there)
        if reason.any():
            ok = reason == 0
            t1, t3, h = (np.where(ok, value, math.nan) for value in (t1, t3, h))
            there = {name: _harmless(value, ok) for name, value in there.items()}
        tb, mu1 = _tangent(there["beta_deg"]), _tangent(there["phi_deg"])
        mu2 = _tangent(there["phi_back_deg"]) if "phi_back_deg" in there else mu1
        weight = 1.0 + there["kv"]
        cot = cot_gamma(t1, t3)
        bond, limit = None, mu1
        lifts: Any = False
        if "cohesion_pa" in there:
            bond = _bond(t1, t3, h, there["cohesion_pa"], there["density_kg_m3"])
            term = bond * np.sqrt(1.0 + tb * tb)
            ky = yield_coefficient(mu1, 1.0, tb, weight, functions, term)
            limit = sliding_limit(mu1, tb, weight, ky, bond, functions)
        else:
            ky = yield_coefficient(mu1, 1.0, tb, weight, functions)
        if back_fracture:
            mode = mode_code(t1, t3, limit, cot < 0.0, functions)
            sine, cosine = _direction(mode, t1, t3, cot, mu1, mu2)
            share = 0.0 if bond is None else term * _share_of_bond(mode, t1, t3, cot, mu2)
            k = yield_coefficient(sine, cosine, tb, weight, functions, share)
            confined = mode == CONFINED_TOPPLE
            if confined.any():
                branch = on_its_branch(k, ky, wedges(cot, mu1, mu2), functions)
                k = np.where(confined, branch, k)
            if bond is not None:
                phi_back = there.get("phi_back_deg", there["phi_deg"])
                beyond = phi_back > there["phi_deg"] + np.degrees(np.arctan2(1.0, cot))
                reaction = _base_reaction(mode, t1, t3, cot, mu1, mu2)
                slumps = mode == SLUMP
                k = np.where(slumps, on_its_branch(k, ky, beyond, functions), k)
                k = np.where(slumps & (reaction <= 0.0), -math.inf, k)
                k = np.where(confined & (reaction <= 0.0), math.inf, k)
                lifts = toe_lifts(k, reaction, cosine, mu2 - cot, tb, weight, bond, functions) & (
                    confined & (bond > 0.0) & np.isfinite(k)
                )
            state = state_code(k, functions)
        else:
            mode = mode_code_without_back(t1, t3, limit, tb, functions)
            k = np.where(mode == TOPPLE, yield_coefficient(t3, 1.0, tb, weight, functions), ky)
            k = np.where(tb < t1, -math.inf, k)
            state = state_code(k, functions)
        r3 = h * np.sqrt(t3 * t3 + 1.0)
        p2 = frequency_parameter(shape_factor(t1, t3), r3)
        if reason.any():
            mode, state = np.where(ok, mode, NOTHING), np.where(ok, state, NOTHING)
            k, ky, p2 = (np.where(ok, value, math.nan) for value in (k, ky, p2))
            lifts = np.where(ok, lifts, False)
        return mode, state, k, ky, p2, reason, lifts

    codes = [np.empty(shape, dtype=np.int8) for _ in range(3)]
    k, ky, p2 = (np.empty(shape) for _ in range(3))
    lifts = np.empty(shape, dtype=np.bool_)
    whole = (blocks.tan_alpha1, blocks.tan_alpha3, blocks.half_s1_m, blocks.reason_code)
    inputs: list[Any] = [np.broadcast_to(array, shape) for array in whole]
    inputs += [arrays[name] for name in given]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        in_chunks(formula, inputs, (codes[0], codes[1], k, ky, p2, codes[2], lifts))
    result = StabilityArray(codes[0], codes[1], k, ky, p2, codes[2], lifts)
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


def _bond(t1: FloatArray, t3: FloatArray, h: FloatArray, cohesion: Any, density: Any) -> FloatArray:
    """Return the strength of the base's bond over the weight, c L/(ρ g A)."""
    base = h * t3 - h * t1
    area = base * 2.0 * h
    return np.asarray(cohesion * base / (density * STANDARD_GRAVITY_M_S2 * area))


def _share_of_bond(
    mode: NDArray[Any], t1: FloatArray, t3: FloatArray, cot: FloatArray, mu2: Any
) -> FloatArray:
    """Return what a bond adds to the numerator of the governing yield, over that of sliding."""
    share = np.where(mode == SLIDE, 1.0, 0.0)
    share = np.where(mode == SLUMP, slump_bond(t1, -1.0, -t3, 1.0, cot, mu2), share)
    confined = confined_bond(t3, -1.0, t1, -1.0, cot, mu2)
    return np.asarray(np.where(mode == CONFINED_TOPPLE, confined, share))


def _base_reaction(
    mode: NDArray[Any], t1: FloatArray, t3: FloatArray, cot: FloatArray, mu1: Any, mu2: Any
) -> FloatArray:
    """Return the reaction of the base, up to a factor, of blocks that slump or topple confined."""
    slumping = slump(t1, -1.0, -t3, 1.0, cot, mu1, mu2)[2]
    confined = confined_topple(t3, -1.0, t1, -1.0, cot, mu1, mu2)[2]
    return np.asarray(np.where(mode == SLUMP, slumping, confined))


def _reasons(bad: CodeArray, size: int, given: Mapping[str, Any]) -> CodeArray:
    reason = np.broadcast_to(bad, (size,)).astype(np.int8)
    for name, (code, fine) in _USABLE.items():
        if name in given:
            usable = fine(np.asarray(given[name]))
            if not np.all(usable):
                reason[~usable & (reason == 0)] = code
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
