"""`predict --kind`, `fit --kind` and `simulate --kind`: as from Python, with clear rejections."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbfrag.question.question import predict
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.simulation import shaken_mechanism
from tests.cli.conftest import Rejects, Shell
from tests.synthetic import write_suite

SLUMP = "alpha1_deg = 56\nalpha3_deg = 76\nr3_m = 0.7\nbeta_deg = 22\nphi_deg = 30\n"
SLIDE = "s1_m = 1\ns2_m = 0.6\ngamma_deg = 25\nbeta_deg = 20\nphi_deg = 40\n"
MOTION = ("--pgv", "0.4", "--pga", "0.5")


@pytest.fixture
def block(tmp_path: Path) -> Path:
    return tmp_path / "block.toml"


def test_a_slide_is_answered_as_from_python(shell: Shell, block: Path) -> None:
    command = ("predict", "--kind", "sliding", "--displacement", "0.05", "--component", "single",
             *MOTION)  # fmt: skip
    document = shell.json(*command, "--ky", "0.1", "--beta", "10")
    value = {"displacement_m": 0.05, "pgv_m_s": 0.4, "pga_g": 0.5, "component": "single"}
    answer = predict(ky=0.1, beta_deg=10.0, **value)
    answers = document.pop("answers")
    assert document == answer.as_dict()
    assert [item["model"] for item in answers] == ["sliding-pgv_pga", "sliding-pgv"]
    assert document == {
        k: v
        for k, v in shell.json(*command[:1], *command[3:], "--ky", "0.1", "--beta", "10").items()
        if k != "answers"
    }
    assert document["data"] == "the built-in data set"
    block.write_text(SLIDE)
    from_file = shell.json(*command, "--block", block)
    by_hand = predict(ky=0.36397023, beta_deg=20.0, **value)
    assert from_file["probability"] == pytest.approx(by_hand.probability, rel=1e-5)
    assert "median displacement 0." in shell(*command, "--ky", "0.1").stdout


def test_a_slump_is_answered_as_from_python(shell: Shell, block: Path) -> None:
    block.write_text(SLUMP)
    shaken = shaken_mechanism(
        model_of_kind("slumping"), Block.from_angles(56, 76, 0.7), beta_deg=22, phi_deg=30
    )
    for rotation_deg, option in ((None, ()), (2.0, ("--rotation", "2"))):
        command = ("predict", "--kind", "slumping", *MOTION, *option)
        document = shell.json(*command, "--block", block)
        answer = predict(
            ks=shaken.yield_g, ps2=shaken.p2, pgv_m_s=0.4, pga_g=0.5, rotation_deg=rotation_deg
        )
        assert document["probability"] == pytest.approx(answer.probability, rel=1e-12)
        numbers = shell.json(*command, "--ks", str(shaken.yield_g), "--ps2", str(shaken.p2))
        assert numbers["probability"] == answer.probability


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--kind", "sliding", "--ky", "0.1", *MOTION), "--displacement is missing"),
        (("--kind", "sliding", "--displacement", "0.1", *MOTION), "--ky is missing"),
        (
            ("--kind", "sliding", "--ky", "0.1", "--displacement", "0.1"),
            "no intensity measure is given: a prediction requires --pga, or --pgv, or --sa",
        ),
        (("--kind", "slumping", "--ks", "0.1", *MOTION), "--ps2 is missing"),
        (
            ("--kind", "slumping", "--kr", "0.1", *MOTION),
            "kind slumping uses --ks and --ps2",
        ),
        (
            ("--p2", "3", "--kr", "0.1", "--ky", "1", *MOTION),
            "ky cannot be combined with kind toppling",
        ),
        (
            ("--kind", "confined_toppling", "--p2", "3", "--kr", "1", *MOTION),
            "kind confined_toppling uses --kct and --pct2",
        ),
        (
            (
                "--kind",
                "confined_toppling",
                "--kct",
                "0.3",
                "--pct2",
                "8",
                "--rotation",
                "2",
                *MOTION,
            ),
            "rotation_deg is not a failure criterion of kind confined_toppling",
        ),
        (
            ("--kind", "slumping", "--ks", "0.1", "--ps2", "3", "--rotation", "7", *MOTION),
            "no stored slumping model of a rotation of 7°",
        ),
    ],
)
def test_what_does_not_fit_is_rejected(
    rejects: Rejects, options: tuple[str, ...], words: str
) -> None:
    assert words in rejects("predict", *options)


def test_a_block_of_another_mode_is_rejected(rejects: Rejects, block: Path) -> None:
    block.write_text(SLIDE)
    command = ("predict", "--block", block, *MOTION)
    assert "the failure mode is slide" in rejects(*command, "--kind", "slumping")
    assert "give --displacement" in rejects(*command)
    block.write_text(SLUMP)
    distance = ("--displacement", "0.1")
    assert "the failure mode is slump" in rejects(*command, "--kind", "sliding", *distance)


def test_a_campaign_is_run_fitted_and_asked(shell: Shell, tmp_path: Path) -> None:
    shell("motions", "add", write_suite(tmp_path / "records", 6), "--suite", "s")
    summary = shell.json("simulate", "--kind", "sliding", "--displacement", "0.02", "--jobs", "1")
    assert (summary["kind"], summary["combinations"]) == ("sliding", 6 * 2 * 2)
    again = shell.json("simulate", "--kind", "sliding", "--displacement", "0.02", "--jobs", "1")
    assert again["resumed"] == again["combinations"]
    report = shell.json("fit", "--kind", "sliding", "--term", "pgv_pga")
    assert report["is_default"]
    assert report["events"] == 3
    assert "calibration_slope" in shell("models", "show", "sliding-pgv_pga", "--verbose").stdout
    (listed,) = shell.json("models", "list")
    assert (listed["name"], listed["kind"]) == ("sliding-pgv_pga", "sliding")
    assert "unchanged" in shell("models", "check").stdout
    document = shell.json(
        "predict", "--kind", "sliding", "--ky", "0.1", "--displacement", "0.05", *MOTION
    )
    assert document["model"] == "sliding-pgv_pga"
    assert "reference" not in document["data"]


def test_options_of_one_kind_do_not_go_with_another(rejects: Rejects) -> None:
    assert "--p2 requires --kind rocking or toppling" in rejects(
        "simulate", "--kind", "sliding", "--p2", "1"
    )
    assert "campaigns are of" in rejects("simulate", "--kind", "falling")
    message = rejects("fit", "--kind", "sliding", "--term", "pgv", "--method", "wls")
    assert "method wls fits blocks with p2 and kr, not those of kind sliding" in message
    assert "omit --rotation" in rejects("fit", "--term", "pgv", "--rotation", "2")


def test_a_rectangle_in_another_unit_is_doubted(shell: Shell) -> None:
    output = shell("predict", "--height", "240", "--width", "50", "--pgv", "0.6").stdout
    assert output.startswith("Check the unit: height 240 m (in cm?)")
    assert "Check the unit" not in shell("predict", "--height", "2.4", "--width", "0.5",
                                           "--pgv", "0.6").stdout  # fmt: skip


def test_a_block_that_fails_at_rest_is_said_to(shell: Shell, rejects: Rejects) -> None:
    steep = ("--height", "2", "--width", "0.5", "--dip", "40", "--phi", "35", "--pgv", "0.3")
    document = shell.json("predict", *steep)
    assert document["probability"] == document["ci_low"] == document["ci_high"] == 1.0
    assert "it fails without an earthquake" in document["warnings"][0]
    assert "rocking is free-standing" in rejects("predict", *steep, "--kind", "free")


def test_a_rejection_of_measures_names_options(rejects: Rejects) -> None:
    message = rejects("predict", "--p2", "3", "--kr", "0.1", "--kind", "rocking", "--tm", "0.5")
    assert "--tm is given: a prediction requires --pga, or --pgv, or --sa" in message
