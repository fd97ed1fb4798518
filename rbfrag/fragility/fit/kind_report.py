"""What a fit of blocks that slide or slump reports: a dictionary of plain values."""

from __future__ import annotations

from typing import Any

from rbfrag.db.model_file import ModelRow

MEANINGS = {
    "sliding": "probability that the permanent displacement exceeds a stated one",
    "slumping": "probability that the block slumps past recovery, or by the stated rotation",
}
"""What the probability of each kind is a probability of."""


def kind_report(row: ModelRow) -> dict[str, Any]:
    """Return the report of a fitted or stored model under the keys of the JSON contract."""
    return {
        "name": row.name,
        "kind": row.kind,
        "term": row.term,
        "method": row.method,
        "meaning": MEANINGS[row.kind],
        "coefficients": dict(row.coefficients),
        **row.diagnostics,
        "covariance": [list(line) for line in row.covariance],
        "domain": {name: list(edges) for name, edges in row.domain.items()},
        "data_fingerprint": row.data_fingerprint,
        "is_default": row.is_default,
        "created": row.created,
    }
