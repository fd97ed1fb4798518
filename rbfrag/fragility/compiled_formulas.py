"""The formulas compiled for many rows: the same functions, hence the same bits."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility import elementary, formulas
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.integrator.compiled import inlined_kernel, kernel

FloatArray = NDArray[np.float64]

_LEAST_NORMAL, _LIFT = 2.0**-1022, 2.0**54
_FRACTION, _HALF = 0x000FFFFFFFFFFFFF, 0x3FE0000000000000
_TO_THE_52, _BIASED_52 = 0x4330000000000000, 2.0**52 + 1022.0
_ROUNDER, _ROUNDER_BITS = 1.5 * 2.0**52, 0x4338000000000000

_PARTS = (
    "bound",
    "features",
    "score",
    "standard_error",
    "_place",
    "floor_places",
    "less_between",
    "least_width",
    "widened",
    "_faded",
    "interval",
    "answer",
    "is_plain",
)


@inlined_kernel
def _split(x: float) -> tuple[float, float]:
    # as elementary.split by the bits of the number, which works on several rows at a time
    tiny = x < _LEAST_NORMAL
    lifted = x * _LIFT if tiny else x
    bits = np.float64(lifted).view(np.int64)
    m = np.int64((bits & _FRACTION) | _HALF).view(np.float64)
    k = np.int64((bits >> 52) | _TO_THE_52).view(np.float64) - _BIASED_52
    return m, k - 54.0 if tiny else k


@inlined_kernel
def _scaled(m: float, k: float) -> float:
    exponent = np.float64(k + _ROUNDER).view(np.int64) - _ROUNDER_BITS + 1023
    return m * np.int64(exponent << 52).view(np.float64)


Compile = Callable[[Callable[..., Any]], Callable[..., Any]]


def _compiled_elementary(compiled: Compile) -> dict[str, Callable[..., Any]]:
    space: dict[str, Any] = {**vars(elementary), "split": _split, "scaled": _scaled}
    return {
        name: compiled(FunctionType(getattr(elementary, name).__code__, space, name))
        for name in ("ln", "exponential")
    }


def _compiled_parts(compiled: Compile) -> SimpleNamespace:
    # The functions call each other by their module's names: give them a module of compiled ones.
    space: dict[str, Any] = {**vars(formulas), **_compiled_elementary(compiled)}
    for name in _PARTS:
        plain = getattr(formulas, name)
        space[name] = compiled(FunctionType(plain.__code__, space, name, plain.__defaults__))
    return SimpleNamespace(**{name: space[name] for name in (*_PARTS, "ln", "exponential")})


_parts = _compiled_parts(kernel)
_ln, _exponential = _parts.ln, _parts.exponential
_bound, _features, _score = _parts.bound, _parts.features, _parts.score
_interval, _answer = _parts.interval, _parts.answer

# Those of one formula alone are short enough to become part of a loop.
_inlined = _compiled_parts(inlined_kernel)
_score_of_one, _standard_error_of_one = _inlined.score, _inlined.standard_error
_interval_of_one, _is_plain_of_one = _inlined.interval, _inlined.is_plain
_floor_places_of_one, _less_between_of_one = _inlined.floor_places, _inlined.less_between
_widened_of_one = _inlined.widened


@kernel
def logarithms(x: FloatArray, out: FloatArray) -> None:
    """Fill the natural logarithm of each number, shape (n,)."""
    for i in range(x.size):
        out[i] = _ln(x[i])


@kernel
def exponentials(x: FloatArray, out: FloatArray) -> None:
    """Fill e to the power of each number, shape (n,)."""
    for i in range(x.size):
        out[i] = _exponential(x[i])


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


ROWS = 512
"""Rows that are worked on at a time: their columns fit the processor's first cache."""

_COLUMNS = 20
_SIZE, _STRENGTH, _X, _PGV, _PGA, _TM, _PGD, _P, _Y, _ETA = (ROWS * i for i in range(10))
_REACH, _MIDDLE, _LOW, _HIGH, _PLAIN = (ROWS * i for i in range(10, 15))
_NODE, _BEYOND, _SHARE_NODE, _SHARE_BEYOND, _LEAST = (ROWS * i for i in range(15, _COLUMNS))


