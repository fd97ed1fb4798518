"""Rows of a table of blocks that cannot be used: which they are, where they stand, what is said."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import BlockRows, read_blocks, read_draws
from rbfrag.exchange.table_answers import predict_table
from rbfrag.exchange.tables.files import write_block_table
from rbfrag.fragility.validation import describe_invalid, in_list
from tests.block_tables import read_columns

NAMES = ("block_id", "p2_1_s2", "kr", "mode", "weight", "lon", "lat")
SOUND = ("A", 3.0, 0.1, "topple", 1.0, 20.0, 40.5)
BAD: dict[str, tuple[tuple[Any, ...], str]] = {
    "empty cell": (("B", 3.0, None, "", 1.0, 20.0, 40.5), "kr is not a number"),
    "NaN": (("B", math.nan, 0.1, "", 1.0, 20.0, 40.5), "p2 is not a number"),
    "text": (("B", 3.0, "n/a", "", 1.0, 20.0, 40.5), "kr = 'n/a' is not a number"),
    "negative": (("B", -3.0, 0.1, "", 1.0, 20.0, 40.5), "p2 = -3 1/s² is not above zero"),
    "unstable": (
        ("B", 3.0, -0.1, "", 1.0, 20.0, 40.5),
        "kr = -0.1 is not above zero: the block is",
    ),
    "other mode": (("B", 3.0, 0.1, "slide", 1.0, 20.0, 40.5), "the block's mode is slide"),
    "weight": (("B", 3.0, 0.1, "", -1.0, 20.0, 40.5), "weight = -1: give a number not below"),
    "no place": (("B", 3.0, 0.1, "", 1.0, None, 40.5), "lon = nan, lat = 40.5 is no place"),
    "off the map": (("B", 3.0, 0.1, "", 1.0, 20.0, 95.0), "lon = 20, lat = 95 is no place"),
}
"""Rows that cannot be used, and how their reasons begin."""

FORMS = ("comma", "semicolon", "xlsx", "parquet", "geojson", "columns", "frame")
WORDS = {"comma": "line", "semicolon": "line", "geojson": "feature"}
FIRST = {"comma": 2, "semicolon": 2, "xlsx": 2}
"""What the rows of a form are counted by, from which number on; row and 1 where it is not said."""


def cell_text(cell: Any, decimal: str = ".") -> str:
    if cell is None or cell != cell:
        return ""
    return str(cell) if isinstance(cell, str) else str(cell).replace(".", decimal)


def table(folder: Path, form: str, rows: Sequence[tuple[Any, ...]]) -> Any:
    """Write rows in one of the forms that a table of blocks may have."""
    columns: dict[str, list[Any]] = {name: [row[i] for row in rows] for i, name in enumerate(NAMES)}
    if form == "columns":
        return columns
    if form == "frame":
        return pd.DataFrame(columns)
    if form in ("comma", "semicolon"):
        delimiter, decimal, mark = (",", ".", "") if form == "comma" else (";", ",", "\ufeff")
        lines = [NAMES, *([cell_text(cell, decimal) for cell in row] for row in rows)]
        path = folder / f"{form}.csv"
        text = "\r\n".join(delimiter.join(line) for line in lines)
        path.write_text(mark + text, encoding="utf-8", newline="")
    elif form == "geojson":
        path = folder / "a.geojson"
        features = [
            {
                "geometry": row[5] and {"type": "Point", "coordinates": row[5:7]},
                "properties": {
                    name: None if cell != cell else cell
                    for name, cell in zip(NAMES[:5], row[:5], strict=True)
                },
            }
            for row in rows
        ]
        path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    else:
        path = folder / f"a.{form}"
        texts = {name: [cell_text(cell) for cell in cells] for name, cells in columns.items()}
        write_block_table(
            {name: np.array(cells, dtype=object) for name, cells in texts.items()}, path
        )
    return path


@settings(max_examples=40)
@given(
    form=st.sampled_from(FORMS),
    kinds=st.lists(st.sampled_from(["sound", "sound", *BAD]), min_size=1, max_size=12),
)
def test_bad_rows_leave_the_others_as_they_are(
    tmp_path_factory: pytest.TempPathFactory, form: str, kinds: list[str]
) -> None:
    rows = [
        (f"b{i}", *(SOUND if kind == "sound" else BAD[kind][0])[1:]) for i, kind in enumerate(kinds)
    ]
    source = table(tmp_path_factory.mktemp("table"), form, rows)
    bad = [i for i, kind in enumerate(kinds) if kind != "sound"]
    if len(bad) == len(rows):
        with pytest.raises(InputError, match=r"(invalid block|blocks is valid).*\(block b0\)"):
            read_blocks(source)
        return
    parsed = read_blocks(source)
    assert parsed.rejected["row"].tolist() == bad
    assert parsed.blocks["row"].tolist() == [i for i in range(len(rows)) if i not in bad]
    for i, reason, place in zip(bad, parsed.rejected["reason"], parsed.row_labels, strict=True):
        expected = BAD[kinds[i]][1]
        if form == "geojson" and kinds[i] == "no place":  # a point has both, or none
            expected = "lon = nan, lat = nan is no place"
        assert reason.startswith(expected), (form, kinds[i])
        number = FIRST.get(form, 1) + i
        assert place == f"{WORDS.get(form, 'row')} {number} (block b{i})"
    assert (parsed.blocks["kr"] == 0.1).all()
    again = parsed.with_rejected({"block_id": parsed.blocks["block_id"], "p": parsed.blocks["kr"]})
    assert again["block_id"].tolist() == [row[0] for row in rows]
    assert np.flatnonzero(np.isnan(again["p"]) | (again["p"] != 0.1)).tolist() == bad
    text = parsed.describe_invalid()
    assert len(text) == bool(bad)
    if bad:
        assert text[0].startswith(
            f"{len(bad)} of {len(rows)} blocks could not be used; the reasons"
        )
        assert f"(block b{bad[0]}): " in text[0]
        with pytest.raises(InputError) as rejection:
            parsed.require_all("all are asked about")
        message = str(rejection.value)
        assert f"{len(bad)} of {len(rows)} blocks are invalid, and all are asked" in message
        assert len(message) < 500


@pytest.mark.parametrize("kind", ["empty cell", "text", "negative", "other mode"])
@pytest.mark.parametrize("form", ["comma", "semicolon", "xlsx", "parquet"])
def test_predictions_name_the_same_row(tmp_path: Path, form: str, kind: str) -> None:
    source = table(tmp_path, form, [SOUND, SOUND, BAD[kind][0], SOUND])
    target = tmp_path / f"out{source.suffix}"
    document: Any = predict_table(
        source, target, inputs={"pgv_m_s": 0.6}, ignore_columns=("weight",)
    )
    place = f"{WORDS.get(form, 'row')} {FIRST.get(form, 1) + 2}"
    (message,) = (text for text in document.warnings if "could not be used" in text)
    assert message.startswith("1 of 4 blocks could not be used; the reasons stand in the column")
    assert f"; it is {place}: " in message
    reasons = read_columns(target, ("probability",), texts=("reason",))
    assert np.isnan(reasons["probability"]).tolist() == [False, False, True, False]
    assert reasons["reason"][2]


@pytest.mark.parametrize("with_arrow", [True, False])
def test_lines_are_those_of_an_editor(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, with_arrow: bool
) -> None:
    """Blank lines, which spreadsheets write with delimiters, and cells of two lines count."""
    source = tmp_path / "a.csv"
    source.write_text(
        'block_id,p2_1_s2,kr,remark\na,3,0.1,"two\nlines"\n\n,,,\nb,3,,\nc,3,0.1,\nd,3,,"x\ny"\n\n'
    )
    if not with_arrow:
        monkeypatch.setattr("rbfrag.exchange.tables.csv_file.pyarrow", _no_arrow)
    rows = read_blocks(source)
    assert rows.row_labels == ["line 6 (block b)", "line 8 (block d)"]
    document: Any = predict_table(
        source, tmp_path / "b.csv", inputs={"pgv_m_s": 0.6}, model=None, level=0.95, db=None
    )
    assert (document.rows, document.without_answer) == (4, 2)
    assert "the first is line 6: kr is not a number" in str(document.warnings)


def _no_arrow() -> None:
    from rbfrag.errors import MissingExtraError

    raise MissingExtraError("Parquet files require pyarrow", "parquet")


def test_delimiters_behind_the_last_column_are_no_column(tmp_path: Path) -> None:
    """Excel writes as many as the widest row of its sheet has ever had."""
    source = tmp_path / "a.csv"
    source.write_text("block_id;p2_1_s2;kr;;\na;3;0,1;;\nb;3;0,2;;\nc;3;0,2;;x\n;;;;\n")
    rows = read_blocks(source)
    assert rows.blocks["block_id"].tolist() == ["a", "b"]
    assert rows.rejected["reason"].tolist() == ["5 cells under 3 columns"]
    document = predict_table(
        source, tmp_path / "b.csv", inputs={"pgv_m_s": 0.6}, model=None, level=0.95, db=None
    )
    assert (document.rows, document.answered) == (3, 2)


def test_what_a_command_does_not_read_is_no_concern_of_it() -> None:
    columns = {"p2_1_s2": [3.0, 3.0], "kr": [0.1, 0.1], "loss": ["much", 5.0], "lon": [999.0, 1.0],
               "lat": [0.0, 0.0]}  # fmt: skip
    assert read_blocks(columns).rejected["row"].tolist() == [0]
    assert read_blocks(columns, reads=("lon", "lat")).rejected["row"].tolist() == [0]
    assert read_blocks(columns, reads=("loss",)).rejected["row"].tolist() == [0]
    assert read_blocks(columns, reads=()).rejected_count == 0


def test_rectangles_are_rejected_in_their_own_words() -> None:
    columns = {"height_m": [2.0, None, -1.0, 2.0], "width_m": [0.5, 0.5, 0.5, "?"],
               "dip_deg": [95.0, 0.0, 0.0, 0.0]}  # fmt: skip
    with pytest.raises(InputError) as rejection:
        read_blocks(columns)
    for words in (
        "row 1: dip_deg must be between -90° and 90°, not 95", "row 2: height_m is empty",
        "row 3: height_m must be above 0 m, not -1", "row 4: width_m = '?' is not a number",
    ):  # fmt: skip
        assert words in str(rejection.value)


def test_kinds_of_rows() -> None:
    columns: dict[str, Any] = {
        "p2_1_s2": np.full(5, 3.0), "kr": np.full(5, 0.1),
        "kind": ["", "rocking", "sliding", "free-standing", "toppling"],
        "restitution": [np.nan, 1.2, 0.9, 0.9, 0.9],
    }  # fmt: skip
    expected: BlockRows = read_blocks(columns)
    assert expected.blocks["row"].tolist() == [0, 3, 4]
    assert expected.blocks["kind"].tolist() == ["toppling", "rocking", "toppling"]
    rocking, sliding = expected.rejected["reason"].tolist()
    assert rocking.startswith("restitution = 1.2 must be above 0 and up to 1")
    assert sliding == (
        "the block's mode is slide, and ky is missing: a block of kind sliding is given by ky and "
        "displacement_m"
    )
    for word in ("rolling", "toppeling"):  # beside words that name a kind, and nearly one
        wrong = {**columns, "kind": ["", "rocking", "sliding", word, "toppling"]}
        with pytest.raises(InputError, match=f"'{word}' is not a kind of failure"):
            read_blocks(wrong)
    columns["restitution"][1] = 0.9
    single = read_blocks(columns, one_kind=True)
    assert single.rejected["reason"][0] == (
        "the block's kind is rocking, and the answer is for kind toppling"
    )
    with pytest.raises(InputError, match="unknown kind 'rolling'"):
        read_blocks(columns, "rolling")


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"p2_1_s2": [3.0], "kr": [0.1, 0.2]}, "differ in length: p2_1_s2 1, kr 2"),
        ({"p2_1_s2": [3.0]}, "there is no column kr"),
        ({"p2_1_s2": [], "kr": []}, "there is no block"),
        ({"p2_1_s2": [3.0], "kr": [0.1], "lon": [1.0]}, "lon and lat are required together"),
        ({"p2_1_s2": [3.0], "kr": [0.1], "weight": [0.0]}, "weights of the blocks sum to zero"),
        (3, "blocks is of type int"),
    ],
)
def test_tables_that_are_rejected_as_a_whole(columns: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_blocks(columns)


def test_empty_cells_that_stand_for_something() -> None:
    columns = {"p2_1_s2": [3.0], "kr": [0.1], "weight": [None], "count": [None],
               "kr_sigma": [None], "block_id": [None]}  # fmt: skip
    blocks = read_blocks(columns).blocks
    assert [blocks[name][0] for name in ("weight", "count", "kr_sigma", "block_id")] == [
        1.0, 1.0, 0.0, "",
    ]  # fmt: skip


def test_cells_of_pandas() -> None:
    frame = pd.DataFrame(
        {"p2_1_s2": pd.array([3, None], dtype="Int64"), "kr": [0.1, 0.1], "block_id": [1.0, np.nan]}
    )
    rows = read_blocks(frame)
    assert rows.blocks["row"].tolist() == [0]
    assert rows.rejected["reason"][0].startswith("p2 is not a number")


def test_columns_that_must_be_whole_are_rejected_with_all_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("kr,p2\n0.1,3\nx,3\n0.1\n?,3\n")
    with pytest.raises(InputError) as rejection:
        read_draws(path)
    assert str(rejection.value) == (
        f"{path}, line 3: kr = 'x' is not a number; line 4: 1 cells under 2 columns; "
        "line 5: kr = '?' is not a number"
    )


@pytest.mark.parametrize("read", [read_blocks, read_draws])
def test_what_is_wrong_with_all_rows_names_the_file(tmp_path: Path, read: Any) -> None:
    path = tmp_path / "a.csv"
    path.write_text("alpha1_deg,alpha3_deg,r3_m\n-10,20,1\n")
    with pytest.raises(InputError, match=r"a\.csv: beta_deg is missing: the failure mode"):
        read(path)


def test_a_long_list_has_room_in_a_message() -> None:
    positions = [f"line {i} (block {'n' * 60}{i})" for i in range(5000)]
    reasons = [f"kr = {i} is not a number" if i % 2 else "p2 is empty" for i in range(5000)]
    text = in_list(positions, reasons)
    assert text.startswith(f"{positions[0]}, {positions[2]}")
    assert "and 2,494 more: p2 is empty" in text
    assert text.endswith("; and 2,500 more")
    with pytest.raises(InputError) as rejection:
        read_blocks(
            {"p2_1_s2": np.full(5000, 3.0), "kr": np.append(0.1, np.full(4999, -1.0))}
        ).require_all("all are asked about")
    message = str(rejection.value)
    assert "4,999 of 5,000 blocks" in message
    assert message.endswith("correct or remove these rows")
    assert "…" not in message
    assert describe_invalid(0, 5, [], []) == ()
