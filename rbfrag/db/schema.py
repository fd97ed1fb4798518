"""Tables of the database. Units are in the column names; natural unique keys contain no NULL.

New databases are made from these definitions, and migrations upgrade older ones to them. The
meaning of each table and column is given with it, for :mod:`rbfrag.db.data_dictionary`. Each row
has a digest of its values, which :mod:`rbfrag.db.insert` writes.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    CheckConstraint,
    Column,
    Double,
    ForeignKey,
    Index,
    Integer,
    Join,
    LargeBinary,
    MetaData,
    PrimaryKeyConstraint,
    Table,
    Text,
    UniqueConstraint,
    text,
)
from sqlalchemy.schema import SchemaItem

from rbfrag.motions.response_spectrum import PERIODS_S
from rbfrag.vocabulary.quantities import MECHANISMS, QUANTITIES
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S

metadata = MetaData(
    naming_convention={
        "pk": "pk_%(table_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    }
)

LATER_MEASURES = (*PERIODS_S, "cav_m_s", "arias_m_s", "d5_95_s", "d5_75_s", "housner_m")
"""Intensity measures that came later; missing where a database was upgraded without samples."""

MEASURES = ("pga_g", "pgv_m_s", "pgd_m", "tm_s", *LATER_MEASURES)
"""Intensity measures of a motion, in the order of their columns."""

ORDINATES = tuple(f"sa_{n:03}" for n in range(1, len(SPECTRUM_PERIODS_S) + 1))
"""Columns of a response spectrum, in the order of its periods."""

SITE_COLUMNS = ("lat", "lon", "rjb_km", "rrup_km", "repi_km", "vs30_m_s")
"""Columns of numbers of a recording: the place of its station, its distances and its ground."""

POLARITY = "polarity IN ('forward', 'reverse')"
KIND = "kind <> ''"
FOUND_HAS_VALUE = (
    "status <> 'found' OR (kr_over_pga > 0 AND kr > 0 AND kr_over_pga IS NOT NULL "
    "AND kr IS NOT NULL)"
)
STATUS = "status IN ('found', 'below_limit', 'no_motion', 'outside_model', 'not_searched')"
OUTCOME = (
    "outcome IN ('stable', 'toppled', 'undetermined', 'jump', 'contact_lost', 'indeterminate')"
)

_POLARITY = "forward: positive samples drive toppling out of the slope; reverse: negative ones do"
_KIND = "response kind: the model that answers, such as toppling or sliding"
_LINEAR = "true for the linear verification model, in which k_r is the critical angle in rad"
_NUMERICS = "version of the solver, or imported out of a table; different ones are never mixed"
_KEY = (
    "SHA-256 over everything that decides the row: motions, polarity, kind, block, settings, "
    "numerics; the same in every database"
)
_OUTCOME = (
    "how the run ended: stable, toppled, undetermined (closer to critical than the error), jump"
    " (1 + k_v <= 0), contact_lost, indeterminate"
)


def _table(name: str, meaning: str, *parts: SchemaItem, **options: Any) -> Table:
    digest = "hash of the row's other values, by which rbfrag db check finds altered ones"
    columns = (*parts, _column("digest", BigInteger, digest))
    return Table(name, metadata, *columns, info={"meaning": meaning}, **options)


def _column(name: str, type_: Any, meaning: str, unit: str = "", **options: Any) -> Column[Any]:
    info = {"unit": unit, "meaning": meaning}
    return Column(name, type_, info=info, **{"nullable": False, **options})


def _optional(name: str, type_: Any, meaning: str, unit: str = "") -> Column[Any]:
    return _column(name, type_, meaning, unit, nullable=True)


def _quantity(name: str, *, nullable: bool | None = None) -> Column[Any]:
    """Return the column of a quantity from the vocabulary."""
    about = QUANTITIES[name]
    missing = "missing" in about.stored if nullable is None else nullable
    return _column(name, Double, about.stored, about.unit, nullable=missing)


def _reference(
    name: str, to: str, on_delete: str, meaning: str, *, nullable: bool = False
) -> Column[Any]:
    return _column(name, ForeignKey(to, ondelete=on_delete), meaning, nullable=nullable)


def _row_number() -> Column[Any]:
    return _column("id", Integer, "row number, of this database alone", primary_key=True)


def _ordinates(suffix: str) -> tuple[Column[Any], ...]:
    """Return the columns of a response spectrum."""
    return tuple(
        _column(name, Double, f"SA({period_s:g} s){suffix}", "g")
        for name, period_s in zip(ORDINATES, SPECTRUM_PERIODS_S, strict=True)
    )


def _shaken() -> tuple[Column[Any], ...]:
    """Return the columns of the excitation and the kind of a simulated block."""
    return (
        _reference("motion_id", "motion.id", "RESTRICT", "the horizontal motion"),
        _reference(
            "vertical_motion_id",
            "motion.id",
            "RESTRICT",
            "the vertical motion; missing without one",
            nullable=True,
        ),
        _column("polarity", Text, _POLARITY),
        _column("kind", Text, _KIND),
        _column("linear", Boolean, _LINEAR),
    )


# One event has many spellings: what a file header says is a guess and stays apart from what
# metadata state, even where the texts agree.
earthquake = _table(
    "earthquake",
    "Earthquakes. What a file header says is a guess and stays apart from what metadata state.",
    _row_number(),
    _column("event_id", Text, "the id that earthquakes are told apart by"),
    _column("guessed", Boolean, "true: read off a file header; false: stated by metadata"),
    _column("name", Text, "name for people; may be empty"),
    _quantity("magnitude", nullable=True),
    _optional("time", Text, "origin time, or the year, as text"),
    _optional("mechanism", Text, QUANTITIES["mechanism"].stored),
    _quantity("depth_km", nullable=True),
    UniqueConstraint("event_id", "guessed"),
    CheckConstraint("event_id <> ''", name="event_id"),
    CheckConstraint("magnitude > -5 AND magnitude < 11", name="magnitude"),
    CheckConstraint(f"mechanism IN {MECHANISMS}", name="mechanism"),
    CheckConstraint("depth_km >= -10 AND depth_km <= 800", name="depth_km"),
)

recording = _table(
    "recording",
    "Recordings: what the components of one earthquake at one station share.",
    _row_number(),
    _reference("earthquake_id", "earthquake.id", "RESTRICT", "the earthquake"),
    _column("name", Text, "name that all components of the recording share"),
    _column("station", Text, "station code or name; may be empty"),
    _optional("network", Text, "code or name of the network"),
    *(_quantity(name, nullable=True) for name in SITE_COLUMNS),
    _optional(
        "attributes", Text, "JSON object: text by name of the further columns of the metadata"
    ),
    UniqueConstraint("earthquake_id", "name", "station"),
    CheckConstraint("name <> ''", name="name"),
    CheckConstraint("lat >= -90 AND lat <= 90", name="lat"),
    CheckConstraint("lon >= -180 AND lon <= 360", name="lon"),
    *(CheckConstraint(f"{name} >= 0", name=name) for name in SITE_COLUMNS[2:5]),
    CheckConstraint("vs30_m_s > 0", name="vs30_m_s"),
)

motion = _table(
    "motion",
    "Accelerograms, one component each, with intensity measures of the piecewise linear record "
    "started from rest.",
    _row_number(),
    _reference("recording_id", "recording.id", "RESTRICT", "the recording"),
    _column("component", Text, "component as the source names it; may be empty"),
    _optional(
        "orientation_deg", Double, "azimuth of a horizontal component, clockwise from north", "deg"
    ),
    _column("is_vertical", Boolean, "true for a vertical component, upward positive"),
    _column("dt_s", Double, "sampling interval", "s"),
    _column("npts", Integer, "number of samples"),
    *map(_quantity, MEASURES),
    _column("final_velocity_m_s", Double, "velocity at the last sample; a sign of quality", "m/s"),
    _column(
        "final_displacement_m", Double, "displacement at the last sample; a sign of quality", "m"
    ),
    _column("source_file", Text, "name of the file it was read from"),
    _column("trace_index", Integer, "number of the trace in that file, from 0"),
    _column("file_format", Text, "format of that file"),
    _column("processing", Text, "what metadata or file say was done to the record before"),
    _optional(
        "processing_applied",
        Text,
        "JSON object: every parameter of what rbfrag did to the samples; missing where they are "
        "those of the file",
    ),
    _column("source_sha256", Text, "SHA-256 of the samples as the file has them"),
    _optional("start_time", Text, "time of the first sample by the file's clock, where it says"),
    _column("flags", Text, "JSON list of quality signs"),
    _column("remarks", Text, "JSON list of sentences about the file"),
    _column("samples_sha256", Text, "SHA-256 of the samples as little-endian float64"),
    _optional(
        "samples",
        LargeBinary,
        "the samples, little-endian float64; missing in a reference file",
        "g",
    ),
    _column("added", Text, "UTC time at which it was stored"),
    UniqueConstraint("samples_sha256", "dt_s"),
    CheckConstraint("dt_s > 0", name="dt_s"),
    CheckConstraint("npts > 0", name="npts"),
    CheckConstraint("trace_index >= 0", name="trace_index"),
    CheckConstraint("pga_g >= 0 AND pgv_m_s >= 0 AND pgd_m >= 0 AND tm_s > 0", name="measures"),
    CheckConstraint(
        "sa03_g >= 0 AND sa05_g >= 0 AND sa10_g >= 0 AND sa20_g >= 0 AND sa30_g >= 0",
        name="spectrum",
    ),
    CheckConstraint("cav_m_s >= 0 AND arias_m_s >= 0 AND d5_95_s >= 0", name="energy"),
    CheckConstraint("d5_75_s >= 0", name="d5_75_s"),
    CheckConstraint("housner_m >= 0", name="housner_m"),
    CheckConstraint("length(samples_sha256) = 64", name="samples_sha256"),
    CheckConstraint("length(source_sha256) = 64", name="source_sha256"),
    Index(None, "recording_id"),
    Index(None, "source_sha256"),
)

suite = _table(
    "suite",
    "Named sets of motions.",
    _row_number(),
    _column("name", Text, "name of the suite"),
    UniqueConstraint("name"),
    CheckConstraint("name <> ''", name="name"),
)

suite_motion = _table(
    "suite_motion",
    "Which motion is in which suite.",
    _reference("suite_id", "suite.id", "CASCADE", "the suite"),
    _reference("motion_id", "motion.id", "CASCADE", "the motion"),
    PrimaryKeyConstraint("suite_id", "motion_id"),
    Index(None, "motion_id"),
    sqlite_with_rowid=False,
)

motion_spectrum = _table(
    "motion_spectrum",
    "The response spectrum of motions: pseudo-spectral acceleration, 5 % damping.",
    _reference("motion_id", "motion.id", "CASCADE", "the motion"),
    *_ordinates(""),
    PrimaryKeyConstraint("motion_id"),
    CheckConstraint("sa_001 >= 0", name="ranges"),
    sqlite_with_rowid=False,
)

recording_spectrum = _table(
    "recording_spectrum",
    "RotD50 and RotD100 of recordings: percentiles of the peaks of the two horizontals, rotated "
    "into 180 directions (Boore 2010).",
    _reference("motion_id", "motion.id", "CASCADE", "a horizontal motion of the recording"),
    _reference("other_motion_id", "motion.id", "CASCADE", "the horizontal perpendicular to it"),
    _column("percentile", Integer, "50 for RotD50, 100 for RotD100"),
    _column("pga_g", Double, "percentile of PGA over the directions", "g"),
    _column("pgv_m_s", Double, "percentile of PGV over the directions", "m/s"),
    *_ordinates(", percentile over the directions"),
    PrimaryKeyConstraint("motion_id", "other_motion_id", "percentile"),
    CheckConstraint("percentile IN (50, 100)", name="percentile"),
    CheckConstraint("pga_g >= 0 AND pgv_m_s >= 0 AND sa_001 >= 0", name="ranges"),
    Index(None, "other_motion_id"),
    sqlite_with_rowid=False,
)

toppling_spectrum = _table(
    "toppling_spectrum",
    "The toppling spectrum X(p) of motions.",
    _reference("motion_id", "motion.id", "CASCADE", "the motion"),
    _column("polarity", Text, _POLARITY),
    _quantity("p2"),
    _column("numerics_version", Text, _NUMERICS),
    _column(
        "x_m_s",
        Double,
        "X(p), toppling velocity of the linear model, over excursions from rest",
        "m/s",
    ),
    PrimaryKeyConstraint("motion_id", "polarity", "p2", "numerics_version"),
    CheckConstraint(POLARITY, name="polarity"),
    CheckConstraint("p2 > 0 AND x_m_s >= 0", name="ranges"),
    sqlite_with_rowid=False,
)

campaign = _table(
    "campaign",
    "Runs of rbfrag simulate. Which of them made a row is no part of what the row says.",
    _row_number(),
    _column("settings", Text, "JSON: what was asked for, and on which processor with which numba"),
    _column("numerics_version", Text, _NUMERICS),
    _column("rbfrag_version", Text, "version of rbfrag"),
    _column("started", Text, "UTC time of its start"),
    _optional("finished", Text, "UTC time of its end; missing while it runs and if it was killed"),
)

combination = _table(
    "combination",
    "Critical searches: the strongest block of size p² that a motion topples, or that it slides a"
    " stated distance; for blocks that slump, their strength over the critical factor on the "
    "record. Of free-standing blocks, which have no critical value, the grid of outcomes alone.",
    _row_number(),
    _column("natural_key", Text, _KEY),
    _reference("campaign_id", "campaign.id", "RESTRICT", "the campaign that made it"),
    *_shaken(),
    _optional(
        "p2",
        Double,
        f"{QUANTITIES['p2'].stored}; p_s² at rest of other kinds; missing for sliding",
        QUANTITIES["p2"].unit,
    ),
    _optional(
        "block",
        Text,
        "JSON object: shape, size, friction and dip of a block that slumps or topples confined, "
        "the plane that it slides on, or the factor on Housner's restitution of one that rocks; "
        "missing for toppling",
    ),
    _optional(
        "yield_g",
        Double,
        "yield acceleration of that block where 1 + k_v = 1; missing where the combination is of "
        "blocks of any strength",
        "g",
    ),
    _column("settings", Text, "JSON: what else decided the answer, part of the natural key"),
    _column("numerics_version", Text, _NUMERICS),
    _column(
        "status",
        Text,
        "found; below_limit: nothing topples down to the search limit (censored); no_motion: no "
        "such block ever lifts; outside_model: 1 + k_v <= 0; not_searched: only the blocks of the"
        " grid were run",
    ),
    _optional(
        "search_limit", Double, "smallest strength looked at; missing without a search", "k_r/PGA"
    ),
    _optional(
        "kr_over_pga", Double, "greatest strength known to topple; missing unless found", "k_r/PGA"
    ),
    _optional("lower", Double, "lower end of the bracket: topples", "k_r/PGA"),
    _optional("upper", Double, "upper end of the bracket: safe", "k_r/PGA"),
    _optional(
        "kr", Double, "the critical k_r itself, kr_over_pga times PGA in g; missing unless found"
    ),
    _quantity("y_m_s"),
    _column("certified", Boolean, "true: everything above the bracket is proven safe"),
    _optional(
        "k_up_over_pga",
        Double,
        "proven bound for excursions from rest: nothing above it topples",
        "k_r/PGA",
    ),
    _optional("undecided", Double, "length above the bracket that is not proven safe", "k_r/PGA"),
    _optional(
        "island_width",
        Double,
        "width of the toppling interval that ends at the bracket; missing without a map",
        "k_r/PGA",
    ),
    _optional(
        "kr_over_pga_resolved",
        Double,
        "critical value when toppling intervals narrower than 1e-6 are ignored; missing without a"
        " map",
        "k_r/PGA",
    ),
    _optional(
        "reentrant",
        Boolean,
        "true: a safe island wider than 1e-6 lies below the critical value; missing without a map",
    ),
    _column("n_runs", Integer, "simulations made, most of which are not stored"),
    _column("warnings", Text, "JSON list of sentences about the input or the answer"),
    UniqueConstraint("natural_key"),
    CheckConstraint("length(natural_key) = 64", name="natural_key"),
    CheckConstraint(POLARITY, name="polarity"),
    CheckConstraint(KIND, name="kind"),
    CheckConstraint(STATUS, name="status"),
    CheckConstraint("p2 > 0 AND search_limit > 0 AND n_runs >= 0 AND y_m_s > 0", name="ranges"),
    CheckConstraint("p2 IS NOT NULL OR block IS NOT NULL", name="block"),
    CheckConstraint("yield_g > 0", name="yield_g"),
    CheckConstraint("status = 'not_searched' OR search_limit IS NOT NULL", name="search_limit"),
    CheckConstraint(FOUND_HAS_VALUE, name="found_has_value"),
    CheckConstraint(
        "status = 'found' OR (kr_over_pga IS NULL AND kr IS NULL AND y_m_s IS NULL)",
        name="value_is_found",
    ),
    Index(None, "motion_id"),
    Index(None, "vertical_motion_id"),
    Index(None, "campaign_id"),
)

outcome_interval = _table(
    "outcome_interval",
    "The certified map, made on request: what becomes of every block of an interval of strengths.",
    _reference("combination_id", "combination.id", "CASCADE", "the combination"),
    _column("k_lo", Double, "lower end", "k_r/PGA"),
    _column("k_hi", Double, "upper end; the next interval begins there", "k_r/PGA"),
    _column("outcome", Text, "topples: every block in it; safe: none; undecided: not proven"),
    PrimaryKeyConstraint("combination_id", "k_lo"),
    CheckConstraint("k_lo >= 0 AND k_hi >= k_lo", name="ranges"),
    CheckConstraint("outcome IN ('topples', 'safe', 'undecided')", name="outcome"),
    sqlite_with_rowid=False,
)

simulation = _table(
    "simulation",
    "Single blocks that were run: the critical one, those of the grid that fits read, and others "
    "that were asked for.",
    _reference("combination_id", "combination.id", "CASCADE", "the combination"),
    _column("kr_over_pga", Double, "strength of the block", "k_r/PGA"),
    _optional("theta_n", Double, "peak rotation over the critical angle; missing where it toppled"),
    _column("outcome", Text, _OUTCOME),
    _optional(
        "displacement_m",
        Double,
        "permanent displacement of a sliding block down a level plane; missing for others",
        "m",
    ),
    _optional(
        "grid",
        Integer,
        "number of the block in the grid of its kind, which does not depend on outcomes; missing "
        "for a block outside it",
    ),
    _optional(
        "sensitive",
        Boolean,
        "of a free-standing block: true where the outcome is another one for the motion times 1 + "
        "1e-6 or 1 - 1e-6; missing for others",
    ),
    PrimaryKeyConstraint("combination_id", "kr_over_pga"),
    CheckConstraint("kr_over_pga > 0", name="kr_over_pga"),
    CheckConstraint("theta_n >= 0", name="theta_n"),
    CheckConstraint("grid >= 0", name="grid"),
    CheckConstraint(OUTCOME, name="outcome"),
    sqlite_with_rowid=False,
)

response = _table(
    "response",
    "Histories of single blocks, kept only when asked for.",
    _row_number(),
    _column("natural_key", Text, _KEY),
    *_shaken(),
    _quantity("p2"),
    _quantity("kr"),
    _column("numerics_version", Text, _NUMERICS),
    _column("outcome", Text, _OUTCOME),
    _optional(
        "peak_theta_n", Double, "peak rotation over the critical angle; missing if it toppled"
    ),
    _optional("peak_theta_rad", Double, "peak rotation; missing if it toppled", "rad"),
    _column("npts", Integer, "length of each of the arrays"),
    # Little-endian float64, npts values each.
    _column("time_s", LargeBinary, "times, little-endian float64", "s"),
    _column("theta_rad", LargeBinary, "rotation", "rad"),
    _column("theta_dot_rad_s", LargeBinary, "rotation rate", "rad/s"),
    _column("k_h", LargeBinary, "driving horizontal acceleration, polarity applied", "g"),
    _column("k_v", LargeBinary, "vertical acceleration, upward positive", "g"),
    UniqueConstraint("natural_key"),
    CheckConstraint("length(natural_key) = 64", name="natural_key"),
    CheckConstraint(POLARITY, name="polarity"),
    CheckConstraint(KIND, name="kind"),
    CheckConstraint(OUTCOME, name="outcome"),
    CheckConstraint("p2 > 0 AND kr > 0 AND npts >= 0", name="ranges"),
    Index(None, "motion_id"),
    Index(None, "vertical_motion_id"),
)


def _end(of: str, meaning: str, *, may_be_missing: bool = False) -> tuple[Column[Any], ...]:
    """Return the columns of the final state of a block after one motion of a pair."""
    outcome = f"how the block ends {meaning}: as of simulation"
    return (
        _column(f"{of}_outcome", Text, outcome, nullable=may_be_missing),
        _optional(
            f"{of}_displacement_m",
            Double,
            f"where it is left {meaning}: slip of its contact along the base since its first "
            "place; missing where that is not known",
            "m",
        ),
        _optional(
            f"{of}_rotation_rad",
            Double,
            f"rotation that is left {meaning}; missing of slides, and where it is not known",
            "rad",
        ),
        _optional(
            f"{of}_peak_rad",
            Double,
            f"greatest rotation {meaning}; missing of slides, and where the block failed",
            "rad",
        ),
    )


shock_pair = _table(
    "shock_pair",
    "Blocks under two motions, one after the other, and under the second alone: what a block that "
    "survives the first, in the state that it is left in, does in the second.",
    _row_number(),
    _column("natural_key", Text, _KEY),
    _reference("campaign_id", "campaign.id", "RESTRICT", "the campaign that made it"),
    _reference("first_motion_id", "motion.id", "RESTRICT", "the first horizontal motion"),
    _reference("second_motion_id", "motion.id", "RESTRICT", "the second one"),
    _column(
        "pairing",
        Text,
        "station: two shocks of one station, in their order in time; drawn: motions of different "
        "earthquakes, drawn by a seed",
    ),
    _column("polarity", Text, f"of both motions; {_POLARITY}"),
    _column("kind", Text, _KIND),
    _column("block", Text, "JSON object: the block and its planes"),
    _column("yield_g", Double, "yield acceleration of the block in its first place", "g"),
    _optional(
        "critical_rad",
        Double,
        "rotation at which the block has no strength left; missing of slides",
        "rad",
    ),
    _column("numerics_version", Text, _NUMERICS),
    *_end("first", "after the first motion"),
    *_end(
        "second",
        "after both, from its first place; missing where the first leaves it nowhere known",
        may_be_missing=True,
    ),
    *_end("intact", "after the second motion alone"),
    UniqueConstraint("natural_key"),
    CheckConstraint("length(natural_key) = 64", name="natural_key"),
    CheckConstraint("pairing IN ('station', 'drawn')", name="pairing"),
    CheckConstraint(POLARITY, name="polarity"),
    CheckConstraint(KIND, name="kind"),
    CheckConstraint("yield_g > 0 AND critical_rad > 0", name="ranges"),
    CheckConstraint(
        "first_outcome <> '' AND second_outcome <> '' AND intact_outcome <> ''", name="outcome"
    ),
    Index(None, "campaign_id"),
    Index(None, "first_motion_id"),
    Index(None, "second_motion_id"),
)

fragility_model = _table(
    "fragility_model",
    "Fitted fragility models.",
    _row_number(),
    _column("name", Text, "name of the model"),
    _column("kind", Text, _KIND),
    _column("term", Text, "intensity term, such as pgv, pgv_pga, sa, xp"),
    _column("method", Text, "method of the fit"),
    _column("coefficients", Text, "JSON object: value by parameter, in order"),
    _column("covariance", Text, "JSON list of lists: covariance of the parameters in that order"),
    _column("domain", Text, "JSON object: fitted range [low, high] by variable"),
    _column("data_fingerprint", Text, "hash of the data that were fitted"),
    _column("diagnostics", Text, "JSON object: counts, scores, warnings"),
    _column(
        "is_default", Boolean, "true for the one model of its kind that answers when none is named"
    ),
    _column("created", Text, "UTC time of the fit"),
    _column("form", Integer, "number of the form of its predictor; older forms do not answer"),
    _optional(
        "leave_out_steps",
        Text,
        "JSON list of lists: for each earthquake, the change of the parameters when it is left out",
    ),
    _optional(
        "dependence",
        Text,
        "JSON object: correlation of the blocks of one earthquake, by parameter, and its errors",
    ),
    _optional(
        "completions",
        Text,
        "JSON Lines: regressions of the spectral velocity on the measures named in inputs, with "
        "coefficients and sigma at p² = 30, 10, 3, 1, 0.3 and 0.1 1/s², the fractions of the "
        "variance that earthquake and recording share, and the changes without each earthquake",
    ),
    UniqueConstraint("name"),
    CheckConstraint("name <> ''", name="name"),
    CheckConstraint(KIND, name="kind"),
    CheckConstraint("form >= 1", name="form"),
    # At most one default of a kind: the index holds only the rows that are it.
    Index(
        "uq_fragility_model_default",
        "kind",
        unique=True,
        sqlite_where=text("is_default"),
        postgresql_where=text("is_default"),
    ),
)

# apart from the others: it describes them, and is not content itself
ledger = Table(
    "ledger",
    MetaData(naming_convention=metadata.naming_convention),
    _column("of_table", Text, "the table that is counted", primary_key=True),
    _column(
        "campaign", Integer, "id of the campaign that the rows belong to; 0 for none",
        primary_key=True, autoincrement=False,
    ),
    _column("row_count", BigInteger, "number of rows that rbfrag wrote"),
    _column("digests", BigInteger, "their digests, joined by exclusive or"),
    _optional("found_sound", Text, "when rbfrag db check last found nothing, UTC; may be missing"),
    info={
        "meaning": "How many rows of each table and campaign rbfrag wrote: by it rbfrag db check "
        "finds rows that another program deleted or added."
    },
)  # fmt: skip

vertical = motion.alias("vertical")
"""The vertical motion of a combination or response, where it has one."""


def with_motions(table: Table) -> Join:
    """Return a table joined to its horizontal and its :data:`vertical` motion."""
    return table.join(motion, motion.c.id == table.c.motion_id).outerjoin(
        vertical, vertical.c.id == table.c.vertical_motion_id
    )
