"""Initial schema, the base of later migrations.

A new database is made from :mod:`rbfrag.db.schema` and stamped with the newest revision.

Revision: 0001
"""

from __future__ import annotations

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass
