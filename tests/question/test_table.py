"""Headers of tables: names, units and duplicates; unknown columns are rejected by name."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import read_blocks
from rbfrag.exchange.table_answers import predict_table
from rbfrag.question.question import predict
from rbfrag.question.table import columns_in, field_of, header_of, header_row
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import stability
from rbfrag.vocabulary.quantities import COLUMNS, INPUTS, column_of
from rbfrag.vocabulary.spectral import BY_PERIOD, input_of


@pytest.mark.parametrize(
    ("header", "field", "unit"),
    [
        ("height_m", "height_m", None),
        ("H (m)", "height_m", "m"),
        ("Height [m]", "height_m", "m"),
        ("dip", "beta_deg", None),
        ("Beta", "beta_deg", None),
        ("Friction angle (°)", "phi_deg", "°"),
        ("PGV [cm/s]", "pgv_m_s", "cm/s"),
        ("pga", "pga_g", None),
        ("SA(1.0) [g]", "sa(1)", "g"),
        ("sa(0.5)", "sa(0.5)", None),
        ("SA(0.5s)", "sa(0.5)", None),
        ("SA (0.50 s) [cm/s2]", "sa(0.5)", "cm/s2"),
        ("sa(0.5)_sigma", "sa(0.5)_sigma", None),
        ("Block", "block_id", None),
        ("p2_1_s2", "p2", None),
        ("H_m", "height_m", "m"),
        ("Width, cm", "width_m", "cm"),
        ("PGV cm/s", "pgv_m_s", "cm/s"),
        ("pga_m_s2", "pga_g", "m/s2"),
        ("Block [no.]", "block_id", "no."),
    ],
)
def test_a_column_states_a_field_under_any_of_its_names(
    header: str, field: str, unit: str | None
) -> None:
    match = field_of(header)
    assert match is not None
    assert (match.field, match.unit) == (field, unit)


def test_no_name_stands_for_two_fields() -> None:
    owners: dict[str, str] = {}
    for name in COLUMNS:
        for item in {name, column_of(name), *INPUTS[name].aliases}:
            assert owners.setdefault(item, name) == name, item


@pytest.mark.parametrize(
    ("header", "words"),
    [
        (["hieght_m", "width_m"], "unknown column 'hieght_m'; did you mean 'height_m'"),
        (["hight", "width_m"], "did you mean 'height'"),
        (["height_m", "restitutoin"], "did you mean 'restitution'"),
        (["hieght_cm", "width_m"], "did you mean 'height"),
        (["dip", "beta"], "are both the dip of the base"),
        (["kr", "kr"], "kr occurs twice"),
        (["Height [ft]"], "'ft'"),
        (["PGA (knots)"], "'knots'"),
    ],
)
def test_what_cannot_be_meant_is_rejected(header: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        columns_in(header, "blocks.csv", COLUMNS)


def test_other_columns_are_rejected_where_they_sound_like_input_and_named_elsewhere() -> None:
    header = ["height_m", "width_m", "dip direction", "note"]
    value = columns_in(header, "blocks.csv", COLUMNS)
    with pytest.raises(InputError, match="'dip direction' is unknown; for the dip of"):
        value.check_unused("blocks.csv", value.columns)
    # of a block given by its numbers the dip does not matter
    value.check_unused("blocks.csv", ("p2", "kr"))
    value.check_unused("blocks.csv", ("height_m", "width_m", "beta_deg"))
    (warning,) = value.ignored(header, ("height_m", "width_m"))
    assert warning == "columns ignored: dip direction, note"
    assert warning.code == "ignored_columns"
    left_out = columns_in(header, "blocks.csv", COLUMNS, ["dip direction"])
    left_out.check_unused("blocks.csv", left_out.columns)


def test_columns_of_an_earlier_answer_are_named_as_ignored(tmp_path: Path) -> None:
    source, target = tmp_path / "a.csv", tmp_path / "b.csv"
    source.write_text("block_id,p2_1_s2,kr,pgv_m_s,lon,lat\na,3,0.1,0.6,20,40\n")
    assert predict_table(source, target, inputs={}, component="single").warnings == ()
    assert read_blocks(target).remarks == (
        "column ignored: pgv_m_s",
        "columns of an earlier answer ignored: probability, ci_low, ci_high, event_low, "
        "event_high, in_domain, how, warnings, reason",
    )


def test_losses_are_in_any_currency() -> None:
    value = columns_in(["loss [EUR]", "weight (t)"], "a.csv", COLUMNS)
    assert [value.columns[name].factor for name in ("loss", "weight")] == [1.0, 1.0]


def test_a_name_for_a_column_states_its_field_and_unit() -> None:
    for name in (*COLUMNS, "sa(0.5)", "sa(0.5)_sigma"):
        if name in BY_PERIOD:
            continue  # which have columns by period
        assert columns_in([header_of(name)], "a.csv", [input_of(name)]).columns[name].factor == 1.0


NAMES = ["Block", "H [m]", "W [m]"]


@pytest.mark.parametrize(
    ("rows", "number"),
    [
        ([NAMES, ["A", "2", "0.5"]], 0),
        ([["North wall"], [], ["by", "A. S."], NAMES, ["A", "2", "0.5"]], 3),
        ([["Site", "Name"], NAMES, ["A", "2", "0.5"]], 1),  # a title that states no number
        ([["block", "p2_1_s2"], NAMES], 0),  # nothing changes where the first row states one
        ([["North wall"], ["stone", "kr"], ["x", "0.1"]], 1),
        ([["stone", "size", "shade"], ["B", "2", "W"]], 0),  # numbers are no names
        ([[], ["anything", None], ["3", 3]], 1),
        ([], 0),
    ],
)
def test_the_row_of_the_names(rows: list[list[object]], number: int) -> None:
    assert header_row(rows) == number


def answered(
    tmp_path: Path, text: str, **arguments: float
) -> tuple[list[dict[str, str]], tuple[str, ...]]:
    source, target = tmp_path / "blocks.csv", tmp_path / "answers.csv"
    source.write_text(text)
    document = predict_table(source, target, inputs=arguments, model=None, level=0.95, db=None)
    warnings = document.warnings
    with target.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file)), warnings


@pytest.mark.parametrize("dip", ["dip", "dip_deg", "beta", "Dip (deg)", "beta_deg"])
def test_a_dip_weakens_a_rectangle_whatever_its_column_is_called(tmp_path: Path, dip: str) -> None:
    rows, _ = answered(tmp_path, f"height_m,width_m,{dip},pgv_m_s\n2,0.4,10,0.8\n")
    block = Block.rectangle(2.0, 0.4)
    kr = stability(block, beta_deg=10.0, phi_deg=45.0).kr
    alone = predict(block.p2, kr, pgv_m_s=0.8)
    assert float(rows[0]["probability"]) == pytest.approx(alone.probability, rel=1e-12)


def test_units_in_headers_are_converted_and_said(tmp_path: Path) -> None:
    plain, _ = answered(tmp_path, "height_m,width_m,pgv_m_s\n2,0.4,0.8\n")
    rows, warnings = answered(tmp_path, "H (cm),W [mm],PGV [cm/s]\n200,400,80\n")
    assert float(rows[0]["probability"]) == pytest.approx(float(plain[0]["probability"]), rel=1e-12)
    assert sum(": converted from" in text for text in warnings) == 3


def test_a_rectangle_that_slides_is_never_answered_as_one_that_topples(tmp_path: Path) -> None:
    rows, _ = answered(
        tmp_path,
        "height_m,width_m,dip,phi,pgv_m_s\n2.5,2.5,20,32,0.5\n2,0.4,0,40,0.8\n1,1,40,30,0.5\n",
    )
    first, second, third = rows
    assert first["probability"] == ""
    assert "slides (yield 0.21 g): give displacement_m" in first["reason"]
    assert [row["mode"] for row in rows] == ["slide", "topple", "slide"]
    assert stability(Block.rectangle(2.5, 2.5), beta_deg=20.0, phi_deg=32.0).mode == "slide"
    assert float(second["probability"]) > 0.0
    # it slides at rest
    assert (third["probability"], third["reason"]) == ("1", "unstable")


@pytest.mark.parametrize("width", [0.2, 0.8, 1.678, 1.679, 1.9])
@pytest.mark.parametrize("beta", [-10.0, 0.0, 15.0, 35.0])
def test_rows_slide_where_stability_says_so(width: float, beta: float) -> None:
    phi = 40.0
    judged = stability(Block.rectangle(2.0, width), beta_deg=beta, phi_deg=phi)
    columns = {
        "height_m": [2.0, 3.0],
        "width_m": [width, 0.3],
        "beta": [beta, 0.0],
        "phi": [phi, phi],
    }
    rows = read_blocks(columns)
    if judged.mode == "slide" and judged.yield_acceleration > 0.0:
        assert "slides" in rows.rejected["reason"][0]
    elif judged.yield_acceleration <= 0.0:
        assert "unstable" in rows.rejected["reason"][0]
    else:
        assert rows.rejected_count == 0
        assert rows.blocks["kr"][0] == pytest.approx(judged.kr, rel=1e-12)
