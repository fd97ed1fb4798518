"""`respond --draws`: as from Python, and what cannot be combined with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rbfrag
from tests.cli.conftest import Rejects, Shell
from tests.synthetic import shaking, write_at2

COMMAND = ("respond", "a.csv", "--units", "g", "--dt", "0.01", "--p2", "7")


@pytest.fixture(autouse=True)
def record(shell: Shell) -> None:
    Path("a.csv").write_text("\n".join(f"{0.4 * np.sin(0.08 * i):.6f}" for i in range(400)))
    Path("draws.csv").write_text("p2_1_s2,kr,restitution,weight\n7,0.12,0.9,1\n6,0.2,0.8,2\n")


def test_shares_are_those_of_python(shell: Shell) -> None:
    document = shell.json(
        *COMMAND, "--kr", "0.12", "--kr-sigma", "0.3", "--kind", "rocking", "--restitution", "0.9",
        "--restitution-sigma", "0.05", "--draws", "40", "--polarity", "both",
    )  # fmt: skip
    motion = rbfrag.read_motions("a.csv", units="g", dt_s=0.01)[0]
    expected = rbfrag.respond_draws(
        motion, p2=7.0, kr=0.12, kr_sigma=0.3, kind="rocking", restitution=0.9,
        restitution_sigma=0.05, draws=40, polarity="both",
    )  # fmt: skip
    assert {**document, "warnings": []} == {**expected.as_dict(), "warnings": []}
    words = shell(*COMMAND, "--kr", "0.12", "--draws", "5").stdout
    assert "of 5 drawn blocks fail" in words


def test_a_table_and_a_rectangle_are_drawn_from(shell: Shell) -> None:
    table = shell.json(
        *COMMAND[:6], "--block-draws", "draws.csv", "--kind", "rocking", "--draws", "9"
    )
    assert sum(table["outcomes"].values()) == 9
    shape = ("--height", "0.6", "--width", "0.12", "--kind", "rocking")
    block = rbfrag.Block.rectangle(0.6, 0.12)
    numbers = ("--p2", repr(block.p2), "--kr", repr(block.tan_alpha3), "--kind", "rocking")
    drawn = ("--kr-sigma", "0.3", "--draws", "30")
    single = shell.json(*COMMAND[:6], *shape, *drawn)
    other = shell.json(*COMMAND[:6], *numbers, *drawn)
    assert single["outcomes"] == other["outcomes"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--kr", "0.1", "--polarity", "both"), "--polarity requires --draws"),
        (("--kr", "0.1", "--draws", "0"), "draws = 0"),
        (("--kr", "0.1", "--dip-sigma", "2"), "requires the geometry"),
        (("--kr", "0.1", "--kr-sigma", "0.1", "b.csv"), "supports a single motion"),
        (
            ("--kr", "0.1", "--draws", "3", "--csv", "x.csv"),
            "--draws cannot be combined with --csv",
        ),
        (("--kr", "0.1", "--draws", "3", "--reverse", "--polarity", "both"), "--polarity cannot"),
        (
            ("--draws", "3", "--block-draws", "draws.csv"),
            "--block-draws cannot be combined with --p2",
        ),
    ],
)
def test_what_does_not_fit_is_rejected(rejects: Rejects, more: tuple[str, ...], words: str) -> None:
    assert words in rejects(*COMMAND, *more)


def test_errors_of_measurement_are_those_of_python(shell: Shell) -> None:
    shape = ("--height", "2", "--width", ".4", "--dip", "9", "--phi", "40")
    sigmas = ("--height-sigma", "5%", "--width-sigma", ".04", "--dip-sigma", "2")
    document = shell.json(*COMMAND[:6], *shape, *sigmas)
    motion = rbfrag.read_motions("a.csv", units="g", dt_s=0.01)[0]
    expected = rbfrag.respond_draws(
        motion, height_m=2.0, width_m=0.4, beta_deg=9.0, phi_deg=40.0, height_sigma_m="5%",
        width_sigma_m=0.04, beta_sigma_deg=2.0,
    )  # fmt: skip
    assert {**document, "warnings": []} == {**expected.as_dict(), "warnings": []}
    assert document["draws"] == 512
    assert document["excluded"] > 50
    printed = shell(*COMMAND[:6], *shape, *sigmas, "--draws", "1000").stdout
    assert "drawn blocks that stand fail" in printed
    assert "of the measured range would not stand at rest and is excluded" in printed


def test_derived_numbers_of_other_shapes_are_rejected(rejects: Rejects) -> None:
    shape = ("--s1", "2", "--s2", "0.4", "--gamma", "80", "--beta", "5", "--phi", "40")
    more = ("--no-back", "--kr-sigma", ".1")
    assert "--kr-sigma does not describe this block" in rejects(*COMMAND[:6], *shape, *more)


def test_what_never_moves_is_said_so(shell: Shell) -> None:
    write_at2(Path("weak.AT2"), 0.01 * shaking(3))
    block = ("--kind", "rocking", "--p2", "10", "--kr", "0.3")
    assert "The block does not move" in shell("respond", "weak.AT2", *block).stdout
    drawn = shell("respond", "weak.AT2", *block, "--kr-sigma", "0.1", "--draws", "20").stdout
    assert "P(failure) = 0 %   (95 % confidence interval 0–" in drawn
