"""Check of a database for damage: `rbfrag db check`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from sqlalchemy import (
    Boolean,
    Connection,
    Double,
    Integer,
    LargeBinary,
    Table,
    Text,
    exists,
    func,
    literal_column,
    or_,
    select,
)
from sqlalchemy.sql.elements import ColumnElement

from rbfrag.db.check.combinations import check_combinations
from rbfrag.db.check.damage import FIT_AGAIN, RESTORE, Damage
from rbfrag.db.check.inputs import check_responses, check_shock_pairs
from rbfrag.db.check.ledger import check_ledger
from rbfrag.db.check.motions import check_motions, check_spectra
from rbfrag.db.insert import table_digests
from rbfrag.db.ledger import has_ledger
from rbfrag.db.model_file import STORED, decode_model
from rbfrag.db.schema import earthquake, fragility_model, metadata, motion, recording
from rbfrag.errors import DatabaseError, RbfragError

NOT_COVERED = ("id",)
"""Columns of which nothing tells whether they were altered: row numbers that nothing refers to."""

_DAMAGE = (ValueError, TypeError, ArithmeticError, LookupError, AttributeError, RecursionError)
"""What a value of another type than its column's can raise somewhere."""

_STORAGE: Mapping[type, tuple[str, ...]] = {
    Double: ("real", "integer", "null"),
    Integer: ("integer", "null"),
    Boolean: ("integer", "null"),
    Text: ("text", "null"),
    LargeBinary: ("blob", "null"),
}
"""What SQLite may hold in a column of each type; it takes anything anywhere."""

_OF_ROWS = {
    True: "rows deleted, added, or altered with their digest by another program, by the ledger",
    False: "not covered, for this database is of before the ledger: whole rows that were deleted, "
    "and values altered together with their digest; rbfrag db upgrade adds the ledger",
}

ALTERED = "its values are not those that were written: its digest differs"


def check_database(connection: Connection) -> list[Damage]:
    """Return all damage of a database; an empty list if there is none.

    Looks at the file itself (SQLite), references, the samples against their sha256 and their
    intensity measures, toppling spectra, keys against what they are hashes of, brackets,
    y = kr·g/p, the map of intervals, simulations against both, histories, rows that nothing
    refers to, the digest of each row, rows deleted or added by other programs, numbers that are
    not finite, and the models. Makes no simulation.
    """
    findings: list[Damage] = []
    of_sqlite = (_check_sqlite_file, _check_types) if connection.dialect.name == "sqlite" else ()
    for look in (*of_sqlite, *_LOOKS):
        try:
            for finding in look(connection):
                findings.append(finding)  # noqa: PERF402  # one by one: a later row may break off
        except (*_DAMAGE, RbfragError) as error:
            name = look.__name__.removeprefix("_").removeprefix("check_")
            problem = f"the check of {name} broke off ({type(error).__name__}: {error})"
            findings.append(Damage("database", "-", problem))
    return findings


def coverage(connection: Connection) -> str:
    """Describe what :func:`check_database` covers and what it cannot detect."""
    rows = sum(
        connection.scalar(select(func.count()).select_from(table)) or 0
        for table in metadata.tables.values()
    )
    samples = select(func.count()).where(motion.c.samples.is_not(None))
    return (
        f"{rows} rows of {len(metadata.tables)} tables, each column but "
        f"{', '.join(NOT_COVERED)} by the digest of its row; samples and measures of "
        f"{connection.scalar(samples)} motions; spectra, keys, brackets, maps, histories, models; "
        f"{_OF_ROWS[has_ledger(connection)]}"
    )


def _check_sqlite_file(connection: Connection) -> Iterator[Damage]:
    for (line,) in connection.exec_driver_sql("PRAGMA integrity_check"):
        if line != "ok":
            yield Damage("file", "-", str(line), RESTORE)
    for table, row, parent, _ in connection.exec_driver_sql("PRAGMA foreign_key_check"):
        yield Damage(str(table), str(row), f"points to a row of {parent} that is not there")


