"""Tables of blocks in Excel workbooks, and in the CSV that spreadsheets of decimal commas write."""

from __future__ import annotations

import csv
import datetime
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange.block_rows import read_blocks
from rbfrag.exchange.table_answers import TableAnswer, predict_table
from rbfrag.exchange.tables import workbook
from rbfrag.exchange.tables.files import write_block_table
from rbfrag.hazards.curve_file import read_hazard_curves
from rbfrag.motions.readers import read_motions
from rbfrag.question.components import SINGLE_ASSUMED
from tests.block_tables import read_columns

HEAD = ("block_id", "p2_1_s2", "kr", "pgv_m_s", "remark")


def save(path: Path, *rows: tuple[object, ...]) -> Path:
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    book.create_sheet("notes").append(["not read"])
    book.save(path)
    return path


def answer(source: Path, target: Path, **arguments: float) -> TableAnswer:
    return predict_table(source, target, inputs=arguments, model=None, level=0.95, db=None)


def rows_of(path: Path) -> list[dict[str, object]]:
    head, *rows = openpyxl.load_workbook(path).active.iter_rows(values_only=True)
    return [dict(zip(map(str, head), row, strict=True)) for row in rows]


def test_a_workbook_is_answered_row_by_row_as_csv_is(tmp_path: Path) -> None:
    source = save(
        tmp_path / "blocks.xlsx",
        HEAD,
        (1, 3, 0.1, 0.6, "=1+1"),
        (2, 3.0, datetime.datetime(2024, 3, 1), 0.6, None),
        (3, "3", "0,1", 0.6, "007"),
        (None,) * 5,
        ("d", 3, True, 0.6, 2.5),
        ("e", 3, 0.1, None, None),
        ("f", 3, 0.1, 0.6, None, "beside"),
        ("g", 3, "1,234", 0.6, None),
        (" ", "", None, None, None),
    )
    book = openpyxl.load_workbook(source)
    book.active["E2"].data_type = "s"  # a text, as our own writer has it, not a formula
    book.save(source)
    document = answer(source, tmp_path / "out.xlsx")
    assert (document.rows, document.answered) == (7, 2)
    assert "5 of 7 blocks could not be used" in str(document.warnings)
    assert "row 3: kr is the date 2024-03-01" in str(document.warnings)
    rows = rows_of(tmp_path / "out.xlsx")
    plain = tmp_path / "plain.csv"
    plain.write_text("p2_1_s2,kr,pgv_m_s\n3,0.1,0.6\n")
    answer(plain, tmp_path / "plain-out.csv")
    with (tmp_path / "plain-out.csv").open(newline="") as file:
        (expected,) = csv.DictReader(file)
    assert rows[0]["probability"] == pytest.approx(float(expected["probability"]), rel=1e-12)
    assert rows[0]["in_domain"] is True
    assert (rows[0]["block_id"], rows[0]["remark"], rows[3]["remark"]) == (1, "=1+1", 2.5)
    assert rows[2]["remark"] == "007"
    assert rows[2]["probability"] == rows[0]["probability"]  # a decimal comma
    assert [row["probability"] is None for row in rows] == [False, True, False, *[True] * 4]
    reasons = [str(row["reason"]) for row in rows]
    assert reasons[0] == "None"
    assert "kr is the date 2024-03-01 00:00:00, not a number" in reasons[1]
    assert "kr = '1,234' is 1.234 or 1234: write it as a number" in reasons[6]
    assert "kr is TRUE, not a number" in reasons[3]
    assert "pgv_m_s" in reasons[4]
    assert "6 cells under 5 columns" in reasons[5]
    for name in ("out.csv", "out.parquet"):
        answer(source, tmp_path / name)
        parsed = read_columns(tmp_path / name, ("probability",), texts=("reason",))
        assert np.isfinite(parsed["probability"]).tolist() == [True, False, True] + [False] * 4
        assert parsed["reason"].tolist()[3:] == reasons[3:]
    again = answer(tmp_path / "out.xlsx", tmp_path / "again.xlsx")
    assert (again.rows, again.answered) == (7, 3)  # the cell beside the table is gone


