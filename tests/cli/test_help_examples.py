"""The example of every command's help runs, and what it prints begins with a sentence."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from rbfrag.cli.main import app
from tests.exchange.openquake_job import write_job
from tests.exchange.test_shakemap_grid import GRID
from tests.synthetic import shaking, write_at2

ROOT = Path(__file__).parents[2]

ELSEWHERE = {
    "bench": "tests/benchmarks/test_bench.py: it takes most of a minute",
    "demo": "tests/docs/test_console_blocks.py runs it",
    "serve": "tests/service: it runs until it is stopped",
}
"""Commands whose examples other tests run."""

FIRST = ("motions add", "simulate", "fit")
"""What fills the database that the others read."""

NO_SENTENCE = {
    "models list": "--json", "motions list": "--json", "motions export": "the file",
    "motions rotate": "the file",
    "db upgrade": "the schema", "db info": "--by suite: a table", "db check": "counts",
    "db export": "counts of rows", "db merge": "counts of rows",
    "db import": "counts of rows", "models default": "the model",
    "models check": "a table", "export nrml": "the file", "export pelicun": "the file",
    "motions add": "counts", **{f"plot {name}": "the file" for name in (
        "fit", "chart", "critical", "curve", "sensitivity", "calibration", "vertical", "spectrum",
        "response", "modes", "rotation", "planes",
    )},
}  # fmt: skip
"""Commands whose example prints something else, and what."""


def examples() -> Iterator[tuple[str, str]]:
    """Yield each command with the words after `rbfrag` of its example."""

    def walk(command: Any, words: tuple[str, ...]) -> Iterator[tuple[str, str]]:
        if hasattr(command, "list_commands"):
            for name in command.list_commands(None):
                yield from walk(command.get_command(None, name), (*words, name))
            if not words:
                return
        (line,) = re.findall(r"Example:  rbfrag (.*)", command.epilog or "none")
        if not hasattr(command, "list_commands"):
            yield " ".join(words), line

    yield from walk(typer.main.get_command(app), ())


EXAMPLES = dict(examples())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the examples name, and a database of a small campaign."""
    place = tmp_path_factory.mktemp("examples")
    write_at2(place / "record.AT2", shaking(3))
    records = place / "records"
    records.mkdir()
    for i in range(12):
        component, factor = (("090", 1.0), ("000", 0.8), ("UP", 0.3))[i % 3]
        write_at2(
            records / f"record{i}.AT2", factor * shaking(i), event=f"EVENT {i // 3}",
            station=f"S{i // 3}", component=component,
        )  # fmt: skip
    lines = [f"record{i}.AT2,event {i // 3},{str(i % 3 == 2).lower()},{i // 3}" for i in range(12)]
    header = "file,event_id,is_vertical,companion_group"
    (records / "META.csv").write_text("\n".join([header, *lines]))
    (place / "grid.xml").write_text(GRID.replace(" 10 5", " 60 40"))
    x = np.geomspace(0.01, 10.0, 20)
    rows = [f"{a!r},{b!r}" for a, b in zip(x.tolist(), (1e-3 * x**-2).tolist(), strict=True)]
    (place / "pgv-curve.csv").write_text("\n".join(["pgv_m_s,annual_rate", *rows]))
    write_job(place / "FOLDER")
    (place / "blocks.csv").write_text("block_id,site_id,p2_1_s2,kr\na,0012,3,0.1\n")
    names = "motion,event,p2,pga_g,pgv_m_s,pgd_m,kr"
    (place / "critical.csv").write_text(f"{names}\na,e,3,0.3,0.4,0.1,0.05\n")
    columns = "\n".join(f'{name} = "{name}"' for name in names.split(","))
    (place / "map.toml").write_text(f"[columns]\n{columns}\n")
    for name in ("rockmass.toml", "mass.toml"):
        shutil.copy(ROOT / "docs" / "examples" / "rockmass.toml", place / name)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        patch.delenv("RBFRAG_DB", raising=False)
        for name in FIRST:
            result = CliRunner().invoke(app, shlex.split(EXAMPLES[name]))
            assert result.exit_code == 0, (name, result.stdout, result.stderr, result.exception)
        for name in ("old.db", "ours.db", "theirs.db"):
            shutil.copy("rbfrag.db", name)
    return place


@pytest.mark.parametrize("name", sorted(EXAMPLES.keys() - ELSEWHERE - {*FIRST}))
def test_the_example_runs(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    result = CliRunner().invoke(app, shlex.split(EXAMPLES[name]))
    assert result.exit_code == 0, (result.stdout, result.stderr, result.exception)
    first = result.stdout.partition("\n")[0]
    assert " " in first or name in NO_SENTENCE, first


def test_lists_of_exceptions_name_commands() -> None:
    assert {*ELSEWHERE, *FIRST, *NO_SENTENCE} <= EXAMPLES.keys()
