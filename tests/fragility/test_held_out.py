"""Models fitted without five earthquakes, judged on what blocks did in these.

No record is needed to see that a form, a link, a bound or a regression has changed.
"""

from __future__ import annotations

import json
from typing import Any

import pytest

from benchmarks.model_aims import MODELS as AIMED
from tests.fragility.held_out import FOLDER, blocks, loss_and_slope, probabilities

MODELS: dict[str, dict[str, Any]] = json.loads((FOLDER / "models.json").read_text("utf-8"))

BEYOND = 0.05
"""How far the log loss on these five may lie above that of all held-out earthquakes."""


@pytest.mark.parametrize(
    ("name", "inputs"),
    [(name, inputs) for name, stored in MODELS.items() for inputs in stored["scores"]],
)
def test_a_model_predicts_what_blocks_did_in_held_out_earthquakes(name: str, inputs: str) -> None:
    stored = MODELS[name]
    scores = stored["scores"][inputs]
    expected = scores["log_loss"], scores["slope"]
    failed = blocks(stored["kind"])["failed"]
    result = loss_and_slope(probabilities(stored, inputs), failed)
    assert result == pytest.approx(expected, rel=2e-3)
    aims = next(
        a for measures, a in AIMED[name].sets.items() if measures.words == scores["measures"]
    )
    assert aims.loss is not None
    assert result[0] < aims.loss[0] + BEYOND
    assert 0.7 < result[1] < 1.9
    # another model, of coefficients a twentieth larger, is told from it
    other = loss_and_slope(probabilities(stored, inputs, 1.05), failed)
    assert other != pytest.approx(expected, rel=2e-3)
