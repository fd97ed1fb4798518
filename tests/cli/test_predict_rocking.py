"""Free-standing blocks in `predict`: numbers, shapes, tables and draws, by a model stored here."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from rbfrag.question.question import predict
from rbfrag.solver.block.geometry import Block
from tests.cli.conftest import Rejects, Shell
from tests.fragility.test_rocking_models import PGA, stored

MOTION = ("--pgv", "0.6", "--pga", "0.5", "--db", "own.db")
COMMAND = ("predict", "--kind", "rocking")


@pytest.fixture(autouse=True)
def database(shell: Shell) -> None:
    with opened_database("own.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, stored("pga", PGA).row)


def test_numbers_are_answered_as_from_python(shell: Shell) -> None:
    document = shell.json(*COMMAND, "--p2", "7", "--kr", "0.2", "--restitution", "0.9", *MOTION,
                      "--component", "single")  # fmt: skip
    expected = predict(
        7.0, 0.2, kind="rocking", restitution=0.9, pgv_m_s=0.6, pga_g=0.5, db="own.db",
        component="single",
    )  # fmt: skip
    assert document.pop("answers")[0]["probability"] == expected.probability
    assert document == expected.as_dict()
    assert (document["kind"], document["failure"]) == ("rocking", "overturning")


def test_a_rectangle_is_its_numbers(shell: Shell) -> None:
    block = Block.rectangle(2.0, 0.5)
    numbers = shell.json(*COMMAND, "--p2", repr(block.p2), "--kr", "0.25", *MOTION)
    shape = ("--height", "2", "--width", "0.5")
    for inputs in ((*COMMAND, *shape), ("predict", *shape, "--no-back")):
        document = shell.json(*inputs, *MOTION)
        assert document["kind"] == "rocking"
        assert document["probability"] == pytest.approx(numbers["probability"], rel=1e-9)
        assert any("assumed not to slip" in text for text in document["warnings"])
    factor = shell.json(*COMMAND, *shape, "--restitution", "0.8", *MOTION)
    assert factor["probability"] < numbers["probability"]


def test_a_block_that_stands_unevenly_is_that_of_its_weaker_sense(shell: Shell) -> None:
    shape = ("--alpha1", "-12", "--alpha3", "16", "--r3", "1", "--beta", "2", "--phi", "40")
    even = shell.json(*COMMAND, *shape, *MOTION)
    assert not any("weaker sense" in text for text in even["warnings"])
    level = shell.json(*COMMAND, *shape[:6], "--beta", "0", "--phi", "40", *MOTION)
    assert any("weaker sense, backward" in text for text in level["warnings"])
    kr = math.tan(math.radians(12.0))
    assert level["y_m_s"] == pytest.approx(
        kr * 9.80665 / math.sqrt(Block.from_angles(-12.0, 16.0, 1.0).p2), rel=0.02
    )
    assert level["probability"] > even["probability"]


def test_tables_answer_as_single_blocks(shell: Shell) -> None:
    Path("blocks.csv").write_text(
        "height_m,width_m,dip_deg,restitution\n2,0.5,0,\n2,0.5,3,\n2,0.5,-3,0.8\n2,3.2,0,\n"
    )
    shell(*COMMAND, "--batch", "blocks.csv", "--out", "answers.csv", *MOTION)
    with Path("answers.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows[:3]:
        expected = ("--restitution", row["restitution"]) if row["restitution"] else ()
        shape = ("--height", row["height_m"], "--width", row["width_m"], "--dip", row["dip_deg"])
        document = shell.json(*COMMAND, *shape, *expected, *MOTION)
        assert float(row["probability"]) == pytest.approx(document["probability"], rel=1e-12)
    assert rows[3]["probability"] == ""
    assert "comes to rest at its first impact" in rows[3]["reason"]


def test_a_column_of_restitution_with_empty_cells_is_that_of_each_block(shell: Shell) -> None:
    Path("blocks.csv").write_text("p2_1_s2,kr,restitution\n7,0.2,\n7,0.2,0.9\n7,0.2,0\n7,0.2,1.2\n")
    shell(*COMMAND, "--batch", "blocks.csv", "--out", "answers.csv", *MOTION)
    with Path("answers.csv").open() as file:
        formula, value, rests, wrong = csv.DictReader(file)
    expected = shell.json(*COMMAND, "--p2", "7", "--kr", "0.2", *MOTION)
    assert float(formula["probability"]) == pytest.approx(expected["probability"], rel=1e-12)
    inputs = shell.json(*COMMAND, "--p2", "7", "--kr", "0.2", "--restitution", "0.9", *MOTION)
    assert float(value["probability"]) == pytest.approx(inputs["probability"], rel=1e-12)
    for row in (rests, wrong):
        assert row["probability"] == ""
        assert "restitution must be above 0 and up to 1" in row["reason"]


def test_draws_of_a_scanned_rock_are_one_block(shell: Shell) -> None:
    Path("rock.csv").write_text(
        "block_id,azimuth_deg,p2_1_s2,kr,restitution\nr0,0,17,0.2,0.9\nr90,90,16,0.3,0.8\n"
    )
    document = shell.json(*COMMAND, "--block-draws", "rock.csv", *MOTION)
    separate = [
        predict(p2, kr, kind="rocking", restitution=e, pgv_m_s=0.6, pga_g=0.5, db="own.db")
        for p2, kr, e in ((17.0, 0.2, 0.9), (16.0, 0.3, 0.8))
    ]
    mean = 0.5 * (separate[0].probability + separate[1].probability)
    assert document["probability"] == pytest.approx(mean, rel=1e-12)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--p2", "7"), "--kr is missing: a block of kind rocking"),
        (("--p2", "7", "--kr", "0.2", "--restitution", "1.2"), "restitution = 1.2"),
        (("--p2", "7", "--kr", "0.2", "--restitution", "0"), "restitution = 0"),
        (("--height", "2", "--width", "3.2"), "comes to rest at its first impact"),
        (("--height", "2", "--width", "1", "--phi", "10"), "the failure mode is slide"),
    ],
)
def test_what_is_no_free_standing_block_is_rejected(
    rejects: Rejects, more: tuple[str, ...], words: str
) -> None:
    assert words in rejects(*COMMAND, *more, *MOTION)


def test_block_names_the_command_for_a_block_that_stands_free(
    shell: Shell, rejects: Rejects
) -> None:
    shape = ("block", "--height", "2", "--width", "0.5", "--no-back")
    assert "no friction angle is required with --kind rocking" in rejects(*shape)
    warned = shell.json(*shape, "--phi", "40")["warnings"]
    assert any("rbfrag predict --kind rocking" in text for text in warned)
