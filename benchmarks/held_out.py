"""Predictions for held-out earthquakes, and their scores.

Every model predicts the blocks of each earthquake without it (leave-one-earthquake-out
cross-validation). Of the toppling and rocking models the coefficients, the regression that
completes the spectral velocity and its standard deviation all leave the earthquake out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.engine import opened_database
from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.fit.data import KR, FitData, FitSource, fit_data, read_source
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.fit.likelihood import Binomial, most_likely
from rbfrag.fragility.fit.losses import held_out_probabilities
from rbfrag.fragility.fit.result import CLIP, calibration, cr3, jackknife_steps
from rbfrag.fragility.fit.stored import regression_of
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import LOGIT
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, spectral_name

FloatArray = NDArray[np.float64]
Labels = NDArray[np.intp]
Mask = NDArray[np.bool_]

MAGNITUDES = (0.0, 5.6, 6.0, 6.5, 7.5, math.inf)
"""Edges of the magnitude classes."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """Predictions for blocks of held-out earthquakes, arrays of shape (n,).

    Args:
        p: probability of failure.
        failed: 1 or 0.
        event: number of the earthquake.
        magnitude: of the earthquake, NaN where it is unknown.
        kr: uplift acceleration coefficient; None for blocks without it.
        p2: squared frequency parameter [1/s²]; None for blocks without it.
    """

    p: FloatArray
    failed: FloatArray
    event: Labels
    magnitude: FloatArray | None = None
    kr: FloatArray | None = None
    p2: FloatArray | None = None

    @classmethod
    def of(cls, data: FitData, source: FitSource, p: FloatArray) -> Predicted:
        """Return the scored blocks of a fit, with P of all of its grid, shape (n, m).

        Blocks above the fitted range of k_r are left out: they are safe, and would flatter a loss.
        """
        judged = data.judged
        chosen = judged.is_known & np.isfinite(p)
        if "kr" in data.blocks:
            chosen &= data.grid("kr") <= KR[1]
        magnitude = source.table.measure("magnitude")[data.combination]
        event, magnitude = (
            np.broadcast_to(column[:, None], chosen.shape)[chosen]
            for column in (data.event, magnitude)
        )
        of_block = [
            data.grid(name)[chosen] if name in data.blocks else None for name in ("kr", "p2")
        ]
        return cls(p[chosen], judged.failed[chosen], event, magnitude, *of_block)

    def only(self, chosen: Mask) -> Predicted:
        """Return a subset of the blocks."""
        columns = (getattr(self, field.name) for field in fields(self))
        return Predicted(*(None if column is None else column[chosen] for column in columns))

    def kr_from(self, low: float, high: float = math.inf) -> Predicted:
        """Return the blocks with k_r from `low` to below `high`."""
        assert self.kr is not None
        return self.only((self.kr >= low) & (self.kr < high))

    def of_size(self, p2: float) -> Predicted:
        """Return the blocks of one size p² [1/s²]."""
        assert self.p2 is not None
        return self.only(np.isclose(self.p2, p2))

    def of_magnitude(self, low: float, high: float) -> Predicted:
        """Return the blocks of the earthquakes of a magnitude class."""
        assert self.magnitude is not None
        return self.only((self.magnitude >= low) & (self.magnitude < high))

    @property
    def loss(self) -> float:
        """Mean log loss."""
        return float(log_losses(self.p, self.failed).mean())

    @property
    def slope(self) -> tuple[float, float]:
        """Calibration slope with its standard error; NaN where P separates the outcomes."""
        failed = self.failed > 0.5
        if not failed.any() or failed.all() or self.p[failed].min() > self.p[~failed].max():
            return math.nan, math.nan
        return calibration_slope(self.p, self.failed, self.event)

    @property
    def intercepts(self) -> list[float]:
        """Calibration intercept of each magnitude class; positive where P is too low."""
        parts = [self.of_magnitude(low, high) for low, high in pairwise(MAGNITUDES)]
        return [
            calibration(part.p, part.failed, np.ones(part.p.size, dtype=np.bool_)).intercept
            for part in parts
        ]

    @property
    def ratio(self) -> float:
        """Predicted over observed number of failures."""
        return float(self.p.sum() / self.failed.sum())


def log_losses(p: FloatArray, failed: FloatArray) -> FloatArray:
    """Return the log loss of each block; P is clipped at 1e-4 and 1 - 1e-4."""
    clipped = np.clip(p, CLIP, 1.0 - CLIP)
    return np.asarray(-np.where(failed > 0.5, np.log(clipped), np.log1p(-clipped)))


def clustered_mean(values: FloatArray, event: Labels) -> tuple[float, float]:
    """Return the mean of finite values and its standard error clustered by earthquake."""
    finite = np.isfinite(values)
    values, event = values[finite], event[finite]
    mean = float(values.mean())
    sums = np.bincount(event, values - mean)
    g = np.unique(event).size
    return mean, float(np.sqrt(g / (g - 1.0) * (sums @ sums)) / values.size)


def calibration_slope(p: FloatArray, failed: FloatArray, event: Labels) -> tuple[float, float]:
    """Return the slope of the outcomes on the logit of P, and its CR3 standard error.

    1 is perfect; below 1 P is too close to 0 and 1 (over-confident).
    """
    clipped = np.clip(p, CLIP, 1.0 - CLIP)
    columns = np.column_stack([np.ones(p.size), np.log(clipped / (1.0 - clipped))])
    number = np.unique(event, return_inverse=True)[1].astype(np.intp)
    rows = Binomial(LOGIT, columns, failed, np.ones(p.size), number)
    b = most_likely(rows)
    return float(b[1]), float(np.sqrt(cr3(jackknife_steps(rows, b))[1, 1]))


class StoredModels:
    """Models of a database with the data that they were fitted to.

    Args:
        path: the database.
        rows: its models.
    """

    def __init__(self, path: str, rows: Sequence[ModelRow]) -> None:
        self.path = path
        self.rows = {row.name: row for row in rows}
        self._sources: dict[tuple[str, str], FitSource] = {}
        self._data: dict[str, FitData] = {}

    def source(self, row: ModelRow) -> FitSource:
        """Return what the fits of this model's kind read."""
        method = method_named(row.method)
        key = row.kind, method.block.points
        if key not in self._sources:
            with opened_database(self.path, read_only=True) as engine, engine.connect() as c:
                self._sources[key] = read_source(c, method.block, kind=row.kind)
        return self._sources[key]

    def predicted(self, name: str, inputs: Sequence[str] = ()) -> Predicted:
        """Return the predictions of a model for held-out earthquakes.

        Args:
            name: of the model.
            inputs: intensity measures in addition to those that the model requires.

        Raises:
            RbfragError: the database has no outcomes, or too few motions have the inputs.
        """
        row = self.rows[name]
        source, term, method = self.source(row), TERMS[row.term], method_named(row.method)
        if method.forms[row.term].velocity is None:
            fitted = fit_source(source, term, method, kind=row.kind)
            return Predicted.of(fitted.data, source, fitted.result.held_out)
        data, names = self.data(row), (*term.inputs, *inputs)
        p = held_out_probabilities(self.model(row), data, self.spectra(row), names)
        return Predicted.of(data, source, p)

    def data(self, row: ModelRow) -> FitData:
        """Return the data of a fit."""
        if row.name not in self._data:
            method, term = method_named(row.method), TERMS[row.term]
            self._data[row.name] = fit_data(self.source(row), method, term, kind=row.kind)
        return self._data[row.name]

    def spectra(self, row: ModelRow) -> FloatArray:
        """Return the response spectrum of the motion of each row of a fit [g], shape (n, 21)."""
        spectra = self.source(row).spectra
        assert spectra is not None
        return spectra[self.data(row).combination]

    def model(self, row: ModelRow) -> FragilityModel:
        """Return a model that regresses its spectral velocity on any measures."""
        return FragilityModel.from_row(
            row, regress=lambda row, used: regression_of(row, used, self.path)
        )


def scored_blocks(source: FitSource) -> tuple[dict[str, FloatArray], FloatArray]:
    """Return block and shaking of the blocks that toppling models are scored on, by the names of
    the inputs and with the toppling spectrum `xp_m_s`, and which of them fail, each shape (n,).
    """
    data = fit_data(source, method_named("toppling"), TERMS["pgv"])
    chosen = data.judged.is_known
    columns = {name: source.table.measure(name) for name in ("pgv_m_s", "pga_g", "tm_s", "pgd_m")}
    columns["xp_m_s"] = source.xp_m_s
    if source.spectra is not None:
        columns |= dict(zip(map(spectral_name, SPECTRUM_PERIODS_S), source.spectra.T, strict=True))
    of_motion = {name: column[data.combination][:, None] for name, column in columns.items()}
    values = {name: data.grid(name) for name in ("p2", "kr")} | of_motion
    shape = chosen.shape
    return (
        {name: np.broadcast_to(value, shape)[chosen] for name, value in values.items()},
        data.judged.failed[chosen],
    )
