"""Models of toppling fitted to earthquakes, and what they predict for those left out.

The studies of model choice, coverage and joint failures start here. A fit sorts its rows by its own
measure, so that the rows of two fits, or of a fit and of the database, do not stand in one order:
they are joined by the block that they are about (:class:`Key`), never by number.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.engine import opened_database
from rbfrag.fragility.fit.data import KR, Y0_OVER_PGV, FitData, FitSource, fit_data, read_source
from rbfrag.fragility.fit.likelihood import most_likely
from rbfrag.fragility.fit.maximum_likelihood import OutcomeRows, outcome_rows, parameter_names
from rbfrag.fragility.fit.result import cr3, jackknife_steps
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import Method
from rbfrag.fragility.methods import method_named
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]
Labels = NDArray[np.intp]

FOLDS = 16
STEP = float(np.log(Y0_OVER_PGV[1] / Y0_OVER_PGV[0]))
"""Of the grid of y/PGV, in ln y."""

MODELS = {
    "pgv": ("bounded", "pgv_kr"),
    "pgv_pga": ("bounded", "pgv_pga"),
    "pgv_pga_tm": ("bounded", "pgv_pga_tm"),
    "record": ("record", "xp"),
}
"""Method and term of the four models that the aims are about."""


class Key(NamedTuple):
    """A block of the grid under one side of one motion: what rows are joined by.

    Args:
        motion: id of the motion in the database.
        polarity: forward or reverse.
        p2: squared frequency parameter [1/s²].
        y: toppling velocity [m/s].
    """

    motion: int
    polarity: str
    p2: float
    y: float


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Blocks of the grid of y/PGV with what they did, all of length n.

    Args:
        keys: the blocks.
        failed: 1 or 0; blocks of unknown outcome are left out.
        event: number of the earthquake.
        site: number of the recording.
        motion: number of the component.
        polarity: +1 forward, -1 reverse.
        fold: number of the fold that the earthquake is held out in.
        strength: number of y/PGV in its grid.
        value: measures and block by the name of the formulas.
    """

    keys: tuple[Key, ...]
    failed: FloatArray
    event: Labels
    site: Labels
    motion: Labels
    polarity: Labels
    fold: Labels
    strength: Labels
    value: dict[str, FloatArray]

    def joined(self, predicted: Mapping[Key, float]) -> FloatArray:
        """Return the P of a model at these blocks, NaN where it has none, shape (n,)."""
        return np.array([predicted.get(key, np.nan) for key in self.keys])

    def placement(self, rows: Labels) -> Placement:
        """Return where some of the blocks stand."""
        return Placement(
            np.log(self.value["p"][rows]), np.log(self.value["y"][rows]),
            self.event[rows], self.site[rows], self.motion[rows], self.polarity[rows],
        )  # fmt: skip


def read(path: str | Path) -> tuple[FitSource, Outcomes]:
    """Return what fits of toppling without vertical motion read, and the blocks of its grid."""
    with opened_database(path, read_only=True) as engine, engine.connect() as connection:
        source = read_source(connection)
    return source, outcomes(source)


def outcomes(source: FitSource) -> Outcomes:
    """Return the blocks of the grid, of known outcome."""
    table = source.table
    assert source.recording is not None
    y = _y_m_s(source)
    ratio = y / table.pgv_m_s[:, None]
    within = (ratio > Y0_OVER_PGV[0] * 0.999999) & (ratio < Y0_OVER_PGV[-1] * 1.000001)
    within &= source.k_over_pga * table.pga_g[:, None] >= KR[0]
    is_known = np.isfinite(source.failed) & within
    row = np.nonzero(is_known)[0]

    def numbers(values: NDArray[np.generic]) -> Labels:
        return np.unique(values[row], return_inverse=True)[1].astype(np.intp)

    event = numbers(table.event_id.astype(str))
    measures = {"pgv": table.pgv_m_s, "pga": table.pga_g, "tm": table.tm_s, "p2": table.p2}
    return Outcomes(
        keys=tuple(_keys(source, row, y[is_known])),
        failed=source.failed[is_known],
        event=event,
        site=numbers(source.recording),
        motion=numbers(table.motion_id),
        polarity=np.where(table.polarity == "forward", 1, -1)[row],
        fold=folds(event),
        strength=np.rint(np.log(ratio[is_known] / Y0_OVER_PGV[0]) / STEP).astype(np.intp),
        value={"y": y[is_known], "p": np.sqrt(table.p2[row])}
        | {name: column[row] for name, column in measures.items()},
    )


