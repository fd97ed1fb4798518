"""The list of readers is complete; each reads its sound files and rejects what broke it once."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random
from types import FrameType

import pytest

from benchmarks.fuzz_readers import Tally, bases, read_record
from benchmarks.readers import READERS, Reader, _database
from rbfrag.errors import MOST_CHARACTERS, InputError, MotionFileError, RbfragError, one_paragraph
from rbfrag.motions.metadata import read_metadata
from tests.conftest import ROOT

PACKAGE = ROOT / "rbfrag"

OPENING = frozenset({
    "open", "read_bytes", "read_text", "ParquetFile", "open_csv", "read_csv", "read_parquet",
    "read_dataframe", "load", "fromfile", "loadtxt", "genfromtxt", "ParseFile", "iterparse",
    "source_text", "reading", "read_xml", "xml_events", "csv_rows", "toml_document",
    "json_document", "connect_sqlite",
})  # fmt: skip
"""What opens a file, in Python, in the libraries that rbfrag uses, and in rbfrag itself."""

NO_READERS = {
    "__init__.py:_home_of_names": "the package's own stub",
    "cli/main.py:end_unwritten": "opens what swallows output that cannot be written",
    "campaign/runner.py:_processor": "the computer's own description",
    "exchange/openquake_tables.py:_opened": "HDF5's own library, which damaged bytes may hang",
    "plots/shakemap.py:world": "the package's own coastline",
    "rockmasses/file.py:rock_mass_of_toml": "is given the text",
    "service/app.py:lifespan": "opens the pool of processes",
    "service/app.py:make_app": "its inner function opens the pool of processes",
    "service/predict.py:answer_table": "hands on the table, and reads the answer",
    "service/work.py:run": "opens the pool of processes",
}
"""Functions that open files and make nothing of a file from outside."""


def functions_that_open() -> Iterator[str]:
    """`module:function` of every function in which something is opened for reading."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
                continue
            if any(map(opens, ast.walk(function))):
                yield f"{path.relative_to(PACKAGE)}:{function.name}"


def opens(node: ast.AST) -> bool:
    if not isinstance(node, ast.Call):
        return False
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    modes = [a.value for a in node.args if isinstance(a, ast.Constant)]
    return name in OPENING and not any(str(mode)[:1] in "wax" for mode in modes)


def test_the_list_of_readers_is_complete(tmp_path: Path) -> None:
    _database.cache_clear()  # what makes its sound file is to be seen, too
    called: set[str] = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(str(PACKAGE)):
            name = Path(frame.f_code.co_filename).relative_to(PACKAGE)
            called.add(f"{name}:{frame.f_code.co_name}")

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        for reader in READERS:
            read_all(reader, tmp_path)
        (tmp_path / "record").write_bytes(bases(None)["rbfrag CSV"][0])
        read_record("rbfrag CSV", tmp_path / "record", Random(0), Tally())
    finally:
        sys.setprofile(before)
    opening = set(functions_that_open())
    assert opening - called - {*NO_READERS} == set()
    assert {*NO_READERS} <= opening
    assert len(opening & called) > 5


def read_all(reader: Reader, folder: Path) -> None:
    for content in reader.sound():
        suffix = reader.suffix
        path = folder / (f"sound{suffix}" if suffix.startswith(".") else suffix)
        path.write_bytes(content)
        reader.read(path)
        path.unlink()


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_every_sound_file_is_read(reader: Reader, tmp_path: Path) -> None:
    read_all(reader, tmp_path)


BY_NAME = {reader.name: reader for reader in READERS}

OFTEN = 3000
"""Depth of a document that no parser of Python reaches."""


def spoilt_parquet() -> bytes:
    content = bytearray(BY_NAME["blocks Parquet"].sound()[0])
    # the first page of data stands at the beginning, behind the four letters PAR1
    content[4:60] = bytes(56)
    return bytes(content)


