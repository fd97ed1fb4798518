"""Which fragility model answers."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import lru_cache
from os import PathLike
from pathlib import Path

from rbfrag.db.location import DEFAULT_NAME, REFERENCE, locate, reference_file
from rbfrag.db.model_file import unknown_model
from rbfrag.db.rows import ModelRow
from rbfrag.errors import InputError, UnknownModelError
from rbfrag.fragility.measures import TERMS, terms_from
from rbfrag.fragility.model import BEST_ON_PGV, METHODS_BEST_FIRST, FragilityModel

_BLOCK = ("p2", "kr")

LEVELS = {"xp": 3, "pgv_pga_tm": 2, "pgv_pga": 1}
"""How much a term knows of the motion; the single terms know least, 0."""

FROM_REFERENCE = (
    "answered by the reference model that is shipped with rbfrag: there is no rbfrag.db here and "
    "no --db or RBFRAG_DB names another"
)

_Stamp = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class _Store:
    """The models of one place.

    Args:
        place: its name in messages.
        stamp: what tells whether the file has changed since; () where nothing can.
        models: the models of toppling.
        suited: those that have been found to suit some measures, by the names of these.
    """

    place: str
    stamp: _Stamp
    models: list[FragilityModel]
    suited: dict[tuple[str, ...], list[FragilityModel]] = field(default_factory=dict)


_SHIPPED = str(REFERENCE)
_stores_before: dict[tuple[str, bool], _Store] = {}
_rows_before: dict[int, tuple[ModelRow, FragilityModel]] = {}
_MOST_ROWS = 64


def find_model(
    model: ModelRow | FragilityModel | str | None,
    given: Collection[str],
    db: str | PathLike[str] | None = None,
) -> FragilityModel:
    """Return the model that answers for the given measures of the motion.

    The more is known of the motion, the better the model: one on X(p), then PGV with PGA and Tm,
    then PGV with PGA, then a single term. Among the stored models of the best kind that the
    measures suffice for, the database's default answers, else the best method.

    Args:
        model: a model, the name of a stored one, or None.
        given: names of the measures that are known (``pgv_m_s``, ``pga_g``, …).
        db: database; None for ``RBFRAG_DB``, or else ``rbfrag.db`` in the current folder, or
            else the reference that is shipped.

    Raises:
        InputError: the measures do not suffice.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    if type(model) is FragilityModel:
        chosen = model
    elif model is None:
        return _suited(tuple(given), db)[0]
    elif isinstance(model, str):
        chosen = _named(model, db)
    else:
        chosen = _of_row(model)  # type: ignore[arg-type]
    for name in chosen.term.inputs:
        if name not in given:
            raise InputError(_wanting(chosen, _measures(given)))
    return chosen


def suited_models(
    given: Collection[str], db: str | PathLike[str] | None = None
) -> list[FragilityModel]:
    """Return one stored model for each term that the measures suffice for, the recommended first.

    Args:
        given: names of the measures that are known.
        db: database, as for :func:`find_model`.

    Raises:
        InputError: the measures do not suffice for any.
        UnknownModelError: the database holds no model.
        DatabaseError: the database cannot be read.
    """
    return list(_suited(tuple(given), db))


_terms_from = lru_cache(terms_from)


def _suited(given: tuple[str, ...], db: str | PathLike[str] | None) -> list[FragilityModel]:
    possible = _terms_from(given)
    if not possible:
        wanted = ", or ".join(" and ".join(TERMS[name].inputs) for name in _ASKED)
        raise InputError(
            f"{_known(_measures(given))} is given: a prediction needs {wanted}, or a motion"
        )
    store = _store(db)
    before = store.suited.get(given)
    if before is None:
        before = store.suited[given] = _suited_in(store, given, possible)
    return before


def _suited_in(
    store: _Store, given: tuple[str, ...], possible: tuple[str, ...]
) -> list[FragilityModel]:
    if not store.models:
        raise UnknownModelError(unknown_model(None, [], store.place))
    best: dict[str, FragilityModel] = {}
    for model in store.models:
        name = model.term.name
        if name in possible and (name not in best or _merit(model) > _merit(best[name])):
            best[name] = model
    if not best:
        have = ", ".join(f"{model.name} ({model.term.name})" for model in store.models)
        raise InputError(
            f"no stored model works with {_known(_measures(given))}; stored are {have}: give the "
            "measures that one of them needs, or fit another with  rbfrag fit --term "
            f"{' or '.join(possible)}"
        )
    order = {name: number for number, name in enumerate(possible)}
    return sorted(
        best.values(),
        key=lambda model: (
            -LEVELS.get(model.term.name, 0),
            not model.row.is_default,
            order[model.term.name],
        ),
    )


