"""Models with spectral predictors: their regressions; models of earlier forms are deleted.

Revision: 0004
"""

from __future__ import annotations

from alembic import op
from sqlalchemy import MetaData, Table, delete

from rbfrag.db.insert import renew_digests

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    connection = op.get_bind()
    before = Table("fragility_model", MetaData(), autoload_with=connection)
    # their methods are no longer there: fit again
    connection.execute(delete(before))
    op.execute("ALTER TABLE fragility_model ADD COLUMN completions TEXT")
    renew_digests(
        connection, Table("fragility_model", MetaData(), autoload_with=connection), before
    )