SPOILT = {
    "integer of 5000 digits": ("block TOML", b"alpha1_deg = " + b"9" * 5000 + b"\n"),
    "deep array": ("block TOML", b"vertices_m = " + b"[" * OFTEN + b"]" * OFTEN),
    "long dotted key": ("block TOML", b".".join([b"a"] * 100_000) + b" = 1\n"),
    "dotted key in a table": ("rock mass TOML", b"a = {b" + b".b" * 100_000 + b" = 1}\n"),
    "dotted header": ("rock mass TOML", b"[a" + b".a" * 100_000 + b"]\n"),
    "deep JSON": ("hazard curve JSON", b'{"a": ' * OFTEN + b"1" + b"}" * OFTEN),
    "integer beyond a float": (
        "hazard curve JSON",
        b'{"Peak Ground Acceleration": {"xs": [1' + b"0" * 400 + b', 1], "ys": [1, 0.1]}}',
    ),
    "JSON with a key twice": ("blocks GeoJSON", b'{"type": 1, "type": "FeatureCollection"}'),
    "JSON of a million keys, one twice": (
        "blocks GeoJSON",
        b"{" + b",".join(b'"%d":1' % i for i in range(1_000_000)) + b',"999999":1}',
    ),
    "deep XML": ("NRML", b"<a>" * OFTEN + b"</a>" * OFTEN),
    "text in many pieces": ("NRML", b"<nrml>" + b"a<!---->" * 400_000 + b"</nrml>"),
    "cell without end": ("block CSV", b'x_m,y_m,contact\n0,0,"' + b"h" * 200_000 + b"\n"),
    "long cell": ("pelicun", b"ID,Demand-Type," + b"x" * 200_000 + b"\n"),
    "no header": ("realizations", b"# rlz_id,weight\n"),
    "damaged page": ("blocks Parquet", spoilt_parquet()),
    "damaged page of a table": ("predicted Parquet", spoilt_parquet()),
    "steering a terminal": ("block TOML", b'"\\u001b[2J\\u202e" = 1\n'),
    "long name of a block": ("blocks CSV", b"block_id,p2_1_s2,kr\n" + b"a" * 201 + b",3,0.1\n"),
    "long name of an asset": (
        "pelicun",
        b"ID,Demand-Type,Demand-Unit,LS1-Family,LS1-Theta_0\n"
        + b"a" * 201 + b",Peak Ground Velocity,mps,lognormal,1\n",
    ),
    "long name of an earthquake": ("metadata", b"file,event_id\na.txt," + b"e" * 201 + b"\n"),
}  # fmt: skip


@pytest.mark.parametrize("case", SPOILT)
def test_what_once_ended_in_a_traceback_is_one_sentence(case: str, tmp_path: Path) -> None:
    name, content = SPOILT[case]
    path = tmp_path / f"spoilt{BY_NAME[name].suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError) as rejected:
        BY_NAME[name].read(path)
    message = str(rejected.value)
    assert tmp_path.name in message
    assert message.isprintable()
    assert len(message) <= MOST_CHARACTERS


@pytest.mark.parametrize(
    "name",
    ["block CSV", "rock mass CSV", "hazard curve CSV", "realizations", "metadata", "pelicun"],
)
def test_lone_carriage_returns_end_lines(name: str, tmp_path: Path) -> None:
    reader = BY_NAME[name]
    for content in reader.sound():
        path = tmp_path / f"old{reader.suffix}"
        path.write_bytes(content.replace(b"\n", b"\r"))
        reader.read(path)


def test_a_name_of_200_characters_is_one(tmp_path: Path) -> None:
    path = tmp_path / "metadata.csv"
    path.write_text(f"file,event_id\na.txt,{'e' * 200}\n")
    assert read_metadata(path).rows[0].event_id == "e" * 200


def test_messages_are_bounded_and_printable() -> None:
    for error in (
        RbfragError("a" * 5000),
        InputError("one\n\ttwo\x1b[31m\u202e " + "and more " * 400 + "do this"),
        MotionFileError("file\x07.txt", "word " * 1000, line=3),
    ):
        assert str(error).isprintable()
        assert len(str(error)) <= MOST_CHARACTERS < 500
    assert str(InputError("one\n  two\x00")) == r"one two\x00"
    assert one_paragraph("start " + "x " * 999 + "do this").endswith("do this")
    assert one_paragraph("install it with  pip") == "install it with  pip"
