"""Ledger that reveals rows deleted or added by another program.

Revision: 0009
"""

from __future__ import annotations

from alembic import op

from rbfrag.db.ledger import renew_ledger
from rbfrag.db.schema import ledger

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    connection = op.get_bind()
    ledger.create(connection)
    renew_ledger(connection)
