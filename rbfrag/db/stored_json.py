"""JSON columns: decoded, or rejected with a one-sentence error."""

from __future__ import annotations

import json
from typing import Any

from rbfrag.errors import DatabaseError


def stored_json(text: Any, kind: type, where: str) -> Any:
    """Return the value of a JSON column.

    Args:
        text: what the column holds; None (nothing) gives None.
        kind: list or dict, which it must be.
        where: table, row and column, for the message.

    Raises:
        DatabaseError: it is no JSON, or something else than a `kind`.
    """
    if text is None:
        return None
    try:
        value = json.loads(text)
    except (ValueError, TypeError, RecursionError) as error:
        raise _damaged(where, str(error)) from None
    if not isinstance(value, kind):
        raise _damaged(where, f"no JSON {'list' if kind is list else 'object'}")
    return value


def stored_number(value: Any, where: str) -> Any:
    """Return a number of a column, or None; SQLite accepts text in number columns."""
    if value is None or isinstance(value, int | float):
        return value
    raise _damaged(where, f"{value!r} is not a number")


def _damaged(where: str, reason: str) -> DatabaseError:
    return DatabaseError(
        f"{where} of the database is damaged ({reason}): run  rbfrag db check  and restore the "
        "database from a backup"
    )