def folds(event: Labels) -> Labels:
    """Return the number of the part that each row's earthquake is in; they are dealt by size."""
    size = np.bincount(event)
    fold = np.empty(size.size, dtype=np.intp)
    fold[np.argsort(-size, kind="stable")] = np.arange(size.size) % FOLDS
    return np.asarray(fold[event])


def _y_m_s(source: FitSource) -> FloatArray:
    table = source.table
    per_k = table.pga_g * STANDARD_GRAVITY_M_S2 / np.sqrt(table.p2)
    return np.asarray(source.k_over_pga * per_k[:, None])


def _keys(source: FitSource, row: Labels, y: FloatArray) -> Iterator[Key]:
    """Yield the keys of blocks of some rows of the source."""
    table = source.table
    columns = (table.motion_id[row], table.polarity[row], table.p2[row], y)
    return map(Key, *(column.tolist() for column in columns))


def by_block(
    source: FitSource, data: FitData, place: Labels, values: NDArray[Any]
) -> dict[Key, Any]:
    """Return what a fit says of some blocks, by the block.

    Args:
        source: what was fitted.
        data: the rows of the fit.
        place: flat indices of blocks on its grid, shape (k,).
        values: what it says of each, shape (k,).

    Raises:
        ValueError: a block stands there twice.
    """
    row = data.combination[place // data.failed.shape[1]]
    keys = _keys(source, row, data.grid("y_m_s").ravel()[place])
    result = dict(zip(keys, values.tolist(), strict=True))
    if len(result) != place.size:
        raise ValueError(f"{place.size - len(result)} blocks of a fit stand in it twice")
    return result


def predictions(source: FitSource, data: FitData, probability: FloatArray) -> dict[Key, float]:
    """Return the P of every block of known outcome, given on the grid of a fit, shape (n, m)."""
    place = np.flatnonzero(data.judged.is_known)
    return by_block(source, data, place, probability.ravel()[place])


@dataclass(frozen=True, eq=False)
class Study:
    """A model fitted to all earthquakes, and its predictions of each by a fit to the others.

    Args:
        name: of the model.
        data: the rows of the fit.
        rows: their outcomes with features.
        b: the parameters, shape (k,).
        steps: those of leaving each earthquake out, shape (G, k).
        held_out: P of every block of the study by the fit without its earthquake, shape (n,).
    """

    name: str
    data: FitData
    rows: OutcomeRows
    b: FloatArray
    steps: FloatArray
    held_out: FloatArray

    @property
    def errors(self) -> FloatArray:
        """CR3 errors of the parameters, shape (k,)."""
        return np.sqrt(np.diag(cr3(self.steps)))

    @property
    def placement(self) -> Placement:
        """Where the fitted blocks stand."""
        data, place = self.data, self.rows.place
        row = place // data.failed.shape[1]
        assert data.recording is not None
        return Placement(
            np.log(data.grid("p").ravel()[place]), np.log(data.grid("y_m_s").ravel()[place]),
            data.event[row], data.recording[row], data.motion[row],
            data.polarity[row].astype(np.intp),
        )  # fmt: skip


def studied(source: FitSource, blocks: Outcomes, name: str, method: Method | None = None) -> Study:
    """Fit a model of outcomes to all earthquakes, and to all but each.

    Args:
        source: what fits read.
        blocks: of the study.
        name: of one of `MODELS`, or of a term where a method is given.
        method: one that reads outcomes.
    """
    if method is None:
        method, term = method_named(MODELS[name][0]), TERMS[MODELS[name][1]]
    else:
        term = TERMS[name]
    data = fit_data(source, method, term)
    rows = outcome_rows(data, method, term, parameter_names(method, term))
    b = most_likely(rows.data)
    held_out = blocks.joined(predictions(source, data, rows.held_out(b)))
    return Study(name, data, rows, b, jackknife_steps(rows.data, b), held_out)
