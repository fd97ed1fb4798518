"""The packages: imports run one way without circles, each library and each kind has its place."""

from __future__ import annotations

import ast
import importlib.util
import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from rbfrag.vocabulary.quantities import MEASURES, QUANTITIES

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "rbfrag"

LEVELS = (
    {"vocabulary"},
    {"results"},
    {"motions"},
    {"solver"},
    {"db"},
    {"fragility"},
    {"question"},
    {"hazards", "rockmasses"},
    {"plots", "exchange", "campaign"},
    {"bench"},
    {"cli", "service"},
)
"""Lowest first: a package imports only from levels below its own."""

MOST_LINES, MOST_PARAMETERS = 120, 10
"""Of a function of the solver."""

FREE_STANDING = {"errors", "files", "frames", "threads", "version"}
"""Top-level modules that every package may import."""

# Alembic runs the migrations on the tables, and the public face names every package.
OUTSIDE_THE_ORDER = {"migrations", "__init__"}

LEVEL_OF = {package: level for level, packages in enumerate(LEVELS) for package in packages}

SOURCES = sorted(PACKAGE.rglob("*.py"))

MOST_FILES = 26
"""A folder that holds more is split into packages (its __init__.py counts)."""

KIND_FILES = (
    "solver/models/",
    "solver/kinds.py",
    "campaign/kinds/",
    "fragility/method.py",
    "fragility/methods/",
    "migrations/",
    "vocabulary/headers.py",
)
"""Where the name of a kind may stand as a string; elsewhere a kind is a value."""


def drawing() -> ModuleType:
    """Return the script that reads the imports and draws the figure of docs/architecture.md."""
    script = ROOT / "docs" / "draw_architecture.py"
    spec = importlib.util.spec_from_file_location("draw_architecture", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


KINDS = {"toppling", "rocking", "sliding", "slumping", "confined_toppling"}
QUOTED_KIND = re.compile(f"['\"]({'|'.join(sorted(KINDS))})['\"]")


def kind_names(source: str) -> list[int]:
    """Return the lines where a string names a kind, or quotes one inside SQL.

    Defaults of arguments, and of fields that are arguments of their class, are set aside with all
    that declares them, and docstrings.
    """
    aside: set[int] = set()
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.arguments):
            defaults = [default for default in (*node.defaults, *node.kw_defaults) if default]
            aside.update(id(part) for default in defaults for part in ast.walk(default))
        elif isinstance(node, ast.ClassDef):
            fields = [part.value for part in node.body if isinstance(part, ast.AnnAssign)]
            aside.update(id(part) for value in fields if value for part in ast.walk(value))
        elif isinstance(node, ast.Expr):
            aside.add(id(node.value))
        elif isinstance(node, ast.keyword) and node.arg in {"help", "epilog"}:
            aside.update(id(part) for part in ast.walk(node.value))
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in aside
        if node.value in KINDS or QUOTED_KIND.search(node.value)
    ]


def package_of(path: Path) -> str:
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


def upward(package: str, names: set[str]) -> set[str]:
    """Of the imported names, those that a module of this package must not import."""
    wrong = set()
    for name in names:
        parts = name.split(".")
        if parts[0] != "rbfrag" or len(parts) == 1:
            continue
        target = parts[1]
        if (
            target == package
            or target in FREE_STANDING
            or (len(parts) == 2 and target == "__version__")
        ):
            continue
        if target == "migrations":
            if package != "db":
                wrong.add(name)
        elif target not in LEVEL_OF or LEVEL_OF[target] >= LEVEL_OF.get(package, -1):
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
    [path for path in SOURCES if package_of(path) not in OUTSIDE_THE_ORDER],
    ids=lambda path: str(path.relative_to(PACKAGE)),
)
def test_imports_run_one_way(path: Path) -> None:
    package = package_of(path)
    names = imported(path.read_text(encoding="utf-8"))
    if package in FREE_STANDING:
        assert {name for name in names if name.startswith("rbfrag.")} <= {
            "rbfrag.errors",
            "rbfrag.errors.InputError",
        }
    else:
        assert upward(package, names) == set()


def test_every_folder_is_a_known_package() -> None:
    folders = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()}
    assert folders - {"migrations"} <= set(LEVEL_OF)
    modules = {path.stem for path in PACKAGE.glob("*.py")}
    assert modules == FREE_STANDING | {"__init__"}
    assert not [p for p in SOURCES if "util" in str(p.relative_to(PACKAGE)).lower()]


