"""A field that is declared in one line is known to every door and to the documentation."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import rbfrag

PACKAGE = Path(rbfrag.__file__).parent
LINES = {
    "failure": '        Quantity("hardness", "Rebound hardness of the rock", "MPa", '
    'input=Input(aliases=("rebound",))),\n',
    "measures": '        Quantity("csi_g", "Characteristic intensity", "g", "CI", NOT_NEGATIVE, '
    'Input(), measure=Measure(power=1), credible=(0.0, 5.0, "larger than ever recorded")),\n',
}
"""A line by the group of quantities that it is added to."""

ASKED = """
import json, sys
import numpy as np
import rbfrag
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from rbfrag.db.location import REFERENCE

single = rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, hardness=40.0)
many = rbfrag.predict(np.array([3.0, 3.0]), 0.1, pgv_m_s=0.6, hardness=40.0)
shape = rbfrag.predict(height_m=2.0, width_m=0.4, pgv_m_s=0.6, hardness=40.0)
schema = make_app(ServiceSettings(db=str(REFERENCE))).openapi()
print(json.dumps({
    "same": single.probability == rbfrag.predict(3.0, 0.1, pgv_m_s=0.6).probability,
    "warnings": [single.warnings, many.warnings, shape.warnings],
    "help": rbfrag.predict.__doc__,
    "schema": json.dumps(schema),
}))
"""


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with two more lines, an input and an intensity measure; its folder."""
    folder = tmp_path_factory.mktemp("declared")
    package = folder / "rbfrag"
    package.mkdir()
    for each in PACKAGE.iterdir():
        if each.name != "vocabulary":
            (package / each.name).symlink_to(each)
    (package / "vocabulary").mkdir()
    for each in (PACKAGE / "vocabulary").glob("*.*"):
        text = each.read_text(encoding="utf-8")
        if each.name == "quantities.py":
            for group, line in LINES.items():
                head, mark, rest = text.partition(f'    "{group}": (\n')
                assert mark
                text = f"{head}{mark}{line}{rest}"
        (package / "vocabulary" / each.name).write_text(text, encoding="utf-8")
    return folder


def run(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_python_and_requests_know_it(copied: Path) -> None:
    answer = json.loads(run(copied, "-c", ASKED))
    assert answer["same"]
    for warnings in answer["warnings"]:
        assert "hardness is not read: no model asks for it" in warnings
    assert answer["schema"].count("Rebound hardness of the rock [MPa].") >= 2  # GET and POST
    assert "``hardness``: Rebound hardness of the rock [MPa]." in answer["help"]


def test_the_shell_and_its_tables_know_it(copied: Path) -> None:
    assert "Rebound hardness of the rock [MPa]." in run(
        copied, "-m", "rbfrag.cli.main", "predict", "--help"
    )
    told = run(
        copied, "-m", "rbfrag.cli.main", "predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6",
        "--hardness", "40",
    )  # fmt: skip
    assert "not read: no model asks for it" in told
    (copied / "blocks.csv").write_text("p2,kr,PGV [cm/s],Rebound [MPa]\n3,0.1,60,40\n")
    told = run(copied, "-m", "rbfrag.cli.main", "predict", "--blocks", "blocks.csv")
    assert "column ignored: Rebound [MPa]" in told


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
    assert "csi_g = 7 g is larger than ever recorded" in answer["warnings"]
    assert "``csi_g``: Characteristic intensity [g]." in answer["help"]
    told = run(copied, "-m", "rbfrag.cli.main", "predict", "--help")
    assert "--csi" in told
    (copied / "csi.csv").write_text("p2,kr,PGV [cm/s],csi [%g]\n3,0.1,60,40\n")
    told = run(copied, "-m", "rbfrag.cli.main", "predict", "--blocks", "csi.csv", "--json")
    assert "csi" in told


def test_the_data_dictionary_knows_it(copied: Path) -> None:
    (copied / "docs").symlink_to(PACKAGE.parent / "docs")
    script = "from docs.generate_data_dictionary import page; print(page())"
    assert "hardness" in run(copied, "-c", script)
