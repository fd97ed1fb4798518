"""Figures of models and data, from a database that was just filled."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Refuses, Shell
from tests.synthetic import shaking, write_at2


@pytest.fixture
def database(shell: Shell, tmp_path: Path) -> Path:
    folder = tmp_path / "records"
    folder.mkdir()
    for seed in range(6):
        strength = 0.3 * 1.6**seed
        write_at2(folder / f"{seed}.AT2", strength * shaking(seed), event=f"EVENT {seed}")
    shell("motions", "add", folder)
    shell("simulate", "--p2", "10,1", "--jobs", "1")
    shell("fit", "--term", "pgv", "--method", "lognormal")
    return tmp_path / "rbfrag.db"


def test_every_figure_of_the_database(
    shell: Shell, refuses: Refuses, database: Path, tmp_path: Path
) -> None:
    figures = {
        "chart": (),
        "curve": ("--p2", "3", "--kr", "0.1"),
        "fit": ("--log",),
        "calibration": (),
        "sensitivity": (),
        "spectrum": ("1", "2"),
    }
    for name, options in figures.items():
        path = tmp_path / f"{name}.png"
        shell("plot", name, *options, "--out", path)
        assert path.stat().st_size > 5000, name
    # these motions have no vertical components
    assert "--vertical both" in refuses("plot", "vertical", "--out", tmp_path / "v.png")
    assert not (tmp_path / "v.png").exists()
