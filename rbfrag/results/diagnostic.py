"""Warnings as every interface shows them: a text, and a code for programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

ROWS_LISTED = 1_000
"""Most rows of a warning that a document lists."""

NOTE, WARNING = SEVERITIES = ("note", "warning")

CODES: Mapping[str, tuple[str, str]] = {
    "back_friction_neglected": (NOTE, "friction on the back face is neglected (conservative)"),
    "by_mechanics": (NOTE, "mechanics decides in place of the fitted model"),
    "check_unit": (WARNING, "a value that is seldom meant: another unit may have been typed"),
    "cohesion_not_given": (NOTE, "rows without cohesion in a table that gives it elsewhere"),
    "cohesion_without_effect": (NOTE, "cohesion does not act on a base that opens"),
    "component_converted": (NOTE, "measures or a curve converted to a single component"),
    "curve_ends": (WARNING, "the hazard curve ends before the fragility does"),
    "decimal_comma": (NOTE, "a number with a decimal comma was understood"),
    "density_assumed": (NOTE, "the density of the rock is assumed"),
    "drained": (WARNING, "water pressure is assumed to vanish (unconservative)"),
    "example_only": (WARNING, "the only row of a table is the example of the template"),
    "example_skipped": (NOTE, "the example of the template was skipped"),
    "extrapolation": (WARNING, "block or shaking outside the fitted range"),
    "fit": (NOTE, "data that a fit leaves out, or estimates that are uncertain"),
    "friction_not_given": (NOTE, "the friction angle is assumed to prevent sliding"),
    "heel_tips": (WARNING, "pulses into the slope tip a sliding block (unconservative)"),
    "ignored_columns": (WARNING, "columns of a table that the answer does not depend on"),
    "incomplete_map": (WARNING, "a ShakeMap without all of its nodes or values"),
    "model_choice": (NOTE, "the measures do not suffice for a better model"),
    "model_not_stored": (NOTE, "a fit of the built-in data set is not stored"),
    "no_drained_bound": (NOTE, "the question without water has no answer"),
    "no_shaking": (NOTE, "P = 0 without shaking"),
    "note": (NOTE, "any other note; its text says all"),
    "rows_rejected": (WARNING, "rows of a table that have no answer"),
    "rotd50_component": (NOTE, "the measures are assumed to be RotD50"),
    "shaking_certain": (NOTE, "the uncertainty of the shaking is not given, and not integrated"),
    "single_component": (NOTE, "the measures are assumed to be of a single component"),
    "site_join": (NOTE, "the sites at which the blocks stand"),
    "suspicious_value": (WARNING, "a value outside its credible range"),
    "synthetic_data": (WARNING, "the model is fitted to synthetic pulses, not to earthquakes"),
    "table_layout": (NOTE, "how the layout of a table was understood"),
    "toe_slips": (WARNING, "the toe of a toppling block slips"),
    "undrained": (NOTE, "water pressure keeps acting while the block moves (conservative)"),
    "unit_assumed": (NOTE, "a field of a file has no unit"),
    "unit_converted": (NOTE, "a column was converted to the unit of its field"),
    "unstable_at_rest": (WARNING, "the block fails without an earthquake"),
    "unused_measures": (NOTE, "intensity measures that the model does not use"),
    "water_not_given": (NOTE, "rows without water in a table that gives it elsewhere"),
}
"""Severity and meaning of each code."""


class Diagnostic(str):
    """A warning; it is its own text.

    Args:
        text: the fact and its consequence.
        code: what programs tell it by, one of `CODES`.
        fields: input fields in the text, which each interface spells in its own way.
        rows: indices of the rows of a table that it holds for; empty for all of them.
    """

    code: str
    fields: tuple[str, ...]
    rows: Sequence[int]

    def __new__(
        cls,
        text: str,
        code: str = "note",
        *,
        fields: tuple[str, ...] = (),
        rows: Sequence[int] = (),
    ) -> Diagnostic:
        """Return a warning with its code."""
        assert code in CODES, code
        self = super().__new__(cls, text)
        self.code, self.fields, self.rows = code, fields, rows
        return self

    @property
    def severity(self) -> str:
        """``note`` or ``warning``."""
        return CODES[self.code][0]

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
            "code": warning.code,
            "severity": warning.severity,
            "text": str(warning),
            "fields": list(warning.fields),
            "rows": [int(row) for row in warning.rows[:ROWS_LISTED]],
            "row_count": len(warning.rows),
        }
        for warning in diagnostics(warnings)
    ]


def with_diagnostics(document: Any) -> Any:
    """Return a JSON document with ``diagnostics`` beside its ``warnings``, or each of a list."""
    if isinstance(document, list):
        return [with_diagnostics(part) for part in document]
    if not isinstance(document, Mapping) or "warnings" not in document:
        return document
    return {**document, "diagnostics": as_documents(document["warnings"])}


def codes_by_row(warnings: Iterable[str], size: int) -> Any:
    """Return the codes of the warnings about single rows, an array of texts of shape (size,)."""
    import numpy as np

    texts = np.full(size, "", dtype=object)
    for warning in diagnostics(warnings):
        rows = np.unique(np.asarray(warning.rows, dtype=np.intp))
        texts[rows] = [
            text if warning.code in text.split() else f"{text} {warning.code}".strip()
            for text in texts[rows].tolist()
        ]
    return texts
