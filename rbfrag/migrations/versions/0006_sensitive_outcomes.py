"""Which outcomes of free-standing blocks are sensitive to the last digits of the motion.

Revision: 0006
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from rbfrag.migrations.tables import fill_digests, rebuild_table

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("simulation", sa.Column("sensitive", sa.Boolean(), nullable=True))
    if op.get_context().dialect.name == "sqlite":
        rebuild_table("simulation", {}, (), {}, last=("digest",))
    fill_digests(op.get_bind(), "simulation")


def downgrade() -> None:
    if op.get_context().dialect.name == "sqlite":
        rebuild_table("simulation", {}, (), {}, left_out=("sensitive",))
    else:
        op.drop_column("simulation", "sensitive")
    fill_digests(op.get_bind(), "simulation")
