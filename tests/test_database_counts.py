"""The last line of a test run says on which databases it ran."""

from __future__ import annotations

from types import SimpleNamespace

from tests.conftest import pytest_terminal_summary


def _line(*properties: list[tuple[str, str]]) -> list[str]:
    reports = [SimpleNamespace(when="call", user_properties=item) for item in properties]
    reports.append(SimpleNamespace(when="setup", user_properties=[("database", "sqlite")]))
    lines: list[str] = []
    reporter = SimpleNamespace(
        getreports=lambda kind: reports if kind == "passed" else [], write_line=lines.append
    )
    pytest_terminal_summary(reporter)
    return lines


def test_tests_are_counted_on_each_database() -> None:
    lite, server = [("database", "sqlite")], [("database", "postgresql")]
    assert _line(lite, server, lite, []) == ["database tests: 2 on SQLite, 1 on PostgreSQL"]
    # a server that was skipped is seen
    assert _line(lite) == ["database tests: 1 on SQLite, 0 on PostgreSQL"]
    assert _line([]) == []
