"""Fitting a fragility model to the critical values and outcomes of a database."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from rbfrag.db.rows import CombinationTable, ModelRow
from rbfrag.errors import FitError, InputError
from rbfrag.fragility import formulas
from rbfrag.fragility.fit.data import FitData, fit_data
from rbfrag.fragility.fit.line import fit_wls
from rbfrag.fragility.fit.log_relations import log_correlations, power_law
from rbfrag.fragility.fit.lognormal import fit_lognormal
from rbfrag.fragility.fit.method_result import MethodResult
from rbfrag.fragility.fit.outcomes import fit_outcomes
from rbfrag.fragility.fit.report import FitReport
from rbfrag.fragility.fit.source import FitSource, read_source
from rbfrag.fragility.interval_floor import RICHER, interval_floor, of_motions, of_sizes
from rbfrag.fragility.measures import TERMS, Term, intensity_term
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction_values import pgv_over_pga_s

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from rbfrag.db.queries import Vertical

METHODS: Mapping[str, Callable[..., MethodResult]] = {
    "wls": fit_wls,
    "lognormal": fit_lognormal,
    **{
        name: partial(fit_outcomes, method=name)
        for name in ("logistic", "weibull", "bounded", "record", "power")
    },
}
"""The methods of fitting: ``method(data, term, seed=…)``."""

WITH_EXPONENT = ("lognormal", "logistic")
"""Methods that can estimate the exponent M."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fit with what only a study of fits needs.

    Args:
        report: the report.
        data: the points.
        result: what the method handed back, with its held-out probabilities.
    """

    report: FitReport
    data: FitData
    result: MethodResult


def fit(
    source: Connection | CombinationTable | FitSource,
    *,
    term: str,
    method: str = "wls",
    suite: str | None = None,
    name: str | None = None,
    vertical: Vertical = "without",
    seed: int = 0,
    estimate_m: bool = False,
    doubtful_pgd: bool = False,
) -> FitReport:
    """Fit a fragility model; nothing is stored.

    Args:
        source: a connection to the database, or the data themselves (critical values alone
            carry ``wls`` and ``lognormal``).
        term: intensity term: ``pgv``, ``pga_tm``, ``pgd_tm``, ``pgv_pga``, ``pgv_pga_tm`` or
            ``xp``.
        method: method of fitting: ``wls`` and ``lognormal`` (of critical values, for a term that
            is one number), ``logistic`` (of outcomes, the same terms), ``weibull`` and
            ``bounded`` (of outcomes, the terms with PGV), ``record`` and ``power`` (``xp``).
        suite: suite of motions to fit (connection only); None for all motions.
        name: name of the model; None for method and term, such as ``wls-pgv``.
        vertical: ``without`` or ``with`` vertical motion, or ``both`` (connection only).
        seed: seed of the bootstrap by earthquake.
        estimate_m: estimate the exponent M of y = k_r g/p^M instead of M = 1 (``lognormal`` and
            ``logistic``).
        doubtful_pgd: True to let ``pgd_tm`` read the PGD of records that are flagged for an
            implausible final velocity or displacement (connection only).

    Returns:
        The report; ``report.model.row`` is what the database stores.

    Raises:
        InputError: unknown term or method, or two that do not go together.
        FitError: the data cannot carry the fit; the message says why and what to do.
    """
    chosen = _checked(term, method, seed=seed, name=name, estimate_m=estimate_m)
    if isinstance(source, CombinationTable):
        source = FitSource.of_table(source)
    elif not isinstance(source, FitSource):
        source = read_source(source, suite=suite, vertical=vertical, doubtful_pgd=doubtful_pgd)
    return fit_source(
        source,
        chosen,
        method,
        name=name,
        seed=seed,
        estimate_m=estimate_m,
        selection={"suite": suite, "vertical": vertical, "doubtful_pgd": doubtful_pgd},
    ).report


def fit_source(
    source: FitSource,
    term: Term,
    method: str,
    *,
    name: str | None = None,
    seed: int = 0,
    estimate_m: bool = False,
    selection: Mapping[str, object] | None = None,
    compared: bool = True,
) -> Fitted:
    """Fit a model and keep its held-out probabilities.

    Arguments as for :func:`fit`; `compared` says whether the model gets its table of least widths,
    for which those that know more are fitted too: a study of scores has no use for it.
    """
    table = source.table
    data = fit_data(source, term)
    options = {"estimate_m": True} if estimate_m else {}
    result = METHODS[method](data, term, seed=seed, **options)
    law = power_law(table)
    correlations = log_correlations(table)
    events = int(np.unique(data.event[data.found]).size)
    with_vertical = (selection or {}).get("vertical", "without")
    row = ModelRow(
        name=name or f"{method}-{term.name}",
        term=term.name,
        method=method,
        coefficients=result.coefficients,
        covariance=result.covariance,
        domain=_domain(data, method, term),
        data_fingerprint=data.fingerprint,
        diagnostics={
            "standard_errors": result.standard_errors,
            "n": int(data.found.sum()),
            "n_censored": int((~data.found).sum()),
            "events": events,
            "degrees_of_freedom": events - 1,
            "scores": result.scores,
            "warnings": [*_data_warnings(data), *result.warnings],
            "n_total": data.n_total,
            "n_found": int((table.status == "found").sum()),
            "n_below_limit": int((table.status == "below_limit").sum()),
            "n_no_motion": int((table.status == "no_motion").sum()),
            "n_excluded_undefined_term": data.n_excluded,
            "n_outside_model": data.n_outside_model,
            "guessed_events": data.guessed_events,
            "power_law": asdict(law) if law is not None else None,
            "log_correlations": correlations,
            "term_rank": list(correlations),
            "suite": (selection or {}).get("suite"),
            "doubtful_pgd": (selection or {}).get("doubtful_pgd", False),
            "vertical": with_vertical,
            **result.details,
        },
        created=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    if compared:
        row = _with_floor(row, source, str(with_vertical))
    return Fitted(FitReport.from_model(FragilityModel.from_row(row)), data, result)


def _checked(term: str, method: str, *, seed: int, name: str | None, estimate_m: bool) -> Term:
    chosen = intensity_term(term)
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}: use one of {', '.join(METHODS)}")
    if (method, term) not in formulas.SHAPES:
        terms = ", ".join(of for by, of in formulas.SHAPES if by == method)
        methods = ", ".join(by for by, of in formulas.SHAPES if of == term)
        raise InputError(
            f"method {method} does not go with the term {term}: it fits {terms}; the term {term} "
            f"is fitted by {methods}"
        )
    if estimate_m and method not in WITH_EXPONENT:
        raise InputError(
            f"method {method} keeps M = 1: the exponent is estimated by {', '.join(WITH_EXPONENT)}"
        )
    if seed < 0:
        raise InputError(f"seed = {seed}: give a whole number from 0 up")
    if name is not None and not name.strip():
        raise InputError("the name of the model is empty: give a name or leave it out")
    return chosen


def _with_floor(row: ModelRow, source: FitSource, vertical: str) -> ModelRow:
    """Return the model with its table of least widths, where models that know more exist."""
    table: list[float] = []
    if RICHER[row.term]:
        model = FragilityModel.from_row(row)
        others = [_richer_model(name, source, vertical) for name in RICHER[row.term]]
        known = [other for other in others if other is not None]
        if known:
            sample = of_motions(source) if RICHER[row.term] == ("xp",) else of_sizes(source)
            table = interval_floor(model, known, sample)
    return replace(row, diagnostics={**row.diagnostics, "interval_floor": table})


def _richer_model(name: str, source: FitSource, vertical: str) -> FragilityModel | None:
    """Return the best model of a term, with clustered covariance and its own table, only that."""
    from rbfrag.fragility.fit.outcomes import fit_parameters

    term = TERMS[name]
    method = "record" if name == "xp" else "bounded"
    try:
        data = fit_data(source, term)
        names, parameters, covariance, freedom = fit_parameters(data, term, method)
    except FitError:
        return None
    row = ModelRow(
        name=name,
        term=name,
        method=method,
        coefficients=dict(zip(names, parameters.tolist(), strict=True)),
        covariance=tuple(tuple(line) for line in covariance.tolist()),
        domain={},
        data_fingerprint="",
        diagnostics={
            "degrees_of_freedom": freedom,
            "events": int(np.unique(data.event[data.found]).size),
            "vertical": vertical,
        },
    )
    return FragilityModel.from_row(_with_floor(row, source, vertical))


def _domain(data: FitData, method: str, term: Term) -> dict[str, tuple[float, float]]:
    of_outcomes = method not in ("wls", "lognormal")
    used = data.found | of_outcomes
    with np.errstate(divide="ignore", invalid="ignore"):
        columns = {
            "p2": data.p2,
            "intensity_m_s": data.x,
            "y_m_s": data.y0_m_s if of_outcomes else data.y,
            "tm_s": data.tm_s,
            "pgv_over_pga_s": pgv_over_pga_s(data.pgv_m_s, data.pga_g),
        }
    if "pgv_m_s" not in term.inputs or "pga_g" not in term.inputs:
        del columns["pgv_over_pga_s"]
    result = {}
    for name, values in columns.items():
        chosen = values[used]
        chosen = chosen[np.isfinite(chosen)]
        if chosen.size:
            result[name] = (float(chosen.min()), float(chosen.max()))
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
            "defined (no mean period, a PGD in doubt, or no toppling spectrum stored)"
        )
    if data.n_outside_model:
        result.append(
            f"{data.n_outside_model} combinations are outside the block model and left out"
        )
    return result
