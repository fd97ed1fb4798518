"""`rbfrag block`, and commands that take a block from a file."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rbfrag
from tests.cli.conftest import Rejects, Shell
from tests.synthetic import shaking, write_at2, write_suite

KEYS = {
    "mode", "state", "p2", "kr", "ky", "ks", "kct", "yield_acceleration", "alpha1_deg",
    "alpha3_deg", "gamma_deg", "r1_m", "r3_m", "shape_factor",
}  # fmt: skip

ANGLES = ("--alpha1", "-10", "--alpha3", "25", "--r3", "1.5")
PLANES = ("--beta", "5", "--phi", "35")

FILE = "alpha1_deg = -10\nalpha3_deg = 25\nr3_m = 1.5\nbeta_deg = 5\nphi_deg = 35\n"


def test_json_is_the_python_answer(shell: Shell) -> None:
    answer = shell.json("block", *ANGLES, *PLANES, "--phi-back", "30", "--kv", "0.1")
    block = rbfrag.Block.from_angles(-10, 25, 1.5)
    result = rbfrag.stability(block, beta_deg=5, phi_deg=35, phi_back_deg=30, kv=0.1)
    assert set(answer) >= KEYS
    for key in ("mode", "state", "kr", "ky", "ks", "kct", "yield_acceleration"):
        assert answer[key] == getattr(result, key)
    for key in ("p2", "alpha1_deg", "alpha3_deg", "gamma_deg", "r1_m", "r3_m", "shape_factor"):
        assert answer[key] == getattr(block, key)
    assert (answer["mode"], answer["ks"], answer["kct"]) == ("topple", None, None)
    assert answer["warnings"] == list(result.warnings)
    assert answer["margins"][0] == {
        "variable": result.margins[0].variable,
        "change_deg": result.margins[0].change_deg,
        "mode": result.margins[0].mode,
    }


def test_three_descriptions_of_one_block(shell: Shell, tmp_path: Path) -> None:
    block = rbfrag.Block.from_angles(-10, 25, 1.5)
    spacings = (
        "--s1",
        repr(block.s1_m),
        "--s2",
        repr(block.s2_m),
        "--gamma",
        repr(block.gamma_deg),
    )
    rows = "\n".join(
        f"{x!r},{y!r},{contact}"
        for (x, y), contact in zip(block.vertices_m, ("heel", "toe", "", "back"), strict=True)
    )
    (tmp_path / "b.csv").write_text(f"x_m,y_m,contact\n{rows}\n")
    outline = ("--polygon", "b.csv", "--gamma", repr(block.gamma_deg))
    answers = [shell.json("block", *shape, *PLANES) for shape in (ANGLES, spacings, outline)]
    for answer in answers:
        for key, value in answers[0].items():
            if isinstance(value, float):
                assert answer[key] == pytest.approx(value, rel=1e-12)
        assert (answer["mode"], answer["state"]) == ("topple", "stable")


def test_options_override_the_file(shell: Shell, tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(FILE)
    assert shell.json("block", "--polygon", "b.toml")["mode"] == "topple"
    assert shell.json("block", "--polygon", "b.toml", "--phi", "20")["mode"] == "slide"


def test_what_no_number_expresses_is_null(shell: Shell) -> None:
    answer = shell.json(
        "block", "--alpha1", "-40", "--alpha3", "20", "--r3", "1", "--beta", "10", "--phi", "70"
    )
    assert (answer["mode"], answer["state"]) == ("confined_topple", "locked")
    assert answer["yield_acceleration"] is None
    assert answer["kct"] is None


def test_no_back_and_cohesion(shell: Shell) -> None:
    steep = ("--alpha1", "-40", "--alpha3", "20", "--r3", "1", *PLANES)
    assert shell.json("block", *steep)["mode"] == "confined_topple"
    assert shell.json("block", *steep, "--no-back")["mode"] == "topple"
    slide = ("--alpha1", "0", "--alpha3", "70", "--r3", "1", *PLANES)
    bonded = shell.json("block", *slide, "--cohesion", "5000", "--density", "2700")
    assert bonded["cohesion"]["ky"] == bonded["ky"] > shell.json("block", *slide)["ky"]


def test_table_for_people(shell: Shell) -> None:
    short = shell("block", *ANGLES, *PLANES).stdout
    assert short.startswith("Uplift acceleration ")
    assert "change_deg" not in short
    result = shell("block", *ANGLES, *PLANES, "--verbose")
    assert "topple" in result.stdout
    assert re.search(r"^phi +-10 +slide$", result.stdout, re.MULTILINE)
    assert "Note      friction on the back face is neglected" in result.stdout
    bonded = shell(
        "block", *ANGLES, *PLANES, "--cohesion", "5000", "--density", "2700", "--verbose"
    )
    assert "cohesion_phi_equivalent_deg" in bonded.stdout


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (PLANES, "--phi requires the geometry of a block: give --height --width, or"),
        ((*ANGLES[:4], *PLANES), "--r3 is missing"),
        ((*ANGLES, "--s1", "1", *PLANES), "--s1"),
        ((*ANGLES, "--polygon", "b.toml", *PLANES), "cannot be combined with --polygon"),
        ((*ANGLES, "--phi", "35"), "--beta is missing"),
        ((*ANGLES, "--beta", "5"), "--phi is missing"),
        ((*ANGLES, "--beta", "5", "--phi", "90"), "--phi must be at least 0° and below 90°"),
        ((*ANGLES, "--beta", "nan", "--phi", "35"), "--beta = nan"),
        ((*ANGLES, *PLANES, "--kv", "-1"), "kv = -1"),
        (("--alpha1", "25", "--alpha3", "-10", "--r3", "1", *PLANES), "not below"),
        (("--s1", "0", "--s2", "1", "--gamma", "60", *PLANES), "--s1 must be above 0 m, not 0"),
        (("--polygon", "nowhere.csv", *PLANES), "nowhere.csv: no such file"),
    ],
)
def test_rejected(rejects: Rejects, options: tuple[str, ...], word: str) -> None:
    assert word in rejects("block", *options)


def test_respond_and_predict_from_a_block_file(shell: Shell, tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(FILE)
    record = write_at2(tmp_path / "record.AT2", shaking(3))
    block = shell.json("block", "--polygon", "b.toml")
    numbers = ("--p2", repr(block["p2"]), "--kr", repr(block["kr"]))
    by_numbers = shell.json("respond", record, *numbers)
    by_file = shell.json("respond", record, "--block", "b.toml")
    assert by_file.pop("warnings")[0].startswith("friction on the back face is neglected")
    by_numbers.pop("warnings")
    of_toe = ("toe_needs_deg", "toe_needs_s", "toe_slips_g")
    assert all(by_file.pop(name) is not None for name in of_toe)
    assert [by_numbers.pop(name) for name in of_toe] == [None] * 3  # a toe is of a shape
    assert by_file == by_numbers

    shell("motions", "add", write_suite(tmp_path / "records"))
    shell("simulate", "--p2", "10,1", "--jobs", "1")
    shell("fit", "--term", "pgv")
    by_numbers = shell.json("predict", *numbers, "--pgv", "0.6")
    by_file = shell.json("predict", "--block", "b.toml", "--pgv", "0.6")
    assert by_file["probability"] == by_numbers["probability"]
    assert by_file["y_m_s"] == by_numbers["y_m_s"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("phi_deg = 35", "phi_deg = 20"), ["slides (yield 0.27 g)"]),
        (("beta_deg = 5\n", ""), ["--beta is missing"]),
        (("phi_deg = 35", "phi_deg = 35\nkv = 0.2"), ["kv"]),
    ],
)
def test_only_the_model_that_the_mode_calls_for_is_run(
    rejects: Rejects, tmp_path: Path, change: tuple[str, str], words: list[str]
) -> None:
    (tmp_path / "b.toml").write_text(FILE.replace(*change))
    message = rejects("predict", "--pgv", "0.6", "--block", "b.toml")
    for word in (*words, "b.toml"):
        assert word in message


def test_a_confined_block_is_answered_for_by_its_own_model(shell: Shell, tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(FILE.replace("alpha1_deg = -10", "alpha1_deg = -40"))
    answer = shell.json("predict", "--pgv", "0.6", "--pga", "0.9", "--block", "b.toml")
    assert (answer["kind"], answer["mode"]) == ("confined_toppling", "confined_topple")


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (("beta_deg = 5", "beta_deg = 26"), "unstable"),
        (("beta_deg = 5", "beta_deg = 25"), "k_r = 0 g"),
        (("beta_deg = 5\n", ""), "--beta is missing"),
        (("phi_deg = 35", "phi_deg = 35\nkv = 0.2"), "kv"),
    ],
)
def test_respond_rejects_what_no_motion_decides(
    rejects: Rejects, tmp_path: Path, change: tuple[str, str], word: str
) -> None:
    (tmp_path / "b.toml").write_text(FILE.replace(*change))
    record = write_at2(tmp_path / "record.AT2", shaking(3))
    message = rejects("respond", record, "--block", "b.toml")
    assert word in message
    assert "b.toml" in message


def test_a_block_is_given_once(rejects: Rejects, tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(FILE)
    assert "--p2" in rejects("predict", "--pgv", "1", "--block", "b.toml", "--p2", "3")
    assert "--kr" in rejects("predict", "--pgv", "1", "--block", "b.toml", "--kr", "0.1")
    assert "--p2 is missing" in rejects("predict", "--pgv", "1")


def test_block_starts_without_the_heavy_libraries() -> None:
    program = (
        "import sys\n"
        "from rbfrag.cli.main import app\n"
        "app(['block', '--alpha1', '-10', '--alpha3', '25', '--r3', '1', '--beta', '5',"
        " '--phi', '35', '--json'], standalone_mode=False)\n"
        "heavy = ('numpy', 'pandas', 'statsmodels', 'scipy', 'numba', 'matplotlib', 'sqlalchemy')\n"
        "print([name for name in heavy if name in sys.modules], file=sys.stderr)\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(process.stdout)["mode"] == "topple"
    assert process.stderr.strip() == "[]"
