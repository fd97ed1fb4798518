"""Stored histories against their inputs and their own counts."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, func, select

from rbfrag.db.check.finding import COMPUTE_AGAIN, Finding
from rbfrag.db.keys import response_key
from rbfrag.db.schema import motion, response

_SERIES = ("time_s", "theta_rad", "theta_dot_rad_s", "k_h", "k_v")
_BLOCK = ("polarity", "kind", "p2", "kr", "numerics_version", "linear")


def check_responses(connection: Connection) -> Iterator[Finding]:
    """Yield histories whose key is not the hash of their inputs, or of another length."""
    vertical = motion.alias("vertical")
    lengths = [func.length(response.c[name]).label(name) for name in _SERIES]
    query = (
        select(
            response.c.id,
            response.c.natural_key,
            response.c.npts,
            *(response.c[name] for name in _BLOCK),
            motion.c.samples_sha256,
            motion.c.dt_s,
            vertical.c.samples_sha256.label("vertical_sha256"),
            *lengths,
        )
        .select_from(
            response.join(motion, motion.c.id == response.c.motion_id).outerjoin(
                vertical, vertical.c.id == response.c.vertical_motion_id
            )
        )
        .order_by(response.c.id)
    )
    for row in connection.execute(query).mappings():
        expected = response_key(
            motion_sha256=row["samples_sha256"],
            dt_s=row["dt_s"],
            vertical_sha256=row["vertical_sha256"],
            **{name: row[name] for name in _BLOCK},
        )
        if expected != row["natural_key"]:
            problem = "its natural key is not the hash of its inputs"
            yield Finding("response", str(row["id"]), problem, COMPUTE_AGAIN)
        for name in _SERIES:
            if row[name] != 8 * row["npts"]:
                problem = f"{name} holds {row[name]} bytes, not 8 x {row['npts']}"
                yield Finding("response", str(row["id"]), problem, COMPUTE_AGAIN)