def test_formulas_are_read_as_their_values(tmp_path: Path) -> None:
    source = save(tmp_path / "a.xlsx", ("p2_1_s2", "kr"), (3, "=0.05*2"))
    with pytest.raises(InputError, match=r"formula in cell B2 was never computed: open the"):
        read_blocks(source)
    computed = tmp_path / "b.xlsx"
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(computed, "w") as new:
        for member in old.infolist():
            text = old.read(member)
            if member.filename == "xl/worksheets/sheet1.xml":
                assert b"<f>0.05*2</f><v" in text
                text = text.replace(b"<v />", b"<v>0.1</v>").replace(b"<v></v>", b"<v>0.1</v>")
            new.writestr(member, text)
    assert read_blocks(computed).require_all()["kr"].tolist() == [0.1]


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize(("delimiter", "decimal"), [(";", ","), (";", "."), ("\t", ",")])
def test_csv_is_answered_as_it_is_written(
    tmp_path: Path, mark: str, delimiter: str, decimal: str
) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    table = "Größe,p2_1_s2,kr,pgv_m_s\nä,3,0.1,0.6\nb,3,1e-1,0.6\nc,3,x,0.6\n"
    written = table.replace(",", delimiter).replace(".", decimal)
    source.write_text(mark + written, encoding="utf-8")
    assert answer(source, target).answered == 2
    text = target.read_text(encoding="utf-8")
    assert text.startswith(f"{mark}Größe{delimiter}")
    head, first, second, third = text.removeprefix(mark).splitlines()
    assert first.startswith(written.splitlines()[1])
    cells = dict(zip(head.split(delimiter), first.split(delimiter), strict=True))
    plain = tmp_path / "plain.csv"
    plain.write_text(table)
    answer(plain, tmp_path / "plain-out.csv")
    expected = read_columns(tmp_path / "plain-out.csv", ("probability",))["probability"]
    assert float(cells["probability"].replace(decimal, ".")) == pytest.approx(expected[0])
    assert read_columns(target, ("probability",))["probability"][1] == pytest.approx(expected[1])
    assert third.endswith("kr = 'x' is not a number")
    assert second


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_rows_above_the_names_of_csv(tmp_path: Path, delimiter: str) -> None:
    """A large table too, which pyarrow reads."""
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    row = "3;0.1;0.6".replace(";", delimiter)
    row = row if delimiter == "," else row.replace(".", ",")
    names = "p2;kr;pgv".replace(";", delimiter)
    title = 'Survey, of 12.5. and\n"two\nlines"\n\n'
    for count in (3, 150_000):
        source.write_text("\n".join([title + names, *[row] * count, ""]))
        document = answer(source, target)
        assert (document.rows, document.answered) == (count, count)
        assert [*document.warnings] == [
            SINGLE_ASSUMED,
            "the names of the columns are in line 5: the lines above are ignored",
        ]
        assert target.read_text().count("\n") == count + 1
    source.write_text("\n".join([title + names, row, row.replace("3", "x")]))
    assert "line 7: p2 = 'x'" in str(answer(source, target).warnings)


