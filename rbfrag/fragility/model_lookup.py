"""Which fragility model answers."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from os import PathLike
from pathlib import Path

from rbfrag.db.location import locate
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
    if not terms_from(measures):
        raise InputError(
            f"{_known(measures)} does not suffice for any model: give "
            f"{', or '.join(' and '.join(term.inputs) for term in TERMS.values())}"
        )
    if model is None:
        return _suited(_stored(db), measures)
    if isinstance(model, str):
        model = _named(model, db)
    chosen = model if isinstance(model, FragilityModel) else FragilityModel.from_row(model)
    if chosen.term.name not in terms_from(measures):
        raise InputError(_wanting(chosen, measures))
    return chosen


def _known(measures: Collection[str]) -> str:
    return " and ".join(measures) or "nothing about the motion, which"


def _wanting(model: FragilityModel, measures: Collection[str]) -> str:
    return (
        f"model {model.name!r} needs {' and '.join(model.term.inputs)} "
        f"({model.term.title}); given is {' and '.join(measures)}: give what it needs, or "
        "choose a model of another term"
    )


def _suited(rows: Sequence[ModelRow], measures: Collection[str]) -> FragilityModel:
    if not rows:
        raise UnknownModelError("the database holds no fitted model yet: make one with  rbfrag fit")
    by_preference = sorted(rows, key=lambda row: not row.is_default)
    default = FragilityModel.from_row(by_preference[0])
    if default.term.name in terms_from(measures):
        return default
    for term in terms_from(measures):
        for row in by_preference:
            if row.term == term:
                return FragilityModel.from_row(row)
    have = ", ".join(f"{row.name} ({row.term})" for row in by_preference)
    raise InputError(
        f"no stored model works with {' and '.join(measures)}; stored: {have}. "
        f"{_wanting(default, measures)}"
    )


def _named(name: str, db: str | PathLike[str] | None) -> ModelRow:
    place = locate(db)
    if isinstance(place, Path):
        from rbfrag.db.model_file import read_model

        return read_model(place, name)
    from rbfrag.db.model_store import load_model

    from rbfrag.db.engine import opened_database

    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        return load_model(connection, name)


def _stored(db: str | PathLike[str] | None) -> Sequence[ModelRow]:
    place = locate(db)
    if isinstance(place, Path):
        from rbfrag.db.model_file import read_models

        return read_models(place)
    from rbfrag.db.model_store import model_rows

    from rbfrag.db.engine import opened_database

    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        return model_rows(connection)
