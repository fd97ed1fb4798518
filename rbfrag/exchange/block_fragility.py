"""The fragility of blocks as a function of one measure of shaking, for other tools."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, Unpack

import numpy as np
from scipy.special import ndtr, ndtri

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import FragilityFunction
from rbfrag.fragility.measures import SPECTRAL
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.hazards.measure_type import IntensityType
from rbfrag.question.fields import AnsweringFields
from rbfrag.question.keywords import model_for
from rbfrag.solver.kinds import mode_of_kind
from rbfrag.solver.results import FloatArray

FAILED = {"topple": "toppled", "slide": "slid", "slump": "slumped", "confined_topple": "toppled"}
"""The limit state of a block by its mode."""

"""What becomes of such models."""

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


class BlockFunctions(NamedTuple):
    """The fragilities of blocks.

    Args:
        functions: one of each block, or of their class.
        about: name, term and method of the model.
        warnings: what to know about them.
    """

    functions: list[FragilityFunction]
    about: tuple[str, str, str]
    warnings: tuple[str, ...] = ()


def block_functions(
    names: Sequence[str],
    numbers: Mapping[str, FloatArray],
    measure: str,
    kind: str | None = None,
    *,
    one_class: bool = False,
    levels: int = 80,
    **answering: Unpack[AnsweringFields],
) -> BlockFunctions:
    """Return the fragility of each block over one measure.

    A fragility that is lognormal to 1e-9 is returned as such, every other
    on a grid of levels with equal ratios between `SMALLEST` and one minus it, together with the
    largest error of linear interpolation on that grid. One that rises again towards weak shaking
    begins at its lowest.

    Args:
        numbers: what a model reads of them, by field, shape (m,) each; NaN of an option for the
            block's own.
        measure: ``pgv_m_s``, ``pga_g`` or ``sa10_g``, which a model reads alone.
        kind: how they fail; None for what they are given by.
        one_class: the blocks stand for one class: one function, their mean, of one name.
        answering: model and db, as in :func:`rbfrag.predict`.

    Raises:
        InputError: a block or a measure that no model can work with, or too few levels.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    x, model = scanned_levels(), model_for(answering, (*numbers, measure), kind)
    measured, parts = probabilities_over(x, numbers, measure, levels, model)
    state = FAILED.get(mode_of_kind(model.row.kind), "failed")
    rows: Iterator[FloatArray] = (row for part in parts for row in part)
    if one_class:
        size = next(iter(numbers.values())).size
        rows = iter([sum(part.sum(axis=0) for part in parts) / size])
    functions = [
        _function(FragilityFunction(name, state, measured), x, row, levels)
        for name, row in zip(names, rows, strict=True)
    ]
    begun = [each.no_damage_limit for each in functions if each.no_damage_limit is not None]
    warnings = (
        (
            f"P of model {model.name} rises again below {measure} = {max(begun):.2g}, where it was "
            "fitted on too little: the functions begin there, and nothing fails below",
        )
        if begun
        else ()
    )
    return BlockFunctions(functions, about_model(model), warnings)


def about_model(model: FragilityModel) -> tuple[str, str, str]:
    """Return name, term and method of a model."""
    return model.name, model.term.name, model.row.method


def scanned_levels() -> FloatArray:
    """Return the levels [m/s or g] that fragilities are looked for on, of equal ratios."""
    return np.geomspace(_LOWEST, _HIGHEST, _SCANNED)


def probabilities_over(
    x: FloatArray,
    numbers: Mapping[str, FloatArray],
    measure: str,
    levels: int,
    model: FragilityModel,
) -> tuple[IntensityType, Iterator[FloatArray]]:
    """Return the meaning of the levels, and probabilities at them, some blocks at a time."""
    if levels < 10:
        raise InputError(f"levels = {levels}: a discrete fragility needs at least 10")
    if measure not in _TYPES:
        raise InputError(f"measure = {measure!r}: use one of {', '.join(_TYPES)}")
    columns = model.method.block.filled(numbers)

    def rows() -> Iterator[FloatArray]:
        for start in range(0, next(iter(columns.values())).size, _CHUNK):
            some = slice(start, start + _CHUNK)
            of_blocks = {name: column[some, None] for name, column in columns.items()}
            yield array_answer(model, {**of_blocks, measure: x}, interval=False).probability

    return _TYPES[measure], rows()


def _function(
    empty: FragilityFunction, x: FloatArray, p: FloatArray, levels: int
) -> FragilityFunction:
    """Return a function with the probabilities p at the levels x."""
    if np.isnan(p).any():
        raise InputError(
            f"block {empty.name!r} has no fragility: its numbers must be above zero and finite"
        )
    # A normal score straight in ln x is a lognormal function; near 1 scores have few digits.
    middle = (p > 1e-9) & (p < 1.0 - 1e-5)
    if middle.sum() > 2:
        slope, intercept = np.polyfit(np.log(x[middle]), ndtri(p[middle]), 1)
        if slope > 0.0 and np.abs(ndtr(intercept + slope * np.log(x)) - p).max() < _STRAIGHT:
            return replace(empty, median=float(np.exp(-intercept / slope)), beta=float(1.0 / slope))
    lowest = int(np.argmin(p))
    begins = float(x[lowest]) if p[0] - p[lowest] > SMALLEST else None
    if begins is not None:
        x, p = x[lowest:], p[lowest:]
    rising = np.maximum.accumulate(p)
    inside = np.flatnonzero((rising > SMALLEST) & (rising < 1.0 - SMALLEST))
    if inside.size < 2:
        raise InputError(
            f"block {empty.name!r}: the probability jumps from 0 to 1 between {x[0]:g} and "
            f"{x[-1]:g}, which a fragility function cannot show"
        )
    low, high = max(inside[0] - 1, 0), min(inside[-1] + 1, x.size - 1)
    grid = np.geomspace(x[low], x[high], levels)
    on_grid = np.interp(grid, x, rising)
    error = np.abs(np.interp(x[low : high + 1], grid, on_grid) - rising[low : high + 1]).max()
    return replace(
        empty, levels=grid, probability=np.clip(on_grid, 0.0, 1.0), no_damage_limit=begins,
        grid_error=float(error),
    )  # fmt: skip
