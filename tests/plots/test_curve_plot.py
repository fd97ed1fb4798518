"""The fragility curve: predict's own numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.model import FragilityModel
from rbfrag.plots import plot
from rbfrag.plots.curve import plot_curve
from rbfrag.question.question import predict
from tests.fragility.portfolio_draws import SHARED
from tests.plots.critical_values import straight_line_model

BLOCK = {"p2": 3.0, "kr": 0.1}


def test_curve_and_band_are_those_of_predict(tmp_path, figures) -> None:
    model = straight_line_model()
    plot_curve(model, BLOCK, tmp_path / "c.png", level=0.9)
    axes = figures[0].axes[0]
    dashed, solid = (line for line in axes.lines if len(line.get_xdata()) > 2)
    x, y = dashed.get_data()
    inside = np.isfinite(solid.get_ydata())
    for i in (40, 120, 200):
        answer = predict(3.0, 0.1, pgv_m_s=float(x[i]), model=model, level=0.9)
        assert y[i] == pytest.approx(answer.probability, rel=1e-12)
        assert inside[i] == answer.in_domain
        (interval,) = axes.collections  # no sites are asked for
        band = interval.get_paths()[0].vertices
        edges = band[np.isclose(band[:, 0], x[i], rtol=1e-12)][:, 1]
        assert (edges.min(), edges.max()) == pytest.approx((answer.ci_low, answer.ci_high))
    assert y[-1] > 0.95
    assert "fitted on 360 critical values of 7 earthquakes" in axes.get_title()


def test_the_range_at_some_sites_is_a_second_band(tmp_path, figures) -> None:
    row = replace(straight_line_model().row, dependence=SHARED)
    model = FragilityModel.from_row(row)
    plot_curve(model, BLOCK, tmp_path / "c.png", level=0.9, sites=5)
    axes = figures[0].axes[0]
    event, interval = axes.collections
    assert "90 % prediction interval, 5 sites of one earthquake" in event.get_label()
    assert "90 % confidence interval" in interval.get_label()
    x = axes.lines[0].get_xdata()[150]
    answer = predict(3.0, 0.1, pgv_m_s=float(x), model=model, level=0.9, sites=5)
    for band, ends in (
        (event, (answer.event_low, answer.event_high)),
        (interval, (answer.ci_low, answer.ci_high)),
    ):
        outline = band.get_paths()[0].vertices
        edges = outline[np.isclose(outline[:, 0], x, rtol=1e-12)][:, 1]
        assert (edges.min(), edges.max()) == pytest.approx(ends)


def test_other_measures_are_held(tmp_path, figures) -> None:
    plot_curve(straight_line_model("pga_tm"), BLOCK, tmp_path / "c.png", fixed={"tm_s": 0.5})
    axes = figures[0].axes[0]
    assert axes.get_xlabel() == "peak ground acceleration, PGA [g]"
    assert "; Tm 0.5 s" in axes.get_title()


@pytest.mark.parametrize(
    ("over", "shaking", "model"),
    [
        ("pgv", {"pga_g": 0.4, "sa_g": {0.3: 0.9, 1.0: 0.5}}, "toppling-pgv_pga"),
        ("pga", {"tm_s": 0.5}, "toppling-pga"),
        ("sa(1)", {"sa_g": {0.3: 0.9}}, "toppling-sa"),
        ("sa(1)", {"pga_g": 0.4, "kind": "rocking"}, "rocking-pga"),
    ],
)
def test_curves_over_each_measure_are_those_of_predict(
    over, shaking, model, tmp_path, figures
) -> None:
    picture = plot.curve(3.0, 0.05, tmp_path / "c.png", over=over, **shaking)
    assert not picture.warnings
    (axes,) = figures[0].axes
    assert f"model {model}" in axes.get_title()
    assert ("SA(0.3 s) 0.9 g" in axes.get_title()) == (0.3 in shaking.get("sa_g", {}))
    x, y = axes.lines[0].get_data()
    varied = {"pgv": {"pgv_m_s": x[80]}, "pga": {"pga_g": x[80]}}.get(over, {})
    question = {**shaking, **varied}
    if over == "sa(1)":
        question["sa_g"] = {**shaking.get("sa_g", {}), 1.0: x[80]}
    answer = predict(3.0, 0.05, **question)
    assert answer.model == model
    assert y[80] == pytest.approx(answer.probability, rel=1e-9)


def test_a_measure_without_use_is_named(tmp_path) -> None:
    picture = plot.curve(3.0, 0.05, tmp_path / "c.png", sa_g={1.0: 0.5})
    assert any("sa_g was not used" in text for text in picture.warnings)


def test_the_axis_of_a_named_model_is_its_first_measure_that_is_not_held(tmp_path, figures) -> None:
    named = {"model": "rocking-pga", "kind": "rocking"}
    for pga, axis in (({"pga_g": 0.4}, "PGV [m/s]"), ({}, "PGA [g]")):
        plot.curve(3.0, 0.05, tmp_path / "c.png", **named, **pga)
        assert figures[-1].axes[0].get_xlabel().endswith(axis)


def test_a_missing_measure_is_named(tmp_path) -> None:
    with pytest.raises(InputError, match="tm_s"):
        plot_curve(straight_line_model("pga_tm"), BLOCK, tmp_path / "c.png")
    assert not list(tmp_path.iterdir())


def test_as_many_curves_beside_it_as_styles_and_no_more(tmp_path, figures, overlapping) -> None:
    names = [f"fragility {i} of a file with rather long names of $ states" for i in range(21)]
    compared = {name: lambda x: np.clip(x, 0.0, 1.0) for name in names}
    with pytest.raises(InputError, match=r"21 fragility functions .* maximum is 20"):
        plot_curve(straight_line_model(), BLOCK, tmp_path / "c.png", compared=compared)
    assert not list(tmp_path.iterdir())
    del compared[names[-1]]
    plot_curve(straight_line_model(), BLOCK, tmp_path / "c.png", compared=compared)
    (figure,) = figures
    axes = figure.axes[0]
    drawn = [line for line in axes.lines if line.get_label().startswith("fragility")]
    assert len({(line.get_color(), line.get_linestyle()) for line in drawn}) == 20
    assert axes.get_window_extent().height > 0.3 * figure.bbox.height
    assert overlapping(figure, [axes.title, *figure.legends[0].get_texts()]) == []


def test_a_model_of_outcomes_is_fitted_on_outcomes() -> None:
    about = {"n": 8579, "n_outcomes": 45766, "events": 100}
    assert describe.fitted_data(about) == "fitted on 45,766 outcomes of 100 earthquakes"
    assert describe.fitted_data({"n": 8579, "events": 100}) == (
        "fitted on 8,579 critical values of 100 earthquakes"
    )
    assert describe.fitted_data({}) == ""
