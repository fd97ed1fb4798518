"""The formulas compiled for many rows: the same functions, hence the same bits."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility import formulas
from rbfrag.solver.compiled import kernel

FloatArray = NDArray[np.float64]

_PARTS = (
    "bound",
    "features",
    "score",
    "probability",
    "standard_error",
    "least_width",
    "answer",
)


def _compiled_parts() -> dict[str, Callable[..., Any]]:
    # The functions call each other by their module's names: give them a module of compiled ones.
    space: dict[str, Any] = dict(vars(formulas))
    for name in _PARTS:
        plain = getattr(formulas, name)
        space[name] = kernel(FunctionType(plain.__code__, space, name, plain.__defaults__))
    return {name: space[name] for name in _PARTS}


_parts = _compiled_parts()
_bound = _parts["bound"]
_features = _parts["features"]
_score = _parts["score"]
_probability = _parts["probability"]
_answer = _parts["answer"]


@kernel
def feature_rows(
    shape: int,
    y: FloatArray,
    p: FloatArray,
    x: FloatArray,
    pga_g: FloatArray,
    tm_s: FloatArray,
    out: FloatArray,
    bounded: NDArray[np.int64],
) -> None:
    """Fill the six features and the bound of each row.

    Args:
        shape: one of the shapes of :mod:`rbfrag.fragility.formulas`.
        y: toppling velocities [m/s], shape (n,).
        p: frequency parameters [1/s].
        x: intensities [m/s].
        pga_g: PGA [g].
        tm_s: mean periods [s].
        out: features, shape (n, 6); NaN where a bound holds.
        bounded: codes of the bounds, shape (n,).
    """
    for i in range(y.size):
        bounded[i] = _bound(shape, y[i], p[i], x[i], pga_g[i])
        if bounded[i] == 0:
            f0, f1, f2, f3, f4, f5 = _features(shape, y[i], p[i], x[i], pga_g[i], tm_s[i])
            out[i, 0] = f0
            out[i, 1] = f1
            out[i, 2] = f2
            out[i, 3] = f3
            out[i, 4] = f4
            out[i, 5] = f5
        else:
            out[i, :] = np.nan


@kernel
def probabilities(
    shape: int,
    link: int,
    b: FloatArray,
    y: FloatArray,
    p: FloatArray,
    x: FloatArray,
    pga_g: FloatArray,
    tm_s: FloatArray,
    out: FloatArray,
) -> None:
    """Fill the probability of each row; arguments as for :func:`feature_rows`."""
    for i in range(y.size):
        if _bound(shape, y[i], p[i], x[i], pga_g[i]) != 0:
            out[i] = 0.0
        else:
            out[i] = _probability(link, _score(shape, b, y[i], p[i], x[i], pga_g[i], tm_s[i])[0])


@kernel
def answers(
    shape: int,
    link: int,
    b: FloatArray,
    v: FloatArray,
    floor: FloatArray,
    half_width: float,
    y: FloatArray,
    p: FloatArray,
    x: FloatArray,
    pga_g: FloatArray,
    tm_s: FloatArray,
    middle: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> None:
    """Fill the probability and the ends of its interval of each row.

    Arguments as for :func:`rbfrag.fragility.formulas.answer`, arrays of shape (n,).
    """
    for i in range(y.size):
        middle[i], low[i], high[i] = _answer(
            shape, link, b, v, floor, half_width, y[i], p[i], x[i], pga_g[i], tm_s[i]
        )


@kernel
def etas(
    shape: int,
    b: FloatArray,
    y: FloatArray,
    p: FloatArray,
    x: FloatArray,
    pga_g: FloatArray,
    tm_s: FloatArray,
    out: FloatArray,
) -> None:
    """Fill eta of each row, NaN where a bound holds; arguments as for :func:`feature_rows`."""
    for i in range(y.size):
        if _bound(shape, y[i], p[i], x[i], pga_g[i]) != 0:
            out[i] = np.nan
        else:
            out[i] = _score(shape, b, y[i], p[i], x[i], pga_g[i], tm_s[i])[0]
