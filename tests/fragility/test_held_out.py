"""Models fitted without five earthquakes, judged on what blocks did in these.

The tables in `held_out` are written by `python -m benchmarks.held_out_rows`: no record is needed to
see that a form, a link or a bound of the package no longer says what was fitted.
"""

from __future__ import annotations

import csv
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.fit.likelihood import Binomial, most_likely
from rbfrag.fragility.fit.scores import CLIP
from rbfrag.fragility.method import LOGIT
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.prediction_array import PredictionArray

FloatArray = NDArray[np.float64]

FOLDER = Path(__file__).parent / "held_out"
MODELS: dict[str, dict[str, Any]] = json.loads((FOLDER / "models.json").read_text("utf-8"))

LARGEST_LOSS = {
    "bounded-pgv_kr": 0.14,
    "bounded-pgv_pga": 0.12,
    "bounded-pgv_pga_tm": 0.12,
    "bounded-pgv_pga_sa10_sa30": 0.12,
    "logistic-sa10": 0.2,
    "bounded-pga": 0.26,
    "bounded-pga_sa10": 0.16,
    "bounded-pga_sa03_sa10_sa30": 0.14,
    "record-xp": 0.03,
}
"""Log losses a little above those of all earthquakes left out (docs/evidence/model-choice.md)."""

SLOPES = (0.75, 1.35)
"""Of outcomes on the logit of P: 1 is perfect, less is over-confident."""


def table(name: str) -> dict[str, FloatArray]:
    with (FOLDER / name).open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    columns = zip(*rows[1:], strict=True)
    return {name: np.array(c, float) for name, c in zip(rows[0], columns, strict=True)}


@cache
def blocks(kind: str) -> dict[str, FloatArray]:
    of_blocks, of_motions = table(f"{kind}-blocks.csv"), table(f"{kind}-motions.csv")
    place = np.searchsorted(of_motions["motion"], of_blocks["motion"])
    return {**{name: column[place] for name, column in of_motions.items()}, **of_blocks}


def probabilities(stored: dict[str, Any], sharpened: float = 1.0) -> FloatArray:
    """P of every block by a model whose coefficients are multiplied by a factor."""
    b = {name: sharpened * value for name, value in stored["coefficients"].items()}
    nothing = tuple((0.0,) * len(b) for _ in b)
    row = ModelRow("held out", stored["term"], stored["method"], b, nothing, {}, "",
                   kind=stored["kind"], leave_out_steps=nothing)  # fmt: skip
    model = FragilityModel.from_row(row)
    block = model.method.block
    names = (*block.names, *block.stored, *model.term.inputs)
    given = {name: blocks(stored["kind"])[name] for name in names}
    answer = answer_given(model, given, 0.95, interval=False)
    assert isinstance(answer, PredictionArray)
    return answer.probability


def loss_and_slope(p: FloatArray, failed: FloatArray) -> tuple[float, float]:
    clipped = np.clip(p, CLIP, 1.0 - CLIP)
    loss = -np.where(failed > 0.5, np.log(clipped), np.log1p(-clipped)).mean()
    columns = np.column_stack([np.ones(p.size), np.log(clipped / (1.0 - clipped))])
    rows = Binomial(LOGIT, columns, failed, np.ones(p.size), np.zeros(p.size, np.intp))
    return float(loss), float(most_likely(rows)[1])


@pytest.mark.parametrize("name", MODELS)
def test_a_model_tells_what_blocks_did_in_earthquakes_that_it_has_not_seen(name: str) -> None:
    stored = MODELS[name]
    failed = blocks(stored["kind"])["failed"]
    loss, slope = loss_and_slope(probabilities(stored), failed)
    assert loss < LARGEST_LOSS[name]
    assert SLOPES[0] < slope < SLOPES[1]
    # one that is as over-confident as it could be for all that its loss tells is found out
    _, too_sure = loss_and_slope(probabilities(stored, 2.0), failed)
    assert not SLOPES[0] < too_sure < SLOPES[1]
