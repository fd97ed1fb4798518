"""Options of spectral accelerations by oscillator period: --sa T=VALUE and --sa-sigma T=VALUE."""

import json

import pytest

import rbfrag
from rbfrag.db.location import REFERENCE
from tests.cli.conftest import Shell

BLOCK = ("--p2", "3", "--kr", "0.1", "--db", str(REFERENCE))


def test_options_are_repeated_by_period(shell: Shell) -> None:
    printed = shell(
        "predict", *BLOCK, "--pga", "0.4", "--sa", "0.3=0.9", "--sa", "1=.5 3=.15", "--sa-sigma",
        "1=0.3", "--json",
    )  # fmt: skip
    document = json.loads(printed.stdout)
    expected = rbfrag.predict(
        3.0, 0.1, pga_g=0.4, sa_g={0.3: 0.9, 1: 0.5, 3: 0.15}, sa_sigma={1: 0.3}, db=REFERENCE
    )
    assert document["probability"] == expected.probability
    assert document["shaking"]["sa(1)"] == {"median": 0.5, "sigma": 0.3}


def test_notes_name_the_options(shell: Shell) -> None:
    printed = shell("predict", *BLOCK, "--pgv", "0.5", "--sa", "0.5=0.7", "--sa-sigma", "0.5=0.2")
    assert "Shaking   PGV 0.5 m/s, SA(0.5 s) 0.7 g" in printed.stdout
    assert "--sa was not used" in printed.stdout
    assert "--sa-sigma was not used" in printed.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--sa", "20=0.4"], "--sa 20=0.4: the period must be from 0.01 to 10 s"),
        (["--sa", "x=0.4"], "--sa x=0.4: the period is not a number"),
        (["--sa", "1=x"], "--sa 1=x: give the period in s and the value, such as 0.5=0.4"),
        (["--sa", "0.4"], "--sa 0.4: give the period in s and the value, such as 0.5=0.4"),
        (["--sa", "1=0.4", "--sa", "1.0=0.5"], "--sa 1.0=0.5: the period 1 s is given twice"),
        (["--sa", "1=-0.4"], "--sa 1 = -0.4 g is negative: give the spectral acceleration at 1 s"),
        (["--sa", "1=0.4", "--sa-sigma", "1=-1"], "--sa-sigma 1 = -1: give a standard deviation"),
        (["--sa10", "0.4"], "unknown option --sa10; did you mean --sa?"),
        (["--sa03-sigma", "0.4"], "unknown option --sa03-sigma; did you mean --sa-sigma?"),
    ],
)
def test_what_is_rejected(shell: Shell, options: list[str], words: str) -> None:
    message = shell("predict", *BLOCK, *options, expect=2).stderr
    assert words in message
    assert len(message.splitlines()) <= 2


def test_a_figure_runs_over_a_spectral_acceleration(shell: Shell) -> None:
    shell("plot", "curve", *BLOCK, "--pga", "0.4", "--over", "sa(1)", "--out", "curve.svg")
    message = shell(
        "plot", "curve", *BLOCK, "--sa", "1=0.4", "--over", "sa(1)", "--out", "a.svg", expect=2
    ).stderr
    assert "is the axis of the curve" in message


def test_a_rock_mass_takes_them(shell: Shell) -> None:
    message = shell("rockmass", "mass.toml", "--sa", "1=0.4", "--sa", "1=0.5", expect=2).stderr
    assert "--sa 1=0.5: the period 1 s is given twice" in message
