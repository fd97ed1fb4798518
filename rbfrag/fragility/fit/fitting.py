"""Fitting a fragility model to the critical values and outcomes of a database."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from os import PathLike
from typing import TYPE_CHECKING, Required, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.model_file import COMPARED, ModelRow, reject_taken
from rbfrag.db.rows import IMPORTED, CombinationTable, Selection
from rbfrag.errors import FitError, InputError
from rbfrag.fragility.completion import encode_regressions
from rbfrag.fragility.domain import INSIDE
from rbfrag.fragility.fit.completions import regressions
from rbfrag.fragility.fit.data import (
    NARROW,
    FitData,
    FitSource,
    fit_data,
    motions_of,
    read_source,
)
from rbfrag.fragility.fit.dependence import estimate_dependence, observed_blocks
from rbfrag.fragility.fit.line import fit_wls
from rbfrag.fragility.fit.losses import losses_by_inputs
from rbfrag.fragility.fit.maximum_likelihood import fit_censored, fit_lognormal, fit_outcomes
from rbfrag.fragility.fit.report import FitReport, log_correlations, power_law
from rbfrag.fragility.fit.result import FEW_EVENTS, MethodResult, cr3
from rbfrag.fragility.measures import Term, intensity_term
from rbfrag.fragility.method import Method
from rbfrag.fragility.methods import method_named, methods
from rbfrag.fragility.model import IS_ESTIMATED, LOSSES, FragilityModel
from rbfrag.motions.sample_motions import PULSE
from rbfrag.solver.results import NUMERICS_VERSION, FloatArray
from rbfrag.threads import with_one_thread

if TYPE_CHECKING:
    from sqlalchemy import Connection


ESTIMATORS: Mapping[str, Callable[..., MethodResult]] = {
    "outcomes": fit_outcomes,
    "line": fit_wls,
    "log_line": fit_lognormal,
    "censored": fit_censored,
}


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fit with the additional results for studies of fits.

    Args:
        result: what the method handed back, with its held-out probabilities.
    """

    report: FitReport
    data: FitData
    result: MethodResult


class FitOptions(Selection, total=False):
    """Options of :func:`fit`."""

    kind: str
    term: Required[str]
    method: str | None
    name: str | None
    seed: int
    bootstrap: bool
    dependence: bool
    estimate_m: bool


def fit(
    source: str | PathLike[str] | Connection | CombinationTable | FitSource | None = None,
    *,
    kind: str = "toppling",
    term: str,
    method: str | None = None,
    name: str | None = None,
    seed: int = 0,
    bootstrap: bool = False,
    dependence: bool = False,
    estimate_m: bool = False,
    taken: Collection[str] = (),
    **selection: Unpack[Selection],
) -> FitReport:
    """Fit a fragility model like :func:`rbfrag.fit`, without storing it.

    Args:
        source: the database (a path, URL or connection; None for ``RBFRAG_DB`` or ``rbfrag.db`` in
            the current folder), or the data themselves (critical values alone carry ``wls`` and
            ``lognormal``), of which the selection chooses nothing.
        taken: names that the model must not have; rejected before anything is computed.

    Returns:
        The report; ``report.model.row`` is what the database stores.

    Raises:
        InputError: unknown kind, term or method, or some that do not go together.
        FitError: the data cannot carry the fit; the message says why and what to do.
    """
    of_term = intensity_term(term)
    chosen = method_of_kind(kind, method, term, estimate_m=estimate_m)
    _reject_unfit(chosen, of_term, kind, estimate_m, selection.get("rotation_deg"))
    if seed < 0:
        raise InputError(f"seed = {seed}: give a whole number, 0 or more")
    if name is not None and not name.strip():
        raise InputError("the name of the model is empty: give a name or omit it")
    reject_taken(name or _name(chosen, of_term, kind, selection), taken)
    if isinstance(source, CombinationTable):
        source = FitSource.of_table(source)
    elif source is None or isinstance(source, str | PathLike):
        from rbfrag.db.engine import opened_database

        # reading takes no lock, so that a campaign may go on meanwhile
        with opened_database(source, read_only=True) as engine, engine.connect() as connection:
            source = read_source(connection, chosen.block, kind=kind, **selection)
    elif not isinstance(source, FitSource):
        source = read_source(source, chosen.block, kind=kind, **selection)
    condition = selection.get("where")
    if condition is not None and source.table.p2.size == 0:
        raise FitError(f"no stored result meets where = {condition!r}: change the condition")
    if method is None and not np.isfinite(source.failed).any():
        chosen = method_of_kind(kind, None, term, estimate_m=estimate_m, reads="critical")
    why = None
    if method is None:
        suited = [candidate.name for candidate in methods_of_kind(kind) if term in candidate.forms]
        of = "no outcomes are stored; of critical values" if chosen.reads == "critical" else "of"
        why = f"{chosen.name}, {of} {', '.join(suited)} the best on earthquakes left out"
    return fit_source(
        source, of_term, chosen, kind=kind, name=name, seed=seed, bootstrap=bootstrap,
        dependence=dependence, estimate_m=estimate_m, selection=selection, why=why,
    ).report  # fmt: skip


