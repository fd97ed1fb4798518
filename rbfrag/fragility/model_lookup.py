"""Which fragility model answers."""

from __future__ import annotations

from collections.abc import Collection
from os import PathLike
from pathlib import Path

from rbfrag.db.location import locate
from rbfrag.db.model_record import unknown_model
from rbfrag.db.rows import ModelRow
from rbfrag.errors import InputError, UnknownModelError
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.terms import TERMS, terms_from

_BLOCK = ("p2", "kr")


def find_model(
    model: ModelRow | FragilityModel | str | None,
    given: Collection[str],
    db: str | PathLike[str] | None = None,
) -> FragilityModel:
    """Return the model that answers for the given measures of the motion.

    Args:
        model: a model, the name of a stored one, or None: the database's default if the
            given measures suffice for it, else the best that they suffice for.
        given: names of the measures that are known (``pgv_m_s``, ``pga_g``, …).
        db: database; None for ``RBFRAG_DB``, or else ``rbfrag.db`` in the current folder.

    Raises:
        InputError: the measures do not suffice.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    measures = [name for name in given if name not in _BLOCK]
    if model is None:
        return _suited(db, measures)
    if isinstance(model, str):
        model = _named(model, db)
    chosen = model if isinstance(model, FragilityModel) else FragilityModel.from_row(model)
    if chosen.term.name not in terms_from(measures):
        raise InputError(_wanting(chosen, measures))
    return chosen


def _known(measures: Collection[str]) -> str:
    return " and ".join(measures) or "nothing about the motion"


def _wanting(model: FragilityModel, measures: Collection[str]) -> str:
    return (
        f"model {model.name!r} needs {' and '.join(model.term.inputs)} "
        f"({model.term.title}); given is {_known(measures)}: give what it needs, or "
        "choose a model of another term"
    )


def _suited(db: str | PathLike[str] | None, measures: Collection[str]) -> FragilityModel:
    possible = terms_from(measures)
    if not possible:
        wanted = ", or ".join(" and ".join(term.inputs) for term in TERMS.values())
        raise InputError(f"{_known(measures)} is given: a prediction needs {wanted}")
    rows = _stored(db)
    if not rows:
        raise UnknownModelError(unknown_model(None, [], str(locate(db))))
    for row in rows:
        if row.is_default and row.term in possible:
            return FragilityModel.from_row(row)
    for term in possible:
        for row in rows:
            if row.term == term:
                return FragilityModel.from_row(row)
    have = ", ".join(f"{row.name} ({row.term})" for row in rows)
    terms = " or ".join(possible)
    raise InputError(
        f"no stored model works with {_known(measures)}; stored are {have}: give the measures "
        f"that one of them needs, or fit another with  rbfrag fit --term {terms}"
    )


def _named(name: str, db: str | PathLike[str] | None) -> ModelRow:
    place = locate(db)
    if isinstance(place, Path):
        from rbfrag.db.model_file import read_model

        return read_model(place, name)
    from rbfrag.db.engine import opened_database
    from rbfrag.db.model_store import load_model

    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        return load_model(connection, name)


def _stored(db: str | PathLike[str] | None) -> list[ModelRow]:
    place = locate(db)
    if isinstance(place, Path):
        from rbfrag.db.model_file import read_models

        return read_models(place)
    from rbfrag.db.engine import opened_database
    from rbfrag.db.model_store import model_rows

    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        return model_rows(connection)
