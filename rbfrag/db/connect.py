"""SQLAlchemy engines of a file or a server; their errors become rbfrag errors."""

from __future__ import annotations

import importlib.util
import sqlite3
from functools import partial
from pathlib import Path
from typing import Any, cast

from sqlalchemy import (
    URL,
    Connection,
    Engine,
    ExceptionContext,
    QueuePool,
    create_engine,
    event,
    exc,
    make_url,
)

from rbfrag.db.ledger import keep_ledger
from rbfrag.db.sqlite_file import LONGEST_WAIT_S, connect_sqlite, explained_sqlite_error
from rbfrag.errors import (
    DatabaseBusyError,
    DatabaseError,
    DatabaseFailedError,
    DatabaseNotFoundError,
    DatabaseReadOnlyError,
    InputError,
    MissingExtraError,
)

CONNECT_TIMEOUT_S = 30.0
"""How long a server may take to answer [s], unless the URL has another ``connect_timeout``."""

_KEEPALIVES = {
    "keepalives_idle": 30, "keepalives_interval": 10, "keepalives_count": 3,
    "tcp_user_timeout": 60_000,
}  # fmt: skip
"""A host that is gone without a word is noticed within a minute."""


def database_label(url: URL) -> str:
    """Return the name of the database for messages: the file, or the URL without its password."""
    if url.get_backend_name() == "sqlite":
        return url.database or ""
    return url.set(drivername="postgresql").render_as_string(hide_password=True)


def raw_sqlite(connection: Connection) -> sqlite3.Connection:
    """Return the sqlite3 connection of an SQLAlchemy connection."""
    return cast(sqlite3.Connection, connection.connection.dbapi_connection)


def unchecked_engine(
    place: Path | str,
    *,
    read_only: bool = False,
    foreign_keys: bool = True,
) -> Engine:
    """Return an engine without checking the database, for checks and migrations.

    Args:
        place: what :func:`rbfrag.db.location.locate` returned.
        foreign_keys: False lets a migration rebuild a table that others point to (SQLite).
    """
    url = sqlalchemy_url(place)
    if isinstance(place, Path):
        engine = _sqlite_engine(url, place, read_only, foreign_keys)
    else:
        engine = _server_engine(url, read_only)
    event.listen(engine, "handle_error", _raise_explained)
    keep_ledger(engine)
    return engine


def _sqlite_engine(url: URL, path: Path, read_only: bool, foreign_keys: bool) -> Engine:
    path = path.absolute()  # the working directory may change while the engine lives

    def connect() -> sqlite3.Connection:
        raw = connect_sqlite(path, read_only=read_only, check_same_thread=False)
        if not foreign_keys:
            raw.execute("PRAGMA foreign_keys = OFF")
        return raw

    engine = create_engine(url, creator=connect, poolclass=QueuePool)
    begin = "BEGIN" if read_only else "BEGIN IMMEDIATE"

    def begin_by_hand(connection: Connection) -> None:
        connection.exec_driver_sql(begin)

    event.listen(engine, "begin", begin_by_hand)
    return engine


def _server_engine(url: URL, read_only: bool) -> Engine:
    if importlib.util.find_spec("psycopg") is None:
        raise MissingExtraError("PostgreSQL databases require psycopg", "postgres")
    longest_s = LONGEST_WAIT_S.get()
    # A host that accepts and never answers would hold the caller for good.
    waits_s = CONNECT_TIMEOUT_S if longest_s is None else min(CONNECT_TIMEOUT_S, longest_s)
    patience = {} if "connect_timeout" in url.query else {"connect_timeout": max(int(waits_s), 2)}
    # A connection that the server closed between two transactions is replaced without a word.
    engine = create_engine(url, pool_pre_ping=True, connect_args={**_KEEPALIVES, **patience})
    event.listen(engine, "do_connect", _connected)
    if longest_s is not None:
        event.listen(engine, "connect", partial(_wait_at_most, longest_s))
    if read_only:
        # All queries of one transaction see the same moment, as SQLite's do.
        return engine.execution_options(postgresql_readonly=True, isolation_level="REPEATABLE READ")
    return engine


def _connected(_dialect: object, _record: object, cargs: Any, cparams: Any) -> Any:
    from rbfrag.db.connection_watchdog import PatientConnection

    return PatientConnection.connect(*cargs, **cparams)


def _wait_at_most(seconds: float, connection: Any, _record: object) -> None:
    """Limit the time that the server waits for a lock or runs a statement."""
    before, connection.autocommit = connection.autocommit, True  # else it ends with a rollback
    for name in ("lock_timeout", "statement_timeout"):
        connection.execute(f"SET {name} = {max(int(1000.0 * seconds), 1)}")
    connection.autocommit = before


def sqlalchemy_url(place: Path | str) -> URL:
    """Return the SQLAlchemy URL of the result of :func:`rbfrag.db.location.locate`."""
    if isinstance(place, Path):
        return URL.create("sqlite", database=str(place))
    try:
        url = make_url(place)
    except (exc.ArgumentError, ValueError):
        raise InputError(
            "db: invalid URL: use the form postgresql://user@host:5432/name",
            fields=("db",),
        ) from None
    return url.set(drivername="postgresql+psycopg")


def _raise_explained(context: ExceptionContext) -> None:
    error = context.original_exception
    url = context.engine.url if context.engine is not None else None
    label = database_label(url) if url is not None else "the database"
    if isinstance(error, sqlite3.Error):
        if not isinstance(error, sqlite3.IntegrityError | sqlite3.ProgrammingError):
            raise explained_sqlite_error(error, label) from error
        return
    silent = type(error).__name__ == "SilentServerError"
    if context.is_pre_ping and not silent:
        return  # the server closed it meanwhile: another one takes its place
    # without a connection it was one that could not be made, and the first
    first = context.dialect.server_version_info is None
    connected = silent or context.connection is not None or not first
    explained = _explained_server_error(error, label, connected=connected)
    if explained is not None:
        raise explained from error


def _explained_server_error(
    error: BaseException, label: str, *, connected: bool
) -> DatabaseError | None:
    # psycopg is an extra: its classes are told by what they carry, not by import.
    state: Any = getattr(error, "sqlstate", None)
    if all(base.__module__.partition(".")[0] != "psycopg" for base in type(error).__mro__):
        return None
    reason = " ".join(str(error).split())
    lost = ("OperationalError", "ConnectionTimeout", "SilentServerError")
    unnamed = state is None and type(error).__name__ in lost
    if unnamed and not connected:
        return DatabaseNotFoundError(
            f"cannot reach {label}: {reason}; check host, port, user and database name"
        )
    if state in ("25006", "42501"):  # read_only_sql_transaction, insufficient_privilege
        return DatabaseReadOnlyError(f"{label} may not be written: {reason}")
    if state in ("55P03", "40P01", "40001"):  # lock_not_available, deadlock, serialization
        return DatabaseBusyError(
            f"{label} is locked by another session; what was finished is kept: run the same "
            f"command again ({reason})"
        )
    # a connection may break before the server can say why, and then has no state
    if unnamed or (state is not None and state[:2] in ("08", "53", "57", "58")):
        return DatabaseFailedError(
            f"{label}: the server gave up: {reason}; what was finished is kept: run the same "
            "command again"
        )
    return None
