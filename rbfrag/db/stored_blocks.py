"""The blocks of combinations that two numbers do not describe."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from sqlalchemy import Connection, select

from rbfrag.db.schema import combination


def stored_blocks(connection: Connection, combination_id: ArrayLike) -> list[str]:
    """Return the blocks of some combinations as JSON text; empty for toppling.

    Args:
        connection: the database.
        combination_id: row ids, shape (n,).
    """
    wanted = np.asarray(combination_id, dtype=np.int64).tolist()
    if not wanted:
        return []
    column = combination.c
    query = select(column.id, column.block).where(column.id.between(min(wanted), max(wanted)))
    found = {row_id: block or "" for row_id, block in connection.execute(query)}
    return [found[row_id] for row_id in wanted]