@pytest.mark.parametrize(
    ("library", "packages"),
    [
        ("matplotlib", {"plots"}),
        ("sqlite3", {"db"}),
        ("alembic", {"db", "migrations"}),
        ("statsmodels", {"fragility"}),
        ("numba", {"solver"}),
        ("pyarrow", {"exchange"}),
        ("pyogrio", {"exchange"}),
        ("h5py", {"exchange"}),
        ("rasterio", {"exchange"}),
        ("trimesh", {"exchange"}),
        ("typer", {"cli"}),
        ("fastapi", {"service"}),
        ("uvicorn", {"service"}),
        ("prometheus_client", {"service"}),
        ("pebble", {"service"}),
        ("pyslammer", set()),
    ],
)
def test_a_library_stays_in_its_package(library: str, packages: set[str]) -> None:
    users = {
        package_of(path)
        for path in SOURCES
        if library in libraries(imported(path.read_text(encoding="utf-8")))
    }
    assert users == packages


def test_sql_is_written_in_db_only() -> None:
    # Other packages hold open connections, and name their type, but make no statement.
    handles = {"sqlalchemy", "sqlalchemy.Connection", "sqlalchemy.Engine"}
    for path in SOURCES:
        if package_of(path) in {"db", "migrations"}:
            continue
        names = imported(path.read_text(encoding="utf-8"))
        assert {n for n in names if n.split(".")[0] == "sqlalchemy"} <= handles, path


def test_package_files_import_nothing() -> None:
    for path in PACKAGE.glob("*/__init__.py"):
        assert imported(path.read_text(encoding="utf-8")) == set(), path


def test_every_imported_library_is_declared() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    runtime = (
        "plot", "postgres", "parquet", "excel", "gis", "mseed", "hdf5", "dask", "mesh", "service"
    )  # fmt: skip
    declared = [*project["dependencies"]]
    for extra in runtime:
        declared += project["optional-dependencies"][extra]
    # a library is imported by a name without dashes
    names = {line.split(">")[0].split("[")[0].strip().replace("-", "_") for line in declared}
    used = set()
    for path in SOURCES:
        used |= libraries(imported(path.read_text(encoding="utf-8")))
    assert used - set(sys.stdlib_module_names) - {"rbfrag"} <= names


def test_no_imports_run_in_a_circle(tmp_path: Path) -> None:
    script = drawing()
    assert script.circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}) == [["b", "c"]]
    # names that are put together are followed, wherever in a function
    package = tmp_path / "made"
    (package / "kinds").mkdir(parents=True)
    registry = "from importlib import import_module\n"
    registry += 'def named(kind):\n    return import_module(f"{__name__}.{kind}").MODEL\n'
    (package / "kinds" / "__init__.py").write_text(registry)
    (package / "kinds" / "one.py").write_text("from made.kinds import named\n")
    assert script.circles(script.module_graph(package)) == [["made.kinds", "made.kinds.one"]]
    unnamed = registry.replace('f"{__name__}.{kind}"', "kind")
    (package / "kinds" / "__init__.py").write_text(unnamed)
    with pytest.raises(ValueError, match=r"made\.kinds line 3 imports what it does not name"):
        script.module_graph(package)
    assert script.circles(script.module_graph()) == []


def test_the_check_sees_the_name_of_a_kind() -> None:
    seen = 'if kind == "sliding":\n    sql = "where kind = \'toppling\'"\n'
    assert kind_names(seen) == [1, 2]
    unseen = (
        'def f(kind="toppling", *, other="sliding"):\n    "toppling"\n    Option(help="sliding")\n'
    )
    assert kind_names(unseen) == []


def test_kinds_are_named_in_their_files_only() -> None:
    users = {
        name
        for path in SOURCES
        if not (name := path.relative_to(PACKAGE).as_posix()).startswith(KIND_FILES)
        and kind_names(path.read_text(encoding="utf-8"))
    }
    assert users == set()


def words_of_names(source: str) -> set[str]:
    """Return the words of all identifiers of a source."""
    names = (
        getattr(node, part, None)
        for node in ast.walk(ast.parse(source))
        for part in ("id", "attr", "arg", "name", "asname")
    )
    apart = (re.sub("([A-Z])", r"_\1", name) for name in names if isinstance(name, str))
    return {word for name in apart for word in name.lower().split("_")}


