"""A block is described in the same ways in every command, and every way gives the same answer."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import rbfrag
from rbfrag.exchange.nrml import read_nrml
from tests.cli.conftest import Rejects, Shell
from tests.exchange.test_shakemap_grid import GRID
from tests.synthetic import shaking, write_at2

HEIGHT, WIDTH, DIP, PHI = 2.0, 0.5, 3.0, 45.0
BLOCK = rbfrag.Block.rectangle(HEIGHT, WIDTH)
KR = rbfrag.stability(BLOCK, beta_deg=DIP, phi_deg=PHI).kr
PLANES = ("--beta", str(DIP), "--phi", str(PHI))
SIDES = ("--height", str(HEIGHT), "--width", str(WIDTH))

WAYS = {
    "numbers": ("--p2", repr(BLOCK.p2), "--kr", repr(KR)),
    "rectangle": (*SIDES, "--dip", str(DIP)),
    "rectangle-phi": (*SIDES, *PLANES),
    "angles": (
        "--alpha1", repr(BLOCK.alpha1_deg), "--alpha3", repr(BLOCK.alpha3_deg),
        "--r3", repr(BLOCK.r3_m), *PLANES,
    ),
    "fractures": ("--s1", str(HEIGHT), "--s2", str(WIDTH), "--gamma", "90", *PLANES),
    "block": ("--block", "block.toml"),
    "polygon": ("--polygon", "outline.csv", "--gamma", "90", *PLANES),
}  # fmt: skip


@pytest.fixture
def files(tmp_path: Path, shell: Shell) -> Path:
    write_at2(tmp_path / "record.AT2", shaking(3))
    (tmp_path / "block.toml").write_text(
        f"alpha1_deg = {BLOCK.alpha1_deg!r}\nalpha3_deg = {BLOCK.alpha3_deg!r}\n"
        f"r3_m = {BLOCK.r3_m!r}\nbeta_deg = {DIP}\nphi_deg = {PHI}\n"
    )
    (tmp_path / "outline.csv").write_text(
        f"x_m,y_m,contact\n0,0,heel\n{WIDTH},0,toe\n{WIDTH},{HEIGHT},\n0,{HEIGHT},back\n"
    )
    (tmp_path / "curve.csv").write_text("pgv_m_s,annual_rate\n0.1,0.1\n0.5,0.01\n2,0.0001\n")
    (tmp_path / "grid.xml").write_text(GRID.replace(" 10 5", " 60 40"))
    return tmp_path


def predicted(shell: Shell, way: tuple[str, ...]) -> tuple[float, ...]:
    answer = shell.json("predict", *way, "--pgv", "0.6")
    return answer["y_m_s"], answer["probability"]


def responded(shell: Shell, way: tuple[str, ...]) -> tuple[float, ...]:
    answer = shell.json("respond", "record.AT2", *way)
    assert answer["kind"] == "toppling"
    return answer["critical_angle_deg"], answer["peak_theta_n"] or answer["toppled_s"]


def searched(shell: Shell, way: tuple[str, ...]) -> tuple[float, ...]:
    answer = shell.json("critical", "record.AT2", *(way[:2] if way[0] == "--p2" else way))
    return (answer["kr_over_pga"],)


def at_risk(shell: Shell, way: tuple[str, ...]) -> tuple[float, ...]:
    return (shell.json("hazard", "curve.csv", *way, "--component", "single")["annual_rate"],)


def mapped(shell: Shell, way: tuple[str, ...]) -> tuple[float, ...]:
    return (shell.json("shakemap", "grid.xml", *way, "--out", "a.csv")["largest_probability"],)


def exported(shell: Shell, way: tuple[str, ...]) -> tuple[float, ...]:
    shell("export", "nrml", *way, "--out", "a.xml")
    (parsed,) = read_nrml("a.xml")
    return tuple(parsed.at([0.7, 1.0]).tolist())


def tabled(shell: Shell, way: tuple[str, ...]) -> tuple[float, ...]:
    shell("export", "pelicun", *way, "--out", "a.csv")
    return tuple(map(ord, Path("a.csv").read_text()[:400]))


def drawn(shell: Shell, way: tuple[str, ...]) -> tuple[float, ...]:
    shell("plot", "curve", *way, "--out", "a.svg")
    shell("plot", "response", "record.AT2", *way, "--out", "b.svg")
    return (1.0,)


@pytest.mark.parametrize(
    "inputs", [predicted, responded, searched, at_risk, mapped, exported, tabled, drawn]
)
@pytest.mark.usefixtures("files")
def test_every_way_gives_the_same_answer(shell: Shell, inputs) -> None:
    by_numbers = inputs(shell, WAYS["numbers"])
    assert all(math.isfinite(value) for value in by_numbers)
    for name, way in WAYS.items():
        assert inputs(shell, way) == pytest.approx(by_numbers, rel=1e-9), name


@pytest.mark.usefixtures("files")
def test_block_tells_the_numbers_of_a_rectangle(shell: Shell) -> None:
    for name in ("rectangle-phi", "angles", "fractures", "block", "polygon"):
        answer = shell.json("block", *WAYS[name])
        assert answer["p2"] == pytest.approx(BLOCK.p2, rel=1e-12)
        assert answer["kr"] == pytest.approx(KR, rel=1e-12)
    assert shell.json("block", *SIDES, "--phi", "45")["kr"] == pytest.approx(WIDTH / HEIGHT)


def test_the_mode_of_a_rectangle_is_checked_where_friction_is_known(
    shell: Shell, rejects: Rejects
) -> None:
    command = ("predict", *SIDES, "--pgv", "0.6")
    message = shell.json(*command)["warnings"]
    assert any("assumed to topple" in text for text in message)
    assert not any(
        "assumed to topple" in t for t in shell.json(*command, "--phi", "45")["warnings"]
    )
    assert "the block slides" in rejects(*command, "--phi", "10")


ALPHA1 = ("--alpha1", "-10", "--alpha3", "20", "--r3", "1")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--height", "2"), "--width is missing: --height, --width together"),
        ((*SIDES, "--width", "0"), "--width must be above 0 m, not 0"),
        ((*SIDES, "--dip", "3", "--beta", "3"), "--beta cannot be combined with --dip"),
        (("--dip", "3"), "or by its shape, such as --height and --width"),
        ((*ALPHA1, "--dip", "3"), "--phi is missing"),
        ((*SIDES, "--p2", "3"), "--p2 cannot be combined with --height"),
        ((*SIDES, *ALPHA1), "--alpha1 cannot be combined with --height"),
        ((*SIDES, "--block", "b.toml"), "--height cannot be combined with --block"),
        (("--polygon", "a.csv", "--block", "b.toml"), "--polygon cannot be combined with --block"),
        ((*ALPHA1, "--phi", "30"), "--beta is missing"),
        ((*ALPHA1, "--beta", "3"), "--phi is missing"),
        (("--p2", "3", "--kr", "0.1", "--phi", "30"), "--phi requires the geometry of a block"),
        (("--p2", "3", "--kr", "0.1", "--units", "g"), "--units requires --motion"),
        (("--p2", "3", "--kr", "0.1", "--out", "a.csv"), "--out requires --blocks"),
        (
            (*SIDES, "--batch", "a.csv", "--out", "b.csv"),
            "--height cannot be combined with the blocks of a.csv",
        ),
        ((), "--p2 is missing"),
    ],
)
def test_descriptions_that_do_not_go_together(
    rejects: Rejects, options: tuple[str, ...], words: str
) -> None:
    Path("a.csv").write_text("p2_1_s2,kr\n3,0.1\n")
    assert words in rejects("predict", *options, "--pgv", "0.6")


def test_respond_needs_friction_for_the_film_of_a_rectangle(
    shell: Shell, rejects: Rejects, files: Path
) -> None:
    arguments = ("respond", "record.AT2", *SIDES)
    assert "requires the block geometry and --phi" in rejects(*arguments, "--film", "a.gif")
    for command in ("respond", "critical"):
        message = shell.json(command, *arguments[1:])["warnings"]
        assert any("assumed to topple" in text for text in message)
    assert "--phi is missing" in rejects("critical", *arguments[1:], "--kind", "slumping")


def test_tables_of_rectangles(shell: Shell, files: Path) -> None:
    table = files / "blocks.csv"
    table.write_text("block_id,height_m,width_m,dip_deg\nA,2,0.5,3\nB,2,0.5,0\nC,1,0.5,40\n")
    shell("predict", "--batch", table, "--out", "answers.csv", "--pgv", "1.2")
    rows = [line.split(",") for line in (files / "answers.csv").read_text().splitlines()]
    column = rows[0].index("probability")
    for row, dip in ((rows[1], "3"), (rows[2], "0")):
        alone = shell.json("predict", *SIDES, "--dip", dip, "--pgv", "1.2")
        assert float(row[column]) == pytest.approx(alone["probability"], rel=1e-12)
    assert (float(rows[3][column]), rows[3][-1].strip('"')) == (1.0, "unstable")
    table.write_text("height_m,width_m,dip_deg\n2,0.5,3\n2,0.5,0\n")
    command = ("--component", "single")
    answer = shell.json("hazard", "curve.csv", "--blocks", table, *command)["blocks"]
    alone = shell.json("hazard", "curve.csv", *SIDES, *command)
    assert answer[1]["annual_rate"] == pytest.approx(alone["annual_rate"], rel=1e-12)
    points = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [13.0, 42.5]},
            "properties": {"height_m": HEIGHT, "width_m": WIDTH},
        }
    ]
    place = files / "blocks.geojson"
    place.write_text(json.dumps({"type": "FeatureCollection", "features": points}))
    answer = shell.json("hazard", "curve.csv", "--blocks", place, *command)
    assert answer["annual_rate"] == pytest.approx(alone["annual_rate"], rel=1e-12)


def test_a_table_without_blocks_says_what_it_needs(rejects: Rejects, files: Path) -> None:
    (files / "blocks.csv").write_text("block_id,height_m\nA,2\n")
    message = rejects("hazard", "curve.csv", "--blocks", "blocks.csv")
    assert "width is missing; the columns are" in message
