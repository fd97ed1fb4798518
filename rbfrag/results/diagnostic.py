"""Warnings as every interface shows them: a text, and a code for programs."""

from __future__ import annotations

from collections.abc import Sequence


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
