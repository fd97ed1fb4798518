"""Locked databases, lost servers and two campaigns at once."""

from __future__ import annotations

import os
import socket
import sqlite3
import stat
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import make_url, text

from benchmarks.database_content import content_digest
from benchmarks.durability import campaign, digest, environment, stored
from rbfrag.campaign.simulate import CampaignProgress, simulate
from rbfrag.db import connection_watchdog
from rbfrag.db.engine import opened_database
from rbfrag.db.merge import merge_databases
from rbfrag.errors import DatabaseBusyError, DatabaseFailedError
from tests.cli.conftest import Rejects, Shell, rejects, shell
from tests.durability.conftest import P2

__all__ = ["rejects", "shell"]


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbfrag.db.sqlite_file.BUSY_TIMEOUT_S", 0.05)


def test_a_locked_database(
    database: Path, impatient: None, shell: Shell, rejects: Rejects, untouched: bytes
) -> None:
    other = sqlite3.connect(database, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    (Path.cwd() / "b.db").write_bytes(untouched)
    try:
        for words in (
            ("simulate", "--jobs", "1", "--db", database),
            ("db", "merge", "b.db", "--db", database),
        ):
            message = rejects(*words, status=1)
            assert "is locked by another process; what was finished is kept" in message
        # readers go on
        assert shell.json("db", "info", "--db", database)["rows"]["combination"] == 0
        assert shell.json("db", "check", "--db", database)["sound"]
    finally:
        other.close()
    assert stored(str(database)) == 0


def test_a_lock_half_way(database: Path, impatient: None, undisturbed: str) -> None:
    other = sqlite3.connect(database, isolation_level=None)

    def lock(progress: CampaignProgress) -> None:
        if progress.completed == 8:
            other.execute("BEGIN IMMEDIATE")

    with pytest.raises(DatabaseBusyError, match="run the same command again"):
        simulate(database, p2=P2, jobs=1, on_progress=lock)
    other.close()
    assert stored(str(database)) == 8
    simulate(database, p2=P2, jobs=1)
    assert digest(str(database)) == undisturbed


@pytest.fixture
def on_server(place: str, tmp_path: Path, untouched: bytes) -> str:
    """The motions on the server of the tests."""
    if "://" not in place:
        pytest.skip("of a server")
    (tmp_path / "motions.db").write_bytes(untouched)
    merge_databases(tmp_path / "motions.db", db=place)
    return place


def _end_sessions(place: str) -> None:
    """Close every other session in this database that works in the same schema."""
    with opened_database(place) as engine, engine.begin() as connection:
        connection.execute(
            text(
                "SELECT pg_terminate_backend(a.pid) FROM pg_stat_activity a JOIN pg_locks l "
                "ON l.pid = a.pid JOIN pg_class c ON c.oid = l.relation "
                "WHERE c.relnamespace = current_schema()::regnamespace "
                "AND a.pid <> pg_backend_pid()"
            )
        )


def test_a_server_that_gives_up_half_way(
    on_server: str, undisturbed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import rbfrag.campaign.simulate as module

    insert = module.insert_combinations
    calls = []

    def interrupted(*arguments: object) -> int:
        process = insert(*arguments)  # type: ignore[arg-type]
        calls.append(process)
        if len(calls) == 3:
            _end_sessions(on_server)  # ours holds locks: it is in its transaction
        return process

    monkeypatch.setattr(module, "insert_combinations", interrupted)
    with pytest.raises(DatabaseFailedError, match="what was finished is kept"):
        simulate(on_server, p2=P2, jobs=1)
    monkeypatch.undo()
    assert stored(on_server) == 8
    simulate(on_server, p2=P2, jobs=1)
    assert digest(on_server) == undisturbed


def test_a_connection_that_breaks_without_a_word(on_server: str) -> None:
    with opened_database(on_server) as engine, engine.connect() as connection:
        connection.execute(text("SELECT 1"))
        raw: Any = connection.connection.driver_connection
        with socket.socket(fileno=os.dup(raw.fileno())) as wire:
            wire.shutdown(socket.SHUT_RDWR)
        with pytest.raises(DatabaseFailedError, match="what was finished is kept"):
            connection.execute(text("SELECT 1"))


def test_a_connection_that_the_server_closed_meanwhile_is_replaced(on_server: str) -> None:
    with opened_database(on_server) as engine:
        with engine.connect() as connection:
            first = connection.scalar(text("SELECT pg_backend_pid()"))
        with opened_database(on_server) as other, other.begin() as connection:
            connection.execute(text("SELECT pg_terminate_backend(:pid)"), {"pid": first})
        with engine.connect() as connection:
            assert connection.scalar(text("SELECT pg_backend_pid()")) != first


def test_two_campaigns_at_once(
    place: str, tmp_path: Path, untouched: bytes, undisturbed: str
) -> None:
    (tmp_path / "motions.db").write_bytes(untouched)
    merge_databases(tmp_path / "motions.db", db=place)
    running = [
        subprocess.Popen(
            campaign(place, p2, 1), env=environment(), stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True,
        )
        for p2 in ("10,1", "1,10")
    ]  # fmt: skip
    for process in running:
        message = process.communicate(timeout=300)
        assert process.returncode == 0, message
    assert stored(place) == 24
    assert digest(place) == undisturbed


def test_what_another_campaign_stores_meanwhile_stays_its_own(
    on_server: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other one, of another processor, commits between the look and the insert of this one.

    SQLite lets no other write between the two.
    """
    import rbfrag.db.campaigns as store

    look = store.known_keys
    met = []
    last_bits = "UPDATE simulation SET theta_n = theta_n * :f"

    def content() -> str:
        with opened_database(on_server) as engine, engine.connect() as connection:
            return content_digest(connection)

    def overtaken(connection: object, keys: object) -> set[str]:
        seen = look(connection, keys)  # type: ignore[arg-type]
        if not met:
            met.append("")
            simulate(on_server, p2=P2, jobs=1)
            with opened_database(on_server) as engine, engine.begin() as other:
                other.execute(text(last_bits), {"f": 1.0 + 4e-16})
            met[0] = content()
        return seen

    monkeypatch.setattr(store, "known_keys", overtaken)
    simulate(on_server, p2=P2, jobs=1)
    assert [content()] == met


class TestUnusable:
    def test_no_server(self, rejects: Rejects) -> None:
        pytest.importorskip("psycopg")
        for words in (
            ("simulate",),
            ("db", "check"),
            ("db", "export", "--out", "out"),
            ("db", "merge", "x.db"),
        ):
            Path("x.db").unlink(missing_ok=True)
            if words[:2] == ("db", "merge"):
                with opened_database("x.db", create=True):
                    pass
            message = rejects(*words, "--db", "postgresql://nobody:secret@127.0.0.1:1/none")
            assert "cannot reach postgresql://nobody:***@127.0.0.1:1/none" in message
            assert "secret" not in message

    def test_a_schema_from_the_future(self, database: Path, rejects: Rejects) -> None:
        raw = sqlite3.connect(database)
        raw.execute("UPDATE rbfrag_revision SET version_num = '9999'")
        raw.commit()
        raw.close()
        before = database.read_bytes()
        for words in (
            ("simulate",), ("motions", "list"), ("db", "check"), ("db", "upgrade"),
            ("db", "export", "--out", "out"), ("fit", "--term", "pgv"),
        ):  # fmt: skip
            message = rejects(*words, "--db", database)
            assert "schema 9999, newer than" in message
            assert "install a newer rbfrag" in message
        assert "install a newer rbfrag" in rejects("db", "merge", database, "--db", "new.db")
        assert not Path("new.db").exists()
        assert database.read_bytes() == before

    @pytest.mark.skipif(os.name == "nt", reason="rights of POSIX")
    def test_a_read_only_file(
        self, database: Path, shell: Shell, rejects: Rejects, tmp_path: Path
    ) -> None:
        was_root = os.geteuid() == 0
        database.chmod(0o444)
        # those that pytest made for its own user alone
        folders = [
            folder
            for folder in (database.parent, *database.parent.parents)
            if not folder.stat().st_mode & stat.S_IXOTH
        ]
        rights = [folder.stat().st_mode for folder in folders]
        for folder in folders:
            folder.chmod(0o555)
        if was_root:
            os.seteuid(65534)
        try:
            assert "cannot be written" in rejects("simulate", "--jobs", "1", "--db", database)
            assert shell.json("db", "check", "--db", database)["sound"]
        finally:
            if was_root:
                os.seteuid(0)
            for folder, mode in zip(folders, rights, strict=True):
                folder.chmod(mode)


@contextmanager
def stalling_proxy(port: int) -> Iterator[tuple[int, threading.Event]]:
    """A port that forwards to another one until an event is set, and then stays open, silent."""
    stalls = threading.Event()
    server = socket.create_server(("127.0.0.1", 0))
    wires = []

    def forward(first: socket.socket, other: socket.socket) -> None:
        with suppress(OSError):
            while data := first.recv(1 << 16):
                if not stalls.is_set():
                    other.sendall(data)

    def accept() -> None:
        with suppress(OSError):
            while True:
                near, _ = server.accept()
                far = socket.create_connection(("127.0.0.1", port))
                wires.extend((near, far))
                for pair in ((near, far), (far, near)):
                    threading.Thread(target=forward, args=pair, daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    try:
        yield server.getsockname()[1], stalls
    finally:
        for wire in (server, *wires):
            wire.close()


def test_a_server_that_falls_silent_is_given_up(
    on_server: str, undisturbed: str, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    monkeypatch.setattr(connection_watchdog, "WARNED_S", 0.5)
    monkeypatch.setattr(connection_watchdog, "ENDED_S", 1.5)
    monkeypatch.setattr(connection_watchdog, "PROBE_S", 2)
    url = make_url(on_server)
    with stalling_proxy(url.port or 5432) as (port, stalls):
        by_proxy = url.set(host="127.0.0.1", port=port).render_as_string(hide_password=False)

        def stall(progress: CampaignProgress) -> None:
            if progress.completed >= 8:
                stalls.set()

        with pytest.raises(DatabaseFailedError, match=r"no answer for .* run the same command"):
            simulate(by_proxy, p2=P2, jobs=1, on_progress=stall)
    assert "takes no other connection" in caplog.text
    assert stored(on_server) >= 8
    simulate(on_server, p2=P2, jobs=1)
    assert digest(on_server) == undisturbed


def test_a_statement_may_take_its_time(on_server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_watchdog, "WARNED_S", 0.3)
    monkeypatch.setattr(connection_watchdog, "ENDED_S", 0.6)
    with opened_database(on_server) as engine, engine.connect() as connection:
        assert connection.scalar(text("SELECT 1 FROM pg_sleep(2)")) == 1