def test_the_solver_names_nothing_of_storage() -> None:
    seen = words_of_names("def f(case): return CaseResult(natural_keys=x.campaign)")
    assert seen == {"f", "case", "", "result", "natural", "keys", "x", "campaign"}
    storage = {"case", "cases", "campaign", "campaigns", "combination", "combinations"}
    storage |= {"natural", "database", "stored", "db"}
    for path in (PACKAGE / "solver").rglob("*.py"):
        assert not words_of_names(path.read_text(encoding="utf-8")) & storage, path


def test_no_folder_holds_more_than_a_page_of_files() -> None:
    large = {
        folder.relative_to(PACKAGE).as_posix()
        for folder in {path.parent for path in SOURCES}
        if len(list(folder.glob("*.py"))) > MOST_FILES
    }
    assert large == set()


def test_functions_of_the_solver_can_be_read_at_a_glance() -> None:
    large = set()
    for path in (PACKAGE / "solver").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        # a comment makes a function no longer: kernels state their equations and invariants
        comments = {n for n, line in enumerate(text.split("\n"), 1) if re.match(r" *#", line)}
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                lines = len(set(range(node.lineno, (node.end_lineno or 0) + 1)) - comments)
                inputs = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
                if lines > MOST_LINES or len(inputs) > MOST_PARAMETERS:
                    large.add(node.name)
    # the faces of the solver, whose docstrings say why
    assert large == {"respond", "critical"}


def test_figure_and_walk_of_the_documentation_are_those_of_today(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert drawing().main(["--check"]) == 0, capsys.readouterr().err


OTHER_FACTS = {
    "question/scenario.py": "limits of a published ground-motion model",
}
"""Where a dict maps measures to what is not theirs."""


def facts_of_measures(source: str) -> list[int]:
    """Return the lines of dicts that map a measure to a label, a unit or a limit.

    A value that is a call (of coefficients), a period by its own word, or another name is none.
    """
    lines = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Dict):
            continue
        for key, value in zip(node.keys, node.values, strict=True):
            if not (isinstance(key, ast.Constant) and key.value in MEASURES):
                continue
            parts = value.elts if isinstance(value, ast.Tuple) else [value]
            constants = [part.value for part in parts if isinstance(part, ast.Constant)]
            texts = [constant for constant in constants if isinstance(constant, str)]
            if any(text not in QUANTITIES and "_over_" not in text for text in texts) or (
                isinstance(value, ast.Tuple) and constants and not texts
            ):
                lines.append(node.lineno)
                break
    return lines


def test_facts_of_measures_stand_in_the_vocabulary_only() -> None:
    assert facts_of_measures('a = {"pgv_m_s": "PGV"}\nb = {"pga_g": (0.0, 5.0)}') == [1, 2]
    assert facts_of_measures('a = {"pga_g": pga, "pgv_m_s": x[0]}') == []
    users = {
        name
        for path in SOURCES
        if not (name := path.relative_to(PACKAGE).as_posix()).startswith("vocabulary/")
        and facts_of_measures(path.read_text(encoding="utf-8"))
    }
    assert users == {*OTHER_FACTS}


def percentages(source: str) -> list[int]:
    """Return the lines of f-strings that format a percentage: "{…} %" or "{…:.0%}"."""
    lines = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.JoinedStr):
            continue
        for part, after in zip(node.values, [*node.values[1:], None], strict=True):
            if not isinstance(part, ast.FormattedValue):
                continue
            format_ = "" if part.format_spec is None else ast.unparse(part.format_spec)
            text = after.value if isinstance(after, ast.Constant) else ""
            if "%" in format_ or text.lstrip().startswith("%"):
                lines.append(part.lineno)
    return lines


def test_percentages_are_formatted_in_results_only() -> None:
    assert percentages('f"{100.0 * p:g} %"\nf"{p:.0%} of it"\nf"{100 * p}%"') == [1, 2, 3]
    assert percentages('f"{percent(p)} of {n}"\n"90 %" % p') == []
    users = {
        name
        for path in SOURCES
        if not (name := path.relative_to(PACKAGE).as_posix()).startswith("results/")
        and percentages(path.read_text(encoding="utf-8"))
    }
    assert users == set()
