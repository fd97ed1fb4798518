"""Fragility functions of other tools, for comparison in figures."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.nrml import read_nrml
from rbfrag.exchange.pelicun_table import read_pelicun

FloatArray = NDArray[np.float64]

MOST = 12
"""More curves than these cannot be told apart."""


def of_measure(
    path: str | os.PathLike[str], measure: str
) -> dict[str, Callable[[FloatArray], FloatArray]]:
    """Return the fragility functions of one measure by asset and limit state.

    Args:
        path: NRML (.xml) or a pelicun table (.csv).
        measure: ``pgv_m_s`` or ``pga_g``.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".xml", ".csv"):
        raise InputError(
            f"{path}: unsupported file of fragility functions: use .xml (NRML) or .csv (pelicun)"
        )
    functions = read_nrml(path) if suffix == ".xml" else read_pelicun(path)
    curves: dict[str, Callable[[FloatArray], FloatArray]] = {
        f"{function.name}, {function.limit_state}": function.at
        for function in functions
        if function.kind.measure == measure
    }
    if not curves:
        have = ", ".join(sorted({function.kind.imt for function in functions})) or "none of ground"
        raise InputError(f"{path}: there is no fragility over {measure}; there are {have}")
    if len(curves) > MOST:
        raise InputError(
            f"{path}: {len(curves)} fragilities exceed the maximum of {MOST} for a figure: reduce "
            "the file"
        )
    return curves
