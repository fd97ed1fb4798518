"""Fitting a fragility model to the critical values of a database."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from rbfrag.db.rows import CombinationTable, ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.fit_data import FitData, fit_data
from rbfrag.fragility.log_relations import log_correlations, power_law
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.report import FitReport
from rbfrag.fragility.terms import intensity_term
from rbfrag.fragility.wls_method import MethodResult, fit_wls

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from rbfrag.db.queries import Vertical

METHODS: Mapping[str, Callable[..., MethodResult]] = {"wls": fit_wls}
"""The methods of fitting: ``method(data, term, seed=…)``."""


def fit(
    source: Connection | CombinationTable,
    *,
    term: str,
    method: str = "wls",
    suite: str | None = None,
    name: str | None = None,
    vertical: Vertical = "without",
    seed: int = 0,
) -> FitReport:
    """Fit a fragility model; nothing is stored.

    Args:
        source: a connection to the database, or the critical values themselves.
        term: intensity term: ``pgv``, ``pga_tm`` or ``pgd_tm``.
        method: method of fitting: ``wls``, the dissertation's weighted least squares.
        suite: suite of motions to fit (connection only); None for all motions.
        name: name of the model; None for method and term, such as ``wls-pgv``.
        vertical: ``without`` or ``with`` vertical motion (connection only).
        seed: seed of the bootstrap by earthquake.

    Returns:
        The report; ``report.model.row`` is what the database stores.

    Raises:
        InputError: unknown term or method.
        FitError: the data cannot carry the fit; the message says why and what to do.
    """
    chosen_term = intensity_term(term)
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}: use one of {', '.join(METHODS)}")
    if seed < 0:
        raise InputError(f"seed = {seed}: give a whole number from 0 up")
    if name is not None and not name.strip():
        raise InputError("the name of the model is empty: give a name or leave it out")
    if isinstance(source, CombinationTable):
        table = source
    else:
        from rbfrag.db.queries import combination_table

        table = combination_table(source, suite=suite, vertical=vertical)
    data = fit_data(table, chosen_term)
    result = METHODS[method](data, chosen_term, seed=seed)
    law = power_law(table)
    correlations = log_correlations(table)
    row = ModelRow(
        name=name or f"{method}-{term}",
        term=term,
        method=method,
        coefficients=result.coefficients,
        covariance=result.covariance,
        domain=_domain(data),
        data_fingerprint=data.fingerprint,
        diagnostics={
            "standard_errors": result.standard_errors,
            "n": int(data.found.sum()),
            "n_censored": int((~data.found).sum()),
            "events": int(np.unique(data.event[data.found]).size),
            "scores": result.scores,
            "warnings": [*_data_warnings(data), *result.warnings],
            "n_total": data.n_total,
            "n_found": int((table.status == "found").sum()),
            "n_excluded_undefined_term": data.n_excluded,
            "n_outside_model": data.n_outside_model,
            "guessed_events": data.guessed_events,
            "power_law": asdict(law) if law is not None else None,
            "log_correlations": correlations,
            "term_rank": list(correlations),
            "suite": suite,
            "vertical": vertical,
            **result.details,
        },
        created=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    return FitReport.from_model(FragilityModel.from_row(row))


def _domain(data: FitData) -> dict[str, tuple[float, float]]:
    columns = {
        "p2": data.p2,
        "intensity_m_s": data.x,
        "y_m_s": data.y,
        "tm_s": data.tm_s,
    }
    result = {}
    for name, values in columns.items():
        used = values[data.found & np.isfinite(values)]
        if used.size:
            result[name] = (float(used.min()), float(used.max()))
    return result


def _data_warnings(data: FitData) -> list[str]:
    result = []
    if data.guessed_events:
        result.append(
            f"{data.guessed_events} of {len(data.event_names)} earthquakes are guessed from file "
            "headers: one earthquake may be counted as several, which makes standard errors too "
            "small; name them by  motions add --metadata"
        )
    if data.n_excluded:
        result.append(
            f"{data.n_excluded} critical values are left out because their intensity term is not "
            "defined (no mean period)"
        )
    if data.n_outside_model:
        result.append(
            f"{data.n_outside_model} combinations are outside the block model and left out"
        )
    return result
