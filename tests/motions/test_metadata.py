"""Metadata tables: found by file and trace, bad rows rejected with their line."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.metadata import read_metadata


def table(folder: Path, text: str, *, encoding: str = "utf-8") -> Path:
    path = folder / "meta.csv"
    path.write_bytes(text.encode(encoding))
    return path


def test_every_column(tmp_path: Path) -> None:
    path = table(
        tmp_path,
        "notes,file,trace_index,event_id,units,is_vertical,companion_group,magnitude,processing,"
        "earthquake,year,station,component,dt_s\n"
        'by tape,"a/b, c.txt",2,loma-prieta,gal,1,pair 1,6.93,corrected,"Loma Prieta, CA",1989,'
        "CLS,UP,0.005\n",
    )
    traced = read_metadata(path).trace(tmp_path / "a" / "b, c.txt", 2)
    assert traced is not None
    assert traced.event_id == "loma-prieta"
    assert traced.units == "gal"
    assert traced.is_vertical is True
    assert traced.companion_group == "pair 1"
    assert traced.magnitude == 6.93
    assert traced.processing == "corrected"
    assert traced.earthquake == "Loma Prieta, CA"
    assert traced.year == "1989"
    assert (traced.station, traced.component) == ("CLS", "UP")
    assert traced.dt_s == 0.005
    assert traced.line == 2
    assert traced.attributes == {"notes": "by tape"}
    assert read_metadata(path).not_read == ()


def test_a_column_that_is_nearly_one_is_rejected(tmp_path: Path) -> None:
    for wrong, right in (("proccesing", "processing"), ("magnitud", "magnitude"),
                         ("trace index", "trace_index"), ("eventid", "event_id")):  # fmt: skip
        with pytest.raises(MotionFileError, match=f"{wrong}: did you mean {right}"):
            read_metadata(table(tmp_path, f"file,{wrong}\na.AT2,1\n"))
    read = read_metadata(table(tmp_path, "file,unit,operator,rsn,rank\na.AT2,gal,me,1,2\n"))
    assert read.rows[0].units == "gal"
    assert read.rows[0].attributes == {"operator": "me", "rsn": "1", "rank": "2"}


def test_words_that_do_not_tell_of_the_processing_are_rejected(tmp_path: Path) -> None:
    path = table(tmp_path, "file,processing\na.AT2,corrected\nb.AT2,uncorected\n")
    with pytest.raises(MotionFileError, match="begin with one of corrected") as caught:
        read_metadata(path)
    assert caught.value.line == 3


def test_file_alone_states_nothing(tmp_path: Path) -> None:
    metadata = read_metadata(table(tmp_path, "file\na.AT2\n\n"))
    traced = metadata.trace(tmp_path / "a.AT2", 0)
    assert traced is not None
    assert traced.event_id == ""
    assert traced.is_vertical is None
    assert traced.magnitude is None
    assert traced.units is None
    assert traced.dt_s is None
    assert metadata.trace(tmp_path / "a.AT2", 1) is traced
    assert metadata.trace(tmp_path / "b.AT2", 0) is None
    assert metadata.file(tmp_path / "b.AT2") == []


def test_traces_of_a_file_in_order(tmp_path: Path) -> None:
    path = table(tmp_path, "file,trace_index,component\na.V2A,2,UP\na.V2A,0,N\na.V2A,1,E\n")
    names = [traced.component for traced in read_metadata(path).file(tmp_path / "a.V2A")]
    assert names == ["N", "E", "UP"]


@pytest.mark.parametrize("order", [("", "1"), ("0", "")])
def test_a_whole_file_and_one_of_its_traces(tmp_path: Path, order: tuple[str, str]) -> None:
    first, second = order
    path = table(tmp_path, f"file,trace_index\na.V2A,{first}\na.V2A,{second}\n")
    with pytest.raises(MotionFileError, match="one row without trace_index for the file"):
        read_metadata(path)


def test_byte_order_mark_and_windows_newlines(tmp_path: Path) -> None:
    path = table(tmp_path, "file,event_id\r\na.AT2,quake\r\n", encoding="utf-8-sig")
    traced = read_metadata(path).trace(tmp_path / "a.AT2", 0)
    assert traced is not None
    assert traced.event_id == "quake"


def test_relative_absolute_and_roundabout_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "other" / "b.AT2"
    (tmp_path / "records").mkdir()
    path = table(tmp_path / "records", f"file,event_id\nx/../a.AT2,one\n{elsewhere},two\n")
    monkeypatch.chdir(tmp_path)
    metadata = read_metadata(Path("records") / path.name)
    for name in ("records/a.AT2", "./records/a.AT2", tmp_path / "records" / "a.AT2"):
        traced = metadata.trace(name, 0)
        assert traced is not None
        assert traced.event_id == "one"
    traced = metadata.trace("other/b.AT2", 0)
    assert traced is not None
    assert traced.event_id == "two"
    assert metadata.trace("a.AT2", 0) is None


def test_native_units_of_formats_are_kept_as_text(tmp_path: Path) -> None:
    path = table(tmp_path, "file,file_units\na.V1,g/10\nb.UD,counts (scale factor in header)\n")
    metadata = read_metadata(path)
    assert [metadata.file(tmp_path / name)[0].units for name in ("a.V1", "b.UD")] == [
        "g/10",
        "counts (scale factor in header)",
    ]


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("name,event_id\na,b\n", 1, ("'file'",)),
        ("file,file\na,b\n", 1, ("'file'", "twice")),
        ("file\na.AT2\nb.AT2\na.AT2\n", 4, ("a.AT2", "line 2")),
        ("file,trace_index\na,0\na,1\n./a,1\n", 4, ("line 3",)),
        ("file,event_id\n,quake\n", 2, ("file",)),
        ("file,trace_index\na,-1\n", 2, ("trace_index", "'-1'")),
        ("file,trace_index\na,1.5\n", 2, ("trace_index", "'1.5'")),
        ("file,magnitude\na,6.7\nb,big\n", 3, ("magnitude", "'big'")),
        ("file,magnitude\na,nan\n", 2, ("magnitude", "'nan'")),
        ("file,is_vertical\na,perhaps\n", 2, ("is_vertical", "'perhaps'")),
        ("file,units\na,furlongs\n", 2, ("furlongs", "m/s2")),
        ("file,dt_s\na,0\n", 2, ("dt_s", "'0'")),
        ("file,dt_s\na,inf\n", 2, ("dt_s", "'inf'")),
        ("file,event_id\na,b,c\n", 2, ("3",)),
        ('file,event_id\na,"b\n', 2, ("CSV",)),
    ],
)
def test_bad_tables(tmp_path: Path, text: str, line: int, words: tuple[str, ...]) -> None:
    path = table(tmp_path, text)
    with pytest.raises(MotionFileError) as caught:
        read_metadata(path)
    assert caught.value.line == line
    message = str(caught.value)
    assert message.startswith(f"{path}, line {line}: ")
    for word in words:
        assert word in message


def test_tables_that_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(MotionFileError, match="no such file"):
        read_metadata(tmp_path / "nowhere.csv")
    with pytest.raises(MotionFileError, match="folder"):
        read_metadata(tmp_path)
    with pytest.raises(MotionFileError, match="empty"):
        read_metadata(table(tmp_path, ""))


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(alphabet='file,trace_index\n\r"; 01.\x1c\u2028é/\\', max_size=80))
def test_any_text_is_read_or_rejected(tmp_path: Path, text: str) -> None:
    path = table(tmp_path, "file,trace_index\n" + text)
    try:
        metadata = read_metadata(path)
    except InputError as error:
        rejection = str(error)
    else:
        rejection = ""
        assert metadata.file(tmp_path / "not there") == []
    assert not rejection or rejection.startswith(str(path))


SITE = (
    "file,event_id,companion_group,mechanism,depth_km,network,lat,lon,rjb_km,rrup_km,repi_km,vs30"
)


def test_metadata_of_earthquake_and_site(tmp_path: Path) -> None:
    path = table(tmp_path, f"{SITE},rsn\na.AT2,e,g,Strike slip,8.5,CE,37.1,-121.5,12,13,20,450,7\n")
    (row,) = read_metadata(path).rows
    assert (row.mechanism, row.depth_km) == ("strike-slip", 8.5)
    assert row.site == {
        "network": "CE", "lat": 37.1, "lon": -121.5, "rjb_km": 12.0, "rrup_km": 13.0,
        "repi_km": 20.0, "vs30_m_s": 450.0,
    }  # fmt: skip
    assert row.attributes == {"rsn": "7"}


@pytest.mark.parametrize(
    ("column", "cell", "words"),
    [
        ("lat", "91", "lat '91' must be from -90 to 90"),
        ("lon", "-181", "lon '-181' must be from -180 to 360"),
        ("rjb_km", "-1", "rjb_km '-1' must be at least 0"),
        ("vs30_m_s", "0", "vs30_m_s '0' must be above 0"),
        ("vs30_m_s", "rock", "vs30_m_s 'rock' must be above 0"),
        ("depth_km", "8000", "depth_km '8000' must be from -10 to 800"),
        ("mechanism", "oblique", "mechanism 'oblique' must be unspecified or strike-slip or"),
    ],
)
def test_values_out_of_range_are_rejected(
    tmp_path: Path, column: str, cell: str, words: str
) -> None:
    path = table(tmp_path, f"file,event_id,{column}\na.AT2,e,\nb.AT2,e,{cell}\n")
    with pytest.raises(MotionFileError, match=words) as caught:
        read_metadata(path)
    assert caught.value.line == 3


def test_values_of_one_earthquake_or_recording_agree(tmp_path: Path) -> None:
    head = "file,event_id,companion_group,mechanism,vs30_m_s,npts\n"
    path = table(tmp_path, f"{head}a,e,g,,450,3\nb,e,h,reverse,300,4\nc,e,g,,400,5\n")
    with pytest.raises(
        MotionFileError, match=r"recording 'g' is 400.* but 450.* line 2: correct"
    ) as caught:
        read_metadata(path)
    assert caught.value.line == 4
    path = table(tmp_path, f"{head}a,e,g,normal,,\nb,e,h,reverse,,\n")
    with pytest.raises(MotionFileError, match="mechanism of the earthquake 'e' is reverse, but"):
        read_metadata(path)
    with pytest.raises(MotionFileError, match="mechanism requires the event_id"):
        read_metadata(table(tmp_path, "file,mechanism\na.AT2,reverse\n"))


def test_columns_that_differ_between_components_are_no_attributes(tmp_path: Path) -> None:
    rows = "a,e,g,3,7\nb,e,g,4,7\nc,e,h,5,8\n"
    read = read_metadata(table(tmp_path, f"file,event_id,companion_group,npts,rsn\n{rows}"))
    assert read.not_read == ("npts",)
    assert [read.file(tmp_path / name)[0].attributes for name in "abc"] == [
        {"rsn": "7"}, {"rsn": "7"}, {"rsn": "8"},
    ]  # fmt: skip
