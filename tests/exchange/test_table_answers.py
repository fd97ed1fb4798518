"""Tables of blocks in, the same tables with answers out."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.models import save_model
from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange import table_answers
from rbfrag.exchange.table_answers import ANSWERS, TableAnswer, predict_table
from rbfrag.exchange.tables import csv_file, parts
from rbfrag.exchange.tables.files import write_block_table
from rbfrag.fragility.joint import UNKNOWN, Placement
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.question.question import predict
from tests.block_tables import read_columns
from tests.fragility.conftest import model_row
from tests.fragility.portfolio_draws import LAW, SHARED

HEAD = "block_id,p2_1_s2,kr,pgv_m_s"
TABLE = f'{HEAD}\n"A, upper",3,0.1,0.6\nB,10,0.3,\nC,3,-0.1,0.6\nD,3,0.1,0\n'

Answer = Callable[..., TableAnswer]


@pytest.fixture(params=["with pyarrow", "without pyarrow"])
def answer(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Answer:
    """Answer a table by one stored model, with the fast and with the plain way to CSV."""
    if request.param == "without pyarrow":

        def missing() -> None:
            raise MissingExtraError("Parquet files require pyarrow", "parquet")

        monkeypatch.setattr(csv_file, "pyarrow", missing)
    database = tmp_path / "model.db"
    with opened_database(str(database), create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row())

    def run(source: Path, target: Path, **inputs: float) -> TableAnswer:
        return predict_table(
            source, target, inputs=inputs, model=None, level=0.95, db=str(database)
        )

    return run


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_rows_are_answered_or_say_why_not(answer: Answer, tmp_path: Path) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    source.write_text(TABLE)
    document = answer(source, target)
    assert (document.rows, document.answered, document.without_answer) == (4, 3, 1)
    first, second, third, fourth = rows_of(target)
    assert first["block_id"] == "A, upper"
    expected = predict(3.0, 0.1, pgv_m_s=0.6, db=str(tmp_path / "model.db"))
    assert float(first["probability"]) == pytest.approx(expected.probability, rel=1e-12)
    assert float(first["ci_low"]) == pytest.approx(expected.ci_low, rel=1e-12)
    assert [*first][-len(ANSWERS) :] == [*ANSWERS]
    for row in (first, second, third, fourth):  # each block falls or stands
        assert row["event_low"] == row["event_high"] == ""
    assert (first["in_domain"], first["reason"]) == ("true", "")
    assert second["probability"] == ""
    assert "pgv_m_s" in second["reason"]
    assert (float(third["probability"]), third["reason"]) == (1.0, "unstable")
    assert float(fourth["probability"]) == 0.0
    assert "no shaking" in fourth["reason"]


def total_of(tmp_path: Path, dependence: dict[str, Any] | None, rows: str) -> dict[str, Any]:
    database = tmp_path / "model.db"
    with opened_database(str(database), create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row(dependence=dependence))
    source = tmp_path / "a.csv"
    source.write_text(f"{HEAD},site_id\n{rows}")
    return predict_table(source, inputs={}, model=None, level=0.9, db=str(database))


@pytest.mark.parametrize("sites", [1, 20])
def test_a_table_has_one_range_for_its_total(tmp_path: Path, sites: int) -> None:
    n = 200
    ys = np.random.default_rng(0).uniform(0.05, 0.2, n)
    rows = "".join(f"{i},3.0,{ys[i]},0.6,s{i % sites}\n" for i in range(n))
    document = total_of(tmp_path, SHARED, rows)
    p = np.array([row["probability"] for row in document.blocks])
    blocks = Placement.of(0.0, np.log(ys), site=np.arange(n) % sites, polarity=UNKNOWN)
    counts = JointSampler(LAW, blocks).failures(p, 20_000, np.random.default_rng(1)).sum(axis=1)
    assert document.expected_failures == pytest.approx(p.sum())
    low, high = document.failures_low, document.failures_high
    assert np.quantile(counts, [0.05, 0.95]) == pytest.approx((low, high), abs=4.0)
    assert high - low > 2.0 * 1.645 * np.sqrt((p * (1.0 - p)).sum())


def test_of_many_rows_some_tell_what_pairs_share(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = "".join(f"{i},3.0,{0.05 + 0.0005 * i},0.6,s{i % 9}\n" for i in range(300))
    complete = total_of(tmp_path, SHARED, rows)
    monkeypatch.setattr(table_answers, "MOST_PAIRED", 100)
    (tmp_path / "model.db").unlink()
    subset = total_of(tmp_path, SHARED, rows)
    for name in ("failures_low", "failures_high"):
        assert getattr(subset, name) == pytest.approx(getattr(complete, name), rel=0.1)


def test_what_is_not_known_of_a_total_is_none(tmp_path: Path) -> None:
    document = total_of(tmp_path, None, "1,3.0,0.1,0.6,\n")
    assert document.failures_low is document.failures_high is None
    with pytest.raises(InputError, match="use the column site_id in a table"):
        predict_table(tmp_path / "a.csv", inputs={}, sites=3)


def test_parts_join_without_a_seam(
    answer: Answer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts, "ROWS", 7)
    random = np.random.default_rng(3)
    kr = random.uniform(0.02, 0.3, 40)
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    lines = [f"{i},3.0,{value!r},0.6" for i, value in enumerate(kr.tolist())]
    source.write_text("\n".join([HEAD, *lines]))
    answer(source, target)
    result = rows_of(target)
    assert [row["block_id"] for row in result] == [str(i) for i in range(40)]
    expected = predict(3.0, kr, pgv_m_s=0.6, db=str(tmp_path / "model.db")).probability
    assert [float(row["probability"]) for row in result] == pytest.approx(expected, rel=1e-12)


def test_a_measure_for_all_rows(answer: Answer, tmp_path: Path) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    source.write_text("p2_1_s2,kr\n3,0.1\n")
    answer(source, target, pgv_m_s=0.6)
    expected = predict(3.0, 0.1, pgv_m_s=0.6, db=str(tmp_path / "model.db")).probability
    assert float(rows_of(target)[0]["probability"]) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        ("", "pgv given for all rows is used for 1 of 2 rows: column 'pgv_m_s' is empty there"),
        (
            "0.5",
            "pgv given for all rows is ignored: column 'pgv_m_s' has a value in every row",
        ),
    ],
)
def test_cells_before_a_value_for_all_rows_are_named(
    answer: Answer, tmp_path: Path, cell: str, words: str
) -> None:
    (tmp_path / "in.csv").write_text(f"{HEAD}\nA,3,0.1,0.6\nB,3,0.1,{cell}\n", encoding="utf-8")
    result = answer(tmp_path / "in.csv", tmp_path / "out.csv", pgv_m_s=0.4)
    (warning,) = (item for item in result.warnings if item.code == "option_and_column")
    assert warning == words
    first, second = rows_of(tmp_path / "out.csv")
    assert float(second["probability"]) < float(first["probability"])


@pytest.mark.parametrize(
    ("field", "cell", "value"),
    [("kr_sigma", 0.1, 0.3), ("pgv_sigma", 0.1, 0.6), ("amplification", 1.0, 1.3),
     ("kr_sigma", "", 0.3), ("amplification", "", 1.3)],
)  # fmt: skip
def test_empty_cells_have_the_value_for_all_rows(
    tmp_path: Path, field: str, cell: object, value: float
) -> None:
    (tmp_path / "in.csv").write_text(f"{HEAD},{field}\nA,3,0.1,0.5,{cell}\nB,3,0.1,0.5,\n")
    predict_table(tmp_path / "in.csv", tmp_path / "out.csv", inputs={field: value})
    *_, row = rows_of(tmp_path / "out.csv")
    expected = predict(3.0, 0.1, pgv_m_s=0.5, **{field: value}).probability
    assert float(row["probability"]) == pytest.approx(expected, rel=1e-9)


def test_a_geometry_next_to_the_parameters_of_a_block_is_named(tmp_path: Path) -> None:
    (tmp_path / "in.csv").write_text(f"{HEAD},height_m,width_m\nA,6,0.1,0.5,2,0.6\nB,6,0.1,0.5,,\n")
    result = predict_table(tmp_path / "in.csv", inputs={})
    (warning,) = (item for item in result.warnings if item.code == "two_descriptions")
    assert "its geometry (height_m, width_m) is not used" in warning
    assert [int(row) for row in warning.rows] == [0]
    first, second = (row["probability"] for row in result.blocks or ())
    assert first == second == predict(6.0, 0.1, pgv_m_s=0.5).probability


def test_what_is_said_of_all_rows_must_matter(answer: Answer, tmp_path: Path) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    source.write_text(TABLE)
    with pytest.raises(InputError, match="beta_deg cannot be combined with the blocks of"):
        answer(source, target, beta_deg=5.0)
    assert not target.exists()


def test_an_empty_column_says_nothing(
    answer: Answer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    head, rows = "p2_1_s2,kr,pgv_m_s,pga_g\n", "3,0.1,,\n3,0.2,,\n"
    source.write_text(head + rows)
    assert answer(source, target, pgv_m_s=0.6).answered == 2
    source.write_text(head + rows + "3,0.1,0.5,\n")
    assert answer(source, target, pgv_m_s=0.6).answered == 3  # the option fills the empty cells
    model = str(tmp_path / "model.db")
    filled, _, expected = (float(row["probability"]) for row in rows_of(target))
    assert filled == pytest.approx(predict(3.0, 0.1, pgv_m_s=0.6, db=model).probability)
    assert expected == pytest.approx(predict(3.0, 0.1, pgv_m_s=0.5, db=model).probability)
    monkeypatch.setattr(parts, "ROWS", 2)
    source.write_text(head + rows.replace(",,", ",0.6,") + "3,0.1,0.6,0.5\n")
    with pytest.raises(InputError, match="pga_g is empty in the first rows and filled"):
        answer(source, target)


def test_other_modes_are_not_answered(answer: Answer, tmp_path: Path) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    source.write_text(f"mode,{HEAD}\nslide,A,3,0.1,0.6\ntopple,B,3,0.1,0.6\n")
    answer(source, target)
    first, second = rows_of(target)
    assert first["probability"] == ""
    assert "mode is slide" in first["reason"]
    assert second["probability"] != ""


def test_old_answers_are_replaced(answer: Answer, tmp_path: Path) -> None:
    source, middle, target = (tmp_path / name for name in ("a.csv", "b.csv", "c.csv"))
    source.write_text(TABLE)
    answer(source, middle)
    answer(middle, target)
    assert middle.read_text() == target.read_text()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TABLE.replace("p2_1_s2", "size"), "there is no column p2_1_s2"),
        (TABLE.replace("block_id", "kr"), "the column kr occurs twice"),
        ("", "no column p2_1_s2, nor height_m and width_m; the columns are none"),
    ],
)
def test_bad_tables_are_rejected(answer: Answer, tmp_path: Path, text: str, words: str) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    source.write_text(text)
    with pytest.raises(InputError, match=words):
        answer(source, target)
    assert list(tmp_path.glob("*b.csv*")) == []


def test_a_bad_row_far_down_is_answered_with_its_reason(answer: Answer, tmp_path: Path) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    lines = [f"{i},3,0.1,0.6" for i in range(100_000)]
    lines[70_000], lines[80_000] = "x,3,?,0.6", "y,3,0.1"
    source.write_text("\n".join([HEAD, *lines]))
    document = answer(source, target)
    assert (document.rows, document.answered, document.without_answer) == (100_000, 99_998, 2)
    assert "2 of 100,000 blocks could not be used" in str(document.warnings)
    assert "line 70002: kr = '?' is not a number" in str(document.warnings)
    rows = rows_of(target)
    assert {row["probability"] for row in rows[:70_000]} == {rows[-1]["probability"]} != {""}
    assert (rows[70_000]["kr"], rows[70_000]["probability"]) == ("?", "")
    assert rows[70_000]["reason"] == "kr = '?' is not a number"
    assert rows[80_000]["reason"] == "3 cells under 4 columns"


def test_the_table_itself_is_not_overwritten(answer: Answer, tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text(TABLE)
    with pytest.raises(InputError, match="is the input table"):
        answer(source, source)
    assert source.read_text() == TABLE


@pytest.mark.parametrize("answer", ["with pyarrow"], indirect=True)
def test_parquet(answer: Answer, tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    columns = {
        "block_id": np.array([f"b{i}" for i in range(50)], dtype=object),
        "p2_1_s2": 10.0 ** random.uniform(-0.5, 1.2, 50),
        "kr": random.uniform(0.02, 0.3, 50),
        "pgv_m_s": np.where(np.arange(50) == 7, np.nan, random.uniform(0.1, 1.2, 50)),
    }
    source, target = tmp_path / "a.parquet", tmp_path / "b.parquet"
    write_block_table(columns, source)
    document = answer(source, target)
    assert (document.rows, document.without_answer) == (50, 1)
    parsed = read_columns(target, ["probability", "kr"])
    expected = predict(
        columns["p2_1_s2"], columns["kr"], pgv_m_s=columns["pgv_m_s"],
        db=str(tmp_path / "model.db"),
    ).probability  # fmt: skip
    assert np.array_equal(parsed["probability"], expected, equal_nan=True)
    assert np.array_equal(parsed["kr"], columns["kr"])
    assert (
        read_columns(target, (), texts=["block_id"])["block_id"].tolist()
        == columns["block_id"].tolist()
    )
    answer(source, tmp_path / "c.csv")
    assert len(rows_of(tmp_path / "c.csv")) == 50


def test_tables_of_blocks_that_slide_or_slump(tmp_path: Path) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    source.write_text(
        "block_id,ky,beta_deg,mode\na,0.1,10,slide\nb,-0.1,10,slide\nc,0.1,10,topple\n"
    )
    arguments = {"displacement_m": 0.05, "pgv_m_s": 0.4, "pga_g": 0.5}
    document = predict_table(
        source, target, inputs=arguments, model=None, level=0.95, db=str(REFERENCE)
    )
    assert (document.kind, document.rows, document.answered) == ("sliding", 3, 2)
    assert [row["kind"] for row in rows_of(target)] == ["sliding", "sliding", "toppling"]
    first, second, third = rows_of(target)
    expected = predict(ky=0.1, beta_deg=10.0, **arguments, db=str(REFERENCE))
    assert float(first["probability"]) == pytest.approx(expected.probability, rel=1e-12)
    assert (second["probability"], second["reason"]) == ("1", "unstable")
    assert "mode is topple, and p2 is missing" in third["reason"]
    source.write_text("ks,ps2_1_s2,pgv_m_s,pga_g\n0.1,3,0.5,0.6\n")
    document = predict_table(
        source, target, inputs={}, model=None, level=0.95, db=str(REFERENCE), rotation_deg=2.0
    )
    assert document.model == "slumping-2deg-pgv_pga"
    expected = predict(ks=0.1, ps2=3.0, rotation_deg=2.0, pgv_m_s=0.5, pga_g=0.6, db=str(REFERENCE))
    (row,) = rows_of(target)
    assert float(row["probability"]) == pytest.approx(expected.probability, rel=1e-12)
    source.write_text("ky,pgv_m_s\n0.1,0.5\n")
    with pytest.raises(InputError, match="no column displacement_m"):
        predict_table(source, target, inputs={}, model=None, level=0.95, db=str(REFERENCE))


def test_uncertain_blocks_are_integrated_over(answer: Answer, tmp_path: Path) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    source.write_text(f"{HEAD},kr_sigma\na,3,0.1,0.6,0.2\nb,3,0.1,0.6,\nc,3,0.1,0.6,-1\n")
    answer(source, target)
    uncertain, certain, rejected = rows_of(target)
    db = str(tmp_path / "model.db")
    expected = predict(3.0, 0.1, pgv_m_s=0.6, kr_sigma=0.2, db=db)
    for name in ("probability", "ci_low", "ci_high", "block_sd"):
        assert float(uncertain[name]) == pytest.approx(getattr(expected, name), rel=1e-12)
    by_itself = predict(3.0, 0.1, pgv_m_s=0.6, db=db)
    assert float(certain["probability"]) == pytest.approx(by_itself.probability, rel=1e-9)
    assert float(certain["block_sd"]) == pytest.approx(0.0, abs=1e-7)
    assert rejected["probability"] == rejected["block_sd"] == ""
    assert "kr_sigma is negative" in rejected["reason"]
    answer(target, tmp_path / "again.csv", p2_sigma=0.1)  # the answers give way to new ones
    assert [*rows_of(tmp_path / "again.csv")[0]].count("block_sd") == 1
