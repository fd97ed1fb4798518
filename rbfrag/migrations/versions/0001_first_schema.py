"""The first schema: motions, campaigns with their results, fitted models.

Revision: 0001
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

APPLICATION_ID = 0x72626672  # "rbfr"


def upgrade() -> None:
    if op.get_context().dialect.name == "sqlite":
        op.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    op.create_table(
        "campaign",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("settings", sa.Text(), nullable=False),
        sa.Column("numerics_version", sa.Text(), nullable=False),
        sa.Column("rbfrag_version", sa.Text(), nullable=False),
        sa.Column("started", sa.Text(), nullable=False),
        sa.Column("finished", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_campaign")),
    )
    op.create_table(
        "earthquake",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("event_id", sa.Text(), nullable=False),
        sa.Column("guessed", sa.Boolean(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("magnitude", sa.Double(), nullable=True),
        sa.Column("time", sa.Text(), nullable=True),
        sa.CheckConstraint("event_id <> ''", name=op.f("ck_earthquake_event_id")),
        sa.CheckConstraint(
            "magnitude > -5 AND magnitude < 11", name=op.f("ck_earthquake_magnitude")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_earthquake")),
        sa.UniqueConstraint("event_id", "guessed", name=op.f("uq_earthquake_event_id_guessed")),
    )
    op.create_table(
        "fragility_model",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("term", sa.Text(), nullable=False),
        sa.Column("method", sa.Text(), nullable=False),
        sa.Column("coefficients", sa.Text(), nullable=False),
        sa.Column("covariance", sa.Text(), nullable=False),
        sa.Column("domain", sa.Text(), nullable=False),
        sa.Column("data_fingerprint", sa.Text(), nullable=False),
        sa.Column("diagnostics", sa.Text(), nullable=False),
        sa.Column("is_default", sa.Boolean(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.CheckConstraint("name <> ''", name=op.f("ck_fragility_model_name")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_fragility_model")),
        sa.UniqueConstraint("name", name=op.f("uq_fragility_model_name")),
    )
    op.create_index(
        "uq_fragility_model_default",
        "fragility_model",
        ["is_default"],
        unique=True,
        sqlite_where=sa.text("is_default"),
        postgresql_where=sa.text("is_default"),
    )
    op.create_table(
        "suite",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.CheckConstraint("name <> ''", name=op.f("ck_suite_name")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_suite")),
        sa.UniqueConstraint("name", name=op.f("uq_suite_name")),
    )
    op.create_table(
        "recording",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("earthquake_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("station", sa.Text(), nullable=False),
        sa.CheckConstraint("name <> ''", name=op.f("ck_recording_name")),
        sa.ForeignKeyConstraint(
            ["earthquake_id"],
            ["earthquake.id"],
            name=op.f("fk_recording_earthquake_id"),
            ondelete="RESTRICT",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_recording")),
        sa.UniqueConstraint(
            "earthquake_id", "name", "station", name=op.f("uq_recording_earthquake_id_name_station")
        ),
    )
    op.create_table(
        "motion",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("recording_id", sa.Integer(), nullable=False),
        sa.Column("component", sa.Text(), nullable=False),
        sa.Column("orientation_deg", sa.Double(), nullable=True),
        sa.Column("is_vertical", sa.Boolean(), nullable=False),
        sa.Column("dt_s", sa.Double(), nullable=False),
        sa.Column("npts", sa.Integer(), nullable=False),
        sa.Column("pga_g", sa.Double(), nullable=False),
        sa.Column("pgv_m_s", sa.Double(), nullable=False),
        sa.Column("pgd_m", sa.Double(), nullable=False),
        sa.Column("tm_s", sa.Double(), nullable=True),
        sa.Column("final_velocity_m_s", sa.Double(), nullable=False),
        sa.Column("final_displacement_m", sa.Double(), nullable=False),
        sa.Column("source_file", sa.Text(), nullable=False),
        sa.Column("trace_index", sa.Integer(), nullable=False),
        sa.Column("file_format", sa.Text(), nullable=False),
        sa.Column("processing", sa.Text(), nullable=False),
        sa.Column("flags", sa.Text(), nullable=False),
        sa.Column("remarks", sa.Text(), nullable=False),
        sa.Column("samples_sha256", sa.Text(), nullable=False),
        sa.Column("samples", sa.LargeBinary(), nullable=True),
        sa.Column("added", sa.Text(), nullable=False),
        sa.CheckConstraint("dt_s > 0", name=op.f("ck_motion_dt_s")),
        sa.CheckConstraint("length(samples_sha256) = 64", name=op.f("ck_motion_samples_sha256")),
        sa.CheckConstraint("npts > 0", name=op.f("ck_motion_npts")),
        sa.CheckConstraint(
            "pga_g >= 0 AND pgv_m_s >= 0 AND pgd_m >= 0 AND tm_s > 0",
            name=op.f("ck_motion_measures"),
        ),
        sa.CheckConstraint("trace_index >= 0", name=op.f("ck_motion_trace_index")),
        sa.ForeignKeyConstraint(
            ["recording_id"],
            ["recording.id"],
            name=op.f("fk_motion_recording_id"),
            ondelete="RESTRICT",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_motion")),
        sa.UniqueConstraint("samples_sha256", "dt_s", name=op.f("uq_motion_samples_sha256_dt_s")),
    )
    op.create_index(op.f("ix_motion_recording_id"), "motion", ["recording_id"], unique=False)
    op.create_table(
        "combination",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("natural_key", sa.Text(), nullable=False),
        sa.Column("campaign_id", sa.Integer(), nullable=False),
        sa.Column("motion_id", sa.Integer(), nullable=False),
        sa.Column("vertical_motion_id", sa.Integer(), nullable=True),
        sa.Column("polarity", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("linear", sa.Boolean(), nullable=False),
        sa.Column("p2", sa.Double(), nullable=False),
        sa.Column("settings", sa.Text(), nullable=False),
        sa.Column("numerics_version", sa.Text(), nullable=False),
        sa.Column("status", sa.Text(), nullable=False),
        sa.Column("search_limit", sa.Double(), nullable=False),
        sa.Column("kr_over_pga", sa.Double(), nullable=True),
        sa.Column("lower", sa.Double(), nullable=True),
        sa.Column("upper", sa.Double(), nullable=True),
        sa.Column("kr", sa.Double(), nullable=True),
        sa.Column("y_m_s", sa.Double(), nullable=True),
        sa.Column("certified", sa.Boolean(), nullable=False),
        sa.Column("k_up_over_pga", sa.Double(), nullable=True),
        sa.Column("undecided", sa.Double(), nullable=True),
        sa.Column("island_width", sa.Double(), nullable=True),
        sa.Column("kr_over_pga_resolved", sa.Double(), nullable=True),
        sa.Column("reentrant", sa.Boolean(), nullable=False),
        sa.Column("n_runs", sa.Integer(), nullable=False),
        sa.Column("warnings", sa.Text(), nullable=False),
        sa.CheckConstraint(
            "kind IN ('toppling', 'sliding', 'slumping', 'confined_toppling')",
            name=op.f("ck_combination_kind"),
        ),
        sa.CheckConstraint(
            "polarity IN ('forward', 'reverse')", name=op.f("ck_combination_polarity")
        ),
        sa.CheckConstraint(
            "status <> 'found' OR (kr_over_pga > 0 AND kr > 0 AND y_m_s > 0 "
            "AND kr_over_pga IS NOT NULL AND kr IS NOT NULL AND y_m_s IS NOT NULL)",
            name=op.f("ck_combination_found_has_value"),
        ),
        sa.CheckConstraint(
            "status = 'found' OR (kr_over_pga IS NULL AND kr IS NULL AND y_m_s IS NULL)",
            name=op.f("ck_combination_value_is_found"),
        ),
        sa.CheckConstraint(
            "status IN ('found', 'below_limit', 'no_motion', 'outside_model')",
            name=op.f("ck_combination_status"),
        ),
        sa.CheckConstraint("length(natural_key) = 64", name=op.f("ck_combination_natural_key")),
        sa.CheckConstraint(
            "p2 > 0 AND search_limit > 0 AND n_runs >= 0", name=op.f("ck_combination_ranges")
        ),
        sa.ForeignKeyConstraint(
            ["campaign_id"],
            ["campaign.id"],
            name=op.f("fk_combination_campaign_id"),
            ondelete="RESTRICT",
        ),
        sa.ForeignKeyConstraint(
            ["motion_id"], ["motion.id"], name=op.f("fk_combination_motion_id"), ondelete="RESTRICT"
        ),
        sa.ForeignKeyConstraint(
            ["vertical_motion_id"],
            ["motion.id"],
            name=op.f("fk_combination_vertical_motion_id"),
            ondelete="RESTRICT",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_combination")),
        sa.UniqueConstraint("natural_key", name=op.f("uq_combination_natural_key")),
    )
    op.create_index(
        op.f("ix_combination_campaign_id"), "combination", ["campaign_id"], unique=False
    )
    op.create_index(op.f("ix_combination_motion_id"), "combination", ["motion_id"], unique=False)
    op.create_index(
        op.f("ix_combination_vertical_motion_id"),
        "combination",
        ["vertical_motion_id"],
        unique=False,
    )
    op.create_table(
        "response",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("natural_key", sa.Text(), nullable=False),
        sa.Column("motion_id", sa.Integer(), nullable=False),
        sa.Column("vertical_motion_id", sa.Integer(), nullable=True),
        sa.Column("polarity", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("linear", sa.Boolean(), nullable=False),
        sa.Column("p2", sa.Double(), nullable=False),
        sa.Column("kr", sa.Double(), nullable=False),
        sa.Column("numerics_version", sa.Text(), nullable=False),
        sa.Column("outcome", sa.Text(), nullable=False),
        sa.Column("peak_theta_n", sa.Double(), nullable=True),
        sa.Column("peak_theta_rad", sa.Double(), nullable=True),
        sa.Column("npts", sa.Integer(), nullable=False),
        sa.Column("time_s", sa.LargeBinary(), nullable=False),
        sa.Column("theta_rad", sa.LargeBinary(), nullable=False),
        sa.Column("theta_dot_rad_s", sa.LargeBinary(), nullable=False),
        sa.Column("k_h", sa.LargeBinary(), nullable=False),
        sa.Column("k_v", sa.LargeBinary(), nullable=False),
        sa.CheckConstraint(
            "kind IN ('toppling', 'sliding', 'slumping', 'confined_toppling')",
            name=op.f("ck_response_kind"),
        ),
        sa.CheckConstraint(
            "outcome IN ('stable', 'toppled', 'undetermined', 'jump', "
            "'contact_lost', 'indeterminate')",
            name=op.f("ck_response_outcome"),
        ),
        sa.CheckConstraint("polarity IN ('forward', 'reverse')", name=op.f("ck_response_polarity")),
        sa.CheckConstraint("length(natural_key) = 64", name=op.f("ck_response_natural_key")),
        sa.CheckConstraint("p2 > 0 AND kr > 0 AND npts >= 0", name=op.f("ck_response_ranges")),
        sa.ForeignKeyConstraint(
            ["motion_id"], ["motion.id"], name=op.f("fk_response_motion_id"), ondelete="RESTRICT"
        ),
        sa.ForeignKeyConstraint(
            ["vertical_motion_id"],
            ["motion.id"],
            name=op.f("fk_response_vertical_motion_id"),
            ondelete="RESTRICT",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_response")),
        sa.UniqueConstraint("natural_key", name=op.f("uq_response_natural_key")),
    )
    op.create_index(op.f("ix_response_motion_id"), "response", ["motion_id"], unique=False)
    op.create_index(
        op.f("ix_response_vertical_motion_id"), "response", ["vertical_motion_id"], unique=False
    )
    op.create_table(
        "suite_motion",
        sa.Column("suite_id", sa.Integer(), nullable=False),
        sa.Column("motion_id", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["motion_id"], ["motion.id"], name=op.f("fk_suite_motion_motion_id"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["suite_id"], ["suite.id"], name=op.f("fk_suite_motion_suite_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("suite_id", "motion_id", name=op.f("pk_suite_motion")),
        sqlite_with_rowid=False,
    )
    op.create_index(op.f("ix_suite_motion_motion_id"), "suite_motion", ["motion_id"], unique=False)
    op.create_table(
        "toppling_spectrum",
        sa.Column("motion_id", sa.Integer(), nullable=False),
        sa.Column("polarity", sa.Text(), nullable=False),
        sa.Column("p2", sa.Double(), nullable=False),
        sa.Column("numerics_version", sa.Text(), nullable=False),
        sa.Column("x_m_s", sa.Double(), nullable=False),
        sa.CheckConstraint(
            "polarity IN ('forward', 'reverse')", name=op.f("ck_toppling_spectrum_polarity")
        ),
        sa.CheckConstraint("p2 > 0 AND x_m_s >= 0", name=op.f("ck_toppling_spectrum_ranges")),
        sa.ForeignKeyConstraint(
            ["motion_id"],
            ["motion.id"],
            name=op.f("fk_toppling_spectrum_motion_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint(
            "motion_id", "polarity", "p2", "numerics_version", name=op.f("pk_toppling_spectrum")
        ),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "outcome_interval",
        sa.Column("combination_id", sa.Integer(), nullable=False),
        sa.Column("k_lo", sa.Double(), nullable=False),
        sa.Column("k_hi", sa.Double(), nullable=False),
        sa.Column("outcome", sa.Text(), nullable=False),
        sa.CheckConstraint(
            "outcome IN ('topples', 'safe', 'undecided')", name=op.f("ck_outcome_interval_outcome")
        ),
        sa.CheckConstraint("k_lo >= 0 AND k_hi >= k_lo", name=op.f("ck_outcome_interval_ranges")),
        sa.ForeignKeyConstraint(
            ["combination_id"],
            ["combination.id"],
            name=op.f("fk_outcome_interval_combination_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("combination_id", "k_lo", name=op.f("pk_outcome_interval")),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "simulation",
        sa.Column("combination_id", sa.Integer(), nullable=False),
        sa.Column("kr_over_pga", sa.Double(), nullable=False),
        sa.Column("theta_n", sa.Double(), nullable=True),
        sa.Column("outcome", sa.Text(), nullable=False),
        sa.CheckConstraint(
            "outcome IN ('stable', 'toppled', 'undetermined', 'jump', "
            "'contact_lost', 'indeterminate')",
            name=op.f("ck_simulation_outcome"),
        ),
        sa.CheckConstraint("kr_over_pga > 0", name=op.f("ck_simulation_kr_over_pga")),
        sa.CheckConstraint("theta_n >= 0", name=op.f("ck_simulation_theta_n")),
        sa.ForeignKeyConstraint(
            ["combination_id"],
            ["combination.id"],
            name=op.f("fk_simulation_combination_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("combination_id", "kr_over_pga", name=op.f("pk_simulation")),
        sqlite_with_rowid=False,
    )


def downgrade() -> None:
    for table in (
        "simulation",
        "outcome_interval",
        "toppling_spectrum",
        "suite_motion",
        "response",
        "combination",
        "motion",
        "recording",
        "suite",
        "fragility_model",
        "earthquake",
        "campaign",
    ):
        op.drop_table(table)
