"""Opening: what is there, what is not, and what is in the way, each in words."""

from __future__ import annotations

import importlib.util
import os
import signal
import socket
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine, func, select, text

import rbfrag.db.engine
import rbfrag.db.location
from rbfrag.db.connect import database_label, sqlalchemy_url
from rbfrag.db.engine import open_database, opened_database, upgrade_database
from rbfrag.db.insert import insert_row
from rbfrag.db.location import VERSION_TABLE, locate
from rbfrag.db.schema import suite
from rbfrag.db.sqlite_file import LONGEST_WAIT_S
from rbfrag.errors import (
    DatabaseBusyError,
    DatabaseError,
    DatabaseNotFoundError,
    DatabaseReadOnlyError,
    InputError,
    MissingExtraError,
    NotADatabaseError,
    SchemaVersionError,
)


def _count(engine: Engine) -> int:
    with engine.connect() as connection:
        return int(connection.scalar(select(func.count()).select_from(suite)) or 0)


def _mark(path: Path, revision: str) -> None:
    raw = sqlite3.connect(path)
    raw.execute("UPDATE rbfrag_revision SET version_num = ?", (revision,))
    raw.commit()
    raw.close()


class TestLocation:
    def test_default_is_in_the_current_folder(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.delenv("RBFRAG_DB", raising=False)
        assert locate(None) == Path("rbfrag.db")

    def test_environment_names_the_default(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("RBFRAG_DB", "elsewhere.db")
        assert locate(None) == Path("elsewhere.db")
        monkeypatch.setenv("RBFRAG_DB", "")
        assert locate(None) == Path("rbfrag.db")

    @pytest.mark.parametrize(
        ("database", "url"),
        [
            ("a b.db", "sqlite:///a b.db"),
            (Path("/x/y.db"), "sqlite:////x/y.db"),
            ("sqlite:////x/y.db", "sqlite:////x/y.db"),
            ("sqlite:///y.db", "sqlite:///y.db"),
            ("sqlite+pysqlite:///y.db", "sqlite:///y.db"),
            ("postgresql://u:p@h:1/n", "postgresql+psycopg://u:p@h:1/n"),
            ("postgres://u@h/n", "postgresql+psycopg://u@h/n"),
        ],
    )
    def test_url(self, database: str | Path, url: str) -> None:
        url_object = sqlalchemy_url(locate(database))
        assert url_object.render_as_string(hide_password=False) == url

    @pytest.mark.parametrize(
        "database",
        [
            "",
            "mysql://h/n",
            "sqlite://",
            "sqlite:///:memory:",
            "sqlite:///x?mode=ro",
            "postgresql://h:port/n",
        ],
    )
    def test_rejected(self, database: str) -> None:
        with pytest.raises(InputError, match="import-a-table" if "mysql" in database else None):
            sqlalchemy_url(locate(database))


class TestCreation:
    def test_a_new_database_is_empty_and_complete(self, engine: Engine) -> None:
        assert _count(engine) == 0

    def test_creating_again_keeps_the_content(self, place: str) -> None:
        with opened_database(place, create=True) as engine, engine.begin() as connection:
            insert_row(connection, suite, {"name": "kept"})
        with opened_database(place, create=True) as engine:
            assert _count(engine) == 1

    def test_nothing_lies_beside_a_closed_database(self, tmp_path: Path) -> None:
        open_database(tmp_path / "x.db", create=True).dispose()
        assert [file.name for file in tmp_path.iterdir()] == ["x.db"]

    def test_an_interrupted_creation_leaves_nothing(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        real = rbfrag.db.engine.migrate

        def interrupted(engine: Engine) -> None:
            real(engine)
            raise KeyboardInterrupt

        monkeypatch.setattr(rbfrag.db.engine, "migrate", interrupted)
        with pytest.raises(KeyboardInterrupt):
            open_database(tmp_path / "x.db", create=True)
        assert list(tmp_path.iterdir()) == []

    def test_a_killed_creation_leaves_no_database(self, tmp_path: Path) -> None:
        path = tmp_path / "x.db"
        code = (
            "import os, signal, sys, rbfrag.db.engine as create\n"
            "from rbfrag.db.engine import open_database\n"
            "real = create.migrate\n"
            "create.migrate = lambda e: (real(e), os.kill(os.getpid(), signal.SIGKILL))\n"
            "open_database(sys.argv[1], create=True)\n"
        )
        process = subprocess.run([sys.executable, "-c", code, str(path)], check=False)
        assert process.returncode == -signal.SIGKILL
        assert not path.exists()
        with opened_database(path, create=True) as engine:
            assert _count(engine) == 0

    def test_the_faster_of_two_creators_is_not_overwritten(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        path = tmp_path / "x.db"
        real = rbfrag.db.engine.migrate

        def overtaken(engine: Engine) -> None:
            monkeypatch.setattr(rbfrag.db.engine, "migrate", real)
            with opened_database(path, create=True) as other, other.begin() as connection:
                insert_row(connection, suite, {"name": "theirs"})
            real(engine)

        monkeypatch.setattr(rbfrag.db.engine, "migrate", overtaken)
        with opened_database(path, create=True) as engine:
            assert _count(engine) == 1
        assert [file.name for file in tmp_path.iterdir()] == ["x.db"]

    def test_without_hard_links(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        def reject(self: Path, target: Path) -> None:
            raise OSError("no links here")

        monkeypatch.setattr(Path, "hardlink_to", reject)
        with opened_database(tmp_path / "x.db", create=True) as engine:
            assert _count(engine) == 0
        assert [file.name for file in tmp_path.iterdir()] == ["x.db"]

    def test_no_folder(self, tmp_path: Path) -> None:
        with pytest.raises(DatabaseNotFoundError, match="create the folder"):
            open_database(tmp_path / "none" / "x.db", create=True)

    def test_a_folder_that_cannot_be_written(self, locked_folder: Any) -> None:
        with locked_folder() as folder, pytest.raises(DatabaseReadOnlyError, match=r"x\.db"):
            open_database(folder / "x.db", create=True)

    def test_signs_with_a_meaning_in_urls(self, tmp_path: Path) -> None:
        path = tmp_path / "a?b#c%20 ü&mode=memory.db"
        open_database(path, create=True).dispose()
        with opened_database(path, read_only=True) as engine:
            assert _count(engine) == 0
        assert [file.name for file in tmp_path.iterdir()] == [path.name]

    def test_rights_are_those_of_any_file(self, tmp_path: Path) -> None:
        path, other = tmp_path / "x.db", tmp_path / "other"
        open_database(path, create=True).dispose()
        other.touch()
        assert path.stat().st_mode == other.stat().st_mode


class TestRefusals:
    def test_missing(self, tmp_path: Path) -> None:
        with pytest.raises(DatabaseNotFoundError, match=r"none\.db.*rbfrag motions add"):
            open_database(tmp_path / "none.db")
        assert list(tmp_path.iterdir()) == []

    def test_below_a_file(self, sqlite_file: Path) -> None:
        with pytest.raises(DatabaseNotFoundError, match="a file, not a folder"):
            open_database(sqlite_file / "x.db")

    @pytest.mark.parametrize("create", [False, True])
    def test_folder(self, tmp_path: Path, create: bool) -> None:
        with pytest.raises(NotADatabaseError, match="is a folder"):
            open_database(tmp_path, create=create)

    def test_a_device(self) -> None:
        with pytest.raises(NotADatabaseError, match="not a regular file"):
            open_database(os.devnull, create=True)

    def test_a_folder_that_cannot_be_entered(self, locked_folder: Any) -> None:
        inner = locked_folder.folder / "inner"
        inner.mkdir()
        with locked_folder():
            inside = inner / "x.db"
            with pytest.raises(DatabaseError, match="denied"):
                open_database(inside, create=True)
            with pytest.raises(DatabaseError, match="denied"):
                open_database(inside)

    @pytest.mark.parametrize("create", [False, True])
    def test_empty_file(self, tmp_path: Path, create: bool) -> None:
        path = tmp_path / "x.db"
        path.touch()
        with pytest.raises(NotADatabaseError, match="is empty"):
            open_database(path, create=create)
        assert path.stat().st_size == 0

    @pytest.mark.parametrize("content", [b"NPTS= 4000", b"SQLite format 3", b"\x00" * 4096])
    def test_another_kind_of_file(self, tmp_path: Path, content: bytes) -> None:
        path = tmp_path / "x.db"
        path.write_bytes(content)
        with pytest.raises(NotADatabaseError, match="is not an SQLite database"):
            open_database(path, create=True)
        assert path.read_bytes() == content

    def test_only_the_magic_is_right(self, tmp_path: Path) -> None:
        path = tmp_path / "x.db"
        path.write_bytes(b"SQLite format 3\x00" + b"\xff" * 2000)
        with pytest.raises(NotADatabaseError):
            open_database(path)

    def test_database_of_another_program(self, tmp_path: Path) -> None:
        path = tmp_path / "x.db"
        raw = sqlite3.connect(path)
        raw.execute("CREATE TABLE motion (id INTEGER)")
        raw.close()
        before = path.read_bytes()
        with pytest.raises(NotADatabaseError, match=r"not (an rbfrag database|of rbfrag)"):
            open_database(path, create=True)
        with pytest.raises(NotADatabaseError, match=r"not (an rbfrag database|of rbfrag)"):
            upgrade_database(path)
        assert path.read_bytes() == before

    def test_newer_schema(self, sqlite_file: Path) -> None:
        _mark(sqlite_file, "9999")
        with pytest.raises(SchemaVersionError, match=r"9999.*install a newer rbfrag"):
            open_database(sqlite_file)
        with pytest.raises(SchemaVersionError, match="install a newer rbfrag"):
            upgrade_database(sqlite_file)

    def test_older_schema(self, sqlite_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(rbfrag.db.location, "REVISIONS", ("0000", "0001"))
        _mark(sqlite_file, "0000")
        with pytest.raises(SchemaVersionError, match=r"test\.db: .* run  rbfrag db upgrade"):
            open_database(sqlite_file)

    def test_damaged_pages(self, sqlite_file: Path) -> None:
        content = sqlite_file.read_bytes()
        sqlite_file.write_bytes(content[:4096] + b"\xaa" * (len(content) - 4096))
        with pytest.raises(DatabaseError, match="damaged"):
            open_database(sqlite_file)

    def test_locked(self, sqlite_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("rbfrag.db.sqlite_file.BUSY_TIMEOUT_S", 0.01)
        other = sqlite3.connect(sqlite_file, isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        try:
            with pytest.raises(DatabaseBusyError, match="locked by another process"):
                open_database(sqlite_file)
            with opened_database(sqlite_file, read_only=True) as reader:
                assert _count(reader) == 0
        finally:
            other.close()

    def test_full_disk(self, sqlite_file: Path) -> None:
        with opened_database(sqlite_file) as engine:
            with engine.begin() as connection:
                connection.exec_driver_sql("PRAGMA max_page_count = 1")
                with pytest.raises(DatabaseError, match="disk is full"):
                    insert_row(connection, suite, {"name": "x" * 100_000})
            assert _count(engine) == 0

    @pytest.mark.parametrize(("options", "limit_s"), [("?connect_timeout=2", None), ("", 2.0)])
    def test_server_that_accepts_and_never_answers(
        self, options: str, limit_s: float | None
    ) -> None:
        pytest.importorskip("psycopg")
        token = LONGEST_WAIT_S.set(limit_s)
        try:
            with socket.create_server(("127.0.0.1", 0)) as silent:
                url = f"postgresql://nobody@127.0.0.1:{silent.getsockname()[1]}/none{options}"
                with pytest.raises(DatabaseNotFoundError, match=r"cannot reach .*timeout"):
                    open_database(url)
        finally:
            LONGEST_WAIT_S.reset(token)

    def test_postgres_without_psycopg(self, monkeypatch: pytest.MonkeyPatch) -> None:
        real = importlib.util.find_spec
        monkeypatch.setattr(
            importlib.util, "find_spec", lambda name: None if name == "psycopg" else real(name)
        )
        with pytest.raises(MissingExtraError, match="postgres"):
            open_database("postgresql://nobody@127.0.0.1:1/none")

    def test_no_server(self) -> None:
        expected = (
            DatabaseNotFoundError if importlib.util.find_spec("psycopg") else MissingExtraError
        )
        with pytest.raises(expected) as caught:
            open_database("postgresql://nobody:secret@127.0.0.1:1/none")
        assert "secret" not in str(caught.value)


class TestReadOnly:
    def test_writes_are_rejected(self, place: str) -> None:
        open_database(place, create=True).dispose()
        with (
            opened_database(place, read_only=True) as engine,
            engine.connect() as connection,
            pytest.raises(DatabaseReadOnlyError),
        ):
            insert_row(connection, suite, {"name": "x"})

    def test_reading_leaves_nothing_behind(self, sqlite_file: Path) -> None:
        with opened_database(sqlite_file, read_only=True) as engine:
            assert _count(engine) == 0
        assert [file.name for file in sqlite_file.parent.iterdir()] == [sqlite_file.name]

    def test_in_a_folder_that_cannot_be_written(self, locked_folder: Any) -> None:
        path = locked_folder.folder / "x.db"
        with opened_database(path, create=True) as engine, engine.begin() as connection:
            insert_row(connection, suite, {"name": "a"})
        with locked_folder():
            assert not os.access(path.parent, os.W_OK, effective_ids=True)
            with opened_database(path, read_only=True) as engine:
                assert _count(engine) == 1
            with pytest.raises(DatabaseReadOnlyError, match="cannot be written"):
                open_database(path)
            with pytest.raises(DatabaseReadOnlyError, match="cannot be written"):
                open_database(path, create=True)

    def test_newer_rows_out_of_reach_are_not_left_out_in_silence(
        self, locked_folder: Any, tmp_path: Path
    ) -> None:
        source = tmp_path / "x.db"
        with opened_database(source, create=True) as engine:
            with engine.begin() as connection:
                insert_row(connection, suite, {"name": "only in the log"})
            for tail in ("", "-wal"):
                copy = locked_folder.folder / f"x.db{tail}"
                copy.write_bytes(source.with_name(f"x.db{tail}").read_bytes())
        with locked_folder() as folder, pytest.raises(DatabaseReadOnlyError, match=r"x\.db-wal"):
            open_database(folder / "x.db", read_only=True)


def test_a_message_never_shows_the_password() -> None:
    from sqlalchemy import make_url

    label = database_label(make_url("postgresql+psycopg://u:secret@h:1/n"))
    assert label == "postgresql://u:***@h:1/n"


def test_two_writers_take_turns(sqlite_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbfrag.db.sqlite_file.BUSY_TIMEOUT_S", 0.01)
    # BEGIN IMMEDIATE: the second waits at its beginning instead of failing in its middle.
    with opened_database(sqlite_file) as engine, engine.begin() as first:
        insert_row(first, suite, {"name": "a"})
        with pytest.raises(DatabaseBusyError):
            open_database(sqlite_file)
    with opened_database(sqlite_file) as engine:
        assert _count(engine) == 1


def test_settings_of_a_writing_connection(sqlite_file: Path) -> None:
    with opened_database(sqlite_file) as engine, engine.connect() as connection:
        pragma = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar()
            for name in ("journal_mode", "foreign_keys", "synchronous")
        }
    assert pragma == {"journal_mode": "wal", "foreign_keys": 1, "synchronous": 2}


def test_a_database_of_two_schemas_is_rejected(place: str) -> None:
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        connection.execute(text(f"DROP TABLE {VERSION_TABLE}"))
        connection.execute(text(f"CREATE TABLE {VERSION_TABLE} (version_num VARCHAR(32))"))
        connection.execute(text(f"INSERT INTO {VERSION_TABLE} VALUES ('0001'), ('0002')"))
    for use in (
        lambda: open_database(place),
        lambda: open_database(place, create=True),
        lambda: upgrade_database(place),
    ):
        with pytest.raises(SchemaVersionError, match=r"has several schema versions, 0001, 0002"):
            use()
