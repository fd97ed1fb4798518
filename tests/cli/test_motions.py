"""`rbfrag motions` through the shell: show, export, partial files, what --vertical means."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbfrag.motions.readers import read_motion
from tests.cli.conftest import Rejects, Shell
from tests.motions import written_by_networks as written
from tests.synthetic import shaking, write_at2

LIST_KEYS = {
    "id", "name", "event_id", "component", "dt_s", "npts", "pga_g", "pgv_m_s", "pgd_m", "tm_s",
    "flags",
}  # fmt: skip


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """An uncorrected recording of three components in one file."""
    channels = [
        (name, [f"{value:.6f}" for value in 10.0 * shaking(i)])
        for i, name in enumerate(("L1", "V2", "T3"))
    ]
    path = tmp_path / "a.V1"
    path.write_text(written.bhrc_v1(channels, 0.02))
    return path


def test_add_says_what_it_processed(shell: Shell, recording: Path) -> None:
    answer = shell.json("motions", "add", recording)
    assert answer == {
        "added": [1, 2, 3], "already_stored": [], "processed": [1, 2, 3], "failed": [],
        "warnings": [], "not_read": [],
    }  # fmt: skip
    rows = shell.json("motions", "list")
    assert set(rows[0]) >= LIST_KEYS
    assert rows[0]["processing_applied"]["corner_hz"] == 0.1
    assert rows[0]["npts"] == 2600
    shell("motions", "add", recording, "--raw", "--db", "raw.db")
    (row, *_) = shell.json("motions", "list", "--db", "raw.db")
    assert row["npts"] == 600
    assert row["processing_applied"] is None
    assert "uncorrected" in row["flags"]


def test_show_of_a_stored_motion(shell: Shell, recording: Path) -> None:
    shell("motions", "add", recording)
    shown = shell.json("motions", "show", "1")
    assert shown["vertical_id"] == 2
    assert shown["vertical_remark"] is None
    assert shown["flags"] == ["event_guessed"]
    assert shown["processing"] == "uncorrected"
    assert shown["source_sha256"] == read_motion(f"{recording}#0").sha256 != shown["sha256"]
    assert shell.json("motions", "show", "2")["vertical_id"] is None
    of_file = shell.json("motions", "show", f"{recording}#0")
    assert of_file["npts"] == 600
    assert of_file["is_corrected"] is False
    assert "vertical_id" not in of_file


def test_export_and_back(shell: Shell, recording: Path, tmp_path: Path) -> None:
    shell("motions", "add", recording)
    answer = shell.json("motions", "export", "1", "2", "--out", "two.csv")
    assert answer["sha256"] == [row["sha256"] for row in shell.json("motions", "list")[:2]]
    again = shell.json("motions", "add", "two.csv")
    assert (again["added"], again["already_stored"]) == ([], [1, 2])
    shell("motions", "export", "1", "--out", "one.at2")
    assert read_motion(tmp_path / "one.at2").sha256 == answer["sha256"][0]
    back = shell.json("critical", "two.csv#0", "--p2", "3", "--vertical", "two.csv#1")
    stored = shell.json("critical", "1", "--p2", "3", "--vertical", "2")
    assert back == stored


def test_export_is_rejected(shell: Shell, rejects: Rejects, recording: Path) -> None:
    assert "3 traces" in rejects("motions", "export", recording, "--out", "a.csv")
    assert "unsupported --format 'xls'" in rejects(
        "motions", "export", f"{recording}#0", "--out", "a.xls"
    )
    assert not Path("a.csv").exists()


def test_partial_files(shell: Shell, rejects: Rejects, tmp_path: Path) -> None:
    path = write_at2(tmp_path / "a.AT2", shaking(1))
    path.write_text(path.read_text().replace("NPTS= 600", "NPTS= 700"))
    assert "--allow-partial" in rejects("motions", "show", path)
    shown = shell.json("motions", "show", path, "--allow-partial")
    assert "partial" in shown["flags"]
    failed = shell("motions", "add", path, expect=1)
    assert "700 samples, but 600 follow" in failed.stderr
    shell("motions", "add", path, "--allow-partial")
    (row,) = shell.json("motions", "list")
    assert "partial" in row["flags"]
    assert "partial" in shell.json("motions", "show", "1")["flags"]


def test_vertical_must_fit(shell: Shell, rejects: Rejects, tmp_path: Path) -> None:
    horizontal = write_at2(tmp_path / "h.AT2", shaking(1))
    other = write_at2(tmp_path / "v.AT2", shaking(2), 0.01, component="UP")
    run = ("respond", horizontal, "--p2", "3", "--kr", "0.3", "--vertical")
    assert "dt = 0.01 s, the horizontal 0.02 s" in rejects(*run, other)
    down = write_at2(tmp_path / "d.AT2", shaking(2), component="DOWN")
    up = write_at2(tmp_path / "u.AT2", -shaking(2), component="UP")
    turned, right = shell.json(*run, down), shell.json(*run, up)
    assert "turned" in turned["warnings"][0]
    assert turned["peak_theta_n"] == right["peak_theta_n"]
    assert "horizontal component 090" in shell.json(*run, horizontal)["warnings"][0]


def test_pgd_of_a_drifting_record_is_left_out_of_fits(shell: Shell, tmp_path: Path) -> None:
    folder = tmp_path / "records"
    folder.mkdir()
    for i in range(6):
        write_at2(folder / f"record{i}.AT2", (0.4 + 0.3 * i) * shaking(i), station=f"S{i}")
    drifting = shaking(3) + 0.0005
    write_at2(folder / "drift.AT2", drifting, event="EVENT 0", station="S9")
    rows = [f"record{i}.AT2,event-{i},uncorrected" for i in range(6)]
    table = folder / "meta.csv"
    table.write_text("\n".join(["file,event_id,processing", *rows, "drift.AT2,event-0,corrected"]))
    shell("motions", "add", folder, "--metadata", table)
    flagged = [row for row in shell.json("motions", "list") if "final_velocity" in row["flags"]]
    assert [row["name"] for row in flagged] == ["S9 090"]
    shell("simulate", "--p2", "10,1", "--jobs", "1")
    without = shell.json("fit", "--term", "pgd_tm", "--name", "a")
    with_it = shell.json("fit", "--term", "pgd_tm", "--doubtful-pgd", "--name", "b")
    of_pgv = shell.json("fit", "--term", "pgv", "--name", "c")
    assert with_it["n"] == of_pgv["n"]
    assert without["n"] == with_it["n"] - 4
    assert any("PGD in doubt" in warning for warning in without["warnings"])
    for name in ("a", "b"):
        assert shell("plot", "fit", "--model", name, "--out", f"{name}.png").stderr == ""


def test_the_list_fits_into_a_hundred_columns(shell: Shell, tmp_path: Path) -> None:
    records = tmp_path / "records"
    records.mkdir()
    for i in range(2):
        station = f"A STATION OF A VERY LONG NAME BESIDE THE RIVER {i}"
        write_at2(records / f"{i}.AT2", shaking(i), event="A VERY LONG NAME " * 5, station=station)
    rows = "0.AT2,e0,corrected\n1.AT2,e1,uncorrected\n"
    (records / "META.csv").write_text(f"file,event_id,processing\n{rows}")
    shell("motions", "add", records, "--metadata", records / "META.csv")
    first, _, head, *lines = shell("motions", "list").stdout.splitlines()
    assert first.startswith("2 motions of 2 earthquakes; 1 processed here, ")
    assert max(map(len, (head, *lines))) <= 100
    at = head.index("processed")
    assert [line[at : at + 3].strip() for line in lines] == ["no", "yes"]
    assert all("…" in line for line in lines)
    assert shell.json("motions", "list")[1]["processing_applied"] is not None