_ASKED = ("pgv", "pga_tm", "pgd_tm")


def _merit(model: FragilityModel) -> tuple[bool, int]:
    order = BEST_ON_PGV if model.term.name == "pgv" else METHODS_BEST_FIRST
    return model.row.is_default, -order.index(model.row.method)


def _measures(given: Collection[str]) -> list[str]:
    return [name for name in given if name not in _BLOCK]


def _known(measures: Collection[str]) -> str:
    return " and ".join(measures) or "nothing about the motion"


def _wanting(model: FragilityModel, measures: Collection[str]) -> str:
    return (
        f"model {model.name!r} needs {' and '.join(model.term.inputs)} "
        f"({model.term.title}); given is {_known(measures)}: give what it needs, or "
        "choose a model of another term"
    )


def _of_row(row: ModelRow) -> FragilityModel:
    kept = _rows_before.get(id(row))
    if kept is not None and kept[0] is row:
        return kept[1]
    model = FragilityModel.from_row(row)
    if len(_rows_before) >= _MOST_ROWS:
        _rows_before.clear()
    _rows_before[id(row)] = (row, model)
    return model


def _place(db: str | PathLike[str] | None) -> tuple[Path | str, bool]:
    """Return where the models are, and whether that is the shipped reference."""
    place = locate(db)
    if db is None and not os.environ.get("RBFRAG_DB") and not Path(place).exists():
        shipped = reference_file()
        if shipped is not None:
            return shipped, True
    return place, False


def _named(name: str, db: str | PathLike[str] | None) -> FragilityModel:
    store = _store(db)
    for model in store.models:
        if model.name == name:
            return model
    known = sorted(model.name for model in store.models)
    raise UnknownModelError(unknown_model(name, known, store.place))


def uses_reference(db: str | PathLike[str] | None) -> bool:
    """Return whether the shipped reference answers for want of another database."""
    return _place(db)[1]


def stored_rows(db: str | PathLike[str] | None = None) -> list[ModelRow]:
    """Return the models of a database as they are stored, sorted by name.

    Args:
        db: database, as for :func:`find_model`.

    Raises:
        DatabaseError: the database cannot be read.
    """
    place, _ = _place(db)
    if isinstance(place, Path):
        from rbfrag.db.model_file import read_models

        return read_models(place)
    return _stored_on_server(place)[0]


def _store(db: str | PathLike[str] | None) -> _Store:
    """Return the models of a database; those of a file are read again only when it has changed."""
    named = db if db is not None else os.environ.get("RBFRAG_DB") or None
    if named is None and not _stamp(DEFAULT_NAME, False):
        kept = _unchanged(_SHIPPED, True)
    else:
        kept = _unchanged(DEFAULT_NAME if named is None else os.fspath(named), False)
    if kept is not None:
        return kept
    place, shipped = _place(db)
    if isinstance(place, Path):
        return _unchanged(str(place), shipped) or _read_again(place, shipped)
    rows, label = _stored_on_server(place)
    return _Store(label, (), [_of_row(row) for row in rows if row.kind == "toppling"])


def _unchanged(path: str, shipped: bool) -> _Store | None:
    kept = _stores_before.get((path, shipped))
    return kept if kept is not None and kept.stamp == _stamp(path, shipped) else None


def _read_again(path: Path, shipped: bool) -> _Store:
    from rbfrag.db.model_file import read_models

    key = str(path)
    stamp = _stamp(key, shipped)
    rows = [row for row in read_models(path) if row.kind == "toppling"]
    models = [FragilityModel.from_row(row) for row in rows]
    if shipped:
        models = [replace(model, notes=(FROM_REFERENCE,)) for model in models]
    store = _Store(key, stamp, models)
    if stamp:
        _stores_before[key, shipped] = store
    return store


def _stored_on_server(url: str) -> tuple[list[ModelRow], str]:
    from rbfrag.db.engine import opened_database
    from rbfrag.db.models import model_rows

    with opened_database(url, read_only=True) as engine, engine.connect() as connection:
        return model_rows(connection), str(engine.url)


def _stamp(path: str, shipped: bool) -> _Stamp:
    """Return what tells this content of a file from another: a name alone does not, for a
    relative one means another file in another folder.
    """
    try:
        file = os.stat(path)  # noqa: PTH116  (Path takes ten times as long)
    except OSError:
        return ()
    stamp = (file.st_mtime_ns, file.st_size, file.st_ino, file.st_dev)
    if shipped:  # nobody writes into that one
        return stamp
    try:
        log = os.stat(path + "-wal")  # noqa: PTH116
    except OSError:
        return stamp
    return (*stamp, log.st_mtime_ns, log.st_size)
