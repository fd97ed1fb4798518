"""Many parallelogram blocks at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.results.result import Tabular
from rbfrag.solver.block.formulas import (
    array_elementwise,
    corner_distance,
    cot_gamma,
    frequency_parameter,
    parallelogram_inertia,
    shape_factor,
    tan_deg,
    tangents_from_spacings,
)
from rbfrag.solver.results import FloatArray

CHUNK = 1 << 14
"""Elements of one chunk."""


def common_shape(inputs: dict[str, ArrayLike]) -> tuple[dict[str, FloatArray], tuple[int, ...]]:
    """Return the arguments as arrays of floats, and their broadcast shape.

    Raises:
        InputError: an argument holds no numbers, or the shapes do not go together.
    """
    arrays: dict[str, FloatArray] = {}
    for name, value in inputs.items():
        try:
            arrays[name] = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(f"{name} has an element that is not a number: {value!r:.80}") from None
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InputError(f"the shapes of the arrays are not compatible: {shapes}") from None
    return arrays, shape


def in_chunks(
    formula: Callable[..., Any], inputs: Sequence[NDArray[Any]], outputs: Sequence[NDArray[Any]]
) -> None:
    """Fill the outputs by a formula of the inputs, chunk by chunk.

    Args:
        formula: takes one chunk of each input, or the number where an input is a single one
            among many; returns one chunk for each output.
        inputs: arrays that broadcast to the shape of the outputs.
        outputs: arrays to fill, contiguous, all of one shape.
    """
    shape, size = outputs[0].shape, outputs[0].size
    flat_in: list[Any] = [
        float(array) if array.ndim == 0 and size != 1 else np.broadcast_to(array, shape).ravel()
        for array in inputs
    ]
    flat_out = [array.reshape(-1) for array in outputs]
    for start in range(0, size, CHUNK):
        part = slice(start, start + CHUNK)
        chunk_values = formula(*(x if isinstance(x, float) else x[part] for x in flat_in))
        for target, values in zip(flat_out, chunk_values, strict=True):
            target[part] = values


CodeArray = NDArray[np.int8]

REASONS = (
    "",
    "a value that describes the block is not a finite number",
    "an angle of the block is out of range: alpha1_deg and alpha3_deg between -90 and 90, "
    "gamma_deg between 0 and 180",
    "a length of the block is not above zero",
    "alpha1_deg is not below alpha3_deg: such angles belong to no block",
    "beta_deg is not between -90 and 90",
    "phi_deg or phi_back_deg is not a friction angle from 0 to below 90 degrees",
    "kv is not above -1: the ground falls away under the block (a jump)",
    "cohesion_pa is below zero, density_kg_m3 is not above zero, or either is not finite",
    "water_m, jrc or joint_length_m is below zero, jcs_mpa is not above zero, or one is not finite",
    "water_m stands above the top of the back fracture, or the fracture does not rise from the "
    "heel",
    "the water lifts the block off its base: it floats",
)
"""Why there is no answer for an element, by its reason code; 0 for none."""

_NOT_FINITE, _ANGLE, _LENGTH, _NO_BLOCK = 1, 2, 3, 4


@dataclass(frozen=True, eq=False, repr=False)
class BlockArray(Tabular):
    """Parallelogram blocks of any number; invalid elements are NaN with a reason.

    Args:
        tan_alpha1: tan α1, shape (...).
        tan_alpha3: tan α3, same shape.
        half_s1_m: half of the thickness normal to the base [m], same shape.
        reason_code: why an element is no block, a place in :data:`REASONS`; same shape.
    """

    tan_alpha1: FloatArray
    tan_alpha3: FloatArray
    half_s1_m: FloatArray
    reason_code: CodeArray

    @classmethod
    def rectangle(cls, height_m: ArrayLike, width_m: ArrayLike) -> BlockArray:
        """Return rectangles; the arguments broadcast.

        Args:
            height_m: heights, perpendicular to the base planes [m].
            width_m: widths along the base planes [m].

        Raises:
            InputError: an argument holds no numbers, or the shapes do not go together.
        """

        def formula(height: FloatArray, width: FloatArray) -> _Columns:
            reason = _reasons((height, width), (height, width))
            height, width = _only_usable(reason, height, width)
            t3 = width / height
            return -t3, t3, height * 0.5, reason

        return _blocks(formula, {"height_m": height_m, "width_m": width_m})

    @classmethod
    def from_angles(
        cls, alpha1_deg: ArrayLike, alpha3_deg: ArrayLike, r3_m: ArrayLike
    ) -> BlockArray:
        """Return the blocks of two block angles and a size; the arguments broadcast.

        Args:
            alpha1_deg: angles of the heel [deg].
            alpha3_deg: angles of the toe [deg].
            r3_m: distances from centroid to toe [m].

        Raises:
            InputError: an argument holds no numbers, or the shapes do not go together.
        """
        functions = array_elementwise()

        def formula(alpha1: FloatArray, alpha3: FloatArray, r3: FloatArray) -> _Columns:
            reason = _reasons((alpha1, alpha3, r3), (r3,))
            in_range = (np.abs(alpha1) < 90.0) & (np.abs(alpha3) < 90.0)
            _because(_ANGLE, ~in_range, reason)
            _because(_NO_BLOCK, alpha1 >= alpha3, reason)
            alpha1, alpha3, r3 = _only_usable(reason, alpha1, alpha3, r3)
            t1, t3 = tan_deg(alpha1, functions), tan_deg(alpha3, functions)
            _because(_NO_BLOCK, t1 >= t3, reason)
            return t1, t3, r3 / corner_distance(1.0, t3, functions), reason

        return _blocks(formula, {"alpha1_deg": alpha1_deg, "alpha3_deg": alpha3_deg, "r3_m": r3_m})

    @classmethod
    def from_fractures(cls, s1_m: ArrayLike, s2_m: ArrayLike, gamma_deg: ArrayLike) -> BlockArray:
        """Return the blocks that pairs of fracture sets cut out; the arguments broadcast.

        Args:
            s1_m: spacings of the base fractures [m].
            s2_m: spacings of the back fractures [m].
            gamma_deg: dips of the back planes less dips of the bases [deg].

        Raises:
            InputError: an argument holds no numbers, or the shapes do not go together.
        """
        functions = array_elementwise()

        def formula(s1: FloatArray, s2: FloatArray, gamma: FloatArray) -> _Columns:
            reason = _reasons((s1, s2, gamma), (s1, s2))
            _because(_ANGLE, ~((gamma > 0.0) & (gamma < 180.0)), reason)
            s1, s2, gamma = _only_usable(reason, s1, s2, gamma)
            t1, t3 = tangents_from_spacings(s1, s2, gamma, functions)
            _because(_NO_BLOCK, t1 >= t3, reason)
            return t1, t3, s1 * 0.5, reason

        return _blocks(formula, {"s1_m": s1_m, "s2_m": s2_m, "gamma_deg": gamma_deg})

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the arrays."""
        return self.tan_alpha1.shape

    @property
    def size(self) -> int:
        """Number of elements."""
        return int(self.tan_alpha1.size)

    @property
    def reason(self) -> NDArray[np.str_]:
        """Reason why an element is not a valid block, as text; empty for valid ones."""
        return np.array(REASONS)[self.reason_code]

    def at(self, indices: NDArray[np.intp]) -> BlockArray:
        """Return a selection of the blocks; a single block broadcasts."""
        parts: list[Any] = [self.tan_alpha1, self.tan_alpha3, self.half_s1_m, self.reason_code]
        return BlockArray(*(part if part.size == 1 else part[indices] for part in parts))

    @property
    def inertia_m2(self) -> FloatArray:
        """Moments of inertia about the centroid per mass [m²]."""
        return parallelogram_inertia(self.tan_alpha1, self.tan_alpha3, self.half_s1_m)

    @property
    def alpha1_deg(self) -> FloatArray:
        """Angles of the heel [deg]."""
        return np.degrees(np.arctan(self.tan_alpha1))

    @property
    def alpha3_deg(self) -> FloatArray:
        """Angles of the toe [deg]."""
        return np.degrees(np.arctan(self.tan_alpha3))

    @property
    def gamma_deg(self) -> FloatArray:
        """Angles of the back planes [deg]."""
        return np.degrees(np.arctan2(1.0, cot_gamma(self.tan_alpha1, self.tan_alpha3)))

    @property
    def r1_m(self) -> FloatArray:
        """Distances from the centroid to the heel [m]."""
        return corner_distance(self.half_s1_m, self.tan_alpha1, array_elementwise())

    @property
    def r3_m(self) -> FloatArray:
        """Distances from the centroid to the toe [m]."""
        return corner_distance(self.half_s1_m, self.tan_alpha3, array_elementwise())

    @property
    def toe(self) -> tuple[FloatArray, FloatArray]:
        """Toes from the centroids: along the bases, out of the slope, and off them [m]."""
        return self.half_s1_m * self.tan_alpha3, -self.half_s1_m

    @property
    def heel(self) -> tuple[FloatArray, FloatArray]:
        """Heels likewise [m]."""
        return self.half_s1_m * self.tan_alpha1, -self.half_s1_m

    @property
    def shape_factor(self) -> FloatArray:
        """F_s = m r3²/I_toe (eq. 4.27)."""
        return shape_factor(self.tan_alpha1, self.tan_alpha3)

    @property
    def p2(self) -> FloatArray:
        """Frequency parameters p² [1/s²] at standard gravity."""
        return frequency_parameter(self.shape_factor, self.r3_m)


