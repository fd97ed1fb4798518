"""Schema of the first release, the base of later migrations.

A new database is made from :mod:`rbfrag.db.schema`.

Revision: 0007
"""

from __future__ import annotations

revision = "0007"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass
