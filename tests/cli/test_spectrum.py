"""`rbfrag spectrum`: the answers of the library, for one motion and for several."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from rbfrag.motions.readers import read_motions
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from tests.cli.conftest import Rejects, Shell
from tests.synthetic import shaking, write_at2


@pytest.fixture
def record(tmp_path: Path) -> Path:
    return write_at2(tmp_path / "a.AT2", shaking(1))


@pytest.fixture
def other(tmp_path: Path) -> Path:
    return write_at2(tmp_path / "b.AT2", shaking(2))


def test_one_motion_is_one_object(shell: Shell, record: Path) -> None:
    answer = shell.json("spectrum", record, "--p2", "10,0.5", "--polarity", "reverse")
    motion = read_motions(record)[0]
    assert {"motion", "polarity", "p2", "x_m_s"} <= set(answer)
    assert answer["motion"] == str(record)
    assert answer["polarity"] == "reverse"
    assert answer["p2"] == [10.0, 0.5]
    # bit for bit what Python answers
    assert answer["x_m_s"] == [toppling_spectrum(motion, p2, "reverse") for p2 in (10.0, 0.5)]


def test_several_are_a_list_in_the_order_given(shell: Shell, record: Path, other: Path) -> None:
    answers = shell.json("spectrum", other, record, "--polarity", "both")
    assert [(answer["motion"], answer["polarity"]) for answer in answers] == [
        (str(other), "forward"),
        (str(other), "reverse"),
        (str(record), "forward"),
        (str(record), "reverse"),
    ]


def test_table_and_picture(shell: Shell, record: Path, other: Path, tmp_path: Path) -> None:
    table, picture = tmp_path / "x.csv", tmp_path / "x.png"
    shown = shell(
        "spectrum", record, other, "--p2", "3,1", "--csv", table, "--plot", picture
    ).stdout
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [(row["motion"], row["p2_1_s2"]) for row in rows] == [
        (str(record), "3.0"),
        (str(record), "1.0"),
        (str(other), "3.0"),
        (str(other), "1.0"),
    ]
    motion = read_motions(other)[0]
    assert float(rows[3]["x_m_s"]) == toppling_spectrum(motion, 1.0)
    assert f"{toppling_spectrum(motion, 1.0):.3g}" in shown
    assert "Critical k_r, to 2 %: 0." in shown
    assert picture.stat().st_size > 2000


def test_stored_motion(shell: Shell, record: Path) -> None:
    shell("motions", "add", record)
    stored = shell.json("spectrum", "1")
    assert stored["x_m_s"] == shell.json("spectrum", record)["x_m_s"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--p2", "3,0"), "p2 number 2 is 0"),
        (("--p2", "3,x"), "'x' is not a number"),
        (("--polarity", "up"), "'up'"),
        (("--csv", "x.txt"), ".txt"),
        (("--plot", "x.jpg"), ".jpg"),
    ],
)
def test_bad_values(
    rejects: Rejects, record: Path, tmp_path: Path, options: tuple[str, str], words: str
) -> None:
    before = sorted(tmp_path.iterdir())
    assert words in rejects("spectrum", record, *options)
    assert sorted(tmp_path.iterdir()) == before


def test_plot_spectrum(shell: Shell, record: Path, tmp_path: Path) -> None:
    picture = tmp_path / "p.svg"
    assert shell("plot", "spectrum", record, "--out", picture).stdout.strip() == str(picture)
    assert picture.stat().st_size > 5000
