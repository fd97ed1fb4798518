"""`rbfrag block --mesh`: the answers of Python, a table that other commands read, rejections."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rbfrag
from tests.block_tables import read_columns
from tests.cli.conftest import Rejects, Shell
from tests.conftest import ROOT
from tests.meshes import box, write_obj

BOULDER = ROOT / "docs" / "examples" / "boulder.obj"
PAGE = ROOT / "docs" / "howto" / "block-from-mesh.md"


def test_json_is_the_python_answer(shell: Shell) -> None:
    answer = shell.json(
        "block", "--mesh", BOULDER, "--density", "2650", "--contact-mm", "20", "--up", "z"
    )
    block = rbfrag.block_from_mesh(BOULDER, density_kg_m3=2650.0, contact_mm=20.0)
    assert answer == block.as_dict()
    weakest = block.hull.weakest()
    assert (answer["kr"], answer["p2"], answer["azimuth_deg"]) == (
        weakest.kr,
        weakest.p2,
        weakest.azimuth_deg,
    )
    assert answer["mass_kg"] == 2650.0 * answer["volume_m3"]
    assert [row["contact_mm"] for row in answer["sensitivity"]] == [5.0, 10.0, 20.0, 30.0]
    assert len(answer["azimuths"]) == 36
    assert answer["kr"] <= min(row["kr"] for row in answer["azimuths"])


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_the_table_is_one_of_blocks(shell: Shell, suffix: str) -> None:
    shell("block", "--mesh", BOULDER, "--out", f"blocks.{suffix}", "--plot", "block.png")
    assert Path("block.png").stat().st_size > 10_000
    shell("predict", "--batch", f"blocks.{suffix}", "--pgv", "0.9", "--out", "answers.csv")
    block = rbfrag.block_from_mesh(BOULDER)
    rocking = block.rocking()
    parsed = read_columns(
        "answers.csv", ("p2_1_s2", "kr", "restitution", "probability"), texts=("block_id",)
    )
    np.testing.assert_array_equal(parsed["kr"], np.minimum(rocking.kr_forward, rocking.kr_backward))
    np.testing.assert_array_equal(parsed["p2_1_s2"], rocking.p2)
    np.testing.assert_array_equal(parsed["restitution"], rocking.restitution)
    assert parsed["block_id"][:2].tolist() == ["boulder-000", "boulder-005"]
    assert np.all((parsed["probability"] >= 0.0) & (parsed["probability"] <= 1.0))
    # shaking along an azimuth and its opposite is one line
    other = block.hull.rocking(rocking.azimuth_deg + 180.0)
    np.testing.assert_allclose(other.kr_forward, rocking.kr_backward, rtol=1e-12)
    np.testing.assert_allclose(other.restitution_forward, rocking.restitution_backward, rtol=1e-12)


def test_the_page_lists_the_columns_of_the_table(shell: Shell) -> None:
    text = PAGE.read_text(encoding="utf-8")
    Path("boulder.obj").write_bytes(BOULDER.read_bytes())
    shell("block", "--mesh", "boulder.obj", "--density", "2650", "--out", "blocks.csv")
    with Path("blocks.csv").open() as file:
        assert f"`{file.readline().strip()}`" in text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--s1", "1"), "--mesh cannot be combined with --s1: a mesh is free-standing"),
        (("--block", "b.toml"), "--mesh cannot be combined with --block"),
        (("--beta", "5"), "--mesh cannot be combined with --beta"),
        (("--no-back",), "--mesh cannot be combined with --no-back"),
        (("--kv", "0.1"), "--mesh cannot be combined with --kv"),
        (("--cohesion", "1"), "--mesh cannot be combined with --cohesion"),
        (("--up", "w"), "up = 'w'"),
        (("--up", "y"), "not its resting pose"),
        (("--contact-mm", "0"), "contact_mm = 0 is not above zero"),
        (("--density", "0"), "density_kg_m3 = 0"),
        (("--out", "blocks.xls"), "blocks.xls"),
        (("--plot", "block.jpg"), "block.jpg"),
    ],
)
def test_rejected(rejects: Rejects, options: tuple[str, ...], words: str) -> None:
    assert words in rejects("block", "--mesh", BOULDER, *options)


@pytest.mark.parametrize("option", [("--up", "y"), ("--contact-mm", "5"), ("--out", "a.csv")])
def test_options_of_a_mesh_need_one(rejects: Rejects, option: tuple[str, str]) -> None:
    message = rejects("block", "--height", "2", "--width", "1", *option)
    assert f"{option[0]} requires --mesh" in message


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl"])
@pytest.mark.parametrize("content", [b"", b"\xff\x00" * 200, b"solid a\nfacet normal\n"])
def test_rubbish_is_rejected(rejects: Rejects, suffix: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / f"a.{suffix}").write_bytes(content)
    assert f"a.{suffix}" in rejects("block", "--mesh", f"a.{suffix}")


def test_doubts_stand_below_the_answer(shell: Shell, tmp_path: Path) -> None:
    vertices, faces = box(0.4, 0.5, 1.1)
    write_obj(tmp_path / "a.obj", (1800.0 * vertices, faces[:, ::-1]))
    result = shell("block", "--mesh", "a.obj")
    assert "1980 m across" in result.stdout
    assert "12 of 12 faces pointed inwards and were turned" in result.stdout
    assert ", mass " not in result.stdout
