"""A folder of lists of accelerations: their index gives dt and is no record itself."""

from __future__ import annotations

from pathlib import Path

from rbfrag.campaign.add_motions import add_motions


def test_index_of_a_folder_is_no_record(tmp_path: Path) -> None:
    folder = tmp_path / "lists"
    folder.mkdir()
    (folder / "120111.th").write_text("0.1\n0.2\n-0.1\n")
    (folder / "120112.th").write_text("0.2\n0.1\n-0.3\n")
    (folder / "dt_index.txt").write_text("120111.th 0.01\n120112.th 0.005\n")
    report = add_motions([folder], db=tmp_path / "motions.db", units="g")
    assert report.failed == ()
    assert len(report.added) == 2
