"""Failure modes and yield accelerations of arrays of blocks: `stability_arrays`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.result import Tabular
from rbfrag.solver.block.arrays import REASONS, BlockArray, CodeArray, common_shape, in_chunks
from rbfrag.solver.block.formulas import (
    SCALAR,
    array_elementwise,
    bond_over_weight,
    corner_distance,
    cot_gamma,
    frequency_parameter,
    shape_factor,
    tan_deg,
)
from rbfrag.solver.results import FloatArray
from rbfrag.solver.stability import joint as joints
from rbfrag.solver.stability.modes import (
    CONFINED_TOPPLE,
    MODES,
    SLIDE,
    SLUMP,
    STATES,
    TOPPLE,
    Planes,
    Water,
    state_code,
)

NOTHING = -1
"""Mode and state code of an element without an answer."""

_VALIDITY: dict[str, tuple[int, Callable[[FloatArray], NDArray[np.bool_]]]] = {
    "beta_deg": (5, lambda beta: np.abs(beta) < 90.0),
    "phi_deg": (6, lambda phi: (phi >= 0.0) & (phi < 90.0)),
    "kv": (7, lambda kv: (kv > -1.0) & (kv < math.inf)),
    "phi_back_deg": (6, lambda phi: (phi >= 0.0) & (phi < 90.0)),
    "cohesion_pa": (8, lambda cohesion: (cohesion >= 0.0) & (cohesion < math.inf)),
    "density_kg_m3": (8, lambda density: (density > 0.0) & (density < math.inf)),
    "water_m": (9, lambda water: (water >= 0.0) & (water < math.inf)),
    "jrc": (9, lambda jrc: (jrc >= 0.0) & (jrc < math.inf)),
    "jcs_mpa": (9, lambda jcs: (jcs > 0.0) & (jcs < math.inf)),
    "joint_length_m": (9, lambda length: (length >= 0.0) & (length < math.inf)),
}
"""Which values can be used, and the reason code of the others, by argument."""

OF_JOINT, _SPILLS, FLOATS = 9, 10, 11


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
        phi_deg: friction angles of the bases, of rough ones the secant angles at their yields
            [deg].
    """

    mode_code: CodeArray
    state_code: CodeArray
    yield_acceleration: FloatArray
    ky: FloatArray
    p2: FloatArray
    reason_code: CodeArray
    toe_lifts: NDArray[np.bool_]
    phi_deg: FloatArray

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
        """Reason why there is no answer, as text; empty where there is one."""
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
    **joint: Unpack[joints.OnJoint[ArrayLike]],
) -> StabilityArray:
    """Return the failure modes, states and yield accelerations of many parallelogram blocks.

    The formulas are those of :func:`rbfrag.solver.stability.single.stability`, and the answers are
    the same to the last bit, those with roughness to rounding.

    Args:
        blocks: the blocks; the other arguments broadcast with them.
        beta_deg: dip of the base planes, between -90 and 90 [deg].
        phi_deg: friction angles of the bases, from 0 and below 90 [deg].
        phi_back_deg: friction angles of the back planes [deg]; None for those of the bases.
        kv: vertical acceleration of the ground, up positive, above -1 [g].
        back_fracture: False for blocks that no plane supports or hinders from behind.
        cohesion_pa: cohesions of the bases, from 0 [Pa]; None for none.
        density_kg_m3: densities of the rock [kg/m³]; None for 2,650 where cohesion, water or
            roughness need it.
        nan: ``propagate`` answers NaN with its reason where the input cannot be used,
            ``raise`` rejects it.
        joint: water and roughness, as :class:`rbfrag.solver.stability.joint.OnJoint` has them.

    Raises:
        InputError: shapes that do not go together, or unusable input that was to be rejected.
    """
    if (drainage := joint.pop("drainage", None)) is not None and "water_m" in joint:
        joint["water_m"] = _undrained(joint["water_m"], drainage)
    if nan not in ("propagate", "raise"):
        raise InputError(f"nan = {nan!r}: use 'propagate' or 'raise'")
    fields = {"beta_deg": beta_deg, "phi_deg": phi_deg, "kv": kv}
    if phi_back_deg is not None:
        fields["phi_back_deg"] = phi_back_deg
    joints.reject_half(*(joint.get(name) for name in ("jrc", "jcs_mpa", "joint_length_m")))
    on_base = {"cohesion_pa": cohesion_pa, **joint}
    strength: dict[str, Any] = {n: value for n, value in on_base.items() if value is not None}
    if strength:
        density = joints.ROCK_KG_M3 if density_kg_m3 is None else density_kg_m3
        fields |= {**strength, "density_kg_m3": density}
    if joint.get("water_m") is not None and not back_fracture:
        raise InputError(joints.NO_FRACTURE, fields=("water_m", "back_fracture"))
    arrays, shape = common_shape({"blocks": blocks.tan_alpha1, **fields})

    def formula(
        t1: FloatArray, t3: FloatArray, h: FloatArray, bad: Any, *arrays: Any
    ) -> tuple[Any, ...]:
        there = dict(zip(fields, arrays, strict=True))
        reason = _reasons(bad, t1.size, there)
        # NaN and harmless planes give no warning and no mode by chance
        if reason.any():
            ok = reason == 0
            t1, t3, h = (np.where(ok, value, math.nan) for value in (t1, t3, h))
            there = {name: np.where(ok, value, 0.0) for name, value in there.items()}
        bond = water = None
        secant_deg = there["phi_deg"]
        if "cohesion_pa" in there:
            base = h * t3 - h * t1
            bond = np.asarray(
                bond_over_weight(there["cohesion_pa"], there["density_kg_m3"], base, base * 2.0 * h)
            )
        tb, mu1 = _tangent(there["beta_deg"]), _tangent(there["phi_deg"])
        mu2 = _tangent(there["phi_back_deg"]) if "phi_back_deg" in there else mu1
        functions = array_elementwise()
        if "water_m" in there:
            water, holds = joints.water_at(
                water_m=there["water_m"], density_kg_m3=there["density_kg_m3"], half_s1_m=h,
                tan_alpha1=t1, tan_alpha3=t3, cot=cot_gamma(t1, t3), tan_beta=tb,
                functions=functions,
            )  # fmt: skip
            reason[(reason == 0) & (holds ^ True) & (there["water_m"] > 0.0)] = _SPILLS
            water = Water(
                *(np.where(there["water_m"] > 0.0, values, 0.0) for values in vars(water).values())
            )
        planes = Planes(tb, mu1, mu2, 1.0 + there["kv"], functions, bond, water)
        if "jrc" in there:
            base, length = h * t3 - h * t1, there.get("joint_length_m", 0.0)
            length = np.maximum(np.where(np.asarray(length) > 0.0, length, base), joints.LAB_M)
            weight = there["density_kg_m3"] * STANDARD_GRAVITY_M_S2 * 2.0 * h
            planes, (_, _, _, secant_deg) = joints.roughened(
                planes, there["phi_deg"], jrc=there["jrc"], jcs_mpa=there["jcs_mpa"],
                length_m=length, weight_pa=weight, power=np.power,
            )  # fmt: skip
        mode, k, ky, lifts, floats = _yields(t1, t3, planes, back_fracture)
        reason[(reason == 0) & floats] = FLOATS
        state = state_code(k, planes.functions)
        p2 = frequency_parameter(shape_factor(t1, t3), corner_distance(h, t3, planes.functions))
        if reason.any():
            ok = reason == 0
            mode, state = np.where(ok, mode, NOTHING), np.where(ok, state, NOTHING)
            k, ky, p2 = (np.where(ok, value, math.nan) for value in (k, ky, p2))
            lifts = lifts & ok
        return mode, state, k, ky, p2, reason, lifts, secant_deg

    codes = [np.empty(shape, dtype=np.int8) for _ in range(3)]
    k, ky, p2, secant_deg = (np.empty(shape) for _ in range(4))
    lifts = np.empty(shape, dtype=np.bool_)
    columns = (blocks.tan_alpha1, blocks.tan_alpha3, blocks.half_s1_m, blocks.reason_code)
    inputs: list[Any] = [np.broadcast_to(array, shape) for array in columns]
    inputs += [arrays[name] for name in fields]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        in_chunks(formula, inputs, (codes[0], codes[1], k, ky, p2, codes[2], lifts, secant_deg))
    result = StabilityArray(codes[0], codes[1], k, ky, p2, codes[2], lifts, secant_deg)
    if nan == "raise" and result.reason_code.any():
        first = np.flatnonzero(result.reason_code.ravel())[0]
        place = tuple(int(i) for i in np.unravel_index(first, shape))
        raise InputError(
            f"element {place[0] if len(place) == 1 else place}: {REASONS[codes[2][place]]}"
        )
    return result


