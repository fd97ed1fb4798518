"""Draw docs/figures/architecture.svg from the imports in rbfrag; --check only compares.

Imports are read from the syntax trees, those in functions and under TYPE_CHECKING included. The
modules that one question loads are listed in docs/architecture.md by asking it.
"""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "rbfrag"
FIGURE = ROOT / "docs" / "figures" / "architecture.svg"
PAGE = ROOT / "docs" / "architecture.md"
START, END = "<!-- loaded -->\n", "<!-- end -->\n"

ASK = """
import sys
from rbfrag.cli.main import run
sys.argv = ["rbfrag", "predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6"]
try:
    run()
except SystemExit:
    pass
for name, module in sorted(sys.modules.items()):
    if name.startswith("rbfrag.") and not module.__file__.endswith("__init__.py"):
        print("loaded", name.replace(".", "/") + ".py")
"""

BESIDE = {"rbfrag", "errors", "files", "frames", "threads", "version", "migrations"}
"""What the figure leaves out: the public face, what everybody may import, the schema's steps."""

UNNAMED = {"rbfrag"}
"""What imports by names that its source does not begin: the public names, which its stub lists."""

Graph = Mapping[str, set[str]]


def modules(package: Path = PACKAGE) -> dict[str, Path]:
    """Return the file of every module, by its full name."""
    names = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def module_graph(package: Path = PACKAGE) -> dict[str, set[str]]:
    """Return the modules of the package that each module imports, wherever it does so.

    Of a name that is put together, as ``import_module(f"{__name__}.{kind}")``, all that it may be.

    Raises:
        ValueError: a name that the source does not even begin: nobody can tell what it imports.
    """
    files = modules(package)
    graph = {}
    for name, path in files.items():
        targets: set[str] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                targets.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                # what is imported is a module of that name, or else a name in the module
                for alias in node.names:
                    full = f"{node.module}.{alias.name}"
                    targets.add(full if full in files else str(node.module))
            elif isinstance(node, ast.Call) and _called(node) == "import_module":
                start = _start_of_text(node.args[0], name)
                if not start and name not in UNNAMED:
                    raise ValueError(f"{name} line {node.lineno} imports what it does not name")
                targets.update(other for other in files if start and other.startswith(start))
        if name == "rbfrag":
            stub = path.with_suffix(".pyi").read_text(encoding="utf-8")
            targets.update(re.findall(r"^from (\S+) import \w+ as", stub, re.MULTILINE))
        graph[name] = {target for target in targets if target in files} - {name}
    return graph


def _called(node: ast.Call) -> str:
    return str(getattr(node.func, "id", getattr(node.func, "attr", "")))


def _start_of_text(node: ast.expr, module: str) -> str:
    """Return how a text begins, as far as the source of a module tells: empty for not at all."""
    start = ""
    for part in node.values if isinstance(node, ast.JoinedStr) else [node]:
        value = part.value if isinstance(part, ast.Constant | ast.FormattedValue) else None
        if isinstance(value, ast.Name) and value.id == "__name__":
            start += module
        elif isinstance(value, str):
            start += value
        else:
            break
    return start


def circles(graph: Graph) -> list[list[str]]:
    """Return the groups of modules of which each reaches each by imports."""
    reached = {name: _reach(graph, name) for name in graph}
    groups = {
        tuple(sorted(other for other in reached[name] if name in reached[other]))
        for name in graph
        if name in reached[name]
    }
    return [list(group) for group in sorted(groups)]


def _reach(graph: Graph, start: str) -> set[str]:
    seen: set[str] = set()
    waiting = list(graph[start])
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += graph[name]
    return seen


def package_graph(graph: Graph) -> dict[str, set[str]]:
    """Return the packages of rbfrag that each package imports."""
    packages: dict[str, set[str]] = {}
    for name, targets in graph.items():
        package = _package(name)
        if package not in BESIDE:
            targets_of_package = {_package(target) for target in targets}
            packages.setdefault(package, set()).update(targets_of_package - BESIDE - {package})
    return packages


def _package(name: str) -> str:
    return name.split(".")[1] if "." in name else "rbfrag"


def layers(packages: Graph) -> list[list[str]]:
    """Return the packages from the lowest layer up: each imports from layers below its own.

    What no other package imports stands in the uppermost layer.
    """
    height: dict[str, int] = {}

    def of(name: str) -> int:
        if name not in height:
            height[name] = 1 + max((of(below) for below in packages[name]), default=-1)
        return height[name]

    top = max(of(name) for name in packages)
    used = set().union(*packages.values())
    rows: list[list[str]] = [[] for _ in range(top + 1)]
    for name in sorted(packages):
        rows[height[name] if name in used else top].append(name)
    return rows


def direct(packages: Graph) -> list[tuple[str, str]]:
    """Return the imports that no chain of other imports implies."""
    return [
        (name, target)
        for name in sorted(packages)
        for target in sorted(packages[name])
        if not any(target in _reach(packages, other) for other in packages[name] - {target})
    ]


