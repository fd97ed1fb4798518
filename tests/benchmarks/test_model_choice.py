"""The study of model choice: scores are those of the textbook, and missed aims are reported."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.special import expit, logit

from benchmarks.held_out import (
    Predicted,
    StoredModels,
    calibration_slope,
    clustered_mean,
    log_losses,
    scored_blocks,
)
from benchmarks.model_aims import (
    MODELS,
    REQUIRED_ONLY,
    SA_1,
    SA_21,
    WITH_PGV,
    Mark,
    MeasureSet,
    model_marks,
    rare_failures,
)
from benchmarks.model_choice import (
    asked_for_table,
    main,
    predictions_of,
    score_table,
    tables_of,
)
from benchmarks.reliability import EDGES, bins_of, table
from rbfrag.db.engine import open_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models


@pytest.fixture(scope="module")
def models() -> StoredModels:
    return StoredModels(str(REFERENCE), read_models(REFERENCE))


def drawn(slope: float) -> Predicted:
    """Outcomes of blocks, with probabilities whose logit is over the true one by a factor."""
    random = np.random.default_rng(1)
    p = expit(random.normal(0.0, 1.5, 20_000))
    failed = (random.random(p.size) < p).astype(float)
    event, kr = random.integers(0, 40, p.size), np.exp(random.uniform(np.log(0.02), 0.0, p.size))
    p2 = np.tile((30.0, 10.0, 3.0, 1.0, 0.3), p.size // 5)
    magnitude = np.where(event < 20, 5.0, 7.0)
    return Predicted(expit(logit(p) / slope), failed, event, magnitude, kr, p2)


@pytest.mark.parametrize(
    ("name", "measures"),
    [("toppling-pgv_pga", REQUIRED_ONLY), ("rocking-pga", WITH_PGV), ("record-xp", REQUIRED_ONLY)],
)
def test_aims_are_reached_on_the_built_in_data(
    models: StoredModels, name: str, measures: MeasureSet
) -> None:
    blocks = models.predicted(name, measures.names)
    assert blocks.kr is not None
    assert 0.02 <= blocks.kr.min() < blocks.kr.max() <= 1.0
    marks = [*model_marks(name, models.rows[name], {measures: blocks})]
    measured = [mark for mark in marks if not math.isnan(mark.value)]
    assert len(measured) == 6
    assert all(mark.is_reached for mark in measured)


def test_a_prediction_does_not_depend_on_the_outcomes_of_its_earthquake(
    models: StoredModels,
) -> None:
    """The regression, too, is one that leaves the earthquake out."""
    row = models.rows["toppling-pgv_pga"]
    exact, completed = (models.predicted(row.name, measures.names) for measures in (SA_21, SA_1))
    assert exact.loss < completed.loss
    in_sample = row.diagnostics["scores"]
    assert isinstance(in_sample, dict)
    assert exact.loss > in_sample["log_loss_in_sample"]


def test_blocks_that_are_scored_have_what_their_motions_have(models: StoredModels) -> None:
    source = models.source(models.rows["record-xp"])
    inputs, failed = scored_blocks(source)
    assert {column.size for column in inputs.values()} == {failed.size}
    y_m_s = inputs["kr"] * 9.80665 / np.sqrt(inputs["p2"])
    assert not failed[y_m_s >= inputs["xp_m_s"]].any()
    assert not failed[inputs["kr"] >= inputs["pga_g"]].any()


def test_scores_show_what_is_wrong_with_a_model() -> None:
    good, sure = drawn(1.0), drawn(0.5)
    assert good.slope[0] == pytest.approx(1.0, abs=3.0 * good.slope[1])
    assert sure.slope[0] == pytest.approx(0.5, abs=3.0 * sure.slope[1])
    assert good.slope[1] < 0.05
    assert good.loss < sure.loss
    assert good.ratio == pytest.approx(1.0, abs=0.05)
    real = good.kr_from(0.05)
    assert real.kr is not None
    assert real.kr.min() >= 0.05
    assert real.loss == pytest.approx(log_losses(real.p, real.failed).mean())


def test_errors_count_earthquakes_and_not_blocks() -> None:
    random = np.random.default_rng(2)
    event = np.repeat(np.arange(50), 100)
    values = random.normal(size=50)[event] + 0.01 * random.normal(size=event.size)
    mean, error = clustered_mean(np.append(values, np.nan), np.append(event, 0))
    assert mean == pytest.approx(values.mean())
    assert error == pytest.approx(values.reshape(50, 100).mean(axis=1).std(ddof=1) / 50**0.5)
    rows = drawn(1.0)
    alone = calibration_slope(rows.p, rows.failed, np.arange(rows.failed.size) % 500)[1]
    blocks = [np.concatenate([column] * 4) for column in (rows.p, rows.failed)]
    together = calibration_slope(*blocks, np.tile(np.arange(rows.failed.size) % 500, 4))[1]
    assert together == pytest.approx(alone, rel=1e-6)


def test_a_missed_aim_is_reported() -> None:
    def missed(blocks: Predicted) -> set[str]:
        marks = model_marks("toppling-pgv", None, {REQUIRED_ONLY: blocks})
        return {mark.words for mark in marks if not mark.is_reached}

    good, sure = missed(drawn(1.0)), missed(drawn(0.5))
    assert "calibration slope, k_r ≥ 0.05" in sure - good
    assert "lowest calibration slope of a class of p²" in sure - good
    assert "failures with P < 0.01 (2 × expected + 3)" in sure - good
    # of another data set the losses are other ones, and without a row there are no coefficients
    assert "log loss, k_r ≥ 0.02" in good
    assert "largest change of a coefficient, in CR3 standard errors" in good


@pytest.mark.parametrize("name", MODELS)
def test_an_aim_that_is_not_measured_is_missed(name: str) -> None:
    marks = [*model_marks(name, None, {})]
    assert not any(mark.is_reached for mark in marks)
    assert all(mark.cell == "**not measured, missed**" for mark in marks)


def test_intercepts_of_magnitude_classes_are_aimed_at() -> None:
    blocks = drawn(1.0)
    assert blocks.magnitude is not None
    p = np.where(blocks.magnitude < 6.0, expit(logit(blocks.p) - 1.0), blocks.p)
    low = Predicted(p, blocks.failed, blocks.event, blocks.magnitude)
    small, *_, great, greatest = low.intercepts
    assert small == pytest.approx(1.0, abs=0.1)
    assert great == pytest.approx(0.0, abs=0.1)
    assert np.isnan(greatest)
    *_, mark = model_marks("sliding-pgv_pga_m", None, {REQUIRED_ONLY: low})
    assert mark.words == "largest intercept of a magnitude class"
    assert not mark.is_reached


def test_every_set_of_measures_has_a_line() -> None:
    blocks = drawn(1.0)
    names = [name for name, aims in MODELS.items() if aims.kind == "rocking"]
    every = {name: dict.fromkeys(MODELS[name].sets, blocks) for name in names}
    terms = {name: name.removeprefix("rocking-") for name in names}
    lines = score_table(every, terms).splitlines()[2:]
    assert len(lines) == sum(len(MODELS[name].sets) for name in names)
    assert "| PGA, PGV, SA(0.3, 1, 3) |" in "\n".join(lines)
    tables = tables_of("rocking", every, terms)
    assert len(tables["classes"].splitlines()) == 2 + 4 + 6
    assert [line.split(" | ")[0] for line in tables["magnitudes"].splitlines()[2:]] == [
        "| M < 5.6", "| M 5.6 to 6", "| M 6 to 6.5", "| M 6.5 to 7.5", "| M ≥ 7.5",
    ]  # fmt: skip


def test_what_to_ask_for_is_a_table_of_losses(models: StoredModels) -> None:
    predictions = predictions_of(models, ["toppling-pga"])
    scalars = {
        name: {} for name in ("toppling-pgv_pga", "toppling-sa", "rocking-pga", "rocking-sa")
    }
    lines = asked_for_table({**predictions, **scalars}).splitlines()[2:]
    assert lines[0].startswith("| SA(21 periods) | – | 0.077 | –")
    assert lines[-1].startswith("| nothing else | – | 0.171 |")


def test_aims_of_a_database_without_models_are_missed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "empty.db"
    open_database(path, create=True).dispose()
    with pytest.raises(SystemExit):
        main(["--db", str(path), "--aims", "--model", "rocking-sa"])
    printed = capsys.readouterr().out
    assert "**not measured, missed**" in printed
    assert "aims missed" in printed


def test_bins_of_p_hold_every_block() -> None:
    blocks = drawn(1.0)
    p = blocks.p.copy()
    p[:100], p[100:200] = 0.0, 5e-5
    failed = blocks.failed.copy()
    failed[:200] = 0.0
    bins = bins_of(Predicted(p, failed, blocks.event))
    assert sum(part.blocks for part in bins) == p.size
    assert sum(part.observed for part in bins) == failed.sum()
    assert sum(part.predicted for part in bins) == pytest.approx(p.sum())
    assert len(bins) == len(EDGES)
    assert [(part.words, part.blocks) for part in bins[:2]] == [
        ("0 by mechanics", 100), ("< 0.01 %", 100),
    ]  # fmt: skip
    assert bins[1].earthquakes == np.unique(blocks.event[100:200]).size
    for part in bins[4:-3]:
        assert part.observed == pytest.approx(part.predicted, abs=4.0 * part.predicted**0.5)
    lines = table({"PGV": bins, "PGA": bins}).splitlines()
    assert lines[3].count("0 (< 0.01 %)") == 2
    assert lines[3].count("0 (0 %)") == 2
    failures, expected, number = rare_failures(Predicted(p, failed, blocks.event))
    assert number >= 200
    assert failures <= 2.0 * expected + 3.0


def test_a_mark_says_where_it_is_missed() -> None:
    mark = Mark("a", "slope", 0.93, 1.07, 1.0)
    assert mark.aim == "0.93 to 1.07"
    assert mark.cell == "1"
    assert Mark("a", "slope", 0.93, 1.07, 0.925).cell == "**0.925, missed**"
    assert Mark("a", "slope", 0.93, 1.07, math.nan).cell == "**not measured, missed**"
    assert Mark("a", "gain", 0.02, math.inf, 0.03, also=("above 0", False)).cell != "0.03"
    assert Mark("a", "loss", -math.inf, 0.1, 0.1).aim == "≤ 0.1"
