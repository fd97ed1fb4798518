"""Shared fixtures: where the real files and the databases are, and the rule for their absence."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parent.parent

DIALECTS = ("sqlite", "postgresql")
DATABASE = "database"

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def missing(reason: str) -> None:
    """Skip with a reason, or fail where everything must be there."""
    if os.environ.get("RBFRAG_TEST_REQUIRE_FILES"):
        pytest.fail(reason)
    pytest.skip(reason)


def _folder(variable: str, default: str) -> Path:
    folder = Path(os.environ.get(variable) or ROOT / default)
    if folder.is_dir():
        return folder
    missing(f"no real files at {folder}: set {variable} to the folder that holds them")
    return folder


@pytest.fixture(scope="session")
def records_dir() -> Path:
    """Folder of real accelerograms with MANIFEST.csv."""
    return _folder("RBFRAG_TEST_RECORDS", "../shared/motions")


@pytest.fixture(scope="session")
def formats_dir() -> Path:
    """Folder of sample files of other tools."""
    return _folder("RBFRAG_TEST_FORMATS", "../shared/formats")


@pytest.fixture(scope="session")
def cases_dir() -> Path:
    """Folder of field notes, headers and oracles."""
    return _folder("RBFRAG_TEST_CASES", "../shared/cases4")


@pytest.fixture(scope="session")
def shaketable_dir() -> Path:
    """Folder of tests on a shake table (docs/evidence/shake-table.md)."""
    return _folder("RBFRAG_TEST_SHAKETABLE", "../shared/shaketable")


@pytest.fixture(params=DIALECTS)
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """Where a database is to be made: a path, or a schema of its own on a server."""
    request.node.user_properties.append((DATABASE, request.param))
    if request.param == "sqlite":
        yield str(tmp_path / "test.db")
        return
    url = os.environ.get("RBFRAG_TEST_POSTGRES")
    if not url:
        missing("no server: set RBFRAG_TEST_POSTGRES to postgresql://user@host:port/name")
    import psycopg
    from psycopg import sql

    name = sql.Identifier(schema := f"rbfrag_test_{secrets.token_hex(6)}")
    with psycopg.connect(url, autocommit=True) as server:
        server.execute(sql.SQL("CREATE SCHEMA {}").format(name))
        try:
            yield f"{url}?options=-csearch_path%3D{schema}"
        finally:
            server.execute("SET client_min_messages = warning")
            server.execute(sql.SQL("DROP SCHEMA {} CASCADE").format(name))


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say how many tests ran on which database: a suite that skipped one must not look green."""
    passed = [
        value
        for report in terminalreporter.getreports("passed")
        if report.when == "call"
        for name, value in report.user_properties
        if name == DATABASE
    ]
    if passed:
        counts = {dialect: passed.count(dialect) for dialect in DIALECTS}
        terminalreporter.write_line(
            f"database tests: {counts['sqlite']} on SQLite, {counts['postgresql']} on PostgreSQL"
        )
