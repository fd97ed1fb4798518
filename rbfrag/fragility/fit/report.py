"""What a fit reports."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.fit.line import clustered_line
from rbfrag.fragility.measures import SINGLE_TERMS, TERMS
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_list import fitted_number
from rbfrag.results.result import Tabular

_FIELDS = ("standard_errors", "n", "n_censored", "events", "scores", "warnings")


@dataclass(frozen=True, repr=False)
class FitReport(Tabular):
    """A fitted model with all that is said about it.

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
        warnings: sentences for people.
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
    details: Mapping[str, object]
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
            n=fitted_number(diagnostics) or 0,
            n_censored=int(diagnostics.get("n_censored", 0)),
            events=int(diagnostics.get("events", 0)),
            scores=dict(diagnostics.get("scores", {})),
            warnings=tuple(diagnostics.get("warnings", ())),
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

    def as_dict(self) -> dict[str, object]:
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


@dataclass(frozen=True)
class PowerLaw:
    """k_r/PGA = C (ω_m/p)^(-M), fitted by least squares of the logarithms.

    Args:
        exponent_m_se: standard error of M, clustered by earthquake.
    """

    exponent_m: float
    exponent_m_se: float
    constant_c: float
    n: int


def power_law(table: CombinationTable) -> PowerLaw | None:
    """Fit equation (4.28): M is the slope of ln(k_r/PGA) on -ln(ω_m/p).

    Args:
        table: critical values; all that were found and have a mean period are used.

    Returns:
        None when there are too few points or earthquakes, or all ω_m/p are equal.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        x = -np.log(2.0 * math.pi / table.tm_s / np.sqrt(table.p2))
        y = np.log(table.kr_over_pga)
    used = (table.status == "found") & np.isfinite(x) & np.isfinite(y)
    _, events = np.unique(table.event_id[used].astype(str), return_inverse=True)
    if used.sum() < 3 or events.max() < 1 or np.ptp(x[used]) == 0.0:
        return None
    fit = clustered_line(x[used], y[used], np.ones(int(used.sum())), events.astype(np.intp))
    return PowerLaw(
        exponent_m=float(fit.line[1]),
        exponent_m_se=math.sqrt(fit.covariance[1, 1]),
        constant_c=math.exp(fit.line[0]),
        n=int(used.sum()),
    )


def log_correlations(table: CombinationTable) -> dict[str, float]:
    """Return the correlation of ln y with ln x for each single term, the strongest first.

    All terms are judged on the same points: those for which every term is defined. A term
    without variation is left out.
    """
    observed = table.status == "found"
    columns = {
        name: np.asarray(
            TERMS[name].intensity_m_s({key: getattr(table, key) for key in TERMS[name].inputs}),
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
