"""Bad input: exit status 2, one message that names the value and the remedy, nothing lost."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from tests.cli.conftest import Rejects, Shell
from tests.synthetic import shaking, write_at2, write_suite


@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf"])
@pytest.mark.parametrize("option", ["--p2", "--kr"])
def test_block_values(rejects: Rejects, record: Path, option: str, value: str) -> None:
    values = {"--p2": "3", "--kr": "0.1", option: value}
    message = rejects("respond", record, *(part for pair in values.items() for part in pair))
    assert option.removeprefix("--") in message
    assert value.lstrip("-") in message


@pytest.mark.parametrize("value", ["0", "-1", "nan"])
def test_critical_values(rejects: Rejects, record: Path, value: str) -> None:
    assert f"p2 = {value} is not " in rejects("critical", record, "--p2", value)


def test_missing_file(rejects: Rejects) -> None:
    message = rejects("respond", "nowhere.AT2", "--p2", "3", "--kr", "0.1")
    assert "nowhere.AT2" in message
    assert "no such file" in message


def test_bad_sample_is_named_with_its_line(rejects: Rejects, record: Path) -> None:
    lines = record.read_text().split("\n")
    lines[10] = lines[10].replace(lines[10].split()[2], "NaN", 1)
    record.write_text("\n".join(lines))
    message = rejects("critical", record, "--p2", "3")
    assert "line 11" in message
    assert "NaN" in message


def test_wrong_kind_of_record(rejects: Rejects, record: Path) -> None:
    record.write_text(record.read_text().replace("ACCELERATION TIME", "VELOCITY TIME"))
    assert "velocity" in rejects("motions", "show", record)


def test_no_database(rejects: Rejects, tmp_path: Path) -> None:
    for command in (
        ("motions", "list"),
        ("simulate",),
        ("models", "check"),
        ("db", "info"),
        ("db", "check"),
        ("db", "upgrade"),
    ):
        assert "rbfrag.db" in rejects(*command)
    # without a name the built-in data answer these
    for inputs in (
        ("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6"),
        ("fit", "--term", "pgv"),
    ):
        assert "none.db" in rejects(*inputs, "--db", "none.db")
    assert not list(tmp_path.glob("*.db"))


def test_counts_by_something_else(rejects: Rejects) -> None:
    assert "'kind'" in rejects("db", "info", "--by", "kind")


def test_without_a_database_the_reference_answers_and_says_so(shell: Shell) -> None:
    answer = shell.json("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6")
    assert answer["data"] == "the built-in data set"
    assert 0.0 < answer["ci_low"] < answer["probability"] < answer["ci_high"] < 1.0
    assert answer["in_domain"]
    more = shell.json("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--pga", "0.5")
    assert (answer["term"], more["term"]) == ("pgv", "pgv_pga")


def test_file_that_is_no_database(rejects: Rejects, tmp_path: Path) -> None:
    place = tmp_path / "notes.db"
    place.write_text("this is a text file of some length, not a database at all\n" * 20)
    for command in (("motions", "list"), ("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6")):
        assert "notes.db" in rejects(*command, "--db", place)
    assert place.read_text().startswith("this is a text file")


def test_database_of_another_program(rejects: Rejects, tmp_path: Path) -> None:
    place = tmp_path / "other.db"
    with sqlite3.connect(place) as connection:
        connection.execute("CREATE TABLE t (x)")
    connection.close()
    for command in (("db", "info"), ("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6")):
        assert "other.db" in rejects(*command, "--db", place)


@pytest.mark.parametrize("revision", ["0000", "9999"])
def test_older_or_newer_schema(
    shell: Shell, rejects: Rejects, record: Path, tmp_path: Path, revision: str
) -> None:
    shell("motions", "add", record)
    connection = sqlite3.connect(tmp_path / "rbfrag.db")
    connection.execute("UPDATE rbfrag_revision SET version_num = ?", (revision,))
    connection.commit()
    connection.close()
    for command in (("motions", "list"), ("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6")):
        message = rejects(*command)
        assert "rbfrag.db" in message


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--p2", "0", "--kr", "0.1", "--pgv", "0.6"), "p2"),
        (("--p2", "3", "--kr", "0.1", "--pgv", "-0.6"), "pgv"),
        (("--p2", "3", "--kr", "0.1", "--pgv", "nan"), "pgv"),
        (("--p2", "3", "--kr", "nan", "--pgv", "0.6"), "kr"),
        (("--p2", "3", "--kr", "0.1"), "pgv"),
        (("--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--model", "nobody"), "nobody"),
        (("--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--level", "2"), "level"),
    ],
)
def test_predict(
    shell: Shell, rejects: Rejects, tmp_path: Path, options: tuple[str, ...], word: str
) -> None:
    shell("motions", "add", write_suite(tmp_path / "records"))
    shell("simulate", "--p2", "10,1", "--jobs", "1")
    shell("fit", "--term", "pgv")
    assert word in rejects("predict", *options)


def test_simulate(shell: Shell, rejects: Rejects, record: Path) -> None:
    shell("motions", "add", record)
    assert "'x'" in rejects("simulate", "--p2", "3,x")
    assert "twice" in rejects("simulate", "--p2", "3,1,3")
    assert "p2" in rejects("simulate", "--p2", "3,-1")
    assert "--jobs" in rejects("simulate", "--jobs", "0")
    assert "'nobody'" in rejects("simulate", "--suite", "nobody")
    assert shell.json("db", "info")["rows"]["campaign"] == 0


def test_fit(shell: Shell, rejects: Rejects, record: Path) -> None:
    shell("motions", "add", record)
    assert "'pgx'" in rejects("fit", "--term", "pgx")
    assert "'ols'" in rejects("fit", "--term", "pgv", "--method", "ols")
    rejects("fit", "--term", "pgv")
    assert shell.json("models", "list", "--db", "rbfrag.db") == []


def test_plot_folder_and_suffix(shell: Shell, rejects: Rejects, record: Path) -> None:
    options = ("respond", record, "--p2", "3", "--kr", "0.1", "--plot")
    assert "nofolder" in rejects(*options, "nofolder/a.png")
    assert ".xyz" in rejects(*options, "a.xyz")


def test_missing_option_is_a_usage_error(shell: Shell, record: Path) -> None:
    result = shell("respond", record, "--p2", "3", expect=2)
    assert "--kr" in result.stderr
    shell("nonsense", expect=2)


def test_suspicious_dt_is_answered_with_a_warning(shell: Shell, tmp_path: Path) -> None:
    slow = write_at2(tmp_path / "slow.AT2", shaking(3), dt_s=5.0)
    answer = shell.json("respond", slow, "--p2", "3", "--kr", "0.1")
    assert any("dt of 5 s" in sentence for sentence in answer["warnings"])


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("predict", "--p2", "abc"), "--p2 must be a number with a decimal point, optionally"),
        (("predict", "--p2", "1,234"), "optionally with its unit (1/s²), not '1,234'"),
        (("db", "check", "--sample", "1.5"), "--sample must be a whole number, not '1.5'"),
        (("db", "check", "--sample", "-3"), "--sample must be 0 or more, not '-3'"),
        (("predict", "--heigth", "2"), "unknown option --heigth; did you mean --height?"),
        (("predict", "--pgv_m_s", "2"), "unknown option --pgv_m_s; did you mean --pgv?"),
        (("predict", "--pg", "2"), "did you mean --pgv, --pga or --pgd? (help: rbfrag predict"),
        (("db", "info", "--bye", "kind"), "did you mean --by? (help: rbfrag db info --help)"),
        (("predict", "--height"), "--height requires a value"),
        (("predict", "--json=1"), "--json takes no value: omit it"),
        (("predict", "stray"), "unexpected argument stray (help: rbfrag predict --help)"),
        (("hazard",), "CURVE is missing: "),
        (("predicts",), "unknown command 'predicts'; did you mean predict? (help: rbfrag --help)"),
        (("db", "inf"), "unknown command 'inf'; did you mean info?"),
        (("--verson",), "unknown option --verson; did you mean --version?"),
    ],
)
def test_wrong_command_lines_in_one_line(
    rejects: Rejects, command: tuple[str, ...], words: str
) -> None:
    assert words in rejects(*command)


LONG = "a" * 300


@pytest.mark.parametrize(
    "words",
    [
        ("motions", "add", LONG),
        ("motions", "export", "{record}", "--out", f"{LONG}.csv"),
        ("spectrum", "{record}", "--csv", f"{LONG}.csv"),
        ("predict", "--batch", f"{LONG}.csv", "--out", "answers.csv"),
        ("losses", LONG, "--blocks", "blocks.csv"),
        ("report", "--p2", "3", "--kr", "0.1", "--pgv", "0.5", "--out", f"{LONG}.pdf"),
        ("report", "--p2", "3", "--kr", "0.1", "--pgv", "0.5", "--out", f"{LONG}/block.pdf"),
        ("db", "merge", LONG, "--db", "a.db"),
        ("demo", "--folder", LONG),
    ],
)
def test_a_name_that_no_file_can_have(rejects: Rejects, record: Path, words: list[str]) -> None:
    rejects(*(word.format(record=record) for word in words))


def test_metadata_may_name_what_no_file_can_be_called(
    shell: Shell, record: Path, tmp_path: Path
) -> None:
    table = tmp_path / "metadata.csv"
    table.write_text(f"file\n{record.name}\n{LONG}\n")
    place = tmp_path / "a.db"
    process = shell("motions", "add", record.parent, "--metadata", table, "--db", place, expect=1)
    assert "it is not there" in process.stderr
    assert "Traceback" not in process.stderr
