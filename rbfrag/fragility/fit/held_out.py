"""What a stored model's method says of earthquakes it has not seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from rbfrag.db.models import load_model
from rbfrag.fragility.fit.calibration_bins import CalibrationBins, calibration_bins
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.fit.judgement import outcomes_of
from rbfrag.fragility.fit.source import read_source
from rbfrag.fragility.formulas import EXPONENTS
from rbfrag.fragility.measures import intensity_term

if TYPE_CHECKING:
    from sqlalchemy import Connection


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Calibration of one model on earthquakes left out.

    Args:
        name: the model.
        bins: predicted and observed.
        scores: its scores.
        kind: what the outcomes are, in words.
    """

    name: str
    bins: CalibrationBins
    scores: Mapping[str, float]
    kind: str


def held_out_of(connection: Connection, name: str | None, *, seed: int = 0) -> HeldOut:
    """Fit a stored model again, once without each earthquake.

    Args:
        connection: the database.
        name: the model; None for the default.
        seed: of the draws.

    Raises:
        UnknownModelError: no model of that name.
        FitError: the data cannot carry the fit.
    """
    row = load_model(connection, name)
    told = cast("Mapping[str, Any]", row.diagnostics)
    source = read_source(
        connection, suite=told.get("suite"), vertical=told.get("vertical", "without")
    )
    fitted = fit_source(
        source,
        intensity_term(row.term),
        row.method,
        name=row.name,
        seed=seed,
        estimate_m=not EXPONENTS.isdisjoint(row.coefficients),
        selection={"suite": told.get("suite"), "vertical": told.get("vertical", "without")},
    )
    seen = outcomes_of(fitted.data)
    bins = calibration_bins(fitted.data, seen, fitted.result.held_out, seed=seed)
    return HeldOut(row.name, bins, fitted.result.scores, seen.kind)
