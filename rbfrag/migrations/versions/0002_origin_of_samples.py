"""Where stored samples come from: hash of the file's samples, what was applied, start time.

Revision: 0002
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

_OLD = (
    "id, recording_id, component, orientation_deg, is_vertical, dt_s, npts, pga_g, pgv_m_s, "
    "pgd_m, tm_s, final_velocity_m_s, final_displacement_m, source_file, trace_index, "
    "file_format, processing, flags, remarks, samples_sha256, samples, added"
)


def upgrade() -> None:
    if op.get_context().dialect.name == "sqlite":
        # Before the samples: SQLite would walk through a BLOB to a column behind it.
        _rebuild(
            sa.Column("processing_applied", sa.Text(), nullable=True),
            sa.Column("source_sha256", sa.Text(), nullable=False),
            sa.Column("start_time", sa.Text(), nullable=True),
            copied=f"{_OLD}, source_sha256",
            of=f"{_OLD}, samples_sha256",
        )
    else:
        op.add_column("motion", sa.Column("processing_applied", sa.Text(), nullable=True))
        op.add_column("motion", sa.Column("source_sha256", sa.Text(), nullable=True))
        op.add_column("motion", sa.Column("start_time", sa.Text(), nullable=True))
        op.execute("UPDATE motion SET source_sha256 = samples_sha256")
        op.alter_column("motion", "source_sha256", nullable=False)
        op.create_check_constraint(
            op.f("ck_motion_source_sha256"), "motion", "length(source_sha256) = 64"
        )
    op.create_index(op.f("ix_motion_source_sha256"), "motion", ["source_sha256"], unique=False)


def downgrade() -> None:
    op.drop_index(op.f("ix_motion_source_sha256"), "motion")
    if op.get_context().dialect.name == "sqlite":
        _rebuild(copied=_OLD, of=_OLD)
        return
    op.drop_constraint(op.f("ck_motion_source_sha256"), "motion", type_="check")
    for name in ("start_time", "source_sha256", "processing_applied"):
        op.drop_column("motion", name)


def _rebuild(*origin: sa.Column[str], copied: str, of: str) -> None:
    """Make the table anew with the columns of `origin` or without them, and move its rows."""
    checks: list[sa.CheckConstraint] = [
        sa.CheckConstraint("length(source_sha256) = 64", name=op.f("ck_motion_source_sha256"))
        for column in origin
        if column.name == "source_sha256"
    ]
    op.create_table(
        "motion_rebuilt",
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
        *origin,
        sa.Column("flags", sa.Text(), nullable=False),
        sa.Column("remarks", sa.Text(), nullable=False),
        sa.Column("samples_sha256", sa.Text(), nullable=False),
        sa.Column("samples", sa.LargeBinary(), nullable=True),
        sa.Column("added", sa.Text(), nullable=False),
        sa.CheckConstraint("dt_s > 0", name=op.f("ck_motion_dt_s")),
        sa.CheckConstraint("length(samples_sha256) = 64", name=op.f("ck_motion_samples_sha256")),
        *checks,
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
    op.execute(f"INSERT INTO motion_rebuilt ({copied}) SELECT {of} FROM motion")
    op.drop_table("motion")
    op.rename_table("motion_rebuilt", "motion")
    op.create_index(op.f("ix_motion_recording_id"), "motion", ["recording_id"], unique=False)
