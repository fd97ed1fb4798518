"""The list of fitted models as scripts read it. Loads no library."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rbfrag.db.model_file import ModelRow


def model_list(rows: Iterable[ModelRow]) -> list[dict[str, Any]]:
    """Return what `rbfrag models list` says of each model."""
    return [
        {
            "name": row.name,
            "kind": row.kind,
            "term": row.term,
            "method": row.method,
            "is_default": row.is_default,
            "n": row.diagnostics.get("n"),
            "log_loss": _scores(row).get("log_loss_held_out"),
            "events": row.diagnostics.get("events"),
            "sensitive_share": row.diagnostics.get("sensitive_share"),
            "domain": dict(row.domain),
            "created": row.created,
        }
        for row in rows
    ]


def _scores(row: ModelRow) -> Mapping[str, Any]:
    scores = row.diagnostics.get("scores")
    return scores if isinstance(scores, Mapping) else {}
