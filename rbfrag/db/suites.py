"""Suites: named sets of motions."""

from __future__ import annotations

from sqlalchemy import Connection, select

from rbfrag.db.insert import insert_if_new
from rbfrag.db.schema import suite, suite_motion
from rbfrag.db.stored_text import storable
from rbfrag.errors import InputError


def add_to_suite(connection: Connection, name: str, motion_id: int) -> None:
    """Put a motion into a suite, made when new; a motion that is in it stays in it.

    Raises:
        InputError: the name is empty.
    """
    if not name.strip():
        raise InputError("the name of a suite must not be empty")
    name = storable(name)
    insert_if_new(connection, suite, {"name": name})
    suite_id = connection.execute(select(suite.c.id).where(suite.c.name == name)).scalar_one()
    insert_if_new(connection, suite_motion, {"suite_id": suite_id, "motion_id": motion_id})


def suite_names(connection: Connection) -> list[str]:
    """Return the names of all suites, sorted."""
    return sorted(connection.scalars(select(suite.c.name)))


def require_suite(connection: Connection, name: str) -> int:
    """Return the row id of a suite.

    Raises:
        InputError: there is no such suite; the message lists those there are.
    """
    suite_id = connection.scalar(select(suite.c.id).where(suite.c.name == storable(name)))
    if suite_id is None:
        known = ", ".join(suite_names(connection)) or "none"
        raise InputError(f"there is no suite {name!r}; the database holds: {known}")
    return int(suite_id)
