"""Response spectra of motions, RotD50 and RotD100 of recordings, further measures.

What follows from samples is computed for the motions that have them.

Revision: 0002
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op
from sqlalchemy import MetaData, Table

from rbfrag.db.insert import renew_digests
from rbfrag.db.motion_spectra import motions_with_samples, renew_recording_spectra, store_spectrum

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    connection = op.get_bind()
    before = Table("motion", MetaData(), autoload_with=connection)
    number = sa.Double().compile(dialect=connection.dialect)
    for name in ("d5_75_s", "housner_m"):
        op.execute(
            f"ALTER TABLE motion ADD COLUMN {name} {number} "
            f"CONSTRAINT ck_motion_{name} CHECK ({name} >= 0)"
        )
    ordinates = [f"sa_{n:03}" for n in range(1, 22)]
    op.create_table(
        "motion_spectrum",
        sa.Column("motion_id", sa.Integer(), nullable=False),
        *(sa.Column(name, sa.Double(), nullable=False) for name in ordinates),
        sa.Column("digest", sa.BigInteger(), nullable=False),
        sa.CheckConstraint("sa_001 >= 0", name=op.f("ck_motion_spectrum_ranges")),
        sa.ForeignKeyConstraint(
            ["motion_id"],
            ["motion.id"],
            name=op.f("fk_motion_spectrum_motion_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("motion_id", name=op.f("pk_motion_spectrum")),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "recording_spectrum",
        sa.Column("motion_id", sa.Integer(), nullable=False),
        sa.Column("other_motion_id", sa.Integer(), nullable=False),
        sa.Column("percentile", sa.Integer(), nullable=False),
        *(sa.Column(name, sa.Double(), nullable=False) for name in ("pga_g", "pgv_m_s")),
        *(sa.Column(name, sa.Double(), nullable=False) for name in ordinates),
        sa.Column("digest", sa.BigInteger(), nullable=False),
        sa.CheckConstraint(
            "percentile IN (50, 100)", name=op.f("ck_recording_spectrum_percentile")
        ),
        sa.CheckConstraint(
            "pga_g >= 0 AND pgv_m_s >= 0 AND sa_001 >= 0", name=op.f("ck_recording_spectrum_ranges")
        ),
        *(
            sa.ForeignKeyConstraint(
                [name],
                ["motion.id"],
                name=op.f(f"fk_recording_spectrum_{name}"),
                ondelete="CASCADE",
            )
            for name in ("motion_id", "other_motion_id")
        ),
        sa.PrimaryKeyConstraint(
            "motion_id", "other_motion_id", "percentile", name=op.f("pk_recording_spectrum")
        ),
        sqlite_with_rowid=False,
    )
    op.create_index(
        op.f("ix_recording_spectrum_other_motion_id"), "recording_spectrum", ["other_motion_id"]
    )
    motion = Table("motion", MetaData(), autoload_with=connection)
    for motion_id, ground in motions_with_samples(connection):
        values = {"d5_75_s": ground.measures.d5_75_s, "housner_m": ground.housner_m}
        connection.execute(motion.update().where(motion.c.id == motion_id).values(**values))
        store_spectrum(connection, motion_id, ground)
    renew_digests(connection, motion, before)
    for recording_id in connection.scalars(sa.text("SELECT id FROM recording ORDER BY id")).all():
        renew_recording_spectra(connection, recording_id)