WIDTH, BOX_WIDTH, BOX_HEIGHT, GAP, ROW = 780, 236, 66, 14, 104
LINE_LENGTH = 40


def drawn() -> str:
    """Return the figure."""
    graph = module_graph()
    packages = package_graph(graph)
    rows = layers(packages)
    place: dict[str, tuple[float, float]] = {}
    edges = direct(packages)
    for level, row in enumerate(rows):
        # each box as near above what it imports as its row allows
        below = {
            name: [place[target][0] for source, target in edges if source == name] for name in row
        }
        centres = {name: sum(x) / len(x) if x else 0.5 * WIDTH for name, x in below.items()}
        middle = centres[row[0]] if len(row) == 1 else 0.5 * WIDTH
        for i, name in enumerate(sorted(row, key=lambda name: (centres[name], name))):
            place[name] = (
                middle + (i - 0.5 * (len(row) - 1)) * (BOX_WIDTH + GAP),
                16 + (len(rows) - 1 - level) * ROW,
            )
    height = 16 + (len(rows) - 1) * ROW + BOX_HEIGHT + 16
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        'font-family="Helvetica, Arial, sans-serif" role="img" aria-labelledby="title">',
        '  <title id="title">The packages of rbfrag and what they import</title>',
        '  <defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0 L10 5 L0 10 z" fill="#1f4e79"/></marker>'
        "</defs>",
        f'  <rect width="{WIDTH}" height="{height}" rx="8" fill="#ffffff"/>',
    ]
    lines += [_arrow(place[name], place[target]) for name, target in edges]
    for name, (x, y) in place.items():
        lines += _box(name, x, y)
    return "\n".join([*lines, "</svg>", ""])


def _arrow(start: tuple[float, float], end: tuple[float, float]) -> str:
    (x, y), (to_x, to_y) = start, end
    y += BOX_HEIGHT
    lean = max(-0.42, min(0.42, (to_x - x) / WIDTH)) * BOX_WIDTH
    x, to_x = x + lean, to_x - lean
    middle = 0.5 * (y + to_y)
    return (
        f'  <path d="M{x:.1f} {y:.1f} C{x:.1f} {middle:.1f} {to_x:.1f} {middle:.1f} {to_x:.1f} '
        f'{to_y - 1:.1f}" fill="none" stroke="#1f4e79" stroke-width="1.6" '
        'marker-end="url(#tip)"/>'
    )


def _box(name: str, x: float, y: float) -> list[str]:
    folder = PACKAGE / name
    purpose = (ast.get_docstring(ast.parse((folder / "__init__.py").read_text())) or "").split("\n")
    inside = sorted(path.parent.name for path in folder.glob("*/__init__.py"))
    lines = [
        f'  <rect x="{x - BOX_WIDTH / 2:.1f}" y="{y:.1f}" width="{BOX_WIDTH}" '
        f'height="{BOX_HEIGHT}" rx="6" fill="#e8f0f8" stroke="#1f4e79" stroke-width="1.4"/>',
        _text(x, y + 18, 15, name, ' font-weight="bold" fill="#1f4e79"'),
    ]
    words = _wrapped(purpose[0].rstrip(".").split(), LINE_LENGTH)
    lines += [_text(x, y + 33 + 13 * i, 11, line) for i, line in enumerate(words)]
    if inside:
        below = y + 34 + 13 * len(words)
        lines.append(_text(x, below, 9.8, " · ".join(inside), ' fill="#666666"'))
    return lines


def _text(x: float, y: float, size: float, words: str, style: str = ' fill="#222222"') -> str:
    return (
        f'  <text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="middle"{style}>'
        f"{words.replace('&', '&amp;')}</text>"
    )


def _wrapped(words: Iterable[str], length: int) -> list[str]:
    lines = [""]
    for word in words:
        if lines[-1] and len(lines[-1]) + 1 + len(word) > length:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def loaded() -> list[str]:
    """Return the files that the question of docs/architecture.md loads, packages' own aside."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    environment.pop("RBFRAG_DB", None)
    # in an empty folder the shipped reference answers
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.run(
            [sys.executable, "-c", ASK],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
    return [line.split()[1] for line in process.stdout.splitlines() if line.startswith("loaded ")]


def page() -> str:
    """Return docs/architecture.md with the modules that are loaded today."""
    before, rest = PAGE.read_text(encoding="utf-8").split(START)
    after = rest.split(END, 1)[1]
    names = loaded()
    lines = "".join(f"- `{name}`\n" for name in names)
    return f"{before}{START}\n{len(names)} modules:\n\n{lines}\n{END}{after}"


def main(arguments: list[str]) -> int:
    """Write figure and list, or say whether they are up to date."""
    status = 0
    for path, text in ((FIGURE, drawn()), (PAGE, page())):
        if "--check" not in arguments:
            path.write_text(text, encoding="utf-8")
        elif not path.exists() or path.read_text(encoding="utf-8") != text:
            print(f"{path} is out of date: run python docs/draw_architecture.py", file=sys.stderr)
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
