"""Stored histories against their own counts."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, func, select

from rbfrag.db.finding import COMPUTE_AGAIN, Finding
from rbfrag.db.schema import response

_SERIES = ("time_s", "theta_rad", "theta_dot_rad_s", "k_h", "k_v")


def check_responses(connection: Connection) -> Iterator[Finding]:
    """Yield histories whose arrays are not as long as stated.

    Args:
        connection: the database, inside one transaction.
    """
    lengths = [func.length(response.c[name]).label(name) for name in _SERIES]
    query = select(response.c.id, response.c.npts, *lengths).order_by(response.c.id)
    for row in connection.execute(query).mappings():
        for name in _SERIES:
            if row[name] != 8 * row["npts"]:
                problem = f"{name} holds {row[name]} bytes, not 8 x {row['npts']}"
                yield Finding("response", str(row["id"]), problem, COMPUTE_AGAIN)