def _check_unused(connection: Connection) -> Iterator[Damage]:
    no_motion = ~exists().where(motion.c.recording_id == recording.c.id)
    for row_id in connection.scalars(select(recording.c.id).where(no_motion)):
        yield Damage("recording", str(row_id), "no motion belongs to it")
    no_recording = ~exists().where(recording.c.earthquake_id == earthquake.c.id)
    for event_id in connection.scalars(select(earthquake.c.event_id).where(no_recording)):
        yield Damage("earthquake", str(event_id), "no recording belongs to it")


def _check_models(connection: Connection) -> Iterator[Damage]:
    columns = [fragility_model.c[name] for name in STORED]
    for row in connection.execute(select(*columns).order_by(fragility_model.c.name)):
        try:
            model = decode_model(row)
        except DatabaseError as error:
            yield Damage("fragility_model", row.name, str(error), FIT_AGAIN)
            continue
        n = len(model.coefficients)
        if len(model.covariance) != n or any(len(line) != n for line in model.covariance):
            problem = f"the covariance is not {n} by {n}"
            yield Damage("fragility_model", row.name, problem, FIT_AGAIN)


def check_digests(connection: Connection) -> Iterator[Damage]:
    """Yield every row altered after rbfrag wrote it, or with a non-finite number."""
    for name, table in sorted(metadata.tables.items()):
        key = list(table.primary_key.columns)
        columns = [column.name for column in table.c]
        doubles = [i for i, column in enumerate(table.c) if isinstance(column.type, Double)]
        holds_arrays = any(isinstance(column.type, LargeBinary) for column in table.c)
        query = select(table).order_by(*key)
        rows_at_once = 16 if holds_arrays else 1 << 14
        result = connection.execute(query, execution_options={"yield_per": rows_at_once})
        for rows in result.partitions():
            digests: Sequence[int | None]
            try:
                digests = table_digests(table, columns, rows)
            except _DAMAGE:
                digests = [_digest_or_none(table, columns, row) for row in rows]
            for row, digest in zip(rows, digests, strict=True):
                problems = [] if row.digest == digest else [ALTERED]
                bad = [
                    columns[i]
                    for i in doubles
                    if isinstance(row[i], float) and not math.isfinite(row[i])
                ]
                if bad:
                    problems.append(f"{', '.join(bad)}: not a finite number")
                at = ", ".join(str(row._mapping[column]) for column in key) if problems else ""
                for problem in problems:
                    yield Damage(name, at, problem)


def _digest_or_none(table: Table, columns: Sequence[str], row: Sequence[object]) -> int | None:
    """Return the digest of a row; None if a value has another type than its column."""
    try:
        return table_digests(table, columns, [row])[0]
    except _DAMAGE:
        return None


def _check_types(connection: Connection) -> Iterator[Damage]:
    """Yield values of another type than their column, which SQLite allows."""
    for name, table in sorted(metadata.tables.items()):
        key: list[ColumnElement[object]] = [
            literal_column(column.name) for column in table.primary_key.columns
        ]
        for column in table.c:
            kinds = next(_STORAGE[kind] for kind in _STORAGE if isinstance(column.type, kind))
            wrong: ColumnElement[bool] = func.typeof(column).not_in(kinds)
            if isinstance(column.type, Boolean):  # read as true, and yet not equal to it
                wrong = or_(wrong, literal_column(column.name).not_in((0, 1)))
            for row in connection.execute(select(*key).select_from(table).where(wrong)):
                yield Damage(name, ", ".join(map(str, row)), f"{column.name}: of another type")


_LOOKS = (
    check_digests,
    check_motions,
    check_spectra,
    _check_unused,
    check_combinations,
    check_responses,
    check_shock_pairs,
    _check_models,
    check_ledger,
)