def methods_of_kind(kind: str) -> tuple[Method, ...]:
    """Return the methods that use the block parameters of a kind.

    Raises:
        InputError: an unknown kind, or one that no method goes with.
    """
    from rbfrag.solver.kinds import facts_of

    names = facts_of(kind).parameters
    reading = [method for method in methods() if names and method.block.names == names]
    # of a kind without methods of its own, all that read what describes its block
    suited = tuple(method for method in reading if method.block.kind == kind) or tuple(reading)
    if not suited:
        raise InputError(f"there is no fragility model of kind {kind}: no method supports it")
    return suited


def method_of_kind(
    kind: str, name: str | None, term: str = "", *, estimate_m: bool = False, reads: str = ""
) -> Method:
    """Return the named method; by default the one with the best cross-validation score for the
    term.

    Args:
        estimate_m: it estimates the exponent M.
        reads: what it must read; empty for anything.

    Raises:
        InputError: an unknown kind or method, or two that do not go together.
    """
    candidates = methods_of_kind(kind)
    if name is None:
        suited = [
            method for method in candidates if term in method.forms and reads in ("", method.reads)
        ]
        able = (method for method in suited if method.exponent or not estimate_m)
        return min(able, key=lambda method: method.name in COMPARED, default=candidates[0])
    chosen = method_named(name)
    if chosen not in candidates:
        raise InputError(
            f"method {name} fits blocks with {' and '.join(chosen.block.names)}, not those of "
            f"kind {kind}, which are fitted by {', '.join(method.name for method in candidates)}"
        )
    return chosen


