"""A field or measure that is declared in one line is known to every interface and to the docs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import rbfrag

PACKAGE = Path(rbfrag.__file__).parent
LINES = {
    "failure": '        Quantity("hardness", "Rebound hardness of the rock", "MPa", '
    'input=Input(aliases=("rebound",))),\n',
    "measures": '        Quantity("csi_g", "Characteristic intensity", "g", "CI", NOT_NEGATIVE, '
    'Input(), measure=Measure("intensity", power=1), credible=(0.0, 5.0, "larger than recorded"), '
    'stored="characteristic intensity of the record"),\n',
}
"""A line by the group of quantities that it is added to."""

COLUMNS = 'MEASURES = ("pga_g", '
"""The columns of stored measures in the schema begin so."""

INPUTS = """
import json, sys
import numpy as np
import rbfrag
from fastapi.testclient import TestClient
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from rbfrag.db.location import REFERENCE

single = rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, hardness=40.0)
many = rbfrag.predict(np.array([3.0, 3.0]), 0.1, pgv_m_s=0.6, hardness=40.0)
shape = rbfrag.predict(height_m=2.0, width_m=0.4, pgv_m_s=0.6, hardness=40.0)
app = make_app(ServiceSettings(db=str(REFERENCE)))
vocabulary = TestClient(app).get("/v1/vocabulary").json()["quantities"]
print(json.dumps({
    "same": single.probability == rbfrag.predict(3.0, 0.1, pgv_m_s=0.6).probability,
    "warnings": [single.warnings, many.warnings, shape.warnings],
    "help": rbfrag.predict.__doc__,
    "schema": json.dumps(app.openapi()),
    "vocabulary": {each["name"]: each for each in vocabulary},
}))
"""


def declared(source: str) -> str:
    """Return the vocabulary with the additional lines."""
    for group, line in LINES.items():
        head, mark, rest = source.partition(f'    "{group}": (\n')
        assert mark
        source = f"{head}{mark}{line}{rest}"
    return source


def with_column(source: str) -> str:
    """Return the schema with a column of the additional measure."""
    assert COLUMNS in source
    return source.replace(COLUMNS, f'{COLUMNS}"csi_g", ')


def copy_package(folder: Path, changes: dict[str, Callable[[str], str]]) -> Path:
    """Link the package into a folder, with changed copies of some modules; return the folder."""
    package = folder / "rbfrag"
    package.mkdir()
    changed = {name.partition("/")[0] for name in changes}
    for path in PACKAGE.iterdir():
        if path.name not in changed:
            (package / path.name).symlink_to(path)
            continue
        (package / path.name).mkdir()
        for module in path.iterdir():
            name = f"{path.name}/{module.name}"
            if name in changes:
                text = module.read_text(encoding="utf-8")
                (package / name).write_text(changes[name](text), encoding="utf-8")
            elif module.name != "__pycache__":
                (package / name).symlink_to(module)
    return folder


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a package with two more lines: an input and an intensity measure."""
    folder = tmp_path_factory.mktemp("declared")
    return copy_package(folder, {"vocabulary/quantities.py": declared})


def run(folder: Path, *arguments: str) -> str:
    process = subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200"},
    )  # fmt: skip
    assert process.returncode == 0, process.stderr
    return process.stdout + process.stderr


def test_python_and_requests_know_it(copied: Path) -> None:
    answer = json.loads(run(copied, "-c", INPUTS).partition("\n")[0])  # the service logs below
    assert answer["same"]
    for warnings in answer["warnings"]:
        assert "hardness is ignored: no model uses it" in warnings
    assert answer["schema"].count("Rebound hardness of the rock [MPa]") >= 2  # GET and POST
    assert "``hardness``: Rebound hardness of the rock [MPa]" in answer["help"]
    field, measure = (answer["vocabulary"][name] for name in ("hardness", "csi_g"))
    assert (field["label"], field["unit"]) == ("Rebound hardness of the rock", "MPa")
    assert (measure["parameters"], measure["symbol"], measure["group"]) == (
        ["csi"], "CI", "measures",
    )  # fmt: skip


def test_the_shell_and_its_tables_know_it(copied: Path) -> None:
    assert "Rebound hardness of the rock [MPa]" in run(
        copied, "-m", "rbfrag.cli.main", "predict", "--help-all"
    )
    document = run(
        copied, "-m", "rbfrag.cli.main", "predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6",
        "--hardness", "40",
    )  # fmt: skip
    assert "ignored: no model uses it" in document
    (copied / "blocks.csv").write_text("p2,kr,PGV [cm/s],Rebound [MPa]\n3,0.1,60,40\n")
    document = run(copied, "-m", "rbfrag.cli.main", "predict", "--blocks", "blocks.csv")
    assert "column ignored: Rebound [MPa]" in document


MEASURED = """
import json, rbfrag
from rbfrag.fragility.measures import AMPLIFIED, CREDIBLE, MEASURES
single = rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, csi_g=7.0)
print(json.dumps({
    "warnings": single.warnings, "help": rbfrag.predict.__doc__, "power": AMPLIFIED["csi_g"],
    "known": "csi_g" in MEASURES and "csi_g" in CREDIBLE,
}))
"""


def test_a_measure_is_a_line_too(copied: Path) -> None:
    answer = json.loads(run(copied, "-c", MEASURED))
    assert answer["known"]
    assert answer["power"] == 1
    assert any("csi_g was not used" in text for text in answer["warnings"])
    assert "csi_g = 7 g is larger than recorded" in answer["warnings"]
    assert "``csi_g``: Characteristic intensity [g]" in answer["help"]
    document = run(copied, "-m", "rbfrag.cli.main", "predict", "--help-all")
    assert "--csi" in document
    (copied / "csi.csv").write_text("p2,kr,PGV [cm/s],csi [%g]\n3,0.1,60,40\n")
    document = run(copied, "-m", "rbfrag.cli.main", "predict", "--blocks", "csi.csv", "--json")
    assert "csi" in document


def test_a_stored_measure_is_its_column_in_addition(tmp_path: Path) -> None:
    folder = copy_package(
        tmp_path, {"vocabulary/quantities.py": declared, "db/schema.py": with_column}
    )
    (folder / "docs").symlink_to(PACKAGE.parent / "docs")
    page = run(folder, "-c", "from docs.generate_data_dictionary import page; print(page())")
    assert "`hardness`" in page
    assert "`csi_g`" in page
    assert "| csi_g | number | g | characteristic intensity of the record |" in page
