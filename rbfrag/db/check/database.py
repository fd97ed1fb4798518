"""Looking for damage: `rbfrag db check`."""

from __future__ import annotations

import json
from collections.abc import Iterator

from sqlalchemy import Connection, Double, LargeBinary, exists, or_, select
from sqlalchemy.sql.elements import ColumnElement

from rbfrag.db.check.combinations import check_combinations, check_responses
from rbfrag.db.check.finding import FIT_AGAIN, RESTORE, Finding
from rbfrag.db.check.motions import check_motions, check_spectra
from rbfrag.db.insert import table_digests
from rbfrag.db.schema import earthquake, fragility_model, metadata, motion, recording

_GREATEST = 1.7976931348623157e308

ALTERED = "its values are not those that were written: its digest differs"


def check_database(connection: Connection) -> list[Finding]:
    """Return everything that is wrong with a database; an empty list is a clean bill.

    Looks at the file itself (SQLite), references, the samples against their sha256 and their
    intensity measures, toppling spectra, keys against what they are hashes of, brackets,
    y = kr·g/p, the map of intervals, simulations against both, histories, rows that nothing
    refers to, the digest of each row, numbers that are not finite, and the models. Makes no
    simulation.
    """
    findings: list[Finding] = []
    if connection.dialect.name == "sqlite":
        findings += _check_sqlite_file(connection)
    findings += check_numbers(connection)
    findings += check_digests(connection)
    findings += check_motions(connection)
    findings += check_spectra(connection)
    findings += _check_unused(connection)
    findings += check_combinations(connection)
    findings += check_responses(connection)
    findings += _check_models(connection)
    return findings


def _check_sqlite_file(connection: Connection) -> Iterator[Finding]:
    for (line,) in connection.exec_driver_sql("PRAGMA integrity_check"):
        if line != "ok":
            yield Finding("file", "-", str(line), RESTORE)
    for table, row, parent, _ in connection.exec_driver_sql("PRAGMA foreign_key_check"):
        yield Finding(str(table), str(row), f"points to a row of {parent} that is not there")


def _check_unused(connection: Connection) -> Iterator[Finding]:
    no_motion = ~exists().where(motion.c.recording_id == recording.c.id)
    for row_id in connection.scalars(select(recording.c.id).where(no_motion)):
        yield Finding("recording", str(row_id), "no motion belongs to it")
    no_recording = ~exists().where(recording.c.earthquake_id == earthquake.c.id)
    for event_id in connection.scalars(select(earthquake.c.event_id).where(no_recording)):
        yield Finding("earthquake", str(event_id), "no recording belongs to it")


def _check_models(connection: Connection) -> Iterator[Finding]:
    for name, coefficients, covariance in connection.execute(
        select(
            fragility_model.c.name, fragility_model.c.coefficients, fragility_model.c.covariance
        ).order_by(fragility_model.c.name)
    ):
        try:
            n = len(json.loads(coefficients))
            lines = json.loads(covariance)
            if len(lines) != n or any(len(line) != n for line in lines):
                problem = f"the covariance is not {n} by {n}"
                yield Finding("fragility_model", name, problem, FIT_AGAIN)
        except (ValueError, TypeError) as error:
            yield Finding("fragility_model", name, f"cannot be read: {error}", FIT_AGAIN)


def check_digests(connection: Connection) -> Iterator[Finding]:
    """Yield every row whose values were altered after rbfrag wrote it."""
    for name, table in sorted(metadata.tables.items()):
        key = list(table.primary_key.columns)
        columns = [column.name for column in table.c]
        holds_arrays = any(isinstance(column.type, LargeBinary) for column in table.c)
        query = select(table).order_by(*key)
        rows_at_once = 16 if holds_arrays else 1 << 14
        result = connection.execute(query, execution_options={"yield_per": rows_at_once})
        for rows in result.partitions():
            digests = table_digests(table, columns, rows)
            for row, digest in zip(rows, digests, strict=True):
                if row.digest != digest:
                    at = ", ".join(str(row._mapping[column]) for column in key)
                    yield Finding(name, at, ALTERED)


def check_numbers(connection: Connection) -> Iterator[Finding]:
    """Yield every row with a number that is not finite."""
    for name, table in sorted(metadata.tables.items()):
        doubles = [column for column in table.c if isinstance(column.type, Double)]
        if not doubles:
            continue
        key = list(table.primary_key.columns)
        # PostgreSQL sorts NaN above every number; SQLite holds it as NULL.
        wrong: list[ColumnElement[bool]] = [
            or_(column > _GREATEST, column < -_GREATEST) for column in doubles
        ]
        query = select(*key, *doubles).where(or_(*wrong))
        for row in connection.execute(query).mappings():
            bad = [c.name for c in doubles if row[c.name] is not None and not _finite(row[c.name])]
            at = ", ".join(str(row[column.name]) for column in key)
            yield Finding(name, at, f"{', '.join(bad)}: not a finite number")


def _finite(value: float) -> bool:
    return abs(value) <= _GREATEST
