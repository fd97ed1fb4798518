"""The block that a motion topples with a given probability: the answers of predict turned round."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.plots.fit import plot_fit
from rbfrag.plots.model_lines import predicted_strengths, smooth_line
from rbfrag.question.question import predict
from tests.fragility.outcome_draws import drawn_outcomes
from tests.plots.test_held_measures import WITH_TM, model_of

G = 9.80665


def test_each_motion_topples_its_block_with_the_probability() -> None:
    source = drawn_outcomes("logistic", "pgv", (-2.0, 4.8), events=4, motions=1)
    table = source.table
    y = predicted_strengths(WITH_TM, table, 0.3)
    for i in range(table.p2.size):
        answer = predict(
            float(table.p2[i]),
            y[i] * float(table.p2[i]) ** 0.5 / G,
            pgv_m_s=float(table.pgv_m_s[i]),
            pga_g=float(table.pga_g[i]),
            tm_s=float(table.tm_s[i]),
            model=WITH_TM,
        )
        assert answer.probability == pytest.approx(0.3, rel=1e-9)


def test_models_of_the_record_and_of_free_exponents_are_drawn(tmp_path) -> None:
    source = drawn_outcomes("logistic", "pgv", (-2.0, 4.8), events=4, motions=1)
    record = model_of("xp", ("b0", "b_ln_xp_over_y", "b_ln_s"), (4.0, 3.0, 1.0), "record")
    names = ("ln_median", "slope", "ln_sigma", "m_minus_1")
    exponents = model_of("pgv", names, (-0.4, 0.95, -1.2, -0.1), "lognormal")
    for model in (record, exponents, WITH_TM):
        path = tmp_path / "fit.svg"
        plot_fit(source.table, model, path, log=True, measures={"xp_m_s": source.xp_m_s})
        assert "at 50 % probability of failure" in path.read_text(encoding="utf-8")


def test_a_smooth_line_keeps_a_power_law_and_evens_scatter() -> None:
    random = np.random.default_rng(3)
    x = np.exp(random.uniform(-4.0, 1.0, 2000))
    at = np.geomspace(x.min(), x.max(), 50)
    power = smooth_line(x, 0.7 * x**1.3, at)
    np.testing.assert_allclose(power, 0.7 * at**1.3, rtol=1e-9)
    scattered = smooth_line(x, 0.7 * x**1.3 * np.exp(random.normal(0.0, 0.5, x.size)), at)
    assert np.abs(np.log(scattered / power)).max() < 0.15
    # no zigzag: a running median of as much scatter turns back many times
    slopes = np.diff(np.log(scattered)) / np.diff(np.log(at))
    assert slopes.min() > 0.8
    assert np.abs(np.diff(slopes)).max() < 0.1
