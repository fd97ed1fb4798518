"""Records in a zip: read by name or all of them, and no more than it may hold."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from rbfrag.campaign.add_motions import add_motions
from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions import archive
from rbfrag.motions.readers import read_motion, read_motions
from tests.motions.written_by_networks import csmip_v2, esm_asc

SERIES = [f"{0.5 * (-1) ** i * i:.3f}" for i in range(60)]
V2 = csmip_v2([("Up", SERIES), ("H1", SERIES[::-1])], 0.01)
V3 = "Response and Fourier amplitude spectra\nCorrected accelerogram  X-1\n"


def zipped(
    path: Path, members: Mapping[str, str | bytes], method: int = zipfile.ZIP_DEFLATED
) -> Path:
    with zipfile.ZipFile(path, "w", method) as file:
        for name, content in members.items():
            file.writestr(name, content)
    return path


def rejection(path: Path) -> str:
    with pytest.raises(MotionFileError) as caught:
        read_motions(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.fixture
def records(tmp_path: Path) -> Path:
    return zipped(
        tmp_path / "records.zip",
        {
            "chan001.v2": V2,
            "chan001.v3": V3,
            "sub/north.asc": esm_asc(SERIES[5:], 0.01),
            "README.md": "what these are\n",
            "__MACOSX/._chan001.v2": b"\0\1",
        },
    )


def test_a_member_reads_as_the_file(tmp_path: Path, records: Path) -> None:
    (tmp_path / "chan001.v2").write_text(V2)
    alone = read_motions(tmp_path / "chan001.v2")
    packed = read_motions(records / "chan001.v2")
    assert [motion.sha256 for motion in packed] == [motion.sha256 for motion in alone]
    assert packed[0].source_file == "records.zip/chan001.v2"
    assert read_motion(f"{records}/chan001.v2#1").sha256 == alone[1].sha256
    assert read_motion(records / "sub" / "north.asc").source_file == "records.zip/sub/north.asc"


def test_all_members(records: Path) -> None:
    traces = [(motion.source_file, motion.trace_index) for motion in read_motions(records)]
    assert traces == [
        ("records.zip/chan001.v2", 0),
        ("records.zip/chan001.v2", 1),
        ("records.zip/sub/north.asc", 0),
    ]
    with pytest.raises(
        MotionFileError, match=r"has 2 records: give one, such as records.zip/chan001"
    ):
        read_motion(records)


def test_real_members(formats_dir: Path) -> None:
    motions = read_motions(formats_dir / "records" / "58658_V2_members.zip")
    assert len(motions) == 20
    assert {(motion.npts, motion.dt_s) for motion in motions} == {(13000, 0.005)}


def test_adding(tmp_path: Path, records: Path) -> None:
    table = tmp_path / "META.csv"
    table.write_text(
        "file,event_id,magnitude\nrecords.zip,e1,6.5\nrecords.zip/sub/north.asc,e2,6\n"
        "records.zip/gone.v2,e3,6\n"
    )
    report = add_motions(tmp_path, db=tmp_path / "one.db", metadata=table)
    # spectra beside their record and the text about it are passed over, as in a folder
    assert len(report.added) == 3
    (missing,) = report.failed
    assert missing.path.endswith("gone.v2")
    assert "line 4 of the metadata" in missing.reason
    again = add_motions(records / "chan001.v2", db=tmp_path / "one.db", metadata=table)
    assert len(again.already_stored) == 2
    with pytest.raises(InputError, match="file or folder not found"):
        add_motions(tmp_path / "none.zip" / "a.v2", db=tmp_path / "one.db")


def test_spectra_alone_are_rejected(tmp_path: Path) -> None:
    path = zipped(tmp_path / "spectra.zip", {"chan001.v3": V3})
    assert "use the .v2" in rejection(path)
    report = add_motions(path, db=tmp_path / "one.db")
    assert "use the .v2" in report.failed[0].reason


def test_a_member_that_is_not_there(records: Path) -> None:
    assert "no such member in the zip archive; members are, for example" in rejection(
        records / "chan002.v2"
    )
    assert "there is no such file" in rejection(records.parent / "other" / "chan002.v2")


@pytest.mark.parametrize("name", ["/etc/passwd", "../outside.v2", "a/../../b.v2", "C:/a.v2"])
def test_names_that_lead_out(tmp_path: Path, name: str) -> None:
    assert "points outside the archive" in rejection(zipped(tmp_path / "out.zip", {name: V2}))


def test_a_name_twice(tmp_path: Path) -> None:
    path = tmp_path / "twice.zip"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("a.v2", V2)
        with pytest.warns(UserWarning, match="Duplicate name"):
            file.writestr("a.v2", V2)
    assert "'a.v2' twice" in rejection(path)


def test_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bomb = zipped(tmp_path / "bomb.zip", {"a.v2": b"0" * 10_000_000})
    assert bomb.stat().st_size < 20_000
    assert "compression ratio exceeds 200" in rejection(bomb)
    many = zipped(tmp_path / "many.zip", {f"{i}.v2": "" for i in range(200)})
    monkeypatch.setattr(archive, "LARGEST_DIRECTORY_BYTES", 5000)
    assert "too many members" in rejection(many)
    monkeypatch.setattr(archive, "LARGEST_FILE_BYTES", len(V2) * 3 // 2)
    two = zipped(tmp_path / "two.zip", {"a.v2": V2, "b.v2": V2})
    assert f"{2 * len(V2)} bytes long: give one" in rejection(two)
    assert len(read_motions(two / "a.v2")) == 2
    monkeypatch.setattr(archive, "LARGEST_FILE_BYTES", len(V2) - 1)
    assert "too large for an accelerogram" in rejection(two / "a.v2")


def test_a_size_that_is_understated(tmp_path: Path) -> None:
    # no more is unpacked than is stated, and the checksum then fails
    raw = bytearray(zipped(tmp_path / "lie.zip", {"a.v2": V2}).read_bytes())
    for mark, offset in ((b"PK\3\4", 22), (b"PK\1\2", 24)):
        at = raw.index(mark) + offset
        raw[at : at + 4] = (100).to_bytes(4, "little")
    (tmp_path / "lie.zip").write_bytes(raw)
    assert "the zip is damaged" in rejection(tmp_path / "lie.zip")


def test_what_cannot_be_unpacked(tmp_path: Path) -> None:
    assert "has no record" in rejection(zipped(tmp_path / "none.zip", {"README.md": "x"}))
    assert "deflate" in rejection(
        zipped(tmp_path / "lzma.zip", {"a.v2": V2}, method=zipfile.ZIP_LZMA)
    )
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as file:
        file.writestr("a.v2", V2)
    assert "unpack it" in rejection(
        zipped(tmp_path / "nested.zip", {"inner.zip": inner.getvalue()})
    )
    raw = zipped(tmp_path / "cut.zip", {"a.v2": V2}).read_bytes()
    for size in (4, 30, len(raw) // 2, len(raw) - 5):
        (tmp_path / "cut.zip").write_bytes(raw[:size])
        assert "the zip is damaged" in rejection(tmp_path / "cut.zip")
