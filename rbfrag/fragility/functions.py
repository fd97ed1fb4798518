"""Square root and normal distribution for single numbers and for arrays, the same bits in both.

A formula takes one of the two sets below and is thus written once. No numpy is loaded
until an array is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rbfrag.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

N = TypeVar("N", float, "NDArray[np.float64]")
"""A number or an array of numbers."""

_CHUNK = 1 << 16


@dataclass(frozen=True)
class Functions(Generic[N]):
    """The functions that the formulas need, for one kind of number.

    Args:
        sqrt: square root.
        erfc: complementary error function.
        floor: ``floor(a, b)`` is the larger of the two, b being a single number.
    """

    sqrt: Callable[[N], N]
    erfc: Callable[[N], N]
    floor: Callable[[N, float], N]

    def normal_cdf(self, z: N) -> N:
        """Return the standard normal distribution function Φ(z), accurate in both tails."""
        return self.erfc(z * -math.sqrt(0.5)) * 0.5


SCALAR: Functions[float] = Functions(sqrt=math.sqrt, erfc=math.erfc, floor=max)
"""The functions for single numbers."""


@cache
def array_functions() -> Functions[Any]:
    """Return the functions for numpy arrays."""
    import numpy as np

    def erfc(values: FloatArray) -> FloatArray:
        # scipy's erfc loses all digits of the far tail; libm's does not, and is the scalar one.
        flat = values.ravel()
        out = np.empty(flat.shape)
        for start in range(0, flat.size, _CHUNK):
            part = flat[start : start + _CHUNK]
            out[start : start + _CHUNK] = np.fromiter(
                map(math.erfc, part.tolist()), np.float64, part.size
            )
        return out.reshape(values.shape)

    return Functions(sqrt=np.sqrt, erfc=erfc, floor=np.maximum)


def normal_half_width(level: float) -> float:
    """Return q such that a standard normal number lies within ±q with probability `level`.

    Newton's method on the logarithm of the upper tail, ln Q(q) = ln((1 - level)/2); the
    logarithm is concave, so that the iteration ends from one side.

    Args:
        level: confidence level, between 0 and 1.

    Raises:
        InputError: the level is not between 0 and 1.
    """
    if not isinstance(level, int | float) or not 0.0 < level < 1.0:
        raise InputError(
            f"level = {level!r}: a confidence level lies between 0 and 1, such as 0.95"
        )
    tail = 0.5 * (1.0 - level)
    target = math.log(tail)
    q = 1.0
    for _ in range(60):
        upper = 0.5 * math.erfc(q * math.sqrt(0.5))
        density = math.exp(-0.5 * q * q) / math.sqrt(2.0 * math.pi)
        step = upper / density * (math.log(upper) - target)
        q += step
        if abs(step) <= 1e-15 * abs(q):
            break
    return q