def test_a_point_among_decimal_commas_is_not_guessed_at(tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text("p2_1_s2;kr;pgv_m_s\n3;0,1;0,6\n3;1.234;0,6\n")
    document = answer(source, tmp_path / "b.csv")
    assert document.answered == 1
    words = "kr = '1.234' has a decimal point, and the table has decimal commas"
    assert words in str(document.warnings)
    source.write_text('p2_1_s2,kr\n3,"0,1"\n')
    assert answer(source, tmp_path / "b.csv", pgv_m_s=0.6).answered == 1
    source.write_text('p2_1_s2,kr\n3,"1,100"\n')
    with pytest.raises(InputError, match=r"line 2: kr = '1,100' is 1\.100 or 1100"):
        read_blocks(source)


def test_one_bad_row_of_many(tmp_path: Path) -> None:
    size = 10_000
    kr = np.full(size, "0.1", dtype=object)
    kr[5_432] = "?"
    source, target = tmp_path / "a.xlsx", tmp_path / "b.csv"
    write_block_table({"p2_1_s2": np.full(size, 3.0), "kr": kr}, source)
    document = answer(source, target, pgv_m_s=0.6)
    assert (document.rows, document.without_answer) == (size, 1)
    assert "1 of 10,000 blocks could not be used" in str(document.warnings)
    assert "row 5434: kr = '?' is not a number" in str(document.warnings)


@pytest.mark.parametrize(
    "content", [b"", b"PK\x03\x04 no archive", b"p2_1_s2,kr\n3,0.1\n", b"\xd0\xcf\x11\xe0 old"]
)
def test_other_files_are_rejected_in_one_sentence(tmp_path: Path, content: bytes) -> None:
    source = tmp_path / "a.xlsx"
    source.write_bytes(content)
    with pytest.raises(InputError, match="not an Excel workbook"):
        read_blocks(source)


def test_what_no_sheet_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    columns = {"kr": np.full(9, 0.1)}
    monkeypatch.setattr(workbook, "MOST_ROWS", 9)
    with pytest.raises(InputError, match="a sheet of Excel has 8 rows below its names"):
        write_block_table(columns, tmp_path / "a.xlsx")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(workbook, "MOST_BYTES", 100)
    with pytest.raises(InputError, match="uncompressed size"):
        read_blocks(save(tmp_path / "b.xlsx", ("p2_1_s2", "kr"), (3, 0.1)))


def test_without_openpyxl_the_extra_is_named(tmp_path: Path) -> None:
    program = """
import sys
sys.modules["openpyxl"] = None
from rbfrag.errors import MissingExtraError
from rbfrag.exchange.block_rows import read_blocks
from rbfrag.exchange.tables.files import table_path
open("a.xlsx", "w").close()
for act in (lambda: table_path("a.xlsx"), lambda: read_blocks("a.xlsx")):
    try:
        act()
    except MissingExtraError as error:
        print(error)
"""
    process = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert process.stdout.count("pip install 'rbfrag[excel]'") == 2, process.stderr


def save_ods(path: Path, **sheets: list[tuple[object, ...]]) -> Path:
    """An OpenDocument spreadsheet as LibreOffice has it."""
    import pandas as pd

    with pd.ExcelWriter(path, engine="odf") as writer:
        for name, rows in sheets.items():
            frame = pd.DataFrame(rows)
            frame.to_excel(writer, sheet_name=name, header=False, index=False)
    return path


def test_an_open_document_spreadsheet_is_answered_as_a_workbook_is(tmp_path: Path) -> None:
    rows = [HEAD, (1, 3, 0.1, 0.6, "y"), ("b", 3.5, "0,1", 0.6, None), ("c", 3, None, 0.6, "x")]
    source = save_ods(tmp_path / "blocks.ods", blocks=rows, other=[("kr",), (0.1,)])
    save(tmp_path / "blocks.xlsx", *rows)
    document = answer(source, tmp_path / "a.csv")
    same = answer(tmp_path / "blocks.xlsx", tmp_path / "b.csv")
    assert (document.rows, document.without_answer) == (same.rows, same.without_answer) == (3, 1)
    first, second = (
        read_columns(tmp_path / name, ("probability",), texts=("block_id",))
        for name in ("a.csv", "b.csv")
    )
    assert [*first["block_id"]] == [*second["block_id"]]
    np.testing.assert_array_equal(
        np.asarray(first["probability"]), np.asarray(second["probability"])
    )
    with pytest.raises(InputError, match="there is no sheet 'third'; the sheets are blocks, other"):
        read_blocks(source, sheet="third")
    with pytest.raises(InputError, match=r"unsupported suffix '\.ods'"):
        write_block_table({"kr": np.ones(1)}, tmp_path / "out.ods")
    source.write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(InputError, match=r"spreadsheet \(.ods\), or a damaged one"):
        read_blocks(source)


def test_without_odfpy_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = save_ods(tmp_path / "blocks.ods", blocks=[("p2", "kr"), (3.0, 0.1)])
    monkeypatch.setitem(sys.modules, "odf", None)
    monkeypatch.setitem(sys.modules, "odf.opendocument", None)
    with pytest.raises(MissingExtraError, match="require odfpy"):
        read_blocks(source)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
def test_text_in_utf_16(tmp_path: Path, delimiter: str, encoding: str) -> None:
    rows = [("block_id", "p2_1_s2", "kr", "pgv_m_s"), ("Größe", "3", "0.1", "0.6")]
    text = "".join(delimiter.join(row) + "\r\n" for row in rows)
    mark = b"" if encoding == "utf-16" else b"\xfe\xff"
    (tmp_path / "blocks.csv").write_bytes(mark + text.encode(encoding))
    answer(tmp_path / "blocks.csv", tmp_path / "out.csv")
    result = (tmp_path / "out.csv").read_text(encoding="utf-8-sig")
    assert "Größe" in result
    # Excel's "Unicode text": a hazard curve and an accelerogram, too
    curve = "pgv_m_s,annual_rate\r\n0.1,0.01\r\n0.5,0.001\r\n"
    (tmp_path / "curve.csv").write_bytes(mark + curve.encode(encoding))
    assert read_hazard_curves(tmp_path / "curve.csv")[0].levels.tolist() == [0.1, 0.5]
    record = "time [s],a [m/s²]\r\n" + "".join(f"{0.01 * i:.2f},{i % 7}\r\n" for i in range(50))
    (tmp_path / "record.csv").write_bytes(mark + record.encode(encoding))
    assert read_motions(tmp_path / "record.csv")[0].npts == 50
