"""Choice and square root for single numbers and for arrays: a formula is written once for both.

Only these, the four operations and comparisons are used in the formulas of block stability,
and all of them round correctly, so that single numbers and arrays give the same bits. No numpy
is loaded until an array is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

N = TypeVar("N", float, "NDArray[np.float64]")
"""A number or an array of numbers."""


@dataclass(frozen=True)
class Elementwise(Generic[N]):
    """The functions that the formulas need, for one kind of number.

    Args:
        sqrt: square root.
        where: ``where(condition, a, b)`` is a where the condition holds, else b.
    """

    sqrt: Callable[[N], N]
    where: Callable[[Any, Any, Any], Any]


def _choose(condition: bool, yes: float, no: float) -> float:
    return yes if condition else no


SCALAR: Elementwise[float] = Elementwise(sqrt=math.sqrt, where=_choose)
"""The functions for single numbers."""


@cache
def array_elementwise() -> Elementwise[Any]:
    """Return the functions for numpy arrays."""
    import numpy as np

    return Elementwise(sqrt=np.sqrt, where=np.where)
