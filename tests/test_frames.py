"""Answers as tables: what pandas and a notebook get of them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import pandas as pd
import pytest

import rbfrag
from rbfrag.results.result import Tabular
from tests.synthetic import shaking, write_at2


@dataclass(frozen=True, eq=False, repr=False)
class Answer(Tabular):
    name: str
    rate: np.ndarray
    other: np.ndarray
    years: float = 50.0


def test_arrays_make_the_rows_and_single_values_stand_in_each() -> None:
    answer = Answer("a", np.array([1.0, 2.0]), np.zeros(5))
    frame = answer.to_frame()
    assert frame.to_dict("list") == {"name": ["a", "a"], "rate": [1.0, 2.0], "years": [50.0, 50.0]}
    pd.testing.assert_frame_equal(pd.DataFrame(answer), frame)
    assert repr(answer) == "Answer(name='a', rate=[2 values], years=50.0)"


def test_predictions_of_many_blocks_keep_their_numbers_and_reasons() -> None:
    answers = rbfrag.predict([[3.0], [np.nan]], [0.1, 0.2], pgv_m_s=0.6)
    frame = answers.to_frame()
    np.testing.assert_array_equal(frame.probability, answers.probability.ravel())
    assert list(frame.reason) == list(answers.reason.ravel())
    assert frame.reason[3] != ""


def test_series_keep_their_index_and_are_not_joined_by_position() -> None:
    kr = pd.Series([0.1, 0.2], index=["a", "b"])
    answers = rbfrag.predict(np.float32(3.0), kr, pgv_m_s=0.6)
    frame = pd.DataFrame({"p": answers.to_frame().probability, "kr": kr})
    assert list(frame.index) == ["a", "b"]
    single = rbfrag.predict(3.0, 0.2, pgv_m_s=0.6).probability
    assert frame.p["b"] == pytest.approx(single, rel=1e-12)
    with pytest.raises(rbfrag.InputError, match="kr and pgv_m_s are Series of different index"):
        rbfrag.predict(3.0, kr, pgv_m_s=pd.Series([0.6, 0.5], index=["b", "a"]))


def test_one_prediction_is_a_table_of_one_row() -> None:
    answer = rbfrag.predict(3.0, 0.1, pgv_m_s=0.6)
    pd.testing.assert_frame_equal(pd.DataFrame(answer), answer.to_frame())
    # it is made without its initializer, which takes as long as the answer
    assert {*vars(answer)} == {field.name for field in fields(answer)}


CURVE = "pgv_m_s,annual_rate\n0.05,0.05\n0.1,0.02\n0.5,0.001\n2,0.00001\n"


def test_a_curve_is_given_by_its_file_its_path_or_itself(tmp_path) -> None:
    file = tmp_path / "curve.csv"
    file.write_text(CURVE)
    (curve,) = rbfrag.read_hazard_curves(file)
    settings = {"component": "single", "model": "toppling-pgv"}
    for inputs in (file, str(file), [file], [curve]):
        assert rbfrag.hazard(inputs, 3.0, 0.1, **settings).annual_rate == (
            rbfrag.hazard(curve, 3.0, 0.1, **settings).annual_rate
        )
        standing = rbfrag.survival(inputs, 3.0, 0.1, kind="toppling", age_years=1e4, **settings)
        assert standing.annual_rate_any == (
            rbfrag.survival(
                curve, 3.0, 0.1, kind="toppling", age_years=1e4, **settings
            ).annual_rate_any
        )
    halves = rbfrag.hazard([file, file], 3.0, 0.1, weights="0.5,0.5", **settings)
    assert halves.annual_rate == rbfrag.hazard(file, 3.0, 0.1, **settings).annual_rate


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: rbfrag.hazard(3, 3.0, 0.1), "curve is of type int: give a HazardCurve"),
        (lambda: rbfrag.survival([3], 3.0, 0.1, age_years=1.0), "curve is of type int"),
        (lambda: rbfrag.fit("study.db"), r"term is missing: .* fit\(db, term='pgv'\)"),
        (lambda: rbfrag.fit(3, term="pgv"), "db = int: give a path"),
        (lambda: rbfrag.simulate(3), "db is of type int: give the database as a path"),
        (lambda: rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, db=3), "db is of type int"),
        (lambda: rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, model=3), "model is of type int"),
        (lambda: rbfrag.add_motions(3), "paths is of type int"),
        (lambda: rbfrag.read_motions(3), "path is of type int"),
        (lambda: rbfrag.read_hazard_curves(3), "path is of type int"),
        (lambda: rbfrag.block_from_mesh(3), "path is of type int"),
        (lambda: rbfrag.losses(3, {"p2": [3.0], "kr": [0.1]}), "folder is of type int"),
        (lambda: rbfrag.losses(".", 3), "blocks is of type int"),
        (lambda: rbfrag.respond(3, p2=3.0, kr=0.1), "motion is of type int"),
        (lambda: rbfrag.respond_draws(3, p2=3.0, kr=0.1), "motion is of type int"),
    ],
)
def test_what_is_no_file_and_no_answer_is_rejected_by_its_name(ask, message) -> None:
    with pytest.raises(rbfrag.InputError, match=message):
        ask()


def test_every_answer_is_a_table_and_one_line(tmp_path) -> None:
    record = write_at2(tmp_path / "record.AT2", shaking(3))
    block = rbfrag.Block.rectangle(2.0, 0.5)
    curve = rbfrag.HazardCurve("pgv_m_s", np.array([0.1, 1.0]), np.array([1e-2, 1e-4]))
    for answer in (
        rbfrag.predict(3.0, 0.1, pgv_m_s=0.6),
        rbfrag.critical(record, p2=3.0),
        rbfrag.respond(record, p2=3.0, kr=0.1, history=True),
        rbfrag.stability(block, beta_deg=0.0, phi_deg=40.0),
        rbfrag.hazard(curve, 3.0, 0.1),
        rbfrag.survival(curve, p2=3.0, kr=0.1, kind="rocking", age_years=1000.0),
        rbfrag.respond_draws(record, p2=3.0, kr=0.1, draws=4),
        curve,
        rbfrag.BlockArray.from_angles([10.0, 20.0], 30.0, 1.0),
        rbfrag.add_motions(record, db=tmp_path / "rock.db"),
        rbfrag.simulate(tmp_path / "rock.db", p2=[3.0], jobs=1),
    ):
        frame = answer.to_frame()
        of_arrays = isinstance(answer, rbfrag.HazardCurve | rbfrag.BlockArray)
        assert len(frame) == (2 if of_arrays else 1)
        assert not frame.map(lambda cell: isinstance(cell, np.ndarray)).to_numpy().any()
        assert "\n" not in repr(answer)
        assert frame.columns[0] in answer._repr_html_()


@pytest.mark.parametrize("name", ["motion", "vertical"])
def test_a_motion_is_named_by_its_file_or_rejected_by_name(tmp_path, name: str) -> None:
    record = write_at2(tmp_path / "record.AT2", shaking(3))
    motion = rbfrag.read_motions(record)[0]
    for inputs in (record, str(record), f"{record}#0"):
        result = rbfrag.critical(inputs, p2=3.0)
        assert result.kr_over_pga == rbfrag.critical(motion, p2=3.0).kr_over_pga
    assert rbfrag.toppling_spectrum(record, 3.0) == rbfrag.toppling_spectrum(motion, 3.0)
    request = {"motion": motion, "vertical": None, name: [motion, motion]}
    with pytest.raises(rbfrag.InputError, match=f"^{name} is of type list"):
        rbfrag.critical(request["motion"], p2=3.0, vertical=request["vertical"])
    with pytest.raises(rbfrag.InputError, match="of type float"):
        rbfrag.predict(3.0, 0.1, motion=0.6)
    assert "\n" not in repr(motion)
