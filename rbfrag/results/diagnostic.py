"""Warnings as every interface shows them: a text, and a code for programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Rows: TypeAlias = "Sequence[int] | NDArray[np.intp]"

ROWS_LISTED = 1_000
"""Most rows of a warning that a document lists."""

NOTE, WARNING = SEVERITIES = ("note", "warning")

CODES: Mapping[str, tuple[str, str]] = {
    "after_first_slip": (NOTE, "the answer is that of the block after its first slip"),
    "at_limit": (WARNING, "the block is at the limit of stability"),
    "back_friction_neglected": (NOTE, "friction on the back face is neglected (conservative)"),
    "beyond_model": (WARNING, "the motion leaves the range of the model"),
    "block_reasons": (NOTE, "reasons and limits of the answers of several blocks"),
    "bond_breaks": (WARNING, "cohesion or roughness ends with the first slip"),
    "by_mechanics": (NOTE, "mechanics decides in place of the fitted model"),
    "check_stability": (WARNING, "much of the measured range of a block would not stand at rest"),
    "check_unit": (WARNING, "a value that is seldom meant: another unit may have been typed"),
    "cohesion_not_given": (NOTE, "rows without cohesion in a table that gives it elsewhere"),
    "cohesion_without_effect": (NOTE, "cohesion does not act on a base that opens"),
    "component_converted": (NOTE, "measures or a curve converted to a single component"),
    "components_differ": (NOTE, "horizontal and vertical components differ in length"),
    "contact_height": (WARNING, "the height of contact decides about the base of a mesh"),
    "conversion_not_needed": (NOTE, "there are models of the measure that is converted"),
    "cross_tilt_neglected": (NOTE, "a flat plane is tilted across the section"),
    "curve_ends": (WARNING, "the hazard curve ends before the fragility does"),
    "curve_selected": (NOTE, "a file has hazard curves of several measures"),
    "decimal_comma": (NOTE, "a number with a decimal comma was understood"),
    "density_assumed": (NOTE, "the density of the rock is assumed"),
    "direction_guessed": (WARNING, "the direction of a component is assumed"),
    "drained": (WARNING, "water pressure is assumed to vanish (unconservative)"),
    "duplicate_record": (NOTE, "two files hold the same samples"),
    "example_only": (WARNING, "the only row of a table is the example of the template"),
    "example_skipped": (NOTE, "the example of the template was skipped"),
    "excluded_draws": (NOTE, "the part of the measured range that would not stand is excluded"),
    "extrapolation": (WARNING, "block or shaking outside the fitted range"),
    "first_curve": (WARNING, "one of several hazard curves stands for all"),
    "fit": (NOTE, "data that a fit leaves out, or estimates that are uncertain"),
    "flat_back_plane": (WARNING, "the back plane is flatter than the base"),
    "fraction_of_block": (WARNING, "a fraction of the blocks is less than one block"),
    "free_standing": (NOTE, "no plane backs the block, which rocks on both corners"),
    "friction_not_given": (NOTE, "the friction angle is assumed to prevent sliding"),
    "function_starts": (NOTE, "a fragility function begins where the probability is smallest"),
    "header_check": (WARNING, "header and samples of a record disagree"),
    "heel_tips": (WARNING, "pulses into the slope tip a sliding block (unconservative)"),
    "ignored_columns": (WARNING, "columns of a table that the answer does not depend on"),
    "incomplete_map": (WARNING, "a ShakeMap without all of its nodes or values"),
    "independent_measures": (WARNING, "measures of an event are drawn independently"),
    "infinite_rates": (NOTE, "levels that are exceeded with probability 1 are omitted"),
    "intensity_cutoff": (WARNING, "blocks fail at shaking that an event set may omit"),
    "leans_on_back_plane": (NOTE, "a sliding block leans on its back plane at rest"),
    "locked": (NOTE, "no horizontal acceleration moves the block in its mode"),
    "map_incomplete": (NOTE, "the map of outcomes is open below the critical value"),
    "medians_assumed": (NOTE, "uncertain blocks are assumed to be their medians"),
    "mesh_quality": (WARNING, "a mesh was repaired, or its coordinates are coarse"),
    "model_choice": (NOTE, "the measures do not suffice for a better model"),
    "model_limits": (WARNING, "effects on the motion of a block that are not followed"),
    "model_not_stored": (NOTE, "a fit of the built-in data set is not stored"),
    "near_limit": (WARNING, "a run ends closer to failure than its error"),
    "no_answer": (WARNING, "blocks that no fragility model covers"),
    "no_drained_bound": (NOTE, "the question without water has no answer"),
    "no_prediction_interval": (NOTE, "the prediction interval for one earthquake is unknown"),
    "no_samples": (NOTE, "joint failures are not sampled: bounds are given"),
    "no_shaking": (NOTE, "P = 0 without shaking"),
    "no_vertical": (WARNING, "horizontal motions without a vertical component"),
    "not_backed": (WARNING, "a free-standing block is predicted as if backed (unconservative)"),
    "not_certified": (WARNING, "the critical value is not proven"),
    "not_symmetric": (NOTE, "the symmetric block of the weaker sense is predicted (conservative)"),
    "note": (NOTE, "any other note; its text says all"),
    "oblique_planes": (WARNING, "base and back are oblique to each other"),
    "option_and_column": (WARNING, "a value for all rows where a column has values of its own"),
    "other_mode": (WARNING, "the kind or mode is not that of the block"),
    "pairs_drawn": (NOTE, "motions of different earthquakes are paired at random"),
    "pga_alone": (WARNING, "rates from PGA alone are biased"),
    "pgv_from_pga": (NOTE, "PGV is predicted from PGA and magnitude"),
    "plane_sets": (NOTE, "the measured planes of a joint set and their scatter"),
    "prestress_neglected": (NOTE, "pre-stress of a wedged heel is neglected (conservative)"),
    "quadrature_error": (WARNING, "the numerical error of a rate is notable"),
    "quantile_curve": (WARNING, "a quantile of the hazard is not a realization"),
    "record_quality": (WARNING, "a sign that a record is not what it should be"),
    "record_remark": (NOTE, "how a record was read"),
    "rejected_realisations": (WARNING, "realisations of a rock mass that are no block"),
    "renamed": (NOTE, "something is written or stored under another name"),
    "rotd50_component": (NOTE, "the measures are assumed to be RotD50"),
    "rough_back_plane": (NOTE, "friction of a rough back plane is neglected (conservative)"),
    "rows_rejected": (WARNING, "rows of a table that have no answer"),
    "sensitive_outcome": (WARNING, "the response is not determined by the motion as recorded"),
    "sequence": (NOTE, "how one motion of a sequence follows another"),
    "shaking_certain": (NOTE, "the uncertainty of the shaking is not given, and not integrated"),
    "single_component": (NOTE, "the measures are assumed to be of a single component"),
    "single_gmm": (NOTE, "the scenario is predicted with one ground-motion model"),
    "single_site": (NOTE, "the blocks of a class are assumed to stand at one site"),
    "site_join": (NOTE, "the sites at which the blocks stand"),
    "spatial_correlation": (NOTE, "the spatial correlation of the shaking is assumed"),
    "spectral_conversion": (NOTE, "PGV is predicted from a spectral acceleration"),
    "spreadsheet_formula": (WARNING, "spreadsheets compute a text that looks like a formula"),
    "steep_base": (WARNING, "the base is steeper than the face"),
    "structure": (WARNING, "records of a sensor on a structure"),
    "support_assumed": (NOTE, "the block is assumed to be free-standing or backed"),
    "suspicious_value": (WARNING, "a value outside its credible range"),
    "synthetic_data": (WARNING, "the model is fitted to synthetic pulses, not to earthquakes"),
    "table_layout": (NOTE, "how the layout of a table was understood"),
    "toe_followed": (NOTE, "the slip of the toe is followed step by step"),
    "toe_lifts": (WARNING, "the toe lifts off a strong bond: the yield is an upper bound"),
    "toe_slips": (WARNING, "the toe of a toppling block slips"),
    "two_descriptions": (WARNING, "a row has parameters of a block and a geometry"),
    "undetermined": (WARNING, "the outcome is not determined"),
    "undrained": (NOTE, "water pressure keeps acting while the block moves (conservative)"),
    "unit_assumed": (NOTE, "a field of a file has no unit"),
    "unit_converted": (NOTE, "a column was converted to the unit of its field"),
    "unit_in_file": (NOTE, "the unit in a file is used in place of the requested one"),
    "unknown_azimuths": (NOTE, "the azimuths of the blocks are assumed to be unknown"),
    "unknown_dependence": (NOTE, "joint failures are not predicted: bounds are given"),
    "unresolved_rates": (WARNING, "rates are lower than an event set resolves"),
    "unscaled_weights": (WARNING, "weights of a logic tree do not sum to 1"),
    "unstable_at_rest": (WARNING, "the block fails without an earthquake"),
    "unused_input": (NOTE, "an input that the answer does not depend on"),
    "unused_measures": (NOTE, "intensity measures that the model does not use"),
    "upper_bound": (WARNING, "the yield acceleration is an upper bound"),
    "vertical_jump": (WARNING, "the vertical motion throws the block off its base"),
    "water_not_given": (NOTE, "rows without water in a table that gives it elsewhere"),
    "years_of_events": (WARNING, "event years do not agree with the investigation time"),
}
"""Severity and meaning of each code."""


class Diagnostic(str):
    """A warning: a string with a code.

    Args:
        text: the fact and its consequence.
        code: what programs tell it by, one of `CODES`.
        fields: input fields in the text, which each interface spells in its own way.
        rows: indices of the rows of a table that it holds for; empty for all of them.
    """

    code: str
    fields: tuple[str, ...]
    rows: Rows

    def __new__(
        cls,
        text: str,
        code: str = "note",
        *,
        fields: tuple[str, ...] = (),
        rows: Rows = (),
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

    @property
    def label(self) -> str:
        """``Note`` or ``Warning``, before the text of an answer's line."""
        return self.severity.capitalize()

    def replaced(self, **about: Any) -> Diagnostic:
        """Return the warning with another text, or for other rows."""
        return Diagnostic(**{"text": str(self), **vars(self), **about})


