"""The report of a fitted model: parameters, scores on earthquakes held out, settings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from rbfrag.db.rows import CombinationTable
from rbfrag.fragility import describe
from rbfrag.fragility.fit.line import clustered_line
from rbfrag.fragility.measures import SINGLE_TERMS, TERMS
from rbfrag.fragility.model import IS_ESTIMATED, FragilityModel
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import rounded
from rbfrag.results.result import Result, TextLine, TextTable

_FIELDS = ("standard_errors", "n", "n_censored", "events", "scores", "warnings", IS_ESTIMATED)


@dataclass(frozen=True, repr=False)
class FitReport(Result):
    """A fitted model with its parameters, scores and settings.

    Args:
        name: unique name of the model.
        kind: response kind.
        term: intensity term.
        method: how it was fitted.
        coefficients: value of each parameter by name.
        standard_errors: standard error of each parameter by name.
        n: number of critical values that were fitted; of a kind without them, of outcomes.
        n_censored: number of combinations whose critical value lies below the search limit.
        events: number of earthquakes.
        scores: how well the model predicts; ``held_out`` leaves whole earthquakes out, ``kr05``
            reads blocks of k_r >= 0.05 alone.
        warnings: warnings about the data and the fit.
        details: everything else: counts, M, the rank of the terms, settings.
        model: the model itself, ready to be stored or used.
    """

    name: str
    kind: str
    term: str
    method: str
    coefficients: Mapping[str, float]
    standard_errors: Mapping[str, float]
    n: int
    n_censored: int
    events: int
    scores: Mapping[str, float]
    warnings: tuple[str, ...]
    details: Mapping[str, Any]
    model: FragilityModel

    @classmethod
    def from_model(cls, model: FragilityModel) -> FitReport:
        """Return the report of a fitted or stored model."""
        row = model.row
        diagnostics = cast("Mapping[str, Any]", row.diagnostics)
        return cls(
            name=row.name,
            kind=row.kind,
            term=row.term,
            method=row.method,
            coefficients=dict(row.coefficients),
            standard_errors=dict(diagnostics.get("standard_errors", {})),
            n=describe.fitted_number(diagnostics) or 0,
            n_censored=int(diagnostics.get("n_censored", 0)),
            events=int(diagnostics.get("events", 0)),
            scores=dict(diagnostics.get("scores", {})),
            warnings=tuple(Diagnostic(text, "fit") for text in diagnostics.get("warnings", ())),
            details={key: value for key, value in diagnostics.items() if key not in _FIELDS},
            model=model,
        )

    def table_columns(self) -> dict[str, Any]:
        """Return the parameters, one row each, with their standard errors."""
        errors = [self.standard_errors.get(name, math.nan) for name in self.coefficients]
        return {
            "model": self.name,
            "kind": self.kind,
            "term": self.term,
            "method": self.method,
            "parameter": np.array([*self.coefficients], dtype=object),
            "coefficient": np.array([*self.coefficients.values()], dtype=np.float64),
            "standard_error": np.array(errors, dtype=np.float64),
        }

    def sentences(self) -> Iterator[str]:
        """Yield the log loss on earthquakes held out, with its interval."""
        score = self.scores.get("log_loss_held_out")
        if score is None:
            yield f"Model {self.name}: no score on earthquakes held out"
            return
        ends = (self.details.get("score_intervals") or {}).get("log_loss_held_out")
        around = "" if ends is None else f" ({rounded(ends[0])}–{rounded(ends[1])} by earthquakes)"
        yield f"Log loss on earthquakes held out {rounded(score)}{around}; lower is better"

    def lines(self) -> Iterator[TextLine]:
        """Yield the model, why its method was chosen, and the data."""
        default = f", default of {self.kind}" if self.model.row.is_default else ""
        about = f"{self.method} on {self.term}{default}"
        yield TextLine("Model", f"{self.name} ({about}): {self.model.meaning}")
        if reason := self.details.get("why_method"):
            yield TextLine("Method", reason)
        if data := describe.fitted_data(self.model.row.diagnostics):
            yield TextLine("Data", data)
        if condition := self.details.get("where"):
            yield TextLine("Where", condition)
        strong = self.scores.get("log_loss_held_out_kr05")
        if strong is not None:
            spectra = self.model.form.velocity is not None
            also = "; both with response spectra, rbfrag models list has others" if spectra else ""
            text = f"log loss {rounded(strong)} for blocks with k_r ≥ 0.05{also}"
            yield TextLine("Score", text)

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the parameters; if verbose also counts, what blocks share, and all scores."""
        if not verbose:
            errors = {name: rounded(value) for name, value in self.standard_errors.items()}
            yield TextTable(
                ("parameter", "value", "standard error"),
                [(name, rounded(value), errors.get(name))
                 for name, value in self.coefficients.items()],
            )  # fmt: skip
            return
        bootstrap = (self.details.get("bootstrap") or {}).get("standard_errors", {})
        independent = self.details.get("naive_standard_errors") or {}
        yield TextTable(
            ("parameter", "value", "standard error", "by bootstrap", "assumed independent"),
            [(name, value, self.standard_errors.get(name), bootstrap.get(name),
              independent.get(name)) for name, value in self.coefficients.items()],
        )  # fmt: skip
        yield TextTable((), [*self._counts()])
        dependence: Mapping[str, Any] | None = self.model.row.dependence
        if dependence is not None:
            yield TextTable(
                ("shared by the blocks of one earthquake", "value", "standard error"),
                [(name, dependence[name], error) for name, error in dependence["errors"].items()],
            )
        intervals = self.details.get("score_intervals") or {}
        yield TextTable(
            ("score", "value", "low", "high"),
            [(name, value, *intervals.get(name, (None, None)))
             for name, value in self.scores.items()
             if name.endswith(("_in_sample", "_held_out"))],
        )  # fmt: skip

    def _counts(self) -> Iterator[tuple[str, object]]:
        """Yield numbers of the data and of the fit with their names."""
        details = self.details
        for kind in dict.fromkeys((details.get("standard_error_kinds") or {}).values()):
            yield "standard error", kind
        yield "combinations", details.get("n_total")
        yield "critical value found", self.n
        yield "below the search limit", self.n_censored
        yield "outside the model", details.get("n_outside_model")
        yield "earthquakes", self.events
        if details.get("rotation_deg") is not None:
            yield "rotation that counts as failure [deg]", details["rotation_deg"]
        if "n_outcomes" in details:
            yield "outcomes fitted (toppled)", f"{details['n_outcomes']} ({details['n_toppled']})"
            yield "outcomes certain by mechanics", details["n_bounded"]
        if "sensitive_share" in details:
            yield "fraction of sensitive outcomes", details["sensitive_share"]
        for name, value in (details.get("power_law") or {}).items():
            yield f"power law {name}", value
        for name, value in (details.get("log_correlations") or {}).items():
            yield f"correlation of ln y with ln {name}", value
        for name, value in (details.get("scatter_ln_y") or {}).items():
            yield f"dispersion of ln y, {name.replace('_', ' ')}", value
        yield "scores computed from", details.get("judged_on", "critical values")

    def as_dict(self) -> dict[str, Any]:
        """Return the report under the keys of the JSON contract, and more."""
        row = self.model.row
        fields = {name: value for name, value in vars(self).items() if name != "model"}
        details = fields.pop("details")
        return {
            **fields,
            "meaning": self.model.meaning,
            "warnings": list(self.warnings),
            **details,
            "covariance": [list(line) for line in row.covariance],
            "dependence": None if row.dependence is None else dict(row.dependence),
            "domain": {name: list(edges) for name, edges in row.domain.items()},
            "data_fingerprint": row.data_fingerprint,
            "is_default": row.is_default,
            "created": row.created,
        }


