"""Outcomes of blocks in five earthquakes, and the answers of models fitted without them.

The tables beside this file are written by `python -m benchmarks.held_out_rows`.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.fit.likelihood import Binomial, most_likely
from rbfrag.fragility.fit.result import CLIP
from rbfrag.fragility.method import LOGIT
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.prediction_array import PredictionArray

FloatArray = NDArray[np.float64]

FOLDER = Path(__file__).parent


def table(name: str) -> dict[str, FloatArray]:
    with (FOLDER / name).open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    columns = zip(*rows[1:], strict=True)
    return {name: np.array(c, float) for name, c in zip(rows[0], columns, strict=True)}


def blocks(kind: str) -> dict[str, FloatArray]:
    """Blocks of one kind: what they are, the shaking, and what they did."""
    of_blocks, of_motions = table(f"{kind}-blocks.csv"), table(f"{kind}-motions.csv")
    place = np.searchsorted(of_motions["motion"], of_blocks["motion"])
    return {**{name: column[place] for name, column in of_motions.items()}, **of_blocks}


def probabilities(stored: dict[str, Any], inputs: str, sharpened: float = 1.0) -> FloatArray:
    """P of every block from some intensity measures, by a model whose coefficients are multiplied
    by a factor."""
    b = {name: sharpened * value for name, value in stored["coefficients"].items()}
    nothing = tuple((0.0,) * len(b) for _ in b)
    row = ModelRow("held out", stored["term"], stored["method"], b, nothing, {}, "",
                   kind=stored["kind"], leave_out_steps=nothing,
                   completions="\n".join(stored["completions"]))  # fmt: skip
    model = FragilityModel.from_row(row)
    block = model.method.block
    names = (*block.names, *block.stored, *inputs.split())
    arguments = {name: blocks(stored["kind"])[name] for name in names}
    answer = answer_given(model, arguments, 0.95, interval=False)
    assert isinstance(answer, PredictionArray)
    return answer.probability


def loss_and_slope(p: FloatArray, failed: FloatArray) -> tuple[float, float]:
    """Log loss, and the slope of outcomes on the logit of P."""
    clipped = np.clip(p, CLIP, 1.0 - CLIP)
    loss = -np.where(failed > 0.5, np.log(clipped), np.log1p(-clipped)).mean()
    columns = np.column_stack([np.ones(p.size), np.log(clipped / (1.0 - clipped))])
    rows = Binomial(LOGIT, columns, failed, np.ones(p.size), np.zeros(p.size, np.intp))
    return float(loss), float(most_likely(rows)[1])