def with_prefix(prefix: str, warning: str) -> Diagnostic:
    """Return a warning with text before its own, and its own code."""
    (diagnostic,) = diagnostics((warning,))
    return diagnostic.replaced(text=f"{prefix}{warning}")


def diagnostics(*groups: Iterable[str]) -> tuple[Diagnostic, ...]:
    """Return the warnings of an answer, each text once with all its rows."""
    by_text: dict[str, list[Diagnostic]] = {}
    for group in groups:
        for text in group:
            warning = text if isinstance(text, Diagnostic) else Diagnostic(text)
            by_text.setdefault(warning, []).append(warning)
    return tuple(_merged(warnings) for warnings in by_text.values())


def _merged(warnings: Sequence[Diagnostic]) -> Diagnostic:
    first, parts = warnings[0], [warning.rows for warning in warnings]
    if len(parts) == 1 or not all(map(len, parts)):  # about all rows
        return min(warnings, key=lambda warning: len(warning.rows))
    import numpy as np

    return first.replaced(rows=np.concatenate(parts))


def by_severity(warnings: Iterable[str]) -> list[Diagnostic]:
    """Return warnings in the order in which people read them: warnings before notes."""
    return sorted(diagnostics(warnings), key=lambda warning: warning.severity == NOTE)


def labelled(warnings: Iterable[str]) -> tuple[str, ...]:
    """Return warnings as an answer lists them: "Warning: the base is steeper than the face"."""
    return tuple(f"{warning.label}: {warning}" for warning in by_severity(warnings))


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
    """Return a JSON document with ``diagnostics`` in addition to its ``warnings``, or each of a
    list.
    """
    if isinstance(document, list):
        return [with_diagnostics(part) for part in document]
    if not isinstance(document, Mapping) or "warnings" not in document:
        return document
    return {**document, "diagnostics": as_documents(document["warnings"])}


