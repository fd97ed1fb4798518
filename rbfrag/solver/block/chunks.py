"""Formulas over long arrays in pieces that stay in the processor's cache."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError

FloatArray = NDArray[np.float64]

CHUNK = 1 << 14
"""Elements of one piece."""


def common_shape(given: dict[str, ArrayLike]) -> tuple[dict[str, FloatArray], tuple[int, ...]]:
    """Return the arguments as arrays of floats, and the shape they broadcast to.

    Args:
        given: numbers or arrays by name.

    Raises:
        InputError: an argument holds no numbers, or the shapes do not go together.
    """
    arrays: dict[str, FloatArray] = {}
    for name, value in given.items():
        try:
            arrays[name] = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(
                f"{name} holds something that is not a number: {value!r:.80}"
            ) from None
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InputError(f"the shapes do not go together: {shapes}") from None
    return arrays, shape


def in_chunks(
    formula: Callable[..., Any],
    inputs: Sequence[NDArray[Any]],
    outputs: Sequence[NDArray[Any]],
) -> None:
    """Fill the outputs with what a formula makes of the inputs, piece by piece.

    Args:
        formula: takes one piece of each input, or the number where an input is a single one
            among many; returns one piece for each output.
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
        piece = slice(start, start + CHUNK)
        found = formula(*(x if isinstance(x, float) else x[piece] for x in flat_in))
        for target, values in zip(flat_out, found, strict=True):
            target[piece] = values
