"""The tables. Units are in the column names; natural unique keys hold no NULL.

The tables are made by the migrations; a test proves that these definitions equal them. Each row
carries a digest of its values, which :mod:`rbfrag.db.insert` writes.
"""

from __future__ import annotations

from sqlalchemy import (
    BigInteger,
    Boolean,
    CheckConstraint,
    Column,
    Double,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    PrimaryKeyConstraint,
    Table,
    Text,
    UniqueConstraint,
    text,
)

metadata = MetaData(
    naming_convention={
        "pk": "pk_%(table_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    }
)

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

# One event has many spellings: what a file header says is a guess and stays apart from what
# metadata state, even where the texts agree.
earthquake = Table(
    "earthquake",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("event_id", Text, nullable=False),
    Column("guessed", Boolean, nullable=False),
    Column("name", Text, nullable=False),
    Column("magnitude", Double),
    Column("time", Text),
    Column("digest", BigInteger, nullable=False),
    UniqueConstraint("event_id", "guessed"),
    CheckConstraint("event_id <> ''", name="event_id"),
    CheckConstraint("magnitude > -5 AND magnitude < 11", name="magnitude"),
)

recording = Table(
    "recording",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("earthquake_id", ForeignKey("earthquake.id", ondelete="RESTRICT"), nullable=False),
    Column("name", Text, nullable=False),
    Column("station", Text, nullable=False),
    Column("digest", BigInteger, nullable=False),
    UniqueConstraint("earthquake_id", "name", "station"),
    CheckConstraint("name <> ''", name="name"),
)

motion = Table(
    "motion",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("recording_id", ForeignKey("recording.id", ondelete="RESTRICT"), nullable=False),
    Column("component", Text, nullable=False),
    Column("orientation_deg", Double),
    Column("is_vertical", Boolean, nullable=False),
    Column("dt_s", Double, nullable=False),
    Column("npts", Integer, nullable=False),
    Column("pga_g", Double, nullable=False),
    Column("pgv_m_s", Double, nullable=False),
    Column("pgd_m", Double, nullable=False),
    Column("tm_s", Double),
    Column("final_velocity_m_s", Double, nullable=False),
    Column("final_displacement_m", Double, nullable=False),
    Column("source_file", Text, nullable=False),
    Column("trace_index", Integer, nullable=False),
    Column("file_format", Text, nullable=False),
    Column("processing", Text, nullable=False),  # what the source says was done
    Column("processing_applied", Text),  # JSON object; NULL where the samples are the file's
    Column("source_sha256", Text, nullable=False),  # of the samples as the file has them
    Column("start_time", Text),  # of the first sample, as the file's clock has it
    Column("flags", Text, nullable=False),  # JSON list
    Column("remarks", Text, nullable=False),  # JSON list
    Column("samples_sha256", Text, nullable=False),
    Column("samples", LargeBinary),  # little-endian float64 [g]; NULL in a reference file
    Column("added", Text, nullable=False),
    Column("digest", BigInteger, nullable=False),
    UniqueConstraint("samples_sha256", "dt_s"),
    CheckConstraint("dt_s > 0", name="dt_s"),
    CheckConstraint("npts > 0", name="npts"),
    CheckConstraint("trace_index >= 0", name="trace_index"),
    CheckConstraint("pga_g >= 0 AND pgv_m_s >= 0 AND pgd_m >= 0 AND tm_s > 0", name="measures"),
    CheckConstraint("length(samples_sha256) = 64", name="samples_sha256"),
    CheckConstraint("length(source_sha256) = 64", name="source_sha256"),
    Index(None, "recording_id"),
    Index(None, "source_sha256"),
)

suite = Table(
    "suite",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("name", Text, nullable=False),
    Column("digest", BigInteger, nullable=False),
    UniqueConstraint("name"),
    CheckConstraint("name <> ''", name="name"),
)

suite_motion = Table(
    "suite_motion",
    metadata,
    Column("suite_id", ForeignKey("suite.id", ondelete="CASCADE"), nullable=False),
    Column("motion_id", ForeignKey("motion.id", ondelete="CASCADE"), nullable=False),
    Column("digest", BigInteger, nullable=False),
    PrimaryKeyConstraint("suite_id", "motion_id"),
    Index(None, "motion_id"),
    sqlite_with_rowid=False,
)

toppling_spectrum = Table(
    "toppling_spectrum",
    metadata,
    Column("motion_id", ForeignKey("motion.id", ondelete="CASCADE"), nullable=False),
    Column("polarity", Text, nullable=False),
    Column("p2", Double, nullable=False),  # 1/s²
    Column("numerics_version", Text, nullable=False),
    Column("x_m_s", Double, nullable=False),
    Column("digest", BigInteger, nullable=False),
    PrimaryKeyConstraint("motion_id", "polarity", "p2", "numerics_version"),
    CheckConstraint(POLARITY, name="polarity"),
    CheckConstraint("p2 > 0 AND x_m_s >= 0", name="ranges"),
    sqlite_with_rowid=False,
)

campaign = Table(
    "campaign",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("settings", Text, nullable=False),  # JSON
    Column("numerics_version", Text, nullable=False),
    Column("rbfrag_version", Text, nullable=False),
    Column("started", Text, nullable=False),
    Column("finished", Text),  # NULL while it runs, and for ever if it was killed
    Column("digest", BigInteger, nullable=False),
)

combination = Table(
    "combination",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("natural_key", Text, nullable=False),
    Column("campaign_id", ForeignKey("campaign.id", ondelete="RESTRICT"), nullable=False),
    Column("motion_id", ForeignKey("motion.id", ondelete="RESTRICT"), nullable=False),
    Column("vertical_motion_id", ForeignKey("motion.id", ondelete="RESTRICT")),
    Column("polarity", Text, nullable=False),
    Column("kind", Text, nullable=False),
    Column("linear", Boolean, nullable=False),
    Column("p2", Double),  # 1/s²; NULL where the block needs none
    Column("block", Text),  # JSON object; NULL where p2 says all
    Column("settings", Text, nullable=False),  # JSON
    Column("numerics_version", Text, nullable=False),
    Column("status", Text, nullable=False),
    Column("search_limit", Double),  # kr/PGA; NULL without a search
    Column("kr_over_pga", Double),
    Column("lower", Double),  # kr/PGA
    Column("upper", Double),  # kr/PGA
    Column("kr", Double),
    Column("y_m_s", Double),
    Column("certified", Boolean, nullable=False),
    Column("k_up_over_pga", Double),
    Column("undecided", Double),  # kr/PGA
    Column("island_width", Double),  # kr/PGA
    Column("kr_over_pga_resolved", Double),
    Column("reentrant", Boolean),
    Column("n_runs", Integer, nullable=False),
    Column("warnings", Text, nullable=False),  # JSON list
    Column("digest", BigInteger, nullable=False),
    UniqueConstraint("natural_key"),
    CheckConstraint("length(natural_key) = 64", name="natural_key"),
    CheckConstraint(POLARITY, name="polarity"),
    CheckConstraint(KIND, name="kind"),
    CheckConstraint(STATUS, name="status"),
    CheckConstraint("p2 > 0 AND search_limit > 0 AND n_runs >= 0 AND y_m_s > 0", name="ranges"),
    CheckConstraint("p2 IS NOT NULL OR block IS NOT NULL", name="block"),
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

outcome_interval = Table(
    "outcome_interval",
    metadata,
    Column("combination_id", ForeignKey("combination.id", ondelete="CASCADE"), nullable=False),
    Column("k_lo", Double, nullable=False),  # kr/PGA
    Column("k_hi", Double, nullable=False),  # kr/PGA
    Column("outcome", Text, nullable=False),
    Column("digest", BigInteger, nullable=False),
    PrimaryKeyConstraint("combination_id", "k_lo"),
    CheckConstraint("k_lo >= 0 AND k_hi >= k_lo", name="ranges"),
    CheckConstraint("outcome IN ('topples', 'safe', 'undecided')", name="outcome"),
    sqlite_with_rowid=False,
)

simulation = Table(
    "simulation",
    metadata,
    Column("combination_id", ForeignKey("combination.id", ondelete="CASCADE"), nullable=False),
    Column("kr_over_pga", Double, nullable=False),
    Column("theta_n", Double),  # peak rotation over the critical angle; NULL where it toppled
    Column("outcome", Text, nullable=False),
    Column("displacement_m", Double),  # down a level plane, of blocks that slide
    Column("grid", Integer),  # number in the grid of outcomes; NULL for a block beside it
    Column("digest", BigInteger, nullable=False),
    PrimaryKeyConstraint("combination_id", "kr_over_pga"),
    CheckConstraint("kr_over_pga > 0", name="kr_over_pga"),
    CheckConstraint("theta_n >= 0", name="theta_n"),
    CheckConstraint("grid >= 0", name="grid"),
    CheckConstraint(OUTCOME, name="outcome"),
    sqlite_with_rowid=False,
)

response = Table(
    "response",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("natural_key", Text, nullable=False),
    Column("motion_id", ForeignKey("motion.id", ondelete="RESTRICT"), nullable=False),
    Column("vertical_motion_id", ForeignKey("motion.id", ondelete="RESTRICT")),
    Column("polarity", Text, nullable=False),
    Column("kind", Text, nullable=False),
    Column("linear", Boolean, nullable=False),
    Column("p2", Double, nullable=False),  # 1/s²
    Column("kr", Double, nullable=False),
    Column("numerics_version", Text, nullable=False),
    Column("outcome", Text, nullable=False),
    Column("peak_theta_n", Double),
    Column("peak_theta_rad", Double),
    Column("npts", Integer, nullable=False),
    # Little-endian float64, npts values each.
    Column("time_s", LargeBinary, nullable=False),
    Column("theta_rad", LargeBinary, nullable=False),
    Column("theta_dot_rad_s", LargeBinary, nullable=False),
    Column("k_h", LargeBinary, nullable=False),
    Column("k_v", LargeBinary, nullable=False),
    Column("digest", BigInteger, nullable=False),
    UniqueConstraint("natural_key"),
    CheckConstraint("length(natural_key) = 64", name="natural_key"),
    CheckConstraint(POLARITY, name="polarity"),
    CheckConstraint(KIND, name="kind"),
    CheckConstraint(OUTCOME, name="outcome"),
    CheckConstraint("p2 > 0 AND kr > 0 AND npts >= 0", name="ranges"),
    Index(None, "motion_id"),
    Index(None, "vertical_motion_id"),
)

fragility_model = Table(
    "fragility_model",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("name", Text, nullable=False),
    Column("kind", Text, nullable=False),
    Column("term", Text, nullable=False),
    Column("method", Text, nullable=False),
    Column("coefficients", Text, nullable=False),  # JSON object, ordered
    Column("covariance", Text, nullable=False),  # JSON list of lists, in that order
    Column("domain", Text, nullable=False),  # JSON object: [low, high] by variable
    Column("data_fingerprint", Text, nullable=False),
    Column("diagnostics", Text, nullable=False),  # JSON object
    Column("is_default", Boolean, nullable=False),
    Column("created", Text, nullable=False),
    Column("digest", BigInteger, nullable=False),
    UniqueConstraint("name"),
    CheckConstraint("name <> ''", name="name"),
    CheckConstraint(KIND, name="kind"),
    # At most one default of a kind: the index holds only the rows that are it.
    Index(
        "uq_fragility_model_default",
        "kind",
        unique=True,
        sqlite_where=text("is_default"),
        postgresql_where=text("is_default"),
    ),
)
