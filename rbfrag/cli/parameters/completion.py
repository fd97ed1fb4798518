"""Shell completion of model names and motion ids.

A shell asks with what is typed so far; what cannot be read offers nothing, and says nothing.
"""

from __future__ import annotations

import typer

from rbfrag.errors import RbfragError


def model_names(ctx: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Return the models whose names begin with a text, each with a description.

    Args:
        ctx: of typer, with the options that are typed already.
        incomplete: what is typed of the name.
    """
    from rbfrag.fragility.model_selection import stored_rows

    try:
        rows = stored_rows(ctx.params.get("db"))
    except RbfragError:
        return []
    return [
        (row.name, f"{row.kind}: {row.method} on {row.term}")
        for row in rows
        if row.name.startswith(incomplete)
    ]


def motion_ids(ctx: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Return the stored motions whose ids begin with a text, each with its name and PGV.

    Args:
        ctx: of typer, with the options that are typed already.
        incomplete: what is typed of the id.
    """
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motions import motion_rows

    try:
        with (
            opened_database(ctx.params.get("db"), read_only=True) as engine,
            engine.connect() as connection,
        ):
            rows = motion_rows(connection)
    except RbfragError:
        return []
    return [
        (str(row.id), f"{row.name}, PGV {row.pgv_m_s:.3g} m/s")
        for row in rows
        if str(row.id).startswith(incomplete)
    ]
