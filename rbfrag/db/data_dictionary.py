"""What every column means: name, type, unit and meaning, for people who read the tables.

Types, keys and whether a value may be missing come from the schema; a test proves that every
column has its entry here.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from sqlalchemy import Boolean, Column, Double, Integer, LargeBinary

from rbfrag.db.location import SCHEMA_REVISION
from rbfrag.db.schema import metadata

_POLARITY = "forward: positive samples drive toppling out of the slope; reverse: negative ones do"
_KIND = "response kind: the model that answers, such as toppling or sliding"
_DIGEST = ("", "hash of the row's other values, by which rbfrag db check finds altered ones")
_LINEAR = "true for the linear verification model, in which k_r is the critical angle in rad"
_NUMERICS = "version of the solver; results of different versions are never mixed"
_P2 = "frequency parameter p² of the block, m g r3 over the inertia about the toe"
_KEY = "SHA-256 over everything that decides the row: motions, polarity, kind, block, settings, \
numerics; the same in every database"
_OUTCOME = "how the run ended: stable, toppled, undetermined (closer to critical than the error), \
jump (1 + k_v <= 0), contact_lost, indeterminate"

# table: (meaning, {column: (unit, meaning)})
_MEANINGS: dict[str, tuple[str, dict[str, tuple[str, str]]]] = {
    "earthquake": (
        "Earthquakes. What a file header says is a guess and stays apart from what metadata state.",
        {
            "id": ("", "row number, of this database alone"),
            "event_id": ("", "the id that earthquakes are told apart by"),
            "guessed": ("", "true: read off a file header; false: stated by metadata"),
            "name": ("", "name for people; may be empty"),
            "magnitude": ("", "magnitude as the source gives it, scales not harmonised"),
            "time": ("", "origin time, or the year, as text"),
        },
    ),
    "recording": (
        "Recordings: what the components of one earthquake at one station share.",
        {
            "id": ("", "row number, of this database alone"),
            "earthquake_id": ("", "the earthquake"),
            "name": ("", "name that all components of the recording share"),
            "station": ("", "station code or name; may be empty"),
        },
    ),
    "motion": (
        "Accelerograms, one component each, with intensity measures of the piecewise linear record "
        "started from rest.",
        {
            "id": ("", "row number, of this database alone"),
            "recording_id": ("", "the recording"),
            "component": ("", "component as the source names it; may be empty"),
            "orientation_deg": ("deg", "azimuth of a horizontal component, clockwise from north"),
            "is_vertical": ("", "true for a vertical component, upward positive"),
            "dt_s": ("s", "sampling interval"),
            "npts": ("", "number of samples"),
            "pga_g": ("g", "peak ground acceleration, max |a| over both signs"),
            "pgv_m_s": ("m/s", "peak ground velocity, extreme of the exact integral"),
            "pgd_m": ("m", "peak ground displacement, extreme of the exact double integral"),
            "tm_s": (
                "s",
                "mean period of Rathje, Abrahamson and Bray (1998), 0.25 to 20 Hz; missing "
                "where it is not defined",
            ),
            "final_velocity_m_s": ("m/s", "velocity at the last sample; a sign of quality"),
            "final_displacement_m": ("m", "displacement at the last sample; a sign of quality"),
            "source_file": ("", "name of the file it was read from"),
            "trace_index": ("", "number of the trace in that file, from 0"),
            "file_format": ("", "format of that file"),
            "processing": ("", "what metadata or file say was done to the record before"),
            "processing_applied": (
                "",
                "JSON object: every parameter of what rbfrag did to the samples; missing where "
                "they are those of the file",
            ),
            "source_sha256": ("", "SHA-256 of the samples as the file has them"),
            "start_time": ("", "time of the first sample by the file's clock, where it says"),
            "flags": ("", "JSON list of quality signs"),
            "remarks": ("", "JSON list of sentences about the file"),
            "samples_sha256": ("", "SHA-256 of the samples as little-endian float64"),
            "samples": ("g", "the samples, little-endian float64; missing in a reference file"),
            "added": ("", "UTC time at which it was stored"),
        },
    ),
    "suite": (
        "Named sets of motions.",
        {"id": ("", "row number, of this database alone"), "name": ("", "name of the suite")},
    ),
    "suite_motion": (
        "Which motion is in which suite.",
        {"suite_id": ("", "the suite"), "motion_id": ("", "the motion")},
    ),
    "toppling_spectrum": (
        "The toppling spectrum X(p) of motions.",
        {
            "motion_id": ("", "the motion"),
            "polarity": ("", _POLARITY),
            "p2": ("1/s²", _P2),
            "numerics_version": ("", _NUMERICS),
            "x_m_s": ("m/s", "X(p), the toppling velocity of the linear model over fresh starts"),
        },
    ),
    "campaign": (
        "Runs of rbfrag simulate. Which of them made a row is no part of what the row says.",
        {
            "id": ("", "row number, of this database alone"),
            "settings": ("", "JSON: what was asked for, and on which processor with which numba"),
            "numerics_version": ("", _NUMERICS),
            "rbfrag_version": ("", "version of rbfrag"),
            "started": ("", "UTC time of its start"),
            "finished": ("", "UTC time of its end; missing while it runs and if it was killed"),
        },
    ),
    "combination": (
        "Critical searches: the strongest block of size p² that a motion topples, or that it "
        "slides a stated distance; for blocks that slump, their strength over the critical "
        "factor on the record.",
        {
            "id": ("", "row number, of this database alone"),
            "natural_key": ("", _KEY),
            "campaign_id": ("", "the campaign that made it"),
            "motion_id": ("", "the horizontal motion"),
            "vertical_motion_id": ("", "the vertical motion; missing without one"),
            "polarity": ("", _POLARITY),
            "kind": ("", _KIND),
            "linear": ("", _LINEAR),
            "p2": ("1/s²", f"{_P2}; p_s² at rest of other kinds; missing for sliding"),
            "block": (
                "",
                "JSON object: shape, size, friction and dip of a block that slumps or topples "
                "confined, or the plane that it slides on; missing for toppling",
            ),
            "settings": ("", "JSON: what else decided the answer, part of the natural key"),
            "numerics_version": ("", _NUMERICS),
            "status": (
                "",
                "found; below_limit: nothing topples down to the search limit (censored); "
                "no_motion: no such block ever lifts; outside_model: 1 + k_v <= 0; not_searched: "
                "only the blocks of the grid were run",
            ),
            "search_limit": ("k_r/PGA", "smallest strength looked at; missing without a search"),
            "kr_over_pga": (
                "k_r/PGA",
                "greatest strength known to topple; missing unless found",
            ),
            "lower": ("k_r/PGA", "lower end of the bracket: topples"),
            "upper": ("k_r/PGA", "upper end of the bracket: safe"),
            "kr": ("", "the critical k_r itself, kr_over_pga times PGA in g; missing unless found"),
            "y_m_s": ("m/s", "critical toppling velocity k_r g/p; missing unless found"),
            "certified": ("", "true: everything above the bracket is proven safe"),
            "k_up_over_pga": ("k_r/PGA", "proven bound of fresh starts: nothing above it topples"),
            "undecided": ("k_r/PGA", "length above the bracket that is not proven safe"),
            "island_width": (
                "k_r/PGA",
                "width of the toppling interval that ends at the bracket; missing without a map",
            ),
            "kr_over_pga_resolved": (
                "k_r/PGA",
                "critical value when toppling intervals narrower than 1e-6 are ignored; missing "
                "without a map",
            ),
            "reentrant": (
                "",
                "true: a safe island wider than 1e-6 lies below the critical value; missing "
                "without a map",
            ),
            "n_runs": ("", "simulations made, most of which are not stored"),
            "warnings": ("", "JSON list of sentences about the input or the answer"),
        },
    ),
    "outcome_interval": (
        "The certified map, made on request: what becomes of every block of an interval of "
        "strengths.",
        {
            "combination_id": ("", "the combination"),
            "k_lo": ("k_r/PGA", "lower end"),
            "k_hi": ("k_r/PGA", "upper end; the next interval begins there"),
            "outcome": ("", "topples: every block in it; safe: none; undecided: not proven"),
        },
    ),
    "simulation": (
        "Single blocks that were run: the critical one, those of the grid that fits read, and "
        "others that were asked for.",
        {
            "combination_id": ("", "the combination"),
            "kr_over_pga": ("k_r/PGA", "strength of the block"),
            "theta_n": ("", "peak rotation over the critical angle; missing where it toppled"),
            "outcome": ("", _OUTCOME),
            "displacement_m": (
                "m",
                "permanent displacement of a sliding block down a level plane; missing for others",
            ),
            "grid": (
                "",
                "number of the block in the grid of its kind, which does not depend on outcomes; "
                "missing for a block beside it",
            ),
        },
    ),
    "response": (
        "Histories of single blocks, kept only when asked for.",
        {
            "id": ("", "row number, of this database alone"),
            "natural_key": ("", _KEY),
            "motion_id": ("", "the horizontal motion"),
            "vertical_motion_id": ("", "the vertical motion; missing without one"),
            "polarity": ("", _POLARITY),
            "kind": ("", _KIND),
            "linear": ("", _LINEAR),
            "p2": ("1/s²", _P2),
            "kr": ("", "rocking acceleration coefficient k_r = tan(critical angle)"),
            "numerics_version": ("", _NUMERICS),
            "outcome": ("", _OUTCOME),
            "peak_theta_n": ("", "peak rotation over the critical angle; missing if it toppled"),
            "peak_theta_rad": ("rad", "peak rotation; missing if it toppled"),
            "npts": ("", "length of each of the arrays"),
            "time_s": ("s", "times, little-endian float64"),
            "theta_rad": ("rad", "rotation"),
            "theta_dot_rad_s": ("rad/s", "rotation rate"),
            "k_h": ("g", "driving horizontal acceleration, polarity applied"),
            "k_v": ("g", "vertical acceleration, upward positive"),
        },
    ),
    "fragility_model": (
        "Fitted fragility models.",
        {
            "id": ("", "row number, of this database alone"),
            "name": ("", "name of the model"),
            "kind": ("", _KIND),
            "term": ("", "intensity term: pgv, pga_tm, pgd_tm, pgv_pga, pgv_pga_tm, xp"),
            "method": ("", "method of the fit"),
            "coefficients": ("", "JSON object: value by parameter, in order"),
            "covariance": ("", "JSON list of lists: covariance of the parameters in that order"),
            "domain": ("", "JSON object: fitted range [low, high] by variable"),
            "data_fingerprint": ("", "hash of the data that were fitted"),
            "diagnostics": ("", "JSON object: counts, scores, warnings"),
            "is_default": (
                "",
                "true for the one model of its kind that answers when none is named",
            ),
            "created": ("", "UTC time of the fit"),
        },
    ),
}


@dataclass(frozen=True)
class ColumnMeaning:
    """One column.

    Args:
        name: its name.
        type: ``integer``, ``number`` (float64), ``true/false``, ``text`` or ``array`` (float64).
        unit: its unit; empty for none, ``k_r/PGA`` for a k_r over the motion's PGA in g.
        meaning: one sentence.
        may_be_missing: whether a row may have no value.
        refers_to: the table and column it points to; empty for none.
    """

    name: str
    type: str
    unit: str
    meaning: str
    may_be_missing: bool
    refers_to: str


@dataclass(frozen=True)
class TableMeaning:
    """One table.

    Args:
        name: its name.
        meaning: one sentence.
        columns: its columns, in order.
    """

    name: str
    meaning: str
    columns: tuple[ColumnMeaning, ...]


def data_dictionary() -> tuple[TableMeaning, ...]:
    """Return every table with every column."""
    return tuple(
        TableMeaning(
            name=name,
            meaning=meaning,
            columns=tuple(
                _column(metadata.tables[name].c[column], unit, text)
                for column, (unit, text) in {**columns, "digest": _DIGEST}.items()
            ),
        )
        for name, (meaning, columns) in _MEANINGS.items()
    )


def dictionary_as_json() -> dict[str, Any]:
    """Return the dictionary as a JSON document: schema revision and tables."""
    return {"schema": SCHEMA_REVISION, "tables": [asdict(table) for table in data_dictionary()]}


def dictionary_as_markdown() -> str:
    """Return the dictionary as Markdown, a section for each table."""
    parts = []
    for table in data_dictionary():
        lines = [f"## {table.name}", "", table.meaning, ""]
        lines += ["| column | type | unit | meaning |", "| --- | --- | --- | --- |"]
        for column in table.columns:
            notes = [column.meaning]
            if column.refers_to:
                notes.append(f"refers to {column.refers_to}")
            if column.may_be_missing and "missing" not in column.meaning:
                notes.append("may be missing")
            said = "; ".join(notes).replace("|", "\\|")
            lines.append(f"| {column.name} | {column.type} | {column.unit or '-'} | {said} |")
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _column(column: Column[Any], unit: str, meaning: str) -> ColumnMeaning:
    targets = [key.target_fullname for key in column.foreign_keys]
    return ColumnMeaning(
        name=column.name,
        type=_type(column),
        unit=unit,
        meaning=meaning,
        may_be_missing=bool(column.nullable),
        refers_to=targets[0] if targets else "",
    )


def _type(column: Column[Any]) -> str:
    if isinstance(column.type, Boolean):
        return "true/false"
    if isinstance(column.type, Integer) or column.foreign_keys:
        return "integer"
    if isinstance(column.type, Double):
        return "number"
    if isinstance(column.type, LargeBinary):
        return "array"
    return "text"
