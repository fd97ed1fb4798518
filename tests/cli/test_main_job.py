"""The main job through the command line: files in, probability out."""

from __future__ import annotations

import csv
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Shell
from tests.synthetic import shaking, write_at2, write_suite

RESPOND_KEYS = {
    "kind", "outcome", "peak_theta_n", "peak_theta_rad", "critical_angle_deg", "started_s",
    "toppled_s", "error_estimate", "steps", "samples_moved", "samples_total", "warnings",
    "final_theta_rad", "displacement_m", "peak_displacement_m", "centroid_displacement_m",
    "stopped_s", "mode_changes", "how", "mode", "final_mode", "toe_needs_deg", "toe_needs_s",
    "toe_slips_g", "drained",
}  # fmt: skip
CRITICAL_KEYS = {
    "kr_over_pga", "lower", "upper", "kr", "y_m_s", "status", "certified", "k_up_over_pga",
    "undecided", "island_width", "kr_over_pga_resolved", "reentrant", "n_runs", "warnings",
}  # fmt: skip
PREDICT_KEYS = {
    "probability", "ci_low", "ci_high", "level", "model", "term", "method", "y_m_s", "block_sd",
    "intensity_m_s", "in_domain", "warnings", "pgv_over_pga_s", "answers", "kind", "mode",
    "shaking", "failure", "median_displacement_m", "event_low", "event_high", "data", "how",
    "drained", "uncertainty", "as_stated", "sensitivity", "solution",
}  # fmt: skip
SIMULATE_KEYS = {"combinations", "found", "below_limit", "runs", "seconds", "resumed"}
FIT_KEYS = {
    "name", "term", "method", "coefficients", "standard_errors", "n", "n_censored", "events",
    "scores", "warnings",
}  # fmt: skip
MOTION_KEYS = {
    "id", "name", "event_id", "component", "dt_s", "npts", "pga_g", "pgv_m_s", "pgd_m", "tm_s",
    "flags",
}  # fmt: skip


def test_respond_json_has_the_contract_keys(shell: Shell, record: Path) -> None:
    stays = shell.json("respond", record, "--p2", "3", "--kr", "0.25")
    assert set(stays) == RESPOND_KEYS
    assert (stays["outcome"], stays["how"]) == ("stable", "followed in time")
    strong = shell.json("respond", record, "--p2", "3", "--kr", "9")
    assert (strong["outcome"], strong["how"]) == ("stable", "by mechanics")
    assert stays["peak_theta_n"] > 0.0
    assert stays["toppled_s"] is None
    assert stays["samples_total"] == 599
    assert stays["samples_moved"] < 599
    topples = shell.json("respond", record, "--p2", "3", "--kr", "0.03")
    assert topples["outcome"] == "toppled"
    assert topples["peak_theta_n"] is None
    assert topples["peak_theta_rad"] is None
    assert topples["toppled_s"] > topples["started_s"] > 0.0
    assert topples["critical_angle_deg"] == math.degrees(math.atan(0.03))


def test_respond_writes_its_history(shell: Shell, record: Path, tmp_path: Path) -> None:
    answer = shell.json("respond", record, "--p2", "3", "--kr", "0.2", "--csv", "h.csv")
    with (tmp_path / "h.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    theta = np.array([float(row["theta_rad"]) for row in rows])
    times = np.array([float(row["time_s"]) for row in rows])
    assert theta.max() == answer["peak_theta_rad"]
    assert (np.diff(times) >= 0.0).all()
    assert not list(tmp_path.glob("*.part"))


def test_reverse_is_the_negated_record(shell: Shell, record: Path, tmp_path: Path) -> None:
    negated = write_at2(tmp_path / "negated.AT2", -shaking(3))
    reverse = shell.json("critical", record, "--p2", "3", "--reverse")
    forward = shell.json("critical", negated, "--p2", "3")
    assert reverse["kr"] == forward["kr"]
    assert reverse["polarity"] == "reverse"


def test_critical_brackets_what_respond_says(shell: Shell, record: Path) -> None:
    document = shell.json("critical", record, "--p2", "3")
    assert set(document) >= CRITICAL_KEYS
    assert document["status"] == "found"
    assert document["lower"] == document["kr_over_pga"] < document["upper"]
    below = document["lower"] * document["pga_g"]
    above = document["upper"] * document["pga_g"] * (1.0 + 1e-9)
    for kr, outcome in ((below, "toppled"), (above, "stable")):
        answer = shell.json("respond", record, "--p2", "3", "--kr", repr(kr))
        assert answer["outcome"] == outcome


def test_from_files_to_a_probability(shell: Shell, tmp_path: Path) -> None:
    folder = write_suite(tmp_path / "records")
    added = shell.json("motions", "add", folder, "--suite", "made-up")
    assert len(added["added"]) == 6
    listed = shell.json("motions", "list")
    assert [set(row) >= MOTION_KEYS for row in listed] == [True] * 6
    summary = shell.json("simulate", "--suite", "made-up", "--p2", "10,1", "--jobs", "1")
    assert set(summary) >= SIMULATE_KEYS
    assert summary["combinations"] == 24
    assert summary["resumed"] == 0
    again = shell.json("simulate", "--suite", "made-up", "--p2", "10,1", "--jobs", "1")
    assert (again["resumed"], again["runs"], again["found"]) == (24, 0, summary["found"])
    report = shell.json("fit", "--term", "pgv")
    assert set(report) >= FIT_KEYS
    assert report["n"] + report["n_censored"] == 24
    assert report["events"] == 3
    answer = shell.json("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.3")
    assert set(answer) == PREDICT_KEYS
    assert 0.0 <= answer["ci_low"] <= answer["probability"] <= answer["ci_high"] <= 1.0
    assert answer["model"] == "toppling-pgv"
    assert shell.json("models", "list")[0]["is_default"] is True
    assert shell.json("models", "show", "toppling-pgv")["coefficients"] == report["coefficients"]
    assert shell.json("db", "info")["rows"]["combination"] == 24
    (row,) = shell.json("db", "info", "--by", "suite")["suites"]
    assert (row["suite"], row["kind"], row["combinations"]) == ("made-up", "toppling", 24)
    assert (row["motions"], row["vertical"], row["found"]) == (6, 0, summary["found"])
    printed = shell("db", "info", "--by", "suite").stdout.split()
    assert printed[:5] == ["1", "suite", "suite", "kind", "motions"]
    assert "made-up" in printed
    checked = shell.json("db", "check")
    assert (checked["sound"], checked["findings"]) == (True, [])
    assert checked["resimulated"]["exact"] == checked["resimulated"]["sampled"] > 0
    shell("plot", "fit", "--out", "fit.png")
    shell("plot", "response", "1", "--p2", "3", "--kr", "0.1", "--out", "response.svg")
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "response.svg").read_text()


