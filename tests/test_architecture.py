"""The rooms: imports run one way, and each library stays in its own."""

from __future__ import annotations

import ast
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "rbfrag"

LEVELS = (
    {"motions"},
    {"solver"},
    {"db"},
    {"fragility"},
    {"hazards", "rockmasses"},
    {"plots", "exchange", "campaign"},
    {"bench"},
    {"cli", "service"},
)
"""Lowest first: a room imports only from levels below its own."""

FREE = {"errors", "files", "version"}
"""Top-level modules that every room may import."""

# Alembic runs the migrations on the tables, and the public face names every room.
OUTSIDE_THE_ORDER = {"migrations", "__init__"}

LEVEL_OF = {room: level for level, rooms in enumerate(LEVELS) for room in rooms}

SOURCES = sorted(PACKAGE.rglob("*.py"))


def room_of(path: Path) -> str:
    first = path.relative_to(PACKAGE).parts[0]
    return first.removesuffix(".py")


def imported(source: str) -> set[str]:
    """Full names of all modules and names that a source imports, wherever it does so."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide where they point"
            names.add(node.module or "")
            names.update(f"{node.module}.{alias.name}" for alias in node.names)
    return names


def upward(room: str, names: set[str]) -> set[str]:
    """Of the imported names, those that a module of this room must not import."""
    wrong = set()
    for name in names:
        parts = name.split(".")
        if parts[0] != "rbfrag" or len(parts) == 1:
            continue
        target = parts[1]
        if target == room or target in FREE or (len(parts) == 2 and target == "__version__"):
            continue
        if target == "migrations":
            if room != "db":
                wrong.add(name)
        elif target not in LEVEL_OF or LEVEL_OF[target] >= LEVEL_OF.get(room, -1):
            wrong.add(name)
    return wrong


def libraries(names: set[str]) -> set[str]:
    return {name.split(".")[0] for name in names}


def test_the_check_sees_a_wrong_import() -> None:
    assert upward("solver", imported("def f():\n    from rbfrag.db.engine import x")) == {
        "rbfrag.db.engine",
        "rbfrag.db.engine.x",
    }
    assert upward("plots", imported("import rbfrag.campaign.plan")) == {"rbfrag.campaign.plan"}
    assert upward("db", imported("from rbfrag import cli")) == {"rbfrag.cli"}
    assert upward("motions", imported("from rbfrag import predict")) == {"rbfrag.predict"}
    assert upward("cli", imported("from rbfrag.db import rows\nimport rbfrag.errors")) == set()


@pytest.mark.parametrize(
    "path",
    [path for path in SOURCES if room_of(path) not in OUTSIDE_THE_ORDER],
    ids=lambda path: str(path.relative_to(PACKAGE)),
)
def test_imports_run_one_way(path: Path) -> None:
    room = room_of(path)
    names = imported(path.read_text(encoding="utf-8"))
    if room in FREE:
        assert {name for name in names if name.startswith("rbfrag.")} <= {
            "rbfrag.errors",
            "rbfrag.errors.InputError",
        }
    else:
        assert upward(room, names) == set()


def test_every_folder_is_a_known_room() -> None:
    folders = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()}
    assert folders - {"migrations"} <= set(LEVEL_OF)
    modules = {path.stem for path in PACKAGE.glob("*.py")}
    assert modules == FREE | {"__init__"}
    assert not [p for p in SOURCES if "util" in str(p.relative_to(PACKAGE)).lower()]


@pytest.mark.parametrize(
    ("library", "rooms"),
    [
        ("matplotlib", {"plots"}),
        ("sqlite3", {"db"}),
        ("alembic", {"db", "migrations"}),
        ("statsmodels", {"fragility"}),
        ("numba", {"solver"}),
        ("pyarrow", {"exchange"}),
        ("pyogrio", {"exchange"}),
        ("typer", {"cli"}),
        ("fastapi", {"service"}),
        ("uvicorn", {"service"}),
        ("prometheus_client", {"service"}),
        ("pebble", {"service"}),
        ("pyslammer", set()),
    ],
)
def test_a_library_stays_in_its_room(library: str, rooms: set[str]) -> None:
    users = {
        room_of(path)
        for path in SOURCES
        if library in libraries(imported(path.read_text(encoding="utf-8")))
    }
    assert users == rooms


def test_sql_is_written_in_db_only() -> None:
    # Other rooms hold open connections, and name their type, but make no statement.
    handles = {"sqlalchemy", "sqlalchemy.Connection", "sqlalchemy.Engine"}
    for path in SOURCES:
        if room_of(path) in {"db", "migrations"}:
            continue
        names = imported(path.read_text(encoding="utf-8"))
        assert {n for n in names if n.split(".")[0] == "sqlalchemy"} <= handles, path


def test_room_packages_import_nothing() -> None:
    for path in PACKAGE.glob("*/__init__.py"):
        assert imported(path.read_text(encoding="utf-8")) == set(), path


def test_every_imported_library_is_declared() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    runtime = ("plot", "postgres", "parquet", "gis", "dask", "service")
    declared = [*project["dependencies"]]
    for extra in runtime:
        declared += project["optional-dependencies"][extra]
    # a library is imported by a name without dashes
    names = {line.split(">")[0].split("[")[0].strip().replace("-", "_") for line in declared}
    used = set()
    for path in SOURCES:
        used |= libraries(imported(path.read_text(encoding="utf-8")))
    assert used - set(sys.stdlib_module_names) - {"rbfrag"} <= names