_Columns = tuple[FloatArray, FloatArray, FloatArray, CodeArray]


def _blocks(formula: Callable[..., _Columns], inputs: dict[str, ArrayLike]) -> BlockArray:
    arrays, shape = common_shape(inputs)
    t1, t3, h = (np.empty(shape) for _ in range(3))
    reason = np.empty(shape, dtype=np.int8)
    columns = [np.broadcast_to(array, shape) for array in arrays.values()]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        in_chunks(formula, columns, (t1, t3, h, reason))
    return BlockArray(t1, t3, h, reason)


def _reasons(values: tuple[FloatArray, ...], lengths: tuple[FloatArray, ...]) -> CodeArray:
    reason = np.zeros(values[0].shape, dtype=np.int8)
    for value in values:
        _because(_NOT_FINITE, ~np.isfinite(value), reason)
    for length in lengths:
        _because(_LENGTH, length <= 0.0, reason)
    return reason


def _because(code: int, holds: NDArray[np.bool_], reason: CodeArray) -> None:
    """Enter a reason where it holds and no earlier one does."""
    if holds.any():
        reason[holds & (reason == 0)] = code


def _only_usable(reason: CodeArray, *values: FloatArray) -> tuple[FloatArray, ...]:
    """Return the values with NaN for invalid blocks."""
    if not reason.any():
        return values
    return tuple(np.where(reason == 0, value, np.nan) for value in values)
