"""Figures of models and data, from a database that was just filled."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbfrag.db.location import REFERENCE
from tests.cli.conftest import Rejects, Shell
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
    shell: Shell, rejects: Rejects, database: Path, tmp_path: Path
) -> None:
    figures = {
        "chart": (),
        "curve": ("--p2", "3", "--kr", "0.1"),
        "fit": ("--log",),
        "calibration": (),
        "critical": (),
        "sensitivity": ("--height", "2", "--width", "0.4", "--phi", "40", "--pgv", "0.9"),
        "spectrum": ("1", "2"),
    }
    for name, options in figures.items():
        path = tmp_path / f"{name}.png"
        shell("plot", name, *options, "--out", path)
        assert path.stat().st_size > 5000, name
    # these motions have no vertical components
    assert "run  rbfrag simulate  for both" in rejects(
        "plot", "vertical", "--out", tmp_path / "v.png"
    )
    assert not (tmp_path / "v.png").exists()


def test_a_curve_runs_over_what_is_named(shell: Shell, rejects: Rejects, tmp_path: Path) -> None:
    path = tmp_path / "over.svg"
    block = ("--db", REFERENCE, "--p2", "3", "--kr", "0.1", "--out", path)
    shell("plot", "curve", *block, "--over", "pga", "--pgv", "0.6")
    text = path.read_text(encoding="utf-8")
    assert "peak ground acceleration, PGA [g]" in text
    assert "PGV 0.6 m/s" in text
    assert "over = cav: use pgv, pga, pgd or sa(1)" in rejects(
        "plot", "curve", *block, "--over", "cav"
    )
    assert "pgv_m_s is the axis of the curve" in rejects("plot", "curve", *block, "--pgv", "0.6")


def test_a_curve_of_a_free_standing_block(shell: Shell, rejects: Rejects, tmp_path: Path) -> None:
    path = tmp_path / "free.svg"
    shape = ("--db", REFERENCE, "--height", "1", "--width", "0.25", "--out", path)
    for more in (
        ("--kind", "rocking", "--restitution", "0.9"), ("--restitution", "0.9"), ("--no-back",),
    ):  # fmt: skip
        process = shell("plot", "curve", *shape, *more)
        assert "model rocking-pgv" in path.read_text(encoding="utf-8")
        assert "no plane backs the block" not in process.stdout
    message = rejects("plot", "curve", *shape, "--kind", "toppling", "--restitution", "0.9")
    assert "restitution cannot be combined with kind toppling" in message


def test_curves_of_blocks_that_slide_and_slump(
    shell: Shell, rejects: Rejects, tmp_path: Path
) -> None:
    path = tmp_path / "other.svg"
    drawn = ("plot", "curve", "--db", REFERENCE, "--out", path)
    process = shell(*drawn, "--ky", "0.2", "--displacement", "0.1")
    assert "rises again" not in process.stdout
    assert "slides too far" in path.read_text(encoding="utf-8")
    shell(*drawn, "--height", "2.5", "--width", "2.5", "--dip", "20", "--phi", "32",
          "--displacement", "0.1", "--pga", "0.5")  # fmt: skip
    assert "model sliding-pgv_pga" in path.read_text(encoding="utf-8")
    shell(*drawn, "--ks", "0.2", "--ps2", "3", "--pga", "0.5")
    assert "the block slumps" in path.read_text(encoding="utf-8")
    message = rejects(*drawn, "--ky", "0.2", "--displacement", "0.1", "--over", "sa(1)")
    assert "no stored sliding model works with sa(1)" in message


def test_yield_over_rotation(shell: Shell, rejects: Rejects, tmp_path: Path) -> None:
    block = ("--alpha1", "45", "--alpha3", "65", "--r3", "1", "--beta", "0", "--phi", "35")
    answer = shell.json("plot", "rotation", *block, "--out", "r.png", "--back-follows", "0,1")
    assert (tmp_path / "r.png").stat().st_size > 5000
    stays, turns = answer["lines"]
    assert stays["least_g"] == stays["end_g"] < 0.49
    assert turns["least_g"] == pytest.approx(0.597, abs=1e-3)
    assert "from 0 to 1" in rejects(
        "plot", "rotation", *block, "--out", "r.png", "--back-follows", "2"
    )
