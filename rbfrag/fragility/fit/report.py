"""What a fit reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from rbfrag.fragility.model import FragilityModel

_FIELDS = ("standard_errors", "n", "n_censored", "events", "scores", "warnings")


@dataclass(frozen=True)
class FitReport:
    """A fitted model with all that is said about it.

    Args:
        name: unique name of the model.
        term: intensity term.
        method: how it was fitted.
        coefficients: value of each parameter by name.
        standard_errors: standard error of each parameter by name.
        n: number of critical values that were fitted.
        n_censored: number of combinations left out because their critical value lies below
            the search limit.
        events: number of earthquakes.
        scores: how well the model predicts; ``held_out`` leaves whole earthquakes out.
        warnings: sentences for people.
        details: everything else: counts, M, the rank of the terms, settings.
        model: the model itself, ready to be stored or used.
    """

    name: str
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
        told = cast("Mapping[str, Any]", row.diagnostics)
        return cls(
            name=row.name,
            term=row.term,
            method=row.method,
            coefficients=dict(row.coefficients),
            standard_errors=dict(told.get("standard_errors", {})),
            n=int(told.get("n", 0)),
            n_censored=int(told.get("n_censored", 0)),
            events=int(told.get("events", 0)),
            scores=dict(told.get("scores", {})),
            warnings=tuple(told.get("warnings", ())),
            details={key: value for key, value in told.items() if key not in _FIELDS},
            model=model,
        )

    def as_dict(self) -> dict[str, object]:
        """Return the report under the keys of the JSON contract, and more."""
        row = self.model.row
        return {
            "name": self.name,
            "term": self.term,
            "method": self.method,
            "meaning": self.model.meaning,
            "coefficients": dict(self.coefficients),
            "standard_errors": dict(self.standard_errors),
            "n": self.n,
            "n_censored": self.n_censored,
            "events": self.events,
            "scores": dict(self.scores),
            "warnings": list(self.warnings),
            **self.details,
            "covariance": [list(line) for line in row.covariance],
            "domain": {name: list(edges) for name, edges in row.domain.items()},
            "data_fingerprint": row.data_fingerprint,
            "is_default": row.is_default,
            "created": row.created,
        }
