"""Answers as tables: what pandas and a notebook get of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

import rbfrag
from rbfrag.frames import Tabular
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
        rbfrag.survival(curve, p2=3.0, kr=0.1, age_years=1000.0),
    ):
        frame = answer.to_frame()
        assert len(frame) == 1
        assert not frame.map(lambda cell: isinstance(cell, np.ndarray)).to_numpy().any()
        assert "\n" not in repr(answer)
        assert frame.columns[0] in answer._repr_html_()


@pytest.mark.parametrize("name", ["motion", "vertical"])
def test_a_motion_is_named_by_its_file_or_refused_by_name(tmp_path, name: str) -> None:
    record = write_at2(tmp_path / "record.AT2", shaking(3))
    motion = rbfrag.read_motions(record)[0]
    for given in (record, str(record), f"{record}#0"):
        found = rbfrag.critical(given, p2=3.0)
        assert found.kr_over_pga == rbfrag.critical(motion, p2=3.0).kr_over_pga
    assert rbfrag.toppling_spectrum(record, 3.0) == rbfrag.toppling_spectrum(motion, 3.0)
    asked = {"motion": motion, "vertical": None, name: [motion, motion]}
    with pytest.raises(rbfrag.InputError, match=f"^{name} is of type list"):
        rbfrag.critical(asked["motion"], p2=3.0, vertical=asked["vertical"])
    with pytest.raises(rbfrag.InputError, match="of type float"):
        rbfrag.predict(3.0, 0.1, motion=0.6)
    assert "\n" not in repr(motion)
