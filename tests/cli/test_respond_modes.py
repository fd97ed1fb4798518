"""`rbfrag respond` on blocks of every failure mode."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import rbfrag
from rbfrag.motions.sample_motions import reversal_pulse
from rbfrag.results.numbers import percent, rounded
from tests.cli.conftest import Rejects, Shell

SLIDE = ("--s1", "1", "--s2", "2", "--gamma", "60", "--beta", "20", "--phi", "30")
SLUMP = ("--alpha1", "45", "--alpha3", "65", "--r3", "1", "--beta", "0", "--phi", "35")
CONFINED = ("--alpha1", "-40", "--alpha3", "20", "--r3", "1", "--beta", "5", "--phi", "30")
TOPPLE = ("--alpha1", "-10", "--alpha3", "25", "--r3", "1.5", "--beta", "5", "--phi", "35")


@pytest.mark.parametrize(
    ("block", "kind"),
    [
        (SLIDE, "sliding"),
        (SLUMP, "slumping"),
        (CONFINED, "confined_toppling"),
        (TOPPLE, "toppling"),
    ],
)
def test_the_mode_chooses_the_model(
    shell: Shell, record: Path, tmp_path: Path, block: tuple[str, ...], kind: str
) -> None:
    answer = shell.json("respond", record, *block, "--csv", "m.csv", "--plot", "m.png")
    assert answer["kind"] == kind
    # the same model when it is asked for, and the same answer
    again = shell.json("respond", record, *block, "--kind", kind)
    assert again == answer
    rows = (tmp_path / "m.csv").read_text().splitlines()
    assert rows[0].startswith("time_s,theta_rad")
    assert ("displacement_m" in rows[0]) == (kind != "toppling")
    assert len(rows) > 100
    assert (tmp_path / "m.png").stat().st_size > 10_000


def test_sliding_by_its_yield_and_by_its_shape(shell: Shell, record: Path) -> None:
    by_shape = shell.json("respond", record, *SLIDE, "--no-back")
    ky = repr(math.tan(math.radians(10.0)))
    by_yield = shell.json("respond", record, "--ky", ky, "--beta", "20")
    assert by_yield["displacement_m"] == pytest.approx(by_shape["displacement_m"], rel=1e-9)
    assert by_shape["displacement_m"] > 0.0
    assert by_shape["peak_theta_rad"] is None
    assert by_shape["critical_angle_deg"] is None
    flat = shell.json("respond", record, "--ky", ky, "--beta", "20", "--horizontal")
    factor = math.cos(math.radians(10.0)) / math.cos(math.radians(30.0))
    assert by_yield["displacement_m"] == pytest.approx(factor * flat["displacement_m"], rel=1e-9)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ((), "--p2 is missing: give --p2 and --kr, or --ky"),
        (("--p2", "3"), "--kr is missing"),
        (
            ("--p2", "3", "--kr", "0.1", "--ky", "0.1"),
            "--ky is for sliding, --p2 and",
        ),
        (("--ky", "0.1", *SLUMP), "--ky cannot be combined with --alpha1"),
        (("--ky", "0.1", "--phi", "20"), "--phi requires the geometry of a block"),
        (("--ky", "0.1", "--no-back"), "--no-back requires the geometry of a block"),
        (("--ky", "0.1", "--film", "a.gif"), "--film requires the block geometry"),
        (("--ky", "-0.1"), "ky"),
        (("--ky", "1e9", "--beta", "80"), "friction angle"),
        (("--ky", "0.1", "--kind", "slumping"), "requires the geometry"),
        (("--p2", "3", "--kr", "0.1", "--kind", "sliding"), "requires the geometry"),
        (
            ("--p2", "3", "--kr", "0.1", "--two-way"),
            "--two-way cannot be combined with kind toppling",
        ),
        (("--p2", "3", "--kr", "0.1", "--beta", "3"), "--beta cannot be combined with --p2"),
        ((*SLUMP, "--two-way"), "--two-way cannot be combined with kind slumping"),
        ((*SLUMP, "--exaggerate", "3"), "--exaggerate requires --film"),
        ((*SLUMP, "--kind", "rolling"), "unknown kind 'rolling'"),
        ((*SLUMP, "--kind", "confined_toppling"), "topples freely"),
        ((*SLUMP[:6], "--beta", "40", "--phi", "35"), "unstable"),
    ],
)
def test_rejected(rejects: Rejects, record: Path, options: tuple[str, ...], word: str) -> None:
    assert word in rejects("respond", record, *options)


def test_a_film_that_cannot_be_made_is_rejected_before_anything_is_written(
    rejects: Rejects, record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    command = ("respond", record, *SLUMP, "--csv", "m.csv", "--film", "m.mp4")
    assert "use .gif or .html" in rejects(*command)
    assert list(tmp_path.iterdir()) == [record]


def test_a_model_against_the_mode_says_so(shell: Shell, record: Path) -> None:
    answer = shell.json("respond", record, *SLUMP, "--kind", "sliding")
    assert answer["kind"] == "sliding"
    assert any("mode of the block is slump" in warning for warning in answer["warnings"])


def test_cohesion_is_rejected_where_motion_breaks_it(rejects: Rejects, record: Path) -> None:
    Path("b.toml").write_text(
        "s1_m = 1\ns2_m = 2\ngamma_deg = 60\nbeta_deg = 20\nphi_deg = 30\n"
        "cohesion_pa = 100\ndensity_kg_m3 = 2700\n"
    )
    assert "cohesion_pa" in rejects("respond", record, "--block", "b.toml")


def test_a_block_without_a_back_plane_rocks(shell: Shell, record: Path, tmp_path: Path) -> None:
    block = ("--alpha1", "-17", "--alpha3", "20", "--r3", "2", "--beta", "1", "--phi", "35")
    files = ("--csv", "m.csv", "--plot", "m.png", "--film", "m.gif")
    answer = shell.json("respond", record, *block, "--no-back", *files)
    assert (answer["kind"], answer["outcome"]) == ("rocking", "stable")
    assert answer["peak_forward_rad"] > 0.0 < answer["peak_backward_rad"]
    assert answer["peak_theta_rad"] == max(answer["peak_forward_rad"], answer["peak_backward_rad"])
    assert answer["critical_backward_deg"] == pytest.approx(18.0)
    assert answer["impacts"] > 1
    assert answer["sensitive"] is False
    assert shell.json("respond", record, *block, "--kind", "rocking") == answer
    assert (tmp_path / "m.gif").stat().st_size > 10_000
    assert (tmp_path / "m.png").stat().st_size > 10_000
    rows = [line.split(",") for line in (tmp_path / "m.csv").read_text().splitlines()]
    theta, ratio = (rows[0].index(name) for name in ("theta_rad", "theta_over_critical"))
    least = min(rows[1:], key=lambda row: float(row[theta]))
    assert float(least[theta]) == pytest.approx(-answer["peak_backward_rad"], rel=1e-12)
    assert float(least[ratio]) == pytest.approx(float(least[theta]) / math.radians(18.0), rel=1e-9)


def test_a_free_standing_rectangle_needs_no_friction(
    shell: Shell, rejects: Rejects, record: Path
) -> None:
    sides = ("--height", "1.2", "--width", "0.3")
    free_standing = shell("respond", record, *sides, "--no-back", "--json")
    assert "assumed not to slip" in free_standing.stdout
    inputs = shell.json("respond", record, *sides, "--kind", "rocking")
    assert inputs["kind"] == "rocking"
    less = shell.json("respond", record, *sides, "--kind", "rocking", "--restitution", "0.6")
    assert less["peak_theta_rad"] != inputs["peak_theta_rad"]
    by_numbers = shell.json(
        "respond", record, "--kind", "rocking", "--kr", "0.25", "--p2",
        repr(0.75 * 9.80665 / (0.5 * math.hypot(1.2, 0.3))),
    )  # fmt: skip
    assert by_numbers["outcome"] == inputs["outcome"]
    assert by_numbers["impacts"] == inputs["impacts"]
    leans = ("--kind", "rocking", "--dip", "15")
    assert "overturns forward over its toe at rest" in rejects("respond", record, *sides, *leans)
    words = "restitution = 0: give the coefficient"
    assert words in rejects("respond", record, *sides, "--no-back", "--restitution", "0")


def test_a_rocking_block_that_overturns_is_drawn(
    shell: Shell, record: Path, tmp_path: Path
) -> None:
    numbers = ("--kind", "rocking", "--p2", "3", "--kr", "0.03")
    answer = shell.json("respond", record, *numbers, "--plot", "falls.svg")
    assert answer["outcome"] == "toppled"
    missing = [name for name in ("peak_forward_rad", "peak_backward_rad") if answer[name] is None]
    assert len(missing) == 1
    assert answer["toppled_s"] is not None
    assert (tmp_path / "falls.svg").read_text().count("<path") > 20


BLOCK_FILE = """s1_m = 2.0
s2_m = 3.0
gamma_deg = 60.0
beta_deg = 20.0
phi_deg = 38.0
density_kg_m3 = 2650.0
water_m = 1.1372
"""
OUTLINE = "x_m,y_m,contact\n0,0,heel\n3.4641,0,toe\n2.3094,2,\n-1.1547,2,back\n"


def test_a_block_file_with_water_is_answered(shell: Shell, rejects: Rejects, record: Path) -> None:
    Path("wet.toml").write_text(BLOCK_FILE)
    wet = shell.json("respond", record, "--block", "wet.toml")
    assert wet["drained"]["yield_acceleration"] == pytest.approx(0.32492, abs=1e-5)
    assert any("water pressure keeps acting" in text for text in wet["warnings"])
    dry = ("--s1", "2", "--s2", "3", "--gamma", "60", "--beta", "20", "--phi", "38")
    alike = shell.json("respond", record, *dry)
    assert alike["drained"] is None
    assert wet["peak_displacement_m"] > alike["peak_displacement_m"]
    remaining = shell.json("respond", record, "--block", "wet.toml", "--phi-residual", "36")
    assert any("after its first slip" in text for text in remaining["warnings"])
    assert remaining["peak_displacement_m"] > wet["peak_displacement_m"]
    # how far slides go on a level plane does not depend on the water
    searched = shell.json("critical", record, "--block", "wet.toml")
    assert searched["kind"] == "sliding"
    comments = "\n".join(f"# {line}" for line in BLOCK_FILE.splitlines()[2:])
    Path("wet.csv").write_text(f"{comments}\n{OUTLINE}")
    assert "not of outlines" in rejects("respond", record, "--polygon", "wet.csv")


def test_toe_and_modes_are_in_the_answer(shell: Shell, record: Path) -> None:
    answer = shell.json("respond", record, "--height", "4", "--width", "1", "--phi", "16")
    assert answer["mode"] == answer["final_mode"] == "topple"
    assert answer["toe_slips_g"] == pytest.approx(0.4009, abs=6e-5)
    assert answer["toe_needs_deg"] > 14.0
    numbers = shell.json("respond", record, "--p2", "3", "--kr", "0.25")
    assert (numbers["toe_needs_deg"], numbers["toe_slips_g"]) == (None, None)


def test_yields_over_a_rotation_are_dry(rejects: Rejects) -> None:
    Path("wet.toml").write_text(BLOCK_FILE)
    message = rejects("plot", "rotation", "--block", "wet.toml", "--out", "a.png")
    assert "cannot be combined with the yield over a rotation" in message


def test_the_headline_says_whether_the_block_fails(shell: Shell, record: Path) -> None:
    numbers = ("--p2", "3", "--kr", "0.35")
    answer = shell.json("respond", record, *numbers)
    assert answer["outcome"] == "stable"
    headline = shell("respond", record, *numbers).stdout.splitlines()[0]
    peak_deg = math.degrees(answer["peak_theta_rad"])
    assert headline == (
        f"The block does not topple: peak rotation {peak_deg:.2g}° "
        f"({percent(answer['peak_theta_n'])} of the critical angle 19.3°)"
    )
    slid = shell.json("respond", record, *SLIDE)["displacement_m"]
    headline = shell("respond", record, *SLIDE).stdout.splitlines()[0]
    assert headline == f"The block slides {rounded(slid)} m along its base and stops"


def test_the_headline_of_a_slide_says_how_far_the_block_tips() -> None:
    motion = reversal_pulse(0.4, 0.5, 1.0, 0.005)
    slid = rbfrag.respond(motion, ky=0.1)
    tipped = slid.with_values(peak_theta_rad=math.radians(26.0))
    assert slid.displacement_m is not None
    far = rounded(slid.displacement_m)
    assert tipped.headline() == f"The block slides {far} m along its base, tips up to 26° and stops"
