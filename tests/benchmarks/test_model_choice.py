"""The study of model choice: scores are those of the textbook, and missed aims are told."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import expit, logit

from benchmarks.held_out import FOLDS, Outcomes, folds, outcomes, predictions, read, studied
from benchmarks.model_choice import (
    MODELS,
    Aims,
    Mark,
    Predicted,
    calibration_slope,
    class_table,
    clustered_mean,
    log_losses,
    marks,
    predicted,
    score_table,
    table_of_shares,
    tables_of,
)
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.fit.data import FitSource


@pytest.fixture(scope="module")
def study_data() -> tuple[FitSource, Outcomes]:
    source, _ = read(REFERENCE)
    source = source.only(
        np.isin(source.table.p2, (10.0, 1.0, 0.3)) & (source.table.motion_id % 4 == 0)
    )
    return source, outcomes(source)


@pytest.fixture(scope="module")
def pgv_pga(study_data: tuple[FitSource, Outcomes]) -> Predicted:
    return predicted(study_data[0], MODELS["bounded-pgv_pga"])


def test_the_order_of_rows_does_not_matter(study_data: tuple[FitSource, Outcomes]) -> None:
    source, data = study_data
    shuffled = source.only(np.random.default_rng(0).permutation(source.table.p2.size))
    straight, mixed = (studied(item, data, "pgv_pga") for item in (source, shuffled))
    assert mixed.held_out == pytest.approx(straight.held_out, abs=1e-9)
    # rows of fits stand in their own orders: by number their blocks are others
    other = studied(source, data, "record")
    assert (straight.data.values["p2"] != other.data.values["p2"]).any()


def test_a_prediction_is_of_the_block_that_it_is_joined_to(
    study_data: tuple[FitSource, Outcomes],
) -> None:
    source, data = study_data
    study = studied(source, data, "record")
    y_m_s = predictions(source, study.data, study.data.grid("y_m_s"))
    assert np.array_equal(data.joined(y_m_s), data.value["y"])
    assert np.isnan(data.joined({})).all()
    twice = source.only(np.repeat(np.arange(source.table.p2.size), 2))
    with pytest.raises(ValueError, match="twice"):
        studied(twice, data, "record")


def test_fitted_blocks_stand_where_their_motions_do(study_data: tuple[FitSource, Outcomes]) -> None:
    source, data = study_data
    study = studied(source, data, "pgv_pga")
    placed, rows = study.placement, study.rows
    assert len(placed.earthquake) == rows.place.size
    assert np.array_equal(placed.earthquake, rows.data.event)
    r = study.data.grid("kr").ravel()[rows.place] / study.data.grid("pga_g").ravel()[rows.place]
    h = np.exp(0.18 * placed.l - 0.06 * placed.l**2)
    assert rows.data.columns[:, 1] == pytest.approx(-h * np.log(r), rel=1e-9)


def test_earthquakes_are_dealt_whole() -> None:
    event = np.repeat(np.arange(40), np.arange(1, 41))
    fold = folds(event)
    assert set(fold.tolist()) == set(range(FOLDS))
    assert all(np.unique(fold[event == e]).size == 1 for e in range(40))
    assert np.ptp(np.bincount(fold)) < 60


def test_a_model_is_judged_on_what_it_has_not_seen(
    study_data: tuple[FitSource, Outcomes], pgv_pga: Predicted
) -> None:
    assert pgv_pga.kr is not None
    assert pgv_pga.kr.min() >= 0.02
    assert pgv_pga.failed.size == study_data[1].failed.size
    # turned about, the outcomes of one fold change nothing of what is said of them
    source = study_data[0]
    names, event = np.unique(source.table.event_id.astype(str), return_inverse=True)
    first = folds(event) == 3
    turned = replace(source, failed=np.where(first[:, None], 1.0 - source.failed, source.failed))
    again = predicted(turned, MODELS["bounded-pgv_pga"])
    assert names.size == pgv_pga.event.max() + 1
    same = np.isclose(again.p, pgv_pga.p, rtol=0.0, atol=1e-3)
    turned_events = np.isin(pgv_pga.event, np.unique(event[first]))
    assert same[turned_events].all()
    assert not same[~turned_events].all()


def test_the_table_of_shares_leaves_the_earthquake_out() -> None:
    failed, event = np.array([1.0, 1.0, 0.0, 1.0]), np.array([0, 0, 1, 2])
    shares = table_of_shares(failed, event, np.array([4, 4, 4, 9]))
    assert shares.tolist() == [0.25, 0.25, 2.5 / 3.0, 0.5]


def drawn(slope: float) -> Predicted:
    random = np.random.default_rng(1)
    p = expit(random.normal(0.0, 1.5, 20_000))
    failed = (random.random(p.size) < p).astype(float)
    event, kr = random.integers(0, 40, p.size), np.exp(random.uniform(np.log(0.02), 0.0, p.size))
    p2, shares = np.repeat((1.0, 10.0), p.size // 2), np.full(p.size, failed.mean())
    return Predicted(expit(logit(p) / slope), failed, event, kr, p2, shares)


def test_scores_see_what_is_wrong_with_a_model() -> None:
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


def test_an_aim_that_is_missed_is_told() -> None:
    good, sure = drawn(1.0), drawn(0.5)
    aims = Aims("bounded", "pgv", "toppling", good.loss, good.kr_from(0.05).loss, 1.0, (0.8, 1.35),
                (1.0, 1.0, 1.0, 1.0), (0.95, 1.05))  # fmt: skip
    assert all(mark.reached for mark in marks("m", aims, good))
    missed = [mark.words for mark in marks("m", aims, sure) if not mark.reached]
    assert "log loss, k_r ≥ 0.02" in missed
    assert "slope, k_r ≥ 0.05" in missed
    assert "slope, k_r 0.1 to 0.2" in missed
    assert len(list(marks("m", aims, good))) == 4 + 4 + 2


def test_every_model_has_a_line(pgv_pga: Predicted) -> None:
    results = {"bounded-pgv_pga": pgv_pga}
    (line,) = score_table(results).splitlines()[2:]
    assert "pgv, pga" in line
    assert f"{pgv_pga.loss:.4f} ±" in line
    assert len(class_table(results).splitlines()) == 2 + 5
    assert len(class_table(results, "p2").splitlines()) == 2 + 3
    by_magnitude = class_table(results, "magnitude").splitlines()
    assert [line.split(" | ")[0] for line in by_magnitude[2:]] == [
        "| M < 5.6", "| M 5.6 to 6", "| M 6 to 6.5", "| M 6.5 to 7.5", "| M ≥ 7.5",
    ]  # fmt: skip


def test_an_intercept_of_a_class_of_magnitude_is_told() -> None:
    of_kr = drawn(1.0)
    magnitude = np.where(of_kr.event < 20, 5.0, 7.0)
    # small earthquakes are told too little
    p = np.where(magnitude < 6.0, expit(logit(of_kr.p) - 1.0), of_kr.p)
    result = Predicted(p, of_kr.failed, of_kr.event, magnitude=magnitude)
    small, *_, great, greatest = result.intercepts
    assert small == pytest.approx(1.0, abs=0.1)
    assert great == pytest.approx(0.0, abs=0.1)
    assert np.isnan(greatest)
    (mark,) = marks("m", Aims("displacement", "pgv_pga_m", "sliding", intercept=0.9), result)
    assert not mark.reached
    (mark,) = marks("m", Aims("displacement", "pgv_pga_m", "sliding", intercept=1.2), result)
    assert mark.reached
    assert tables_of({"sliding-pgv_pga_m": result}) == {}


def test_a_mark_says_where_it_is_missed() -> None:
    mark = Mark("a", "slope", 0.93, 1.07, 1.0)
    assert mark.aim == "0.93 to 1.07"
    assert mark.cell == "1"
    assert Mark("a", "slope", 0.93, 1.07, 0.925).cell == "**0.925, missed**"
    assert Mark("a", "slope", 0.93, 1.07, math.nan).cell == "**nan, missed**"
    assert Mark("a", "gain", 0.02, math.inf, 0.03, also=("above 0", False)).cell != "0.03"
    assert Mark("a", "loss", -math.inf, 0.1, 0.1).aim == "≤ 0.1"