def water_held_m(
    water_m: ArrayLike, *, s1_m: ArrayLike, gamma_deg: ArrayLike, beta_deg: ArrayLike
) -> FloatArray:
    """Return the heights of water [m] that back fractures can hold: the excess above their top runs
    off.
    """
    gamma, beta = np.radians(gamma_deg), np.radians(beta_deg)
    with np.errstate(invalid="ignore", divide="ignore"):
        top_m = s1_m * np.sin(beta + gamma) / np.sin(gamma)
    return np.asarray(np.minimum(water_m, np.maximum(top_m, 0.0)))


def _undrained(water_m: ArrayLike, drainage: ArrayLike) -> FloatArray:
    """Return the water [m] that keeps acting while blocks move: none on drained blocks."""
    words = np.asarray(drainage, dtype=str)
    # an empty word, as of a cell that was not filled in, means undrained
    drained = np.vectorize(lambda word: joints.is_drained(word or None), otypes=[bool])(words)
    height_m = np.asarray(water_m, dtype=np.float64)
    return np.where(drained & (height_m > 0.0), 0.0, height_m)


def _tangent(angle_deg: Any) -> Any:
    if isinstance(angle_deg, float):
        return tan_deg(angle_deg, SCALAR)
    return tan_deg(angle_deg, array_elementwise())