def test_plot_says_when_the_data_have_changed(shell: Shell, tmp_path: Path) -> None:
    shell("motions", "add", write_suite(tmp_path / "records"))
    shell("simulate", "--p2", "10,1", "--jobs", "1")
    shell("fit", "--term", "pgv")
    assert shell("plot", "fit", "--out", "fit.png").stderr == ""
    shell("simulate", "--p2", "3", "--jobs", "1")
    assert "have changed" in shell("plot", "fit", "--out", "fit.png").stdout


def test_ctrl_c_ends_with_130(shell: Shell, record: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shell("motions", "add", record)

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("rbfrag.campaign.simulate._store", interrupted)
    shell("simulate", "--p2", "3", "--jobs", "1", expect=130)
    monkeypatch.undo()
    assert shell.json("db", "check", "--db", record.parent / "rbfrag.db")["sound"]


def test_stored_motion_answers_like_its_file(shell: Shell, record: Path) -> None:
    shell("motions", "add", record)
    by_id = shell.json("critical", "1", "--p2", "3")
    by_file = shell.json("critical", record, "--p2", "3")
    assert by_id == by_file


def test_bad_files_are_listed_and_good_ones_kept(shell: Shell, tmp_path: Path) -> None:
    folder = write_suite(tmp_path / "records", 2)
    (folder / "empty.AT2").write_text("")
    (folder / "binary.AT2").write_bytes(b"\x00\x01\x02")
    text = (folder / "record0.AT2").read_text()
    (folder / "short.AT2").write_text(text[: len(text) // 2])
    (folder / "notes.txt").write_text("just a note\n")
    result = shell("motions", "add", folder, "--json", expect=1)
    report = json.loads(result.stdout)
    assert len(report["added"]) == 2
    reasons = {Path(bad["file"]).name: bad["reason"] for bad in report["failed"]}
    assert set(reasons) == {"empty.AT2", "binary.AT2", "short.AT2", "notes.txt"}
    assert "empty" in reasons["empty.AT2"]
    assert "binary" in reasons["binary.AT2"]
    assert "truncated" in reasons["short.AT2"]
    assert result.stderr.count("left out:") == 4


def test_nothing_readable_makes_no_database(shell: Shell, tmp_path: Path) -> None:
    (tmp_path / "empty.AT2").write_text("")
    shell("motions", "add", tmp_path / "empty.AT2", expect=1)
    assert not (tmp_path / "rbfrag.db").exists()


def test_metadata_names_the_earthquake(shell: Shell, tmp_path: Path) -> None:
    folder = write_suite(tmp_path / "records", 2)
    (folder / "meta.csv").write_text(
        "file,trace_index,event_id,magnitude\nrecord0.AT2,0,quake-a,6.1\nrecord1.AT2,0,quake-b,7\n"
    )
    shell("motions", "add", folder, "--metadata", folder / "meta.csv")
    rows = shell.json("motions", "list")
    assert [(row["event_id"], row["event_guessed"]) for row in rows] == [
        ("quake-a", False),
        ("quake-b", False),
    ]
    assert rows[0]["magnitude"] == 6.1


HEAVY = ("pandas", "statsmodels", "scipy", "numba", "matplotlib", "sqlalchemy")


def test_predict_starts_without_the_heavy_libraries(shell: Shell, tmp_path: Path) -> None:
    folder = write_suite(tmp_path / "records")
    shell("motions", "add", folder)
    shell("simulate", "--p2", "10,1", "--jobs", "1")
    shell("fit", "--term", "pgv")
    program = (
        "import sys\n"
        "from rbfrag.cli.main import app\n"
        "app(['predict', '--p2', '3', '--kr', '0.1', '--pgv', '0.6', '--json'],"
        " standalone_mode=False)\n"
        f"loaded = [name for name in {HEAVY!r} if name in sys.modules]\n"
        "print(loaded, file=sys.stderr)\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert set(json.loads(process.stdout)) == {*PREDICT_KEYS, "diagnostics"}
    assert process.stderr.strip() == "[]"