def codes_by_row(warnings: Iterable[str], size: int) -> Any:
    """Return the codes of the warnings about single rows, an array of texts of shape (size,)."""
    import numpy as np

    rows_by_code: dict[str, list[Any]] = {}
    for warning in diagnostics(warnings):
        if len(warning.rows):
            rows_by_code.setdefault(warning.code, []).append(warning.rows)
    return texts_by_row(
        ((code, np.concatenate(rows)) for code, rows in rows_by_code.items()), size, " "
    )


def texts_by_row(texts: Iterable[tuple[str, Any]], size: int, separator: str) -> Any:
    """Return the joined texts of each row, an array of texts of shape (size,).

    Args:
        texts: up to 64 texts with the rows that they hold for, as indices or as a mask.
        size: number of rows.
        separator: text between two of them.
    """
    import numpy as np

    # one bit per text, so that a million rows cost little
    words: list[str] = []
    bits = np.zeros(size, dtype=np.uint64)
    for text, rows in texts:
        bits[rows] |= np.uint64(1 << len(words))
        words.append(text)
    sets, index = np.unique(bits, return_inverse=True)
    lines = np.empty(sets.shape, dtype=object)
    for i, bit_set in enumerate(sets.tolist()):
        lines[i] = separator.join(word for k, word in enumerate(words) if bit_set >> k & 1)
    return lines[index]
