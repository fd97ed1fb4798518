"""`rbfrag critical --kind`: the same numbers as from Python, and clear rejections."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from rbfrag.motions.readers import read_motions
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.critical import critical
from rbfrag.solver.models.sliding import KY_OVER_PGA, sliding_displacements
from rbfrag.solver.results import Outcome
from tests.cli.conftest import Rejects, Shell

SLUMP = "alpha1_deg = 56\nalpha3_deg = 76\nr3_m = 0.7\nbeta_deg = 22\nphi_deg = 30\n"


@pytest.fixture
def slump(tmp_path: Path) -> Path:
    path = tmp_path / "slump.toml"
    path.write_text(SLUMP)
    return path


def test_slumping_answers_as_python_does(shell: Shell, record: Path, slump: Path) -> None:
    command = ("critical", record, "--kind", "slumping", "--block", slump, "--rotation", "2")
    document = shell.json(*command, "--reverse")
    result = critical(
        read_motions(record)[0],
        block=Block.from_angles(56, 76, 0.7),
        beta_deg=22,
        phi_deg=30,
        rotation_deg=2.0,
        polarity="reverse",
    )
    assert (document["scale"], document["lower"]) == (result.scale, result.lower_scale)
    assert (document["status"], document["k_over_pga"]) == ("found", result.kr_over_pga)
    assert (document["ks"], document["ps2"]) == (result.yield_g, result.p2)
    assert document["y_m_s"] == pytest.approx(result.y_m_s, rel=1e-14)
    assert document["certified"] is False
    printed = shell(*command).stdout
    assert "The block fails if the record is multiplied by" in printed


def test_sliding_answers_as_python_does(shell: Shell, record: Path) -> None:
    document = shell.json("critical", record, "--kind", "sliding", "--displacement", "0.02,0.1")
    motion = read_motions(record)[0]
    for threshold, distance in zip(document["thresholds"], (0.02, 0.1), strict=True):
        assert threshold["ky_over_pga"] == critical(motion, displacement_m=distance).kr_over_pga
    assert document["ky_over_pga"] == document["thresholds"][0]["ky_over_pga"]
    curve = [row["displacement_m"] for row in document["displacements"]]
    assert curve == sliding_displacements(motion, KY_OVER_PGA).tolist()
    assert "On a dipping base" in shell("critical", record, "--kind", "sliding").stdout


def test_sliding_says_how_far_the_block_slides(shell: Shell, record: Path) -> None:
    block = ("--height", "2", "--width", "2", "--dip", "20", "--phi", "32")
    slid = shell.json("respond", record, *block)["displacement_m"]
    printed = shell("critical", record, *block, "--displacement", "0.05,0.3").stdout
    verdict, critical_ky, *_ = printed.splitlines()
    # tan(32° - 20°)
    assert verdict == (
        f"The block (k_y = 0.213) slides {slid:.3f} m on its base: more than 0.05 m, "
        "not more than 0.3 m"
    )
    assert re.search(r"on a level plane; .*PGA [\d.]+ g, forward polarity$", critical_ky)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--kind", "slumping"), "the kind slumping requires the geometry of a block"),
        (("--kind", "sliding", "--p2", "3"), "--p2 requires --kind toppling"),
        (("--rotation", "3"), "--rotation requires --kind confined_toppling or slumping"),
        (("--kind", "falling"), "use one of confined_toppling, rocking, sliding"),
        (("--kind", "rocking", "--p2", "3"), "has no critical value: the k_r that overturn"),
        ((), "--p2 is missing"),
        (("--kind", "sliding", "--displacement", "far"), "'far' is not a number"),
    ],
)
def test_what_does_not_fit_the_kind_is_rejected(
    rejects: Rejects, record: Path, options: tuple[str, ...], words: str
) -> None:
    assert words in rejects("critical", record, *options)


def test_a_block_chooses_its_kind_by_its_mode(shell: Shell, record: Path, slump: Path) -> None:
    by_mode = shell.json("critical", record, "--block", slump)
    assert by_mode == shell.json("critical", record, "--kind", "slumping", "--block", slump)
    slump.write_text(SLUMP.replace("phi_deg = 30", "phi_deg = 60").replace("= 56", "= -10"))
    block = Block.from_angles(-10, 76, 0.7)
    topples = shell.json("critical", record, "--kind", "toppling", "--block", slump)
    assert topples == shell.json("critical", record, "--p2", repr(block.p2))


def test_a_block_of_another_mode_is_rejected(rejects: Rejects, record: Path, slump: Path) -> None:
    slump.write_text(SLUMP.replace("phi_deg = 30", "phi_deg = 60"))
    message = rejects("critical", record, "--kind", "slumping", "--block", slump)
    assert "slump.toml: the block is not of kind slumping: its mode is slide" in message


def test_two_sentences_unless_every_value_is_requested(shell: Shell, record: Path) -> None:
    answer = shell.json("critical", record, "--p2", "3")
    short = shell("critical", record, "--p2", "3").stdout.splitlines()
    assert answer["certified"]
    assert re.fullmatch(r"Critical k_r = [\d.]+: certified to ±\de-\d+", short[0])
    assert float(short[0].split("k_r = ")[1].split(":")[0]) == pytest.approx(answer["kr"], rel=5e-3)
    assert re.match(r"k_r/PGA = [\d.]+, certified .* p² = 3 s⁻²; .*, forward polarity", short[1])
    every = shell("critical", record, "--p2", "3", "--verbose").stdout
    assert all(f"\n{name} " in every for name in answer if name != "warnings")


def test_a_block_is_reported_to_topple_or_not(shell: Shell, record: Path) -> None:
    """A run of the block decides: one weaker than the critical value may lie in a safe gap."""
    kr = shell.json("critical", record, "--height", "2", "--width", "0.5")["kr"]
    for width, sentence in ((0.5, "does not topple: the critical value"), (0.3, "topples: the")):
        short = shell("critical", record, "--height", "2", "--width", width).stdout
        assert short.startswith(f"The block (k_r = {width / 2:.3f}) {sentence}")
        assert (width / 2 < kr) is ("does not" not in short)
    result = critical(read_motions(record)[0], p2=3.0, full_map=True)
    low, high = max(
        (row["k_lo"], row["k_hi"]) for row in result.map_rows()[:-1] if row["outcome"] == "safe"
    )
    spared = replace(
        result, block_kr=0.5 * (low + high) * result.pga_g, block_outcome=Outcome.STABLE
    )
    assert "does not topple: it is in a safe gap below the critical value" in spared.headline()


def test_the_help_names_no_option_of_other_commands(shell: Shell) -> None:
    assert "--kr" not in shell("critical", "--help").stdout
