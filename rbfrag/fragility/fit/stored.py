"""`rbfrag.fit`: a fragility model from a database, stored there."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from rbfrag.errors import InputError
from rbfrag.fragility.fit.fitting import fit as fit_model
from rbfrag.fragility.fit.report import FitReport
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.model import FragilityModel

if TYPE_CHECKING:
    from rbfrag.db.queries import Vertical


def fit(
    db: str | PathLike[str] | None = None,
    *,
    kind: str = "toppling",
    term: str | None = None,
    method: str | None = None,
    suite: str | None = None,
    vertical: Vertical = "without",
    name: str | None = None,
    seed: int = 0,
    estimate_m: bool = False,
    doubtful_pgd: bool = False,
    rotation_deg: float | None = None,
    replace: bool = False,
) -> FitReport:
    """Fit a fragility model to the stored critical values or outcomes and store it.

    The model of the best score is the default of its kind, unless one was chosen.
    :func:`rbfrag.fragility.fit.fitting.fit` fits likewise and stores nothing.

    Args:
        db: the database: a path or URL; None for ``RBFRAG_DB`` or ``rbfrag.db`` in the current
            folder.
        kind: what the blocks do: any kind that campaigns store.
        term: name of the intensity term, such as ``pgv``, ``sa10`` or ``xp``; there is no default.
        method: method of fitting (docs/theory/fragility.md); None for ``wls``, or the only one
            that there is for the kind.
        suite: suite of motions to fit; None for all motions.
        vertical: ``without`` or ``with`` vertical motion, or ``both``.
        name: name of the model; None for method and term, such as ``wls-pgv``, of another kind
            such as ``sliding-pgv``.
        seed: seed of the bootstrap by earthquake.
        estimate_m: estimate the exponent M of y = k_r g/p^M instead of M = 1 (``lognormal`` and
            ``logistic``).
        doubtful_pgd: True to let ``pgd_tm`` read the PGD of records that are flagged for an
            implausible final velocity or displacement.
        rotation_deg: slumping: the rotation that counts as failure [deg]; None past recovery.
        replace: replace a stored model of the same name.

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
    if term is None:
        raise InputError(
            "term is missing: name the measure that the model reads, as fit(db, term='pgv'): one "
            f"of {', '.join(TERMS)}"
        )
    # reading takes no lock, so that a campaign may go on meanwhile
    report = fit_model(
        db,
        kind=kind,
        term=term,
        method=method,
        suite=suite,
        vertical=vertical,
        name=name,
        seed=seed,
        estimate_m=estimate_m,
        doubtful_pgd=doubtful_pgd,
        rotation_deg=rotation_deg,
    )
    with opened_database(db) as engine, engine.begin() as connection:
        row = save_model(connection, report.model.row, replace=replace)
    return FitReport.from_model(FragilityModel.from_row(row))
