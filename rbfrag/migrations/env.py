"""Alembic environment: migrates over the connection that rbfrag passes.

Developers run Alembic themselves to write a new migration; then ``-x db=PATH`` names
the database that the schema is compared with.
"""

from __future__ import annotations

from alembic import context
from sqlalchemy import Connection

from rbfrag.db.connect import unchecked_engine
from rbfrag.db.location import VERSION_TABLE, locate
from rbfrag.db.schema import metadata
from rbfrag.db.views import create_views, drop_views


def _run(connection: Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=metadata,
        version_table=VERSION_TABLE,
        # SQLite can alter little: Alembic then rebuilds the table.
        render_as_batch=connection.dialect.name == "sqlite",
        # One transaction for everything: a killed upgrade leaves the old schema.
        transactional_ddl=True,
    )
    with context.begin_transaction():
        drop_views(connection)  # a table that a view reads cannot be rebuilt
        context.run_migrations()
        create_views(connection)


_shared: Connection | None = context.config.attributes.get("connection")
if _shared is not None:
    _run(_shared)
else:
    _place = locate(context.get_x_argument(as_dictionary=True).get("db"))
    with unchecked_engine(_place, foreign_keys=False).begin() as _connection:
        _run(_connection)
