"""Check of a database for damage: `rbfrag db check`."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from sqlalchemy import (
    Boolean,
    Connection,
    Double,
    Integer,
    LargeBinary,
    Text,
    exists,
    func,
    literal_column,
    or_,
    select,
)
from sqlalchemy.sql.elements import ColumnElement

from rbfrag.db.check_results import (
    ACCEPT,
    COMPUTE_AGAIN,
    FIT_AGAIN,
    RESTORE,
    Damage,
    check_combinations,
    check_responses,
    check_shock_pairs,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import keep_writers_out, table_digests
from rbfrag.db.ledger import (
    note_sound,
    renew_ledger,
    stored_tallies,
    written_tallies,
)
from rbfrag.db.model_file import STORED, decode_model
from rbfrag.db.motion_spectra import PEAKS_ERROR, HorizontalPair, pair_rows
from rbfrag.db.motions import load_motion, measures_of, same_measure
from rbfrag.db.schema import (
    ORDINATES,
    earthquake,
    fragility_model,
    metadata,
    motion,
    motion_spectrum,
    recording,
    recording_spectrum,
    toppling_spectrum,
)
from rbfrag.db.sqlite_file import LONGEST_WAIT_S
from rbfrag.errors import DatabaseError, InputError, RbfragError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.toppling_spectrum import toppling_spectrum as spectrum_of
from rbfrag.solver.results import NUMERICS_VERSION

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

# Sums over some 1e5 samples, in another order on another processor.
_ROUNDING_OF_SUMS = 1e-9

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
    checks = (
        check_digests, check_motions, check_spectra, check_recording_spectra, _check_unused,
        check_combinations, check_responses, check_shock_pairs, _check_models, check_ledger,
    )  # fmt: skip
    of_sqlite = (_check_sqlite_file, _check_types) if connection.dialect.name == "sqlite" else ()
    for check in (*of_sqlite, *checks):
        try:
            for finding in check(connection):
                findings.append(finding)  # noqa: PERF402  # one by one: a later row may break off
        except (*_DAMAGE, RbfragError) as error:
            name = check.__name__.removeprefix("_").removeprefix("check_")
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
        "id by the digest of its row; samples and measures of "
        f"{connection.scalar(samples)} motions; spectra, keys, brackets, maps, histories, models; "
        "rows deleted, added, or altered with their digest by another program, by the ledger"
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
            digests: Sequence[int | None] = []
            try:
                digests = table_digests(table, columns, rows)
            except _DAMAGE:  # a row has a value of another type than its column: find it
                for row in rows:
                    try:
                        digests = [*digests, *table_digests(table, columns, [row])]
                    except _DAMAGE:
                        digests = [*digests, None]
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


def check_ledger(connection: Connection) -> Iterator[Damage]:
    """Yield the tables whose rows differ from those rbfrag wrote, by campaign."""
    written, stored = written_tallies(connection), stored_tallies(connection)
    for key in sorted(written.keys() | stored.keys()):
        (number, digests), (there, stored_digests) = (
            written.get(key, (0, 0)),
            stored.get(key, (0, 0)),
        )
        if (number, digests) == (there, stored_digests):
            continue
        table, campaign = key
        if there < number:
            problem = "rows were deleted by another program"
        elif there > number:
            problem = "rows were added by another program"
        else:
            problem = "rows were replaced, or altered together with their digests"
        problem += f": {number} were written, {there} are there"
        yield Damage(table, f"campaign {campaign}" if campaign else "-", problem, ACCEPT)


def accept_rows(db: str | os.PathLike[str] | None = None) -> list[Damage]:
    """Accept the present rows as complete; return the differences.

    Args:
        db: the database (path, URL, or None for the default).

    Raises:
        DatabaseError: it cannot be written.
    """
    with opened_database(db) as engine, engine.begin() as connection:
        keep_writers_out(connection)
        differed = list(check_ledger(connection))
        renew_ledger(connection)
    return differed


def mark_sound(db: str | os.PathLike[str] | None, time: str) -> None:
    """Record that a check found nothing; skipped if the database is not writable."""
    token = LONGEST_WAIT_S.set(1.0)
    try:
        with suppress(DatabaseError), opened_database(db) as engine, engine.begin() as connection:
            note_sound(connection, time)
    finally:
        LONGEST_WAIT_S.reset(token)


def check_motions(connection: Connection) -> Iterator[Damage]:
    """Yield damage of motions: bytes, SHA-256 and recomputed intensity measures."""
    ids = list(connection.scalars(select(motion.c.id).order_by(motion.c.id)))
    for row_id in ids:  # one at a time: the samples of all may not fit into memory
        row = connection.execute(select(motion).where(motion.c.id == row_id)).mappings().one()
        stored = connection.execute(select(motion_spectrum).filter_by(motion_id=row_id))
        for problem in _motion_problems(row, stored.mappings().first()):
            file = row["source_file"] or "the file of its record"
            advice = f"restore the database from a backup, or add {file} to a new database"
            yield Damage("motion", str(row_id), problem, advice)


def _motion_problems(row: Any, spectrum: Any) -> Iterator[str]:
    for column in ("flags", "remarks", "processing_applied"):
        try:
            value = json.loads(row[column] or "{}")
            if column != "processing_applied" and not isinstance(value, list):
                yield f"its {column} are no JSON list"
        except (ValueError, RecursionError) as error:
            yield f"its {column} cannot be read: {error}"
    if row["processing_applied"] is None and row["source_sha256"] != row["samples_sha256"]:
        yield "its samples are not those of the file, yet no processing is said to be applied"
    samples = row["samples"]
    if samples is None:
        return
    if len(samples) != 8 * row["npts"]:
        yield f"holds {len(samples)} bytes, not 8 x {row['npts']}"
    elif hashlib.sha256(samples).hexdigest() != row["samples_sha256"]:
        yield "the samples do not match their sha256"
    else:
        try:
            record = GroundMotion(np.frombuffer(samples, dtype="<f8").astype(float), row["dt_s"])
            measures = measures_of(record)
        except InputError as error:
            yield f"the samples are not an accelerogram: {error}"
            return
        for name, now in measures.items():
            if not same_measure(name, row[name], now, record.pgv_m_s, record.pgd_m):
                yield f"{name} is {row[name]!r}, the samples give {now!r}"
        for name, ordinate in zip(ORDINATES, record.spectrum_g, strict=True):
            there = None if spectrum is None else spectrum[name]
            if not same_measure(name, there, ordinate, 0.0, 0.0):
                yield f"{name} of motion_spectrum is {there!r}, the samples give {ordinate!r}"


def check_recording_spectra(connection: Connection) -> Iterator[Damage]:
    """Yield every RotD50 and RotD100 that its two motions do not reproduce."""
    for row in connection.execute(select(recording_spectrum)).mappings().all():
        pair = HorizontalPair(row["motion_id"], row["other_motion_id"])
        try:
            again = pair_rows(pair, *(load_motion(connection, number) for number in pair))
        except RbfragError:
            continue  # its own finding, or no samples
        now = next((rows for rows in again if rows["percentile"] == row["percentile"]), {})
        for name, value in now.items() or {"pga_g": None}.items():
            if value is None or not math.isclose(row[name], value, rel_tol=PEAKS_ERROR):
                at = f"motions {pair.motion_id} and {pair.other_motion_id}, RotD{row['percentile']}"
                problem = f"{name} is {row[name]!r}, the motions give {value!r}"
                yield Damage("recording_spectrum", at, problem, COMPUTE_AGAIN)


def check_spectra(connection: Connection) -> Iterator[Damage]:
    """Yield every X(p) of the present numerics that its motion does not reproduce."""
    column = toppling_spectrum.c
    query = (
        select(column.motion_id, column.polarity, column.p2, column.x_m_s)
        .join(motion)
        .where(column.numerics_version == NUMERICS_VERSION, motion.c.samples.is_not(None))
        .order_by(column.motion_id, column.polarity, column.p2)
    )
    by_motion: dict[int, dict[Polarity, list[tuple[float, float]]]] = defaultdict(
        lambda: defaultdict(list)
    )
    for motion_id, polarity, p2, x_m_s in connection.execute(query):
        by_motion[motion_id][polarity].append((p2, x_m_s))
    for motion_id, by_polarity in by_motion.items():
        try:
            record = load_motion(connection, motion_id)
        except RbfragError:
            continue  # its own finding
        for polarity, values in by_polarity.items():
            again = spectrum_of(record, [p2 for p2, _ in values], polarity)
            for (p2, stored), now in zip(values, again.tolist(), strict=True):
                if not math.isclose(stored, now, rel_tol=_ROUNDING_OF_SUMS, abs_tol=1e-15):
                    row = f"motion {motion_id}, {polarity}, p2 {p2:g}"
                    problem = f"X(p) is {stored!r} m/s, the motion gives {now!r} m/s"
                    yield Damage("toppling_spectrum", row, problem, COMPUTE_AGAIN)
