"""The formulas compiled for many rows: the same functions, hence the same bits."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility import formulas
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.compiled import kernel

FloatArray = NDArray[np.float64]

_PARTS = (
    "bound",
    "features",
    "score",
    "standard_error",
    "least_width",
    "interval",
    "answer",
    "is_plain",
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
_interval = _parts["interval"]
_answer = _parts["answer"]
_is_plain = _parts["is_plain"]


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
            eta = _score(shape, b, y[i], p[i], x[i], pga_g[i], tm_s[i])[0]
            out[i] = _interval(link, eta, 0.0)[0]


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


@kernel
def plain_answers(
    shape: int,
    link: int,
    b: FloatArray,
    v: FloatArray,
    floor: FloatArray,
    half_width: float,
    limits: FloatArray,
    p2: FloatArray,
    kr: FloatArray,
    x: FloatArray,
    pgv_m_s: FloatArray,
    pga_g: FloatArray,
    tm_s: FloatArray,
    pgd_m: FloatArray,
    strides: NDArray[np.int64],
    y: FloatArray,
    middle: FloatArray,
    low: FloatArray,
    high: FloatArray,
    plain: NDArray[np.bool_],
) -> None:
    """Fill y [m/s], and where there is nothing else to say P and the ends of its interval.

    Arguments as for :func:`rbfrag.fragility.formulas.answer` and `is_plain`. Inputs are arrays of
    shape (n,) or (1,); `strides` is 1 or 0 for each of the seven, in their order.
    """
    for i in range(y.size):
        size, strength = p2[i * strides[0]], kr[i * strides[1]]
        intensity, velocity = x[i * strides[2]], pgv_m_s[i * strides[3]]
        pga, tm, pgd = pga_g[i * strides[4]], tm_s[i * strides[5]], pgd_m[i * strides[6]]
        p = math.sqrt(size)
        y[i] = strength * STANDARD_GRAVITY_M_S2 / p
        plain[i] = _is_plain(
            shape, b, limits, size, strength, y[i], intensity, velocity, pga, tm, pgd
        )
        if plain[i]:
            middle[i], low[i], high[i] = _answer(
                shape, link, b, v, floor, half_width, y[i], p, intensity, pga, tm
            )


@kernel
def bounds(
    shape: int,
    y: FloatArray,
    p: FloatArray,
    x: FloatArray,
    pga_g: FloatArray,
    out: NDArray[np.int64],
) -> None:
    """Fill the code of the bound of each row; arguments as for :func:`feature_rows`."""
    for i in range(y.size):
        out[i] = _bound(shape, y[i], p[i], x[i], pga_g[i])
