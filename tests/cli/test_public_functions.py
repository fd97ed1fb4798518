"""Answers and figures of the command line, from Python by the same functions."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import rbfrag
from tests.cli.conftest import Shell
from tests.exchange.test_shakemap_grid import GRID
from tests.synthetic import shaking, write_at2

MASS = Path(__file__).parents[2] / "docs" / "examples" / "rockmass.toml"


def test_a_rock_mass_is_answered_as_by_the_shell(shell: Shell, tmp_path: Path) -> None:
    record = write_at2(tmp_path / "record.AT2", shaking(3))
    answer = rbfrag.rockmass(MASS, n=60, motion=record, scales=(0.5, 1.0), jobs=1)
    command = ["--n", "60", "--motion", record, "--scales", "0.5,1", "--jobs", "1"]
    assert answer.as_dict() == shell.json("rockmass", MASS, *command)
    assert len(answer.to_frame()) == 2 * 60
    answer = rbfrag.rockmass(str(MASS), n=60, pgv_m_s=0.6, sa_g={1.0: 0.4})
    command = ["--n", "60", "--pgv", "0.6", "--sa", "1=0.4"]
    assert answer.as_dict() == shell.json("rockmass", MASS, *command)
    with pytest.raises(rbfrag.InputError, match="motion cannot be combined with pgv_m_s"):
        rbfrag.rockmass(MASS, pgv_m_s=0.6, motion=record)
    assert "\n" not in repr(answer)
    with pytest.raises(rbfrag.InputError, match="mass is of type int"):
        rbfrag.rockmass(3)


def test_a_map_is_answered_as_by_the_shell(shell: Shell, tmp_path: Path) -> None:
    grid = tmp_path / "grid.xml"
    grid.write_text(GRID, encoding="utf-8")
    answer = rbfrag.shakemap(grid, 3.0, 0.1, component="single")
    command = ["--p2", "3", "--kr", "0.1", "--component", "single", "--out", "map.csv"]
    document = shell.json("shakemap", grid, *command)
    assert answer.as_dict() == {name: document[name] for name in document if name != "file"}
    frame = answer.to_frame()
    columns = pd.DataFrame({"p2_1_s2": [3.0], "kr": [0.1]})
    same = rbfrag.shakemap(grid, blocks=columns, component="single").to_frame()
    np.testing.assert_array_equal(frame.probability, same.probability)
    with pytest.raises(rbfrag.InputError, match="kr is missing"):
        rbfrag.shakemap(grid, 3.0)
    with pytest.raises(rbfrag.InputError, match="kr = 0 is not above zero"):
        rbfrag.shakemap(grid, 3.0, 0.0)


@pytest.mark.parametrize(("name", "ending"), [("nrml", ".xml"), ("pelicun", ".csv")])
def test_functions_for_other_tools_are_those_of_the_shell(
    shell: Shell, tmp_path: Path, name: str, ending: str
) -> None:
    file, other = tmp_path / f"python{ending}", tmp_path / f"shell{ending}"
    answer = getattr(rbfrag.export, name)(file, 3.0, 0.1)
    document = shell.json("export", name, "--p2", "3", "--kr", "0.1", "--out", other)
    assert file.read_bytes() == other.read_bytes()
    assert document["model"] == answer.model
    assert answer.as_dict().keys() == document.keys()


def test_figures_are_pictures_without_a_file(tmp_path: Path) -> None:
    picture = rbfrag.plot.curve(3.0, 0.1, pga_g=0.4)
    assert picture._repr_png_().startswith(b"\x89PNG")
    assert repr(picture) == "Picture(path=None, warnings=())"
    file = tmp_path / "modes.svg"
    assert rbfrag.plot.modes(file, phi_deg=40.0).path == file
    assert "<svg" in file.read_text(encoding="utf-8")
    with pytest.raises(rbfrag.InputError):
        rbfrag.plot.chart(tmp_path / "chart.gif")
    with pytest.raises(rbfrag.InputError, match="motion is of type int"):
        rbfrag.plot.spectrum(3)
    assert all(callable(getattr(rbfrag.plot, name)) for name in dir(rbfrag.plot))
    with pytest.raises(AttributeError, match="no attribute 'mode'"):
        rbfrag.plot.mode  # noqa: B018


def test_asking_for_figures_and_exports_loads_no_matplotlib() -> None:
    program = (
        "import sys, rbfrag; rbfrag.plot; rbfrag.export; rbfrag.shakemap; rbfrag.rockmass;"
        "print([name for name in ('matplotlib', 'pyogrio') if name in sys.modules])"
    )
    process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert process.stdout.strip() == "[]", process.stderr
