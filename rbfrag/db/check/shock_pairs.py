"""Blocks under two motions against their inputs."""

from __future__ import annotations

import json
from collections.abc import Iterator

from sqlalchemy import Connection, RowMapping, select

from rbfrag.db.check.finding import COMPUTE_AGAIN, Finding
from rbfrag.db.keys import pair_key
from rbfrag.db.schema import campaign, motion, shock_pair


def check_shock_pairs(connection: Connection) -> Iterator[Finding]:
    """Yield pairs of motions whose key is not the hash of their inputs, or that cannot be."""
    first = motion.alias("first")
    query = (
        select(
            shock_pair,
            motion.c.samples_sha256,
            motion.c.dt_s,
            first.c.samples_sha256.label("first_sha256"),
            first.c.dt_s.label("first_dt_s"),
            campaign.c.numerics_version.label("campaign_numerics"),
        )
        .select_from(
            shock_pair.join(motion, motion.c.id == shock_pair.c.second_motion_id)
            .join(first, first.c.id == shock_pair.c.first_motion_id)
            .outerjoin(campaign)
        )
        .order_by(shock_pair.c.id)
    )
    for row in connection.execute(query).mappings():
        for problem in _problems(row):
            yield Finding("shock_pair", str(row["id"]), problem, COMPUTE_AGAIN)


def _problems(row: RowMapping) -> Iterator[str]:
    try:
        block = json.loads(row["block"])
    except ValueError as error:
        yield f"its block cannot be read: {error}"
        return
    expected = pair_key(
        first_sha256=row["first_sha256"],
        first_dt_s=row["first_dt_s"],
        motion_sha256=row["samples_sha256"],
        dt_s=row["dt_s"],
        block=block,
        **{name: row[name] for name in ("polarity", "kind", "numerics_version")},
    )
    if expected != row["natural_key"]:
        yield "its natural key is not the hash of its inputs"
    if row["campaign_numerics"] not in (None, row["numerics_version"]):
        yield (
            f"numerics version {row['numerics_version']}, its campaign says "
            f"{row['campaign_numerics']}"
        )
    if row["second_outcome"] is not None and row["first_outcome"] != "stable":
        yield (
            f"the first motion ends as {row['first_outcome']}, yet the second is said to find the "
            "block at rest"
        )
