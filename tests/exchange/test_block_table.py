"""Tables go to disk and come back to the bit, whole or not at all."""

from __future__ import annotations

import csv
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import read_blocks
from rbfrag.exchange.tables import files
from rbfrag.exchange.tables.files import write_block_table
from tests.block_tables import read_columns

TABLE = {
    "block_id": np.arange(1, 4),
    "kr": np.array([0.1, math.nan, -math.inf]),
    "mode": np.array(["topple", "", "slide"], dtype=object),
    "in_domain": np.array([True, False, False]),
    "reason": np.array(["", 'a, "b"', "no block; too thin"], dtype=object),
}
KINDS = (".csv", ".xlsx", ".parquet")


@pytest.mark.parametrize("kind", KINDS)
# The first call loads pyarrow, which takes as long as it takes.
@given(values=st.lists(st.floats(width=64), min_size=1, max_size=30))
def test_numbers_come_back_to_the_bit(
    kind: str, values: list[float], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("table") / f"a{kind}"
    column = np.array(values)
    write_block_table({"kr": column, "other": np.zeros(column.size)}, path)
    parsed = read_columns(path, ("kr",))["kr"]
    if kind == ".xlsx":  # 16 digits, and Excel knows no -0
        assert np.allclose(parsed, column, rtol=1e-15, atol=0.0, equal_nan=True)
        return
    assert np.array_equal(parsed, column, equal_nan=True)
    fine = ~np.isnan(column)
    assert np.array_equal(np.signbit(parsed[fine]), np.signbit(column[fine]))


def test_cells_of_a_csv(tmp_path: Path) -> None:
    path = write_block_table(TABLE, tmp_path / "a.csv")
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows == [
        list(TABLE),
        ["1", "0.1", "topple", "true", ""],
        ["2", "", "", "false", 'a, "b"'],
        ["3", "-inf", "slide", "false", "no block; too thin"],
    ]


def test_columns_of_a_parquet_file(tmp_path: Path) -> None:
    from pyarrow import parquet

    path = write_block_table(TABLE, tmp_path / "a.parquet")
    table = parquet.read_table(path)
    assert [str(kind) for kind in table.schema.types] == [
        "int64", "double", "string", "bool", "string",
    ]  # fmt: skip
    assert table.to_pydict()["kr"] == [0.1, None, -math.inf]
    assert table.to_pydict()["reason"] == TABLE["reason"].tolist()


@pytest.mark.parametrize("kind", KINDS)
def test_a_failure_keeps_the_older_file(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a{kind}"
    path.write_text("older")

    def fail(place: Path, *about: object, **more: object) -> None:
        place.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, "table_writer", fail)
    with pytest.raises(InputError, match="No space left"):
        write_block_table(TABLE, path)
    assert path.read_text() == "older"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["a", "a.xls", "none/a.csv"])
def test_places_that_cannot_be_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="table "):
        write_block_table(TABLE, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.csv", b"kr,p2\n0.1,3\n0.1\n", "line 3: 1 cells under 2 columns"),
        ("a.csv", b"kr,p2\n0.1,3\nx,3\n", "line 3: kr = 'x' is not a number"),
        ("a.csv", b"p2\n3\n", "no column kr; the columns are p2"),
        ("a.csv", b"", "no column kr; the columns are none"),
        ("a.csv", b"kr\n\xff\n", "not a text file"),
        ("a.csv", b"PK\x03\x04\x14\0", "is a zip file: unpack it"),
        ("a.parquet", b"kr\n0.1\n", "not a Parquet file"),
        ("a.txt", b"kr\n0.1\n", "use .csv, .xlsx, .parquet or .ods"),
    ],
)
def test_tables_that_cannot_be_read(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=words):
        read_columns(tmp_path / name, ("kr",))


def test_missing_tables_and_columns(tmp_path: Path) -> None:
    for kind in KINDS:
        with pytest.raises(InputError, match="no such file"):
            read_columns(tmp_path / f"none{kind}", ("kr",))
    path = write_block_table(TABLE, tmp_path / "a.parquet")
    with pytest.raises(InputError, match="no column p2; the columns are block_id, kr"):
        read_columns(path, ("p2",))
    with pytest.raises(InputError, match="row 1: mode = 'topple' is not a number"):
        read_columns(path, ("mode",))


def test_without_pyarrow_the_extra_is_named(tmp_path: Path) -> None:
    program = """
import sys
sys.modules["pyarrow"] = None
from rbfrag.errors import MissingExtraError
from tests.block_tables import read_columns
from rbfrag.exchange.tables.files import table_path
table_path("a.csv")
open("a.parquet", "w").close()
for act in (lambda: table_path("a.parquet"), lambda: read_columns("a.parquet", ("kr",))):
    try:
        act()
    except MissingExtraError as error:
        print(error)
"""
    process = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent.parent)},
    )
    assert process.stdout.count("pip install 'rbfrag[parquet]'") == 2, process.stderr


def test_rectangles_of_a_free_standing_kind(tmp_path: Path) -> None:
    """Of these the dip weakens, whichever way it leans, and the restitution is Housner's (1963)."""
    path = tmp_path / "blocks.csv"
    path.write_text(
        "height_m,width_m,dip_deg,kind,restitution\n"
        "3,0.6,-5,,\n3,0.6,-5,rocking,\n3,0.6,-5,rocking,0.9\n"
    )
    columns = read_blocks(path).require_all()
    backed, free_standing, _ = columns["kr"].tolist()
    alpha, dip = np.arctan(0.2), np.radians(5.0)
    assert (backed, free_standing) == pytest.approx((np.tan(alpha + dip), np.tan(alpha - dip)))
    assert columns["restitution"][1:] == pytest.approx([1.0 - 1.5 * np.sin(alpha) ** 2, 0.9])
    assert read_blocks(path, "rocking").require_all()["kr"][0] == pytest.approx(free_standing)


def test_text_of_another_encoding_is_rejected_with_its_row(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    texts = pa.array([b"A7", "Gr\u00fcn".encode("latin-1")]).view(pa.string())
    pq.write_table(pa.table({"block_id": texts, "kr": [0.1, 0.2]}), tmp_path / "a.parquet")
    with pytest.raises(InputError, match="column block_id, row 2: the text is not UTF-8"):
        read_columns(tmp_path / "a.parquet", ("block_id", "kr"))
