"""`rbfrag critical --kind`: the same numbers as from Python, and clear refusals."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbfrag.motions.recognise import read_motions
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.search.displacement import KY_OVER_PGA, critical_sliding, sliding_displacements
from rbfrag.solver.search.scale import critical_scale
from tests.cli.conftest import Refuses, Shell
from tests.synthetic import shaking, write_at2

SLUMP = "alpha1_deg = 56\nalpha3_deg = 76\nr3_m = 0.7\nbeta_deg = 22\nphi_deg = 30\n"


@pytest.fixture
def record(tmp_path: Path) -> Path:
    return write_at2(tmp_path / "record.AT2", shaking(3))


@pytest.fixture
def slump(tmp_path: Path) -> Path:
    path = tmp_path / "slump.toml"
    path.write_text(SLUMP)
    return path


def test_slumping_answers_as_python_does(shell: Shell, record: Path, slump: Path) -> None:
    asked = ("critical", record, "--kind", "slumping", "--block", slump, "--rotation", "2")
    told = shell.json(*asked, "--reverse")
    found = critical_scale(
        read_motions(record)[0],
        Block.from_angles(56, 76, 0.7),
        beta_deg=22,
        phi_deg=30,
        rotation_deg=2.0,
        polarity="reverse",
    )
    assert (told["scale"], told["lower"], told["status"]) == (found.scale, found.lower, "found")
    assert (told["ks"], told["ps2"], told["y_m_s"]) == (found.yield_g, found.p2, found.y_m_s)
    assert told["certified"] is False
    printed = shell(*asked).stdout
    assert "brings the block down" in printed


def test_sliding_answers_as_python_does(shell: Shell, record: Path) -> None:
    told = shell.json("critical", record, "--kind", "sliding", "--displacement", "0.02,0.1")
    motion = read_motions(record)[0]
    for each, distance in zip(told["thresholds"], (0.02, 0.1), strict=True):
        assert each["ky_over_pga"] == critical_sliding(motion, displacement_m=distance).ky_over_pga
    assert told["ky_over_pga"] == told["thresholds"][0]["ky_over_pga"]
    curve = [row["displacement_m"] for row in told["displacements"]]
    assert curve == sliding_displacements(motion, KY_OVER_PGA).tolist()
    assert "on a base that dips" in shell("critical", record, "--kind", "sliding").stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--kind", "slumping"), "--block is missing"),
        (("--kind", "sliding", "--p2", "3"), "--p2 goes with --kind toppling"),
        (("--rotation", "3"), "--rotation goes with --kind slumping and confined_toppling"),
        (("--kind", "falling"), "use one of toppling, sliding"),
        ((), "--p2 is missing"),
        (("--kind", "sliding", "--displacement", "far"), "'far' is no number"),
    ],
)
def test_what_does_not_fit_the_kind_is_refused(
    refuses: Refuses, record: Path, options: tuple[str, ...], words: str
) -> None:
    assert words in refuses("critical", record, *options)


def test_a_block_of_another_mode_is_refused(refuses: Refuses, record: Path, slump: Path) -> None:
    slump.write_text(SLUMP.replace("phi_deg = 30", "phi_deg = 60"))
    message = refuses("critical", record, "--kind", "slumping", "--block", slump)
    assert "slump.toml: the block is not of kind slumping: its mode is slide" in message