@cache
def plain_answers(shape: int, link: int) -> Callable[..., None]:
    """Return the kernel that answers many rows with one formula, where there is no more to say.

    Its arguments are what belongs to the model in :func:`rbfrag.fragility.formulas.answer` and
    `is_plain` (b and v as tuples, floor as an array of all nodes, half_width, limits as a tuple);
    p2, kr, x, PGV [m/s], PGA [g], Tm [s] and PGD [m], arrays of shape (n,) or (1,); and what it
    fills, of shape (n,): y [m/s], P, the ends of its interval, and whether there is no more to
    say. Where there is more, the numbers mean nothing.

    Compiled for one formula, without a branch that depends on the row, and from one scratch array
    with columns at fixed places, so that the compiler sees that no column overlaps another and
    takes several rows at a time.
    """

    def fill(
        b: tuple[float, ...],
        v: tuple[float, ...],
        floor: FloatArray,
        half_width: float,
        limits: tuple[float, ...],
        p2: FloatArray,
        kr: FloatArray,
        x: FloatArray,
        pgv_m_s: FloatArray,
        pga_g: FloatArray,
        tm_s: FloatArray,
        pgd_m: FloatArray,
        y: FloatArray,
        middle: FloatArray,
        low: FloatArray,
        high: FloatArray,
        plain: NDArray[np.bool_],
    ) -> None:
        s = np.ones(_COLUMNS * ROWS)
        for start in range(0, y.size, ROWS):
            n = min(ROWS, y.size - start)
            _take(p2, start, n, s, _SIZE)
            _take(kr, start, n, s, _STRENGTH)
            _take(x, start, n, s, _X)
            _take(pgv_m_s, start, n, s, _PGV)
            _take(pga_g, start, n, s, _PGA)
            _take(tm_s, start, n, s, _TM)
            _take(pgd_m, start, n, s, _PGD)
            for i in range(ROWS):
                p = math.sqrt(s[_SIZE + i])
                s[_P + i] = p
                s[_Y + i] = s[_STRENGTH + i] * STANDARD_GRAVITY_M_S2 / p
            for i in range(ROWS):
                eta, f0, f1, f2, f3, f4, f5 = _score_of_one(
                    shape, b, s[_Y + i], s[_P + i], s[_X + i], s[_PGA + i], s[_TM + i]
                )
                s[_ETA + i] = eta
                s[_REACH + i] = half_width * _standard_error_of_one(v, f0, f1, f2, f3, f4, f5)
            for i in range(ROWS):
                at, down, up = _interval_of_one(link, s[_ETA + i], s[_REACH + i])
                s[_MIDDLE + i] = at
                s[_LOW + i] = down
                s[_HIGH + i] = up
            for i in range(ROWS):
                node, beyond, share_node, share_beyond = _floor_places_of_one(
                    s[_ETA + i], s[_Y + i] / (2.0 * s[_X + i])
                )
                s[_NODE + i] = node
                s[_BEYOND + i] = beyond
                s[_SHARE_NODE + i] = share_node
                s[_SHARE_BEYOND + i] = share_beyond
            for i in range(ROWS):  # row by row, for each looks elsewhere in the tables
                s[_LEAST + i] = _less_between_of_one(
                    floor,
                    int(s[_NODE + i]),
                    s[_BEYOND + i],
                    int(s[_SHARE_NODE + i]),
                    s[_SHARE_BEYOND + i],
                )
            for i in range(ROWS):
                least = half_width * s[_LEAST + i]
                down, up = _widened_of_one(least, s[_MIDDLE + i], s[_LOW + i], s[_HIGH + i])
                s[_LOW + i] = down
                s[_HIGH + i] = up
            for i in range(ROWS):
                clear = _is_plain_of_one(
                    shape, b, limits, s[_SIZE + i], s[_P + i], s[_STRENGTH + i], s[_Y + i],
                    s[_X + i], s[_PGV + i], s[_PGA + i], s[_TM + i], s[_PGD + i],
                )  # fmt: skip
                s[_PLAIN + i] = 1.0 if clear else 0.0
            for i in range(n):
                y[start + i] = s[_Y + i]
            for i in range(n):
                middle[start + i] = s[_MIDDLE + i]
            for i in range(n):
                low[start + i] = s[_LOW + i]
            for i in range(n):
                high[start + i] = s[_HIGH + i]
            for i in range(n):
                plain[start + i] = s[_PLAIN + i] > 0.5

    return kernel(fill)


@inlined_kernel
def _take(column: FloatArray, start: int, n: int, s: FloatArray, place: int) -> None:
    if column.size > 1:
        for i in range(n):
            s[place + i] = column[start + i]
    elif start == 0 and column.size:
        for i in range(ROWS):
            s[place + i] = column[0]


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
