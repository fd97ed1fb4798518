"""Stored models and their data: `rbfrag.fit`, comparison of stored models with the current data,
and calibration on held-out earthquakes.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, Unpack, cast

import numpy as np

from rbfrag.db.engine import open_database, opened_database
from rbfrag.db.location import REFERENCE, data_place
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import load_model, names_of_models, save_model, store_dependence
from rbfrag.db.motion_spectra import stored_spectra
from rbfrag.db.queries import combination_table, recordings_of_motions
from rbfrag.db.rows import Selection
from rbfrag.errors import FitError, InputError, ModelError, RbfragError, UnknownFieldError
from rbfrag.fragility.completion import Regression
from rbfrag.fragility.fit.completions import MotionTable, ordinates_by_motion, regress
from rbfrag.fragility.fit.data import (
    CERTIFIED,
    FitSource,
    fit_data,
    motions_of,
    read_source,
)
from rbfrag.fragility.fit.fitting import FitOptions, Fitted, fit_source
from rbfrag.fragility.fit.fitting import fit as fit_model
from rbfrag.fragility.fit.report import FitReport
from rbfrag.fragility.fit.result import CalibrationBins, calibration_bins
from rbfrag.fragility.measures import TERMS, intensity_term
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import IS_ESTIMATED, FragilityModel
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import count_of
from rbfrag.results.result import ResultList, TextLine, TextTable

if TYPE_CHECKING:
    from sqlalchemy import Connection

OF_BUILT_IN = Diagnostic(
    "the spectral velocity is completed from the motions of the built-in data set: the database of "
    "the model has too few motions with response spectra",
    "model_choice",
)

NOT_STORED = Diagnostic(
    "the fit is of the built-in data set, which is read only: the model is not stored; name a "
    "database of your own (db) to store one",
    "model_not_stored",
)


def fit(
    db: str | PathLike[str] | None = None, *, replace: bool = False, **question: Unpack[FitOptions]
) -> FitReport:
    """Fit a fragility model to the stored critical values or outcomes and store it.

    The model of the best score is the default of its kind, unless one was chosen.
    :func:`rbfrag.fragility.fit.fitting.fit` fits likewise and stores nothing.

    Args:
        db: the database: a path or URL; None for ``RBFRAG_DB`` or ``rbfrag.db`` in the current
            folder, or else the built-in data, which are read only: the model is not stored.
        replace: replace a stored model of the same name.
        kind: what the blocks do: any kind that campaigns store; ``toppling`` if left out.
        term: name of the intensity term, such as ``pgv``, ``sa`` or ``xp``; there is no default.
        method: one of those of the kind (docs/theory/fragility.md); None for the one that predicts
            earthquakes left out best with this term: ``details["why_method"]`` says why.
        suite: suite of motions to fit; None for all motions.
        where: only motions and combinations that meet this condition over columns of the view
            `outcome`, such as ``"vs30_m_s > 600 and magnitude >= 6"``.
        include_structures: read motions of sensors on structures, too.
        vertical: ``without`` (if left out) or ``with`` vertical motion, or ``both``.
        name: name of the model; None for method and term, such as ``wls-pgv``, of another kind
            such as ``sliding-pgv``.
        seed: seed of the bootstrap and of the dependence model; 0 if left out.
        bootstrap: estimate standard errors by a bootstrap of whole earthquakes, too; without it
            only with fewer than 10 earthquakes, for which clustered errors are too small.
        dependence: estimate the dependence model of the blocks of one earthquake, too; without it
            the first joint question of the stored model estimates and stores it.
        estimate_m: estimate the exponent M of y = k_r g/p^M instead of M = 1 (``lognormal`` and
            ``logistic``).
        doubtful_pgd: True to let ``pgd_tm`` read the PGD of records that are flagged for an
            implausible final velocity or displacement.
        rotation_deg: slumping: the rotation that counts as failure [deg]; None past recovery.

    Returns:
        The report of the model as it is stored.

    Raises:
        InputError: unknown kind, term or method, or some that do not go together; a model of
            that name is stored already.
        FitError: the data cannot carry the fit; the message says why and what to do.
        DatabaseError: the database cannot be used.
    """
    if db is not None and not isinstance(db, str | PathLike):
        raise InputError(
            f"db = {type(db).__name__}: give a path or URL; what stores nothing and takes a "
            "connection or a table is rbfrag.fragility.fit.fitting.fit"
        )
    UnknownFieldError.reject(question, FitOptions, "a fit")
    if question.get("term") is None:
        raise InputError(
            "term is missing: give the intensity measure, such as fit(db, term='pgv'), one of "
            f"{', '.join(TERMS)}"
        )
    place, built_in = data_place(db)
    if built_in:
        report = fit_model(place, **question)
        return dataclasses.replace(report, warnings=(*report.warnings, NOT_STORED))
    # what cannot be stored is found out before anything is computed
    with opened_database(db) as engine, engine.connect() as connection:
        taken = [] if replace else names_of_models(connection)
    # reading takes no lock, so that a campaign may go on meanwhile
    report = fit_model(db, taken=taken, **question)
    with opened_database(db) as engine, engine.begin() as connection:
        row = save_model(connection, report.model.row, replace=replace)
    return FitReport.from_model(
        FragilityModel.from_row(row, complete=partial(with_dependence, db=db))
    )


def with_dependence(row: ModelRow, db: str | PathLike[str] | None) -> ModelRow:
    """Return a stored model with its dependence model, which is estimated from its data and stored.

    Where that cannot be, for want of data or because the database is read only, the row remains
    without one, and is not asked again.

    Args:
        row: a model whose fit has not estimated it.
        db: the database that it is stored in.
    """
    estimated = dataclasses.replace(row, diagnostics={**row.diagnostics, IS_ESTIMATED: True})
    try:
        # a database that cannot be written is found out before the estimation
        open_database(db).dispose()
        with opened_database(db, read_only=True) as engine, engine.connect() as connection:
            fitted = _fitted_again(connection, row, dependence=True).report.model.row
        if fitted.data_fingerprint != row.data_fingerprint:
            return estimated
        estimated = dataclasses.replace(
            estimated,
            dependence=fitted.dependence,
            diagnostics={**estimated.diagnostics, "warnings": fitted.diagnostics["warnings"]},
        )
        with opened_database(db) as engine, engine.begin() as connection:
            store_dependence(connection, estimated)
    except RbfragError:
        return estimated
    return estimated


def regression_of(
    row: ModelRow, used: tuple[str, ...], db: str | PathLike[str] | None
) -> tuple[Regression | None, tuple[Diagnostic, ...]]:
    """Return the regression of a model's spectral velocity on measures that it stores none for.

    Where the database has too few motions with response spectra, that of the built-in data answers,
    and a note says so.

    Args:
        used: the measures.
        db: the database that the model is stored in.
    """
    velocity = method_named(row.method).forms[row.term].velocity
    assert velocity is not None
    events = cast("list[str]", row.diagnostics.get("fitted_events", []))
    for place, notes in ((db, ()), (REFERENCE, (OF_BUILT_IN,))):
        try:
            with opened_database(place, read_only=True) as engine, engine.connect() as connection:
                motions = stored_motions(connection, row, events)
            return regress(velocity, used, motions), notes
        except RbfragError:
            continue
    return None, ()


State = Literal["unchanged", "changed", "no data", "unreadable"]


@dataclass(frozen=True)
class ModelCheck:
    """State of the data of one model: unchanged, changed or missing.

    Args:
        state: ``unchanged``; ``changed`` (fit it again); ``no data`` (the database holds models
            without the data they came from, as a reference does); ``unreadable``.
        remark: what changed, or why that is unknown; empty if unchanged.
    """

    name: str
    state: State
    remark: str


@dataclass(frozen=True, eq=False, repr=False)
class ModelChecks(ResultList):
    """Comparison of the data of all models with those that they were fitted to."""

    checks: Sequence[ModelCheck]

    @property
    def is_passed(self) -> bool:
        """False where data have changed, or a model is invalid."""
        return not any(check.state in ("changed", "unreadable") for check in self.checks)

    def sentences(self) -> Iterator[str]:
        """Yield the number of models by the state of their data."""
        counts = Counter(check.state for check in self.checks)
        states = ", ".join(f"{number} {state}" for state, number in counts.items())
        yield f"{count_of(len(self.checks), 'fitted model')}: {states}".removesuffix(": ")

    def lines(self) -> Iterator[TextLine]:
        """Yield each remark with its models."""
        models: dict[str, list[str]] = {}
        for check in self.checks:
            if check.remark:
                models.setdefault(check.remark, []).append(check.name)
        for remark, names in models.items():
            yield TextLine("Remark", f"{', '.join(names)}: {remark}")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:  # noqa: ARG002
        """Yield the models with the state of their data."""
        yield TextTable(("model", "data"), [(check.name, check.state) for check in self.checks])

    def rows(self) -> list[dict[str, Any]]:
        """Return the checks under the keys of the JSON contract."""
        return [asdict(check) for check in self.checks]


def selection_of(row: ModelRow) -> Selection:
    """Return the data selection of a fit."""
    diagnostics = cast("Mapping[str, Any]", row.diagnostics)
    return {
        "suite": diagnostics.get("suite"),
        "where": diagnostics.get("where"),
        "vertical": diagnostics.get("vertical", "without"),
        "doubtful_pgd": bool(diagnostics.get("doubtful_pgd", False)),
        "include_structures": bool(diagnostics.get("include_structures", False)),
        "rotation_deg": diagnostics.get("rotation_deg"),
    }


def source_of(connection: Connection, row: ModelRow) -> FitSource:
    """Return the current data for the fit of a stored model."""
    block = method_named(row.method).block
    source = read_source(connection, block, kind=row.kind, **selection_of(row))
    return dataclasses.replace(source, narrow=narrow_of(row))


def stored_motions(connection: Connection, row: ModelRow, events: list[str]) -> MotionTable:
    """Return the motions of the fit of a stored model."""
    table = combination_table(connection, kind=row.kind, **selection_of(row))
    recordings = recordings_of_motions(connection)
    source = FitSource.of_table(table)
    source = dataclasses.replace(
        source,
        recording=np.array([recordings[number] for number in table.motion_id.tolist()]),
        spectra=ordinates_by_motion(stored_spectra(connection), table.motion_id),
    )
    return motions_of(source, method_named(row.method).block, events)


def narrow_of(row: ModelRow) -> float:
    """Return the maximum relative width at which a fit counted a critical value as found."""
    return float(cast("float", row.diagnostics.get("narrow", CERTIFIED)))


def check_models(connection: Connection, rows: list[ModelRow]) -> ModelChecks:
    """Compare the fingerprint of each model with that of its current data."""
    sources: dict[tuple[Any, ...], FitSource] = {}
    return ModelChecks([_check(connection, row, sources) for row in rows])


def _check(
    connection: Connection, row: ModelRow, sources: dict[tuple[Any, ...], FitSource]
) -> ModelCheck:
    try:
        model = FragilityModel.from_row(row)
    except ModelError as error:
        return ModelCheck(row.name, "unreadable", str(error))
    key = (row.kind, narrow_of(row), *selection_of(row).values())
    try:
        if key not in sources:
            sources[key] = source_of(connection, row)
        data = fit_data(sources[key], method_named(row.method), model.term, kind=row.kind)
    except (FitError, InputError) as error:
        return ModelCheck(row.name, "no data", str(error))
    if data.fingerprint == row.data_fingerprint:
        return ModelCheck(row.name, "unchanged", "")
    then, now = row.diagnostics.get("n"), int(data.observed.sum())
    counts = f"fitted to {then} critical values, {now} today" if then != now else "other values"
    return ModelCheck(row.name, "changed", f"{counts}: fit it again in its place, by rbfrag fit")


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Calibration of one model on held-out earthquakes.

    Args:
        bins: predicted and observed.
        outcomes: what the outcomes are, in words.
    """

    name: str
    bins: CalibrationBins
    scores: Mapping[str, float]
    outcomes: str


def held_out_of(connection: Connection, name: str | None, *, seed: int = 0) -> HeldOut:
    """Fit a stored model again, holding out each earthquake in turn.

    Args:
        name: the model; None for the default.
    """
    row = load_model(connection, name)
    fitted = _fitted_again(connection, row, seed=seed)
    judged = fitted.data.judged
    bins = calibration_bins(judged, fitted.result.held_out, seed=seed)
    return HeldOut(row.name, bins, fitted.result.scores, judged.source)


def _fitted_again(
    connection: Connection, row: ModelRow, *, seed: int | None = None, dependence: bool = False
) -> Fitted:
    """Fit a stored model again to its current data; with its seed if None."""
    method = method_named(row.method)
    return fit_source(
        source_of(connection, row),
        intensity_term(row.term),
        method,
        kind=row.kind,
        name=row.name,
        seed=int(cast("int", row.diagnostics.get("seed", 0))) if seed is None else seed,
        dependence=dependence,
        estimate_m=method.exponent in row.coefficients,
        selection=selection_of(row),
    )
