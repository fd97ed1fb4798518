"""The fragility of blocks as a function of one measure of shaking, for other tools."""

from __future__ import annotations

from collections.abc import Iterator
from os import PathLike

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import FragilityFunction
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.measures import SPECTRAL
from rbfrag.fragility.model import Model
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.hazards.measure_type import IntensityType

FloatArray = NDArray[np.float64]

LIMIT_STATE = "toppled"
"""The limit state of a block."""

SMALLEST = 1e-7
"""Probabilities from this to one minus this are covered by a discrete function."""

_LOWEST, _HIGHEST, _SCANNED = 1e-5, 1e3, 4001
_STRAIGHT = 1e-9
_CHUNK = 256

_TYPES = {
    "pgv_m_s": IntensityType("pgv_m_s", 0.01),
    "pga_g": IntensityType("pga_g", 1.0),
    **{name: IntensityType("sa_g", 1.0, period) for period, name in SPECTRAL.items()},
}
"""What the levels of a function measure, by the measure's name in `predict`."""


def block_functions(
    names: list[str],
    p2: FloatArray,
    kr: FloatArray,
    measure: str,
    *,
    kind: str | None = None,
    restitution: FloatArray | None = None,
    one_class: bool = False,
    levels: int = 80,
    model: Model | None = None,
    db: str | PathLike[str] | None = None,
) -> tuple[list[FragilityFunction], tuple[str, ...]]:
    """Return the fragility of each block over one measure, and the model that answered.

    A fragility that is lognormal to 1e-9 is returned as such, every other
    on a grid of levels with equal ratios between `SMALLEST` and one minus it, together with the
    largest error of linear interpolation on that grid.

    Args:
        names: identifiers of the blocks.
        p2: frequency parameters [1/s²], shape (m,).
        kr: toppling yield acceleration coefficients, shape (m,).
        measure: ``pgv_m_s``, ``pga_g``, ``sa03_g``, ``sa10_g``, ``sa20_g`` or ``sa30_g``, which
            a model reads alone.
        kind: how they stand; None for backed by a slope.
        restitution: of blocks that rock, shape (m,); None or NaN for what angular momentum
            leaves.
        one_class: the blocks stand for one class: one function, their mean, of one name.
        levels: number of levels of a discrete function.
        model: as in :func:`rbfrag.predict`.
        db: as in :func:`rbfrag.predict`.

    Returns:
        The functions, and name, term and method of the model.

    Raises:
        InputError: a block or a measure that no model can work with, or too few levels.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    x = scanned_levels()
    measured, about, parts = probabilities_over(
        x, p2, kr, measure, levels, model, db, kind=kind, restitution=restitution
    )
    if one_class:
        total = np.zeros_like(x)
        for part in parts:
            total += part.sum(axis=0)
        return [_function(names[0], measured, x, total / p2.size, levels)], about
    rows = (row for part in parts for row in part)
    functions = [
        _function(name, measured, x, row, levels) for name, row in zip(names, rows, strict=True)
    ]
    return functions, about


def scanned_levels() -> FloatArray:
    """Return the levels [m/s or g] that fragilities are looked for on, of equal ratios."""
    return np.geomspace(_LOWEST, _HIGHEST, _SCANNED)


def probabilities_over(
    x: FloatArray,
    p2: FloatArray,
    kr: FloatArray,
    measure: str,
    levels: int,
    model: Model | None,
    db: str | PathLike[str] | None,
    *,
    kind: str | None = None,
    restitution: FloatArray | None = None,
) -> tuple[IntensityType, tuple[str, ...], Iterator[FloatArray]]:
    """Return the meaning of the levels, the model, and probabilities, some blocks at a time."""
    if levels < 10:
        raise InputError(f"levels = {levels}: a discrete fragility needs at least 10")
    if measure not in _TYPES:
        raise InputError(f"measure = {measure!r}: use one of {', '.join(_TYPES)}")
    chosen = find_model(model, ("p2", "kr", measure), db, kind=kind)
    stated = {} if restitution is None else {"restitution": restitution}
    columns = chosen.method.block.filled({"p2": p2, "kr": kr, **stated})

    def rows() -> Iterator[FloatArray]:
        for start in range(0, p2.size, _CHUNK):
            some = slice(start, start + _CHUNK)
            of_blocks = {name: column[some, None] for name, column in columns.items()}
            given = {**of_blocks, measure: x[None, :]}
            prediction = answer_given(chosen, given, 0.95, interval=False)
            assert isinstance(prediction, PredictionArray)
            yield prediction.probability

    return _TYPES[measure], (chosen.name, chosen.term.name, chosen.row.method), rows()


def _function(
    name: str, kind: IntensityType, x: FloatArray, p: FloatArray, levels: int
) -> FragilityFunction:
    if np.isnan(p).any():
        raise InputError(
            f"block {name!r} has no fragility: p2 and kr must be above zero and finite"
        )
    # A normal score straight in ln x is a lognormal function; near 1 scores have few digits.
    middle = (p > 1e-9) & (p < 1.0 - 1e-5)
    if middle.sum() > 2:
        slope, intercept = np.polyfit(np.log(x[middle]), ndtri(p[middle]), 1)
        if slope > 0.0 and np.abs(ndtr(intercept + slope * np.log(x)) - p).max() < _STRAIGHT:
            return FragilityFunction(
                name, LIMIT_STATE, kind,
                median=float(np.exp(-intercept / slope)), beta=float(1.0 / slope),
            )  # fmt: skip
    rising = np.maximum.accumulate(p)
    inside = np.flatnonzero((rising > SMALLEST) & (rising < 1.0 - SMALLEST))
    if inside.size < 2:
        raise InputError(
            f"block {name!r}: the probability jumps from 0 to 1 between {x[0]:g} and {x[-1]:g}, "
            "which a fragility function cannot show"
        )
    low, high = max(inside[0] - 1, 0), min(inside[-1] + 1, x.size - 1)
    grid = np.geomspace(x[low], x[high], levels)
    on_grid = np.interp(grid, x, rising)
    error = np.abs(np.interp(x[low : high + 1], grid, on_grid) - rising[low : high + 1]).max()
    return FragilityFunction(
        name, LIMIT_STATE, kind, levels=grid, probability=np.clip(on_grid, 0.0, 1.0),
        grid_error=float(error),
    )  # fmt: skip