def _yields(
    t1: FloatArray, t3: FloatArray, planes: Planes[Any], back_fracture: bool
) -> tuple[NDArray[Any], FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return modes, their yields, those of sliding, and the blocks with a lifting toe or afloat."""
    cot, ky = cot_gamma(t1, t3), planes.ky
    k, lifts = np.array(np.broadcast_to(ky, t1.shape)), np.zeros(t1.shape, dtype=np.bool_)
    floats = np.array(np.broadcast_to(planes.floats(k, SLIDE, cot), t1.shape))
    mode = planes.mode(t1, t3, cot < 0.0, back_fracture=back_fracture)
    for code in (TOPPLE, SLUMP, CONFINED_TOPPLE):
        rows = np.flatnonzero(mode == code)
        if rows.size:
            a1, a3 = t1[rows], t3[rows]
            # in units of half the S1, as `Block.arms` has them
            arms = (a1, -1.0), (-a3, 1.0), (a3, -1.0), (a1, -1.0)
            # single numbers hold for all rows
            parts: dict[str, Any] = {
                name: value[rows]
                for name in ("tan_beta", "mu1", "mu2", "weight", "bond")
                if isinstance(value := getattr(planes, name), np.ndarray)
            }
            if planes.water is not None:
                parts["water"] = Water(*(part[rows] for part in vars(planes.water).values()))
            rows_planes = replace(planes, **parts)
            k[rows], _, lifts[rows] = rows_planes.yield_of(code, arms, cot[rows])
            floats[rows] = rows_planes.floats(k[rows], code, cot[rows])
    if not back_fracture:
        # the weight passes upslope of the heel, and nothing stands there to lean on
        k[planes.tan_beta < t1] = -math.inf
    return mode, k, ky, lifts, floats


def _reasons(bad: CodeArray, size: int, inputs: Mapping[str, Any]) -> CodeArray:
    reason = np.broadcast_to(bad, (size,)).astype(np.int8)
    for name, (code, fine) in _VALIDITY.items():
        if name in inputs:
            valid = fine(np.asarray(inputs[name]))
            if not np.all(valid):
                reason[~valid & (reason == 0)] = code
    return reason
