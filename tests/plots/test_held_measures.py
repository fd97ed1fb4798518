"""Fixed measures of charts of more than one: texts, rejections, and the answers of predict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.completion import NODES_P2, Regression, encode_regressions
from rbfrag.fragility.model import FragilityModel
from rbfrag.plots.chart import plot_chart
from rbfrag.plots.model_lines import failure_line, held_measures
from rbfrag.question.question import predict

G = 9.80665
DOMAIN = {
    "p2": (0.1, 10.0),
    "intensity_m_s": (0.01, 1.0),
    "tm_s": (0.1, 1.6),
    "pgv_over_pga_s": (0.02, 0.32),
}


def model_of(
    term: str, names: tuple[str, ...], values: tuple[float, ...], method: str,
    used: tuple[str, ...] = (), regression: tuple[float, ...] = (),
) -> FragilityModel:  # fmt: skip
    """A model; with a regression of its spectral velocity on the used measures."""
    sizes = len(NODES_P2)
    line = Regression([regression] * sizes, [0.2] * sizes, [[0.1, 0.2]] * sizes)
    row = ModelRow(
        name=f"{method}-{term}",
        term=term,
        method=method,
        coefficients=dict(zip(names, values, strict=True)),
        covariance=tuple(map(tuple, (1e-4 * np.eye(len(values))).tolist())),
        domain=DOMAIN,
        data_fingerprint="",
        diagnostics={"n": 100, "events": 9},
        completions=encode_regressions({" ".join(used): line}) if used else None,
    )
    return FragilityModel.from_row(row).for_inputs(used)


OF_PGV_PGA = (
    "pgv_pga", ("b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_v", "b_ln_z", "b_ln_x"),
    (2.4, 0.65, 2.3, 4.5, 1.0, 2.1), "toppling",
)  # fmt: skip
WITH_TM = model_of(*OF_PGV_PGA, ("pgv_m_s", "pga_g", "tm_s"), (-0.4, -0.4, 0.0, 0.5))
WITH_PGA = model_of(*OF_PGV_PGA, ("pgv_m_s", "pga_g"), (-0.2, -0.3, -0.04))
PGA_TM = model_of(
    "pga", ("b0", "b_ln_p", "b_ln_r", "b_ln_1_minus_r", "b_ln_x"), (-1.2, 0.1, 3.0, 1.9, 3.3),
    "toppling", ("pga_g", "tm_s"), (-1.4, 1.0),
)  # fmt: skip
SA = model_of(
    "sa", ("b0", "b_ln_p", "b_ln_p_squared", "b_ln_x_over_y"), (-2.2, 0.2, -0.1, 3.4), "toppling",
    ("sa(1)",), (-0.4, 0.8),
)  # fmt: skip
OF_SIZE = model_of(
    "pgv", ("b0", "b_ln_v", "b_ln_1_minus_v", "b_ln_p_squared", "b_strength"),
    (1.9, 0.6, 4.7, -0.15, -1.5), "toppling",
)  # fmt: skip
ALONE = model_of("pgv", ("c0", "c1", "v0", "v1"), (0.002, 0.72, 1e-4, 2e-3), "wls")


def test_what_is_not_given_is_the_middle_of_the_fitted_range() -> None:
    held = held_measures(WITH_TM)
    assert held.p2 == pytest.approx(1.0)
    assert held.pgv_over_pga_s == pytest.approx(0.08)
    assert held.constants == {"tm_s": pytest.approx(0.4)}
    assert held.words == "at p² = 1 1/s², PGV/(PGA g) = 0.08 s, Tm = 0.4 s"
    assert held_measures(OF_SIZE).words == "at p² = 1 1/s²"
    assert held_measures(ALONE).words == ""
    assert held_measures(PGA_TM).words == "at p² = 1 1/s², Tm = 0.4 s"
    assert [held_measures(model).across for model in (WITH_TM, PGA_TM, SA, ALONE)] == [
        "pgv_m_s", "pga_g", "sa(1)", "intensity_m_s",
    ]  # fmt: skip


def test_a_size_gives_the_chart_an_axis_of_kr(tmp_path, figures) -> None:
    plot_chart(ALONE, tmp_path / "chart.png", held_measures(ALONE, p2=4.0))
    axes = figures[0].axes[0]
    (beside,) = axes.child_axes
    assert "$k_r$ at $p^2$ = 4" in beside.get_ylabel()
    ends = [y * 4.0**0.5 / G for y in axes.get_ylim()]
    assert beside.get_ylim() == pytest.approx(ends)
    plot_chart(ALONE, tmp_path / "chart.png")
    assert not figures[1].axes[0].child_axes


@pytest.mark.parametrize("model", [OF_SIZE, WITH_PGA, WITH_TM])
@pytest.mark.parametrize("pga", [None, 0.5])
def test_blocks_on_a_line_have_its_probability(model, pga) -> None:
    held = held_measures(model, p2=3.0, pga_g=None if model is OF_SIZE else pga)
    x = np.array([0.05, 0.2, 0.6])
    for pgv, y in zip(x, failure_line(model, x, 0.25, held), strict=True):
        measures = {"pgv_m_s": float(pgv)}
        if model is not OF_SIZE:
            measures["pga_g"] = pgv / (0.08 * G) if pga is None else pga
        if model is WITH_TM:
            measures["tm_s"] = 0.4
        answer = predict(3.0, y * 3.0**0.5 / G, model=model, **measures)
        assert answer.probability == pytest.approx(0.25, rel=1e-9)


@pytest.mark.parametrize(("model", "name"), [(PGA_TM, "pga_g"), (SA, "sa(1)")])
def test_lines_over_an_acceleration_have_its_probability(model, name) -> None:
    x = np.array([0.05, 0.2, 0.6])
    for value, y in zip(x, failure_line(model, x, 0.25, held_measures(model, p2=3.0)), strict=True):
        shaking = {name: float(value)} | ({"tm_s": 0.4} if model is PGA_TM else {})
        answer = predict(3.0, y * 3.0**0.5 / G, model=model, **shaking)
        assert answer.probability == pytest.approx(0.25, rel=1e-9)


def test_no_line_reaches_what_pga_cannot_lift() -> None:
    held = held_measures(WITH_PGA, p2=3.0, pga_g=0.3)
    line = failure_line(WITH_PGA, np.array([0.5, 5.0, 50.0]), 0.01, held)
    assert (line < 0.3 * G / 3.0**0.5).all()


@pytest.mark.parametrize(
    ("model", "held", "words"),
    [
        (OF_SIZE, {"pga_g": 0.3}, "pga_g = 0.3 has no effect"),
        (WITH_PGA, {"tm_s": 0.3}, "tm_s = 0.3 has no effect"),
        (WITH_TM, {"tm_s": 0.0}, "tm_s = 0 is not above zero"),
        (WITH_TM, {"pga_g": float("nan")}, "pga_g = nan is not above zero"),
        (replace(WITH_TM, row=replace(WITH_TM.row, domain={})), {}, "range of p2"),
        (
            model_of("xp", ("b0", "b_ln_xp_over_y", "b_ln_s"), (4.0, 3.0, 1.0), "record"),
            {},
            "of one intensity measure",
        ),
    ],
)
def test_what_cannot_be_held_is_rejected(model, held, words) -> None:
    with pytest.raises(InputError, match=words):
        held_measures(model, **held)


def test_what_is_shaded_is_outside_the_fitted_range(tmp_path, figures) -> None:
    held = held_measures(WITH_PGA, p2=3.0, pga_g=0.3)
    plot_chart(WITH_PGA, tmp_path / "chart.png", held)
    axes = figures[0].axes[0]
    (shade,) = (collection for collection in axes.collections if collection.get_paths())
    edges = np.concatenate([path.vertices for path in shade.get_paths()])[:, 0]
    # PGV/(PGA g) is fitted from 0.02 to 0.32 s
    for edge in (0.02 * 0.3 * G, 0.32 * 0.3 * G):
        assert np.abs(np.log(edges / edge)).min() < 0.03


def test_the_caption_says_what_is_held(tmp_path) -> None:
    path = tmp_path / "chart.svg"
    plot_chart(WITH_TM, path, held_measures(WITH_TM, p2=3.0, pga_g=0.4, tm_s=0.5))
    assert "PGA = 0.4 g, Tm = 0.5 s" in path.read_text(encoding="utf-8")
