"""`predict` of uncertain blocks: sigmas and a table of draws, as from Python and the service."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbfrag.question.question import predict
from tests.cli.conftest import Rejects, Shell

COMMAND = ("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6")
DRAWS = "block_id,p2_1_s2,kr,weight\nrock,3,0.1,1\nrock,2.5,0.12,3\n"


SINGLE = ("--component", "single")


def test_sigmas_are_integrated_over_and_said(shell: Shell) -> None:
    document = shell.json(*COMMAND, "--kr-sigma", "0.2", "--p2-sigma", "0.1", *SINGLE)
    answers = document.pop("answers")
    expected = predict(3.0, 0.1, pgv_m_s=0.6, kr_sigma=0.2, p2_sigma=0.1, component="single")
    assert document == expected.as_dict()
    assert answers[0]["probability"] == expected.probability
    words = shell(*COMMAND, "--kr-sigma", "0.2").stdout
    assert "block uncertainty: standard deviation of P" in words
    assert "uncertain" not in shell(*COMMAND).stdout


def test_draws_of_a_table_are_one_block(shell: Shell) -> None:
    Path("draws.csv").write_text(DRAWS)
    document = shell.json(
        "predict", "--block-draws", "draws.csv", "--pgv", "0.6", "--pga", "0.3", *SINGLE
    )
    document.pop("answers")
    shaking = {"pgv_m_s": 0.6, "pga_g": 0.3, "component": "single"}
    expected = predict([3.0, 2.5], [0.1, 0.12], **shaking, weights=[1.0, 3.0])
    assert document == expected.as_dict()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--kr-sigma", "-1"), "kr_sigma = -1: give a standard deviation of 0 or more"),
        (("--restitution-sigma", "0.1"), "--restitution-sigma cannot be combined with kind"),
        (("--block-draws", "draws.csv"), "--block-draws cannot be combined with --p2"),
    ],
)
def test_what_does_not_fit_is_rejected(rejects: Rejects, more: tuple[str, ...], words: str) -> None:
    Path("draws.csv").write_text(DRAWS)
    assert words in rejects(*COMMAND, *more)


def test_a_known_motion_is_simulated_instead(rejects: Rejects, tmp_path: Path) -> None:
    record = tmp_path / "a.csv"
    record.write_text("0\n0.1\n-0.2\n0\n")
    command = ("predict", "--p2", "3", "--kr", "0.1", "--motion", record, "--dt", "0.1")
    message = rejects(*command, "--units", "g", "--kr-sigma", "0.1")
    assert "by rbfrag respond with draws" in message
