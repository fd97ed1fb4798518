"""The list of fitted models as scripts read it. Loads no library."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from rbfrag.db.model_file import ModelRow, held_out_loss
from rbfrag.fragility.measures import TERMS


def model_list(rows: Iterable[ModelRow]) -> list[dict[str, Any]]:
    """Return what `rbfrag models list` says of each model, the best of a kind first."""
    return [
        {
            **{
                each: getattr(row, each)
                for each in ("name", "kind", "term", "method", "is_default")
            },
            "n": fitted_number(row.diagnostics),
            "reads": list(TERMS[row.term].inputs) if row.term in TERMS else [],
            "log_loss": _finite(held_out_loss(row, "log_loss_held_out")),
            "log_loss_kr05": _finite(held_out_loss(row, "log_loss_held_out_kr05")),
            "events": row.diagnostics.get("events"),
            "sensitive_share": row.diagnostics.get("sensitive_share"),
            "domain": dict(row.domain),
            "created": row.created,
        }
        for row in sorted(rows, key=lambda row: (row.kind, held_out_loss(row)))
    ]


def _finite(loss: float) -> float | None:
    return loss if loss < math.inf else None


def fitted_number(diagnostics: Mapping[str, Any]) -> int | None:
    """Return how many critical values a model was fitted to; of one that reads none, outcomes."""
    critical, outcomes = (diagnostics.get(name) for name in ("n", "n_outcomes"))
    number = critical or outcomes or critical
    return None if number is None else int(number)
