"""`rbfrag.fit`: a fragility model from a database, stored there."""

from __future__ import annotations

import dataclasses
from os import PathLike
from typing import Unpack

from rbfrag.db.engine import opened_database
from rbfrag.db.location import data_place
from rbfrag.db.models import names_of_models, save_model
from rbfrag.errors import InputError, UnknownFieldError
from rbfrag.fragility.fit.fitting import FitOptions
from rbfrag.fragility.fit.fitting import fit as fit_model
from rbfrag.fragility.fit.report import FitReport
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.model import FragilityModel
from rbfrag.results.diagnostic import Diagnostic

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
        term: name of the intensity term, such as ``pgv``, ``sa10`` or ``xp``; there is no default.
        method: one of those of the kind (docs/theory/fragility.md); None for the one that predicts
            earthquakes left out best with this term: ``details["why_method"]`` says why.
        suite: suite of motions to fit; None for all motions.
        include_structures: read motions of sensors on structures, too.
        vertical: ``without`` (if left out) or ``with`` vertical motion, or ``both``.
        name: name of the model; None for method and term, such as ``wls-pgv``, of another kind
            such as ``sliding-pgv``.
        seed: seed of the bootstrap by earthquake; 0 if left out.
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
    return FitReport.from_model(FragilityModel.from_row(row))
