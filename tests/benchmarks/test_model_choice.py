"""The study of model choice: models are joined by block, scores are those of the textbook."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.special import expit, logit

from benchmarks.held_out import Outcomes, outcomes, predictions, read, studied
from benchmarks.model_choice import (
    Model,
    Rows,
    calibration_slope,
    class_table,
    clustered_mean,
    data_table,
    difference_table,
    domain_table,
    log_losses,
    score,
    study,
    table_of_shares,
)
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.fit.data import FitSource


@pytest.fixture(scope="module")
def some() -> tuple[FitSource, Outcomes]:
    source, _ = read(REFERENCE)
    source = source.only(
        np.isin(source.table.p2, (10.0, 1.0, 0.3)) & (source.table.motion_id % 3 == 0)
    )
    return source, outcomes(source)


def test_the_order_of_rows_does_not_matter(some: tuple[FitSource, Outcomes]) -> None:
    source, data = some
    order = np.random.default_rng(0).permutation(source.table.p2.size)
    shuffled = source.only(order)
    straight = studied(source, data, "pgv_pga")
    predicted = {"pgv_pga": straight.own, "record": studied(source, data, "record").own}
    mixed = predicted | {"pgv_pga": studied(shuffled, data, "pgv_pga").own}
    rows = Rows.of(data)
    tables = [
        (class_table(rows, p, tuple(p)), difference_table(rows, p, [("pgv_pga", "record")]))
        for p in (predicted, mixed)
    ]
    assert tables[0] == tables[1]
    # rows of fits stand in their own orders: by number their blocks are others
    p2 = [studied(s, data, name).data.values["p2"] for s, name in
          ((source, "pgv_pga"), (source, "record"))]  # fmt: skip
    assert (p2[0] != p2[1]).any()
    assert np.array_equal(data.value["p2"][straight.block], np.array(
        [data.keys[i].p2 for i in straight.block]
    ))  # fmt: skip
    fitted = straight.rows.place // straight.data.failed.shape[1]
    assert np.array_equal(straight.data.values["p2"][fitted], data.value["p2"][straight.block])


def test_a_prediction_is_of_the_block_that_it_is_joined_to(
    some: tuple[FitSource, Outcomes],
) -> None:
    source, data = some
    study = studied(source, data, "record")
    y_m_s = predictions(source, study.data, study.data.grid("y_m_s"))
    assert np.array_equal(data.joined(y_m_s), data.value["y"])
    assert np.isnan(data.joined({})).all()
    twice = source.only(np.repeat(np.arange(source.table.p2.size), 2))
    with pytest.raises(ValueError, match="twice"):
        studied(twice, data, "record")


def test_the_table_of_shares_leaves_the_earthquake_out() -> None:
    rows = Rows(
        failed=np.array([1.0, 1.0, 0.0, 1.0]),
        event=np.array([0, 0, 1, 2]),
        p2=np.array([1.0, 1.0, 1.0, 3.0]),
        strength=np.array([4, 4, 4, 4]),
    )
    assert table_of_shares(rows).tolist() == [0.25, 0.25, 2.5 / 3.0, 0.5]


def drawn(slope: float) -> tuple[Rows, np.ndarray]:
    random = np.random.default_rng(1)
    p = expit(random.normal(0.0, 1.5, 20_000))
    failed = (random.random(p.size) < p).astype(float)
    event, strength = random.integers(0, 40, p.size), random.integers(0, 25, p.size)
    rows = Rows(failed, event, np.repeat((1.0, 10.0), p.size // 2), strength)
    return rows, expit(logit(p) / slope)


def test_scores_see_what_is_wrong_with_a_model() -> None:
    rows, right = drawn(1.0)
    _, sure = drawn(0.5)
    shares = table_of_shares(rows)
    good, bad = (score(rows, p, shares) for p in (right, sure))
    assert good.slope[0] == pytest.approx(1.0, abs=3.0 * good.slope[1])
    assert bad.slope[0] == pytest.approx(0.5, abs=3.0 * bad.slope[1])
    assert good.slope[1] < 0.05
    assert good.log_loss[0] < bad.log_loss[0]
    assert good.skill_log > 0.1
    assert good.skill_log == pytest.approx(
        1.0 - good.log_loss[0] / log_losses(shares, rows.failed).mean()
    )
    assert score(rows, shares, shares).skill_middle == 0.0


def test_errors_count_earthquakes_and_not_blocks() -> None:
    random = np.random.default_rng(2)
    event = np.repeat(np.arange(50), 100)
    values = random.normal(size=50)[event] + 0.01 * random.normal(size=event.size)
    mean, error = clustered_mean(np.append(values, np.nan), np.append(event, 0))
    assert mean == pytest.approx(values.mean())
    assert error == pytest.approx(values.reshape(50, 100).mean(axis=1).std(ddof=1) / 50**0.5)
    rows, p = drawn(1.0)
    alone = calibration_slope(p, rows.failed, np.arange(rows.failed.size) % 500)[1]
    blocks = [np.concatenate([column] * 4) for column in (p, rows.failed)]
    together = calibration_slope(*blocks, np.tile(np.arange(rows.failed.size) % 500, 4))[1]
    assert together == pytest.approx(alone, rel=1e-6)


def test_half_of_the_motions_are_counted(some: tuple[FitSource, Outcomes]) -> None:
    pairs = zip(some[1].motion.tolist(), some[1].event.tolist(), strict=True)
    motions = sorted(Counter(dict(pairs).values()).values(), reverse=True)
    half = next(n for n in range(len(motions)) if 2 * sum(motions[:n]) >= sum(motions))
    table = data_table(some[1])
    assert f"| horizontal motions | {sum(motions)} |" in table
    assert 1 < half < len(motions) / 2
    assert f"| earthquakes that hold half of the motions | {half} |" in table


def test_every_aim_has_a_value(some: tuple[FitSource, Outcomes]) -> None:
    aims = study(*some, aims_alone=True)["aims"].splitlines()
    assert len(aims) == 2 + 4 * 6
    assert "nan" not in "".join(aims)


def test_models_of_one_range_stand_in_one_line() -> None:
    nothing = np.zeros(0)
    models = {
        name: Model(name, nothing, {}, {"z": (0.1, 2.0), "pgv_m_s": (low, 1.0)})
        for name, low in (("a", 0.1), ("b", 0.2))
    }
    assert domain_table(models).splitlines()[2:] == [
        "| `pgv_m_s` | 0.1 to 1 | a |",
        "| `pgv_m_s` | 0.2 to 1 | b |",
        "| `z` | 0.1 to 2 | a, b |",
    ]
