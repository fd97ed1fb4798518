"""Spectral accelerations, CAV, Arias intensity and duration; what intervals and ranges are from.

Revision: 0005
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sqlalchemy as sa
from alembic import op

from rbfrag.db.motions import LATER_MEASURES, measures_of
from rbfrag.migrations.tables import fill_digests, rebuild_table, reflected
from rbfrag.motions.ground_motion import GroundMotion

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_OF_MODELS = {"form": sa.Integer, "leave_out_steps": sa.Text, "dependence": sa.Text}
_CHECKS = {
    "motion": {
        "spectrum": "sa03_g >= 0 AND sa05_g >= 0 AND sa10_g >= 0 AND sa20_g >= 0 AND sa30_g >= 0",
        "energy": "cav_m_s >= 0 AND arias_m_s >= 0 AND d5_95_s >= 0",
    },
    "fragility_model": {"form": "form >= 1"},
}
_AFTER_THE_MEASURES = (
    "final_velocity_m_s", "final_displacement_m", "source_file", "trace_index", "file_format",
    "processing", "processing_applied", "source_sha256", "start_time", "flags", "remarks",
    "samples_sha256", "samples", "added", "digest",
)  # fmt: skip


def upgrade() -> None:
    connection = op.get_bind()
    for name in LATER_MEASURES:
        op.add_column("motion", sa.Column(name, sa.Double(), nullable=True))
    _fill_measures(connection)
    _change("motion", {}, _AFTER_THE_MEASURES)
    for name, kind in _OF_MODELS.items():
        op.add_column("fragility_model", sa.Column(name, kind(), nullable=True))
    # the models there are were fitted with the predictors of the first form
    op.execute("UPDATE fragility_model SET form = 1")
    _change("fragility_model", {"form": False}, ("digest",))
    for table in _CHECKS:
        fill_digests(connection, table)


def downgrade() -> None:
    left_out = {"motion": LATER_MEASURES, "fragility_model": tuple(_OF_MODELS)}
    for table, columns in left_out.items():
        if op.get_context().dialect.name == "sqlite":
            rebuild_table(table, {}, tuple(_CHECKS[table]), {}, left_out=columns)
        else:
            for name in columns:
                op.drop_column(table, name)  # its checks go with it
        fill_digests(op.get_bind(), table)


def _fill_measures(connection: sa.Connection) -> None:
    """Calculate the new measures of the motions whose samples are there, one at a time."""
    motion = reflected(connection, "motion")
    ids = connection.scalars(sa.select(motion.c.id).where(motion.c.samples.is_not(None))).all()
    for row_id in ids:
        query = sa.select(motion.c.samples, motion.c.dt_s).where(motion.c.id == row_id)
        row = connection.execute(query).one()
        samples = np.frombuffer(bytes(row.samples), dtype="<f8").astype(np.float64)
        measures = measures_of(GroundMotion(samples, row.dt_s))
        values = {name: measures[name] for name in LATER_MEASURES}
        connection.execute(sa.update(motion).where(motion.c.id == row_id).values(**values))


def _change(table: str, nullable: dict[str, bool], last: Sequence[str]) -> None:
    if op.get_context().dialect.name == "sqlite":
        rebuild_table(table, nullable, (), _CHECKS[table], last=last)
        return
    for column, may_be in nullable.items():
        op.alter_column(table, column, nullable=may_be)
    for name, rule in _CHECKS[table].items():
        op.create_check_constraint(op.f(f"ck_{table}_{name}"), table, rule)
