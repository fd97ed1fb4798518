"""Looking for damage: `rbfrag db check`."""

from __future__ import annotations

import json
from collections.abc import Iterator

from sqlalchemy import Connection, exists, select

from rbfrag.db.check.combinations import check_combinations
from rbfrag.db.check.finding import FIT_AGAIN, RESTORE, Finding
from rbfrag.db.check.motions import check_motions
from rbfrag.db.check.numbers import check_digests, check_numbers
from rbfrag.db.check.responses import check_responses
from rbfrag.db.check.spectra import check_spectra
from rbfrag.db.schema import earthquake, fragility_model, motion, recording


def check_database(connection: Connection) -> list[Finding]:
    """Return everything that is wrong with a database; an empty list is a clean bill.

    Looks at the file itself (SQLite), references, the samples against their sha256 and their
    intensity measures, toppling spectra, keys against what they are hashes of, brackets,
    y = kr·g/p, the map of intervals, simulations against both, histories, rows that nothing
    refers to, the digest of each row, numbers that are not finite, and the models. Makes no
    simulation.

    Args:
        connection: the database, inside one transaction.
    """
    found: list[Finding] = []
    if connection.dialect.name == "sqlite":
        found += _check_sqlite_file(connection)
    found += check_numbers(connection)
    found += check_digests(connection)
    found += check_motions(connection)
    found += check_spectra(connection)
    found += _check_unused(connection)
    found += check_combinations(connection)
    found += check_responses(connection)
    found += _check_models(connection)
    return found


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
