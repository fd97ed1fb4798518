"""Warnings as every interface shows them: a text, and a code for programs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

ROWS_LISTED = 1_000
"""Most rows of a warning that a document lists."""


class Diagnostic(str):
    """A warning; it is its own text.

    Args:
        text: the fact and its consequence.
        code: what programs tell it by.
        severity: ``note`` or ``warning``.
        fields: input fields in the text, which each interface spells in its own way.
        rows: indices of the rows of a table that it holds for; empty for all of them.
    """

    code: str
    severity: str
    fields: tuple[str, ...]
    rows: Sequence[int]

    def __new__(
        cls,
        text: str,
        code: str = "note",
        *,
        severity: str = "note",
        fields: tuple[str, ...] = (),
        rows: Sequence[int] = (),
    ) -> Diagnostic:
        """Return a warning with its code."""
        self = super().__new__(cls, text)
        self.code, self.severity, self.fields, self.rows = code, severity, fields, rows
        return self

    def replaced(self, **about: Any) -> Diagnostic:
        """Return the warning with another text, or for other rows."""
        return Diagnostic(**{"text": str(self), **vars(self), **about})


def diagnostics(*groups: Iterable[str]) -> tuple[Diagnostic, ...]:
    """Return the warnings of an answer, each text once: what every writer shows."""
    texts = dict.fromkeys(text for group in groups for text in group)
    return tuple(t if isinstance(t, Diagnostic) else Diagnostic(t) for t in texts)


def as_documents(warnings: Iterable[str]) -> list[dict[str, Any]]:
    """Return warnings under the keys of the JSON contract."""
    return [
        {
            "code": each.code,
            "severity": each.severity,
            "text": str(each),
            "fields": list(each.fields),
            "rows": [int(row) for row in each.rows[:ROWS_LISTED]],
            "row_count": len(each.rows),
        }
        for each in diagnostics(warnings)
    ]


def codes_by_row(warnings: Iterable[str], size: int) -> Any:
    """Return the codes of the warnings about single rows, an array of texts of shape (size,)."""
    import numpy as np

    texts = np.full(size, "", dtype=object)
    for each in diagnostics(warnings):
        rows = np.unique(np.asarray(each.rows, dtype=np.intp))
        texts[rows] = [
            text if each.code in text.split() else f"{text} {each.code}".strip()
            for text in texts[rows].tolist()
        ]
    return texts