def power_law(table: CombinationTable) -> dict[str, float] | None:
    """Fit k_r/PGA = C (ω_m/p)^(-M), equation (4.28), by least squares of the logarithms.

    Args:
        table: critical values; all that were found and have a mean period are used.

    Returns:
        M with its standard error clustered by earthquake, C and the number of values; None when
        there are too few points or earthquakes, or all ω_m/p are equal.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        x = -np.log(2.0 * math.pi / table.tm_s / np.sqrt(table.p2))
        y = np.log(table.kr_over_pga)
    used = (table.status == "found") & np.isfinite(x) & np.isfinite(y)
    _, events = np.unique(table.event_id[used].astype(str), return_inverse=True)
    if used.sum() < 3 or events.max() < 1 or np.ptp(x[used]) == 0.0:
        return None
    fit = clustered_line(x[used], y[used], np.ones(int(used.sum())), events.astype(np.intp))
    return {
        "exponent_m": float(fit.line[1]),
        "exponent_m_se": math.sqrt(fit.covariance[1, 1]),
        "constant_c": math.exp(fit.line[0]),
        "n": int(used.sum()),
    }


def log_correlations(table: CombinationTable) -> dict[str, float]:
    """Return the correlation of ln y with ln x for each single term, the strongest first.

    All terms are judged on the same points: those for which every term is defined. A term
    without variation is left out.
    """
    observed = table.status == "found"
    columns = {
        name: np.asarray(
            TERMS[name].intensity_m_s({key: table.measure(key) for key in TERMS[name].inputs}),
            dtype=np.float64,
        )
        for name in SINGLE_TERMS
    }
    with np.errstate(invalid="ignore"):
        used = observed & (table.y_m_s > 0.0)
        for values in columns.values():
            used &= np.isfinite(values) & (values > 0.0)
    ln_y = np.log(table.y_m_s[used])
    if ln_y.size < 3 or np.ptp(ln_y) == 0.0:
        return {}
    result = {}
    for name, values in columns.items():
        ln_x = np.log(values[used])
        if np.ptp(ln_x) > 0.0:
            result[name] = float(np.corrcoef(ln_x, ln_y)[0, 1])
    return dict(sorted(result.items(), key=lambda item: -item[1]))