@with_one_thread
def fit_source(
    source: FitSource,
    term: Term,
    method: Method,
    *,
    kind: str | None = None,
    name: str | None = None,
    seed: int = 0,
    bootstrap: bool = False,
    dependence: bool = False,
    estimate_m: bool = False,
    selection: Selection | None = None,
    why: str | None = None,
) -> Fitted:
    """Fit a model and keep its held-out probabilities.

    Arguments as for :func:`fit`; `why` is why this method is taken.
    """
    # Rows -> coefficients -> what blocks of one earthquake share -> the stored row: each step sees
    # only the output of the one before.
    table, chosen = source.table, selection or {}
    data = fit_data(source, method, term, kind=kind)
    options = {"estimate_m": True} if estimate_m else {}
    # Errors clustered by earthquake are known to fail with few earthquakes: those
    # with a critical value, or else with outcomes
    has_value = data.observed
    if method.reads == "outcomes" and not has_value.any():
        has_value = np.ones_like(data.observed)
    events = int(np.unique(data.event[has_value]).size)
    options["resample"] = bootstrap or events < FEW_EVENTS
    result = ESTIMATORS[method.fit](data, method, term, seed=seed, **options)
    shared, unknown = None, []
    if dependence:
        try:
            blocks = observed_blocks(data, method.block, result.held_out)
            shared = estimate_dependence(seed=seed, **blocks)
        except FitError as error:
            unknown = [f"the range of one future earthquake is not known: {error}"]
    # The critical values also give the power law of the dissertation and the ranking of terms by
    # their correlation with ln y*.
    of_any_strength = method.block.points == "strengths"
    correlations = log_correlations(table) if of_any_strength else {}
    # without those that mechanics rules out
    fitted = data.read.copy()
    with np.errstate(invalid="ignore", divide="ignore"):
        for bound in method.forms[term.name].bounds:
            fitted &= ~bound.holds(data.blocks)
    warnings = [*_data_warnings(data, source), *result.warnings, *unknown]
    completions = None
    if (velocity := method.forms[term.name].velocity) is not None:
        names = cast("list[str]", result.details["fitted_events"])
        motions = motions_of(source.only(data.combination), method.block, names)
        completions = encode_regressions(regressions(term, velocity, motions))
    row = ModelRow(
        name=name or _name(method, term, data.kind, chosen),
        kind=data.kind,
        term=term.name,
        method=method.name,
        coefficients=result.coefficients,
        covariance=tuple(tuple(line) for line in cr3(result.steps).tolist()),
        leave_out_steps=tuple(tuple(line) for line in result.steps.tolist()),
        dependence=shared,
        completions=completions,
        domain=data.domain,
        data_fingerprint=data.fingerprint,
        diagnostics={
            "standard_errors": result.standard_errors,
            "n": int(data.observed.sum()),
            "n_censored": int(data.censored.sum()),
            "narrow": NARROW,
            "events": events,
            "scores": result.scores,
            "warnings": warnings,
            "n_total": data.n_total,
            "n_found": int((table.status == "found").sum()),
            "n_below_limit": int((table.status == "below_limit").sum()),
            "n_no_motion": int((table.status == "no_motion").sum()),
            "n_excluded_undefined_term": data.n_excluded,
            "n_outside_model": data.n_outside_model,
            "guessed_events": data.guessed_events,
            "recorded_events": sum(not name.startswith(PULSE) for name in data.event_names),
            "power_law": power_law(table) if of_any_strength else None,
            "log_correlations": correlations,
            "term_rank": list(correlations),
            "suite": chosen.get("suite"),
            "where": chosen.get("where"),
            "doubtful_pgd": chosen.get("doubtful_pgd", False),
            "include_structures": chosen.get("include_structures", False),
            "vertical": chosen.get("vertical", "without"),
            "rotation_deg": chosen.get("rotation_deg"),
            "seed": seed,
            IS_ESTIMATED: dependence,
            **({"why_method": why} if why else {}),
            "mahalanobis": joint_scatter(
                (*method.block.names, *term.inputs, *["velocity_m_s"] * (velocity is not None)),
                data.blocks,
                fitted,
            ),
            **result.details,
        },
        created=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    model = FragilityModel.from_row(row)
    if velocity is not None and source.spectra is not None:
        losses = losses_by_inputs(model, data, source.spectra[data.combination])
        diagnostics = {**row.diagnostics, LOSSES: losses}
        model = FragilityModel.from_row(replace(row, diagnostics=diagnostics))
    return Fitted(FitReport.from_model(model), data, result)


def joint_scatter(
    names: Sequence[str], values: Mapping[str, FloatArray], fitted: NDArray[np.bool_]
) -> dict[str, object] | None:
    """Return the scatter of the fitted points in the logarithms of the predictors.

    Args:
        values: by name, of a shape that broadcasts to that of `fitted`.
        fitted: which points are fitted, shape (n, m).

    Returns:
        names, centre, inverse covariance and the radius that the share `INSIDE` of the points lies
        within, JSON-able; None where there are no points. A direction in which the points do not
        scatter counts nothing: the ranges of single variables hold there.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.stack([np.log(np.broadcast_to(values[n], fitted.shape)) for n in names], axis=-1)
    points = logs[fitted & np.isfinite(logs).all(axis=-1)]
    if len(points) <= len(names):
        return None
    centre = points.mean(axis=0)
    inverse = np.linalg.pinv(np.atleast_2d(np.cov(points.T)), rcond=1e-10, hermitian=True)
    from_centre = points - centre
    distance = np.sqrt(np.einsum("ij,jk,ik->i", from_centre, inverse, from_centre, optimize=True))
    return {
        "names": list(names),
        "centre": centre.tolist(),
        "inverse_covariance": inverse.tolist(),
        "radius": float(np.quantile(distance, INSIDE, method="higher")) * (1.0 + 1e-9),
    }


def _reject_unfit(
    method: Method, term: Term, kind: str, estimate_m: bool, rotation_deg: float | None
) -> None:
    if term.name not in method.forms:
        suitable = (
            candidate.name for candidate in methods_of_kind(kind) if term.name in candidate.forms
        )
        raise InputError(
            f"method {method.name} cannot be combined with the term {term.name}: it fits "
            f"{', '.join(method.forms)}; the term {term.name} of kind {kind} is fitted by "
            f"{', '.join(suitable) or 'none'}"
        )
    if estimate_m and method.exponent is None:
        suitable = (candidate.name for candidate in methods() if candidate.exponent is not None)
        raise InputError(
            f"method {method.name} keeps M = 1: the exponent is estimated by {', '.join(suitable)}"
        )
    if rotation_deg is not None and method.block.criterion is None:
        raise InputError(
            f"rotation_deg is not a failure criterion of kind {kind}: omit rotation_deg",
            fields=("rotation_deg",),
        )


def _name(method: Method, term: Term, kind: str, selection: Mapping[str, object]) -> str:
    several = len(methods_of_kind(kind)) > 1
    parts = [] if several and kind == method.block.kind else [kind]
    if method.block.criterion is not None:
        rotation = selection.get(method.block.criterion)
        parts.append("recovery" if rotation is None else f"{rotation:g}deg")
    return "-".join([*parts, *([method.name] if several else []), term.name])


def _data_warnings(data: FitData, source: FitSource) -> list[str]:
    """Return the warnings about results of earlier numerics versions and about excluded data."""
    versions, result = source.table.numerics_version, []
    if IMPORTED in versions:
        result.append("the critical values are imported: safe islands below them are not seen")
    else:
        result += [
            f"the results are of version {version} of the numerics, and this rbfrag computes by "
            f"version {NUMERICS_VERSION}: simulate again to have its own"
            for version in dict.fromkeys(versions.tolist())
            if version != NUMERICS_VERSION
        ]
    if source.structures:
        result.append(
            f"{source.structures} motions recorded on structures are excluded: they are not ground "
            "motion"
        )
    if data.guessed_events:
        result.append(
            f"{data.guessed_events} of {data.events} earthquakes are guessed from file "
            "headers: one earthquake may be counted as several, which makes standard errors too "
            "small; name them in a table of metadata"
        )
    if data.n_excluded:
        result.append(
            f"{data.n_excluded} combinations are left out because a measure that the term reads is "
            "not known (no mean period or magnitude, a PGD in doubt, no toppling spectrum stored)"
        )
    if data.n_outside_model:
        result.append(
            f"{data.n_outside_model} combinations are outside the block model and left out"
        )
    return result
