"""Bringing the fitted models of another database in."""

from __future__ import annotations

from dataclasses import replace

from sqlalchemy import Connection

from rbfrag.db.insert import insert_row
from rbfrag.db.merge.ledger import Ledger
from rbfrag.db.model_record import encode_model
from rbfrag.db.models import model_rows
from rbfrag.db.rows import ModelRow
from rbfrag.db.schema import fragility_model


def merge_models(source: Connection, target: Connection, ledger: Ledger) -> None:
    """Bring models in; of two that differ under one name, the other's gets a number.

    A model "m" that differs from the "m" here is stored as "m-2", or the first number that is
    free. The defaults stay; a database without models of a kind takes the other's.

    Args:
        source: the other database.
        target: the database that is merged into, inside the caller's transaction.
        ledger: what was done.
    """
    ours = {row.name: row for row in model_rows(target)}
    had = {row.kind for row in ours.values()}
    for theirs in model_rows(source):
        name, number = theirs.name, 1
        while name in ours and not _same(ours[name], theirs):
            number += 1
            name = f"{theirs.name}-{number}"
        if name in ours:
            ledger.same["fragility_model"] += 1
            continue
        row = replace(theirs, name=name, is_default=theirs.is_default and theirs.kind not in had)
        insert_row(target, fragility_model, encode_model(row))
        ours[name] = row
        ledger.added["fragility_model"] += 1
        if name != theirs.name:
            ledger.notes.append(
                f"there is another model {theirs.name!r} here: theirs is stored as {name!r}"
            )


def _same(one: ModelRow, other: ModelRow) -> bool:
    left, right = (
        encode_model(replace(row, name="-", is_default=False, created="")) for row in (one, other)
    )
    return left == right
