"""Storage of fitted models."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from sqlalchemy import Connection, Select, and_, select

from rbfrag.db.connect import database_label
from rbfrag.db.insert import delete_rows, insert_row, update_rows, utc_now
from rbfrag.db.model_file import (
    STORED,
    ModelRow,
    decode_model,
    encode_model,
    recommended,
    reject_taken,
    unknown_model,
    with_defaults,
)
from rbfrag.db.schema import fragility_model
from rbfrag.errors import DatabaseError, UnknownModelError


def save_model(connection: Connection, row: ModelRow, *, replace: bool = False) -> ModelRow:
    """Store a fitted model.

    It becomes the default of its kind when it says so; a model that is replaced passes that on.

    Args:
        row: the model; without a time of creation it is now.
        replace: overwrite a model of the same name.

    Returns:
        The model as stored.

    Raises:
        InputError: there is a model of that name already; a value that cannot be stored.
    """
    values = encode_model(row)
    values["created"] = row.created or utc_now()
    query = select(fragility_model.c.name, fragility_model.c.is_default)
    chosen = {other.name: bool(other.is_default) for other in connection.execute(query)}
    if not replace:
        reject_taken(row.name, chosen)
    values["is_default"] = row.is_default or chosen.get(row.name, False)
    # first of all: a damaged model may be replaced, but not changed
    delete_rows(connection, fragility_model, fragility_model.c.name == row.name)
    if values["is_default"]:
        _clear_default(connection, row.kind)
    insert_row(connection, fragility_model, values)
    return load_model(connection, row.name)


def names_of_models(connection: Connection) -> list[str]:
    """Return the names of the stored models, sorted."""
    return sorted(connection.scalars(select(fragility_model.c.name)))


def model_rows(connection: Connection) -> list[ModelRow]:
    """Return all models, sorted by name, with the default of each kind."""
    return with_defaults([decode_model(row) for row in connection.execute(_model_query())])


def load_model(connection: Connection, name: str | None = None) -> ModelRow:
    """Return one model.

    Args:
        name: its name; None for the default of blocks that topple
            (:func:`rbfrag.db.model_file.recommended`).

    Raises:
        UnknownModelError: there is none; the message lists the names there are.
    """
    if name is None:
        default = recommended(model_rows(connection))
    else:
        query = _model_query().where(fragility_model.c.name == name)
        stored = connection.execute(query).one_or_none()
        default = None if stored is None else decode_model(stored)
        # whether it is the default depends on the others, unless one of them is damaged
        with suppress(DatabaseError):
            default = next((row for row in model_rows(connection) if row.name == name), None)
    if default is None:
        names = names_of_models(connection)
        place = database_label(connection.engine.url)
        raise UnknownModelError(unknown_model(name, names, place))
    return default


def store_dependence(connection: Connection, row: ModelRow) -> None:
    """Store the dependence model of a stored model, and the diagnostics of its estimation."""
    values = encode_model(row)
    changed = {name: values[name] for name in ("dependence", "diagnostics")}
    update_rows(connection, fragility_model, fragility_model.c.name == row.name, changed)


def set_default(connection: Connection, name: str) -> None:
    """Set the default model of its kind."""
    _clear_default(connection, load_model(connection, name).kind)
    named = fragility_model.c.name == name
    update_rows(connection, fragility_model, named, {"is_default": True})


def _clear_default(connection: Connection, kind: str) -> None:
    default = and_(fragility_model.c.is_default, fragility_model.c.kind == kind)
    update_rows(connection, fragility_model, default, {"is_default": False})


def _model_query() -> Select[Any]:
    return select(*(fragility_model.c[column] for column in STORED))
