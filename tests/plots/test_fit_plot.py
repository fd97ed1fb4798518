from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow
from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.fragility.model import FragilityModel
from rbfrag.plots import fit as fit_module
from rbfrag.plots import plot
from rbfrag.plots.fit import plot_fit
from rbfrag.solver.results import NUMERICS_VERSION
from tests.synthetic import unknown_measures

N = 400


@pytest.fixture
def table():
    random = np.random.default_rng(6)
    pgv = np.exp(random.uniform(-4, 0.3, N))
    y = np.abs(0.72 * pgv + random.normal(size=N) * np.sqrt(1e-4 + 2e-3 * pgv))
    result = np.arange(N) % 10 != 0
    keep = np.where(result, 1.0, np.nan)
    return CombinationTable(
        combination_id=np.arange(N),
        motion_id=np.arange(N),
        event_id=np.array([f"event-{i % 7}" for i in range(N)], dtype=object),
        event_guessed=np.zeros(N, dtype=bool),
        polarity=np.full(N, "forward", dtype=object),
        p2=np.ones(N),
        status=np.where(result, "found", "below_limit").astype(object),
        search_limit=np.full(N, 0.01),
        kr_over_pga=keep * 0.5,
        upper=np.full(N, np.nan),
        kr=keep * y / 9.80665,
        y_m_s=keep * y,
        pga_g=np.full(N, 0.5),
        pgv_m_s=pgv,
        pgd_m=0.1 * pgv,
        tm_s=np.full(N, 0.5),
        natural_key=np.arange(N).astype(str).astype(object),
        block=np.full(N, None, dtype=object),
        yield_g=np.full(N, np.nan),
        numerics_version=np.full(N, NUMERICS_VERSION, dtype=object),
        measures=unknown_measures(N),
    )


def repeated(table, times):
    return table.only(np.tile(np.arange(table.p2.size), times))


@pytest.fixture
def model():
    return FragilityModel.from_row(
        ModelRow(
            name="wls-pgv",
            term="pgv",
            method="wls",
            coefficients={"c0": 0.002, "c1": 0.72, "v0": 1e-4, "v1": 2e-3},
            covariance=tuple(map(tuple, (1e-8 * np.eye(4)).tolist())),
            domain={},
            data_fingerprint="",
        )
    )


@pytest.fixture
def drawn(monkeypatch):
    """The figures that were made."""
    drawn_figures = []

    def remember(*args):
        drawn_figures.append(new_figure(*args))
        return drawn_figures[-1]

    new_figure = fit_module.canvas.new_figure
    monkeypatch.setattr(fit_module.canvas, "new_figure", remember)
    return drawn_figures


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_the_file_is_written(table, model, tmp_path, suffix):
    path = tmp_path / f"fit.{suffix}"
    assert plot_fit(table, model, path).path == path
    assert path.stat().st_size > 5000


def test_what_the_figure_says(table, model, tmp_path, drawn):
    plot_fit(table, model, tmp_path / "fit.png")
    figure = drawn[0]
    axes, above, beside, variance = figure.axes
    assert variance.get_shared_x_axes().joined(axes, variance)
    assert variance.get_xlabel() == "peak ground velocity, PGV [m/s]"
    assert "[m/s]" in axes.get_ylabel()
    assert "360 critical blocks of 7 earthquakes" in figure.get_suptitle()
    assert "40 critical blocks below the search limit" in figure.get_suptitle()
    assert len(axes.collections[0].get_offsets()) == 360
    assert sum(patch.get_height() for patch in above.patches) == 360
    assert sum(patch.get_width() for patch in beside.patches) == 360


def test_many_blocks_are_counted_in_cells(table, model, tmp_path, drawn):
    plot_fit(repeated(table, 2), model, tmp_path / "fit.png")
    axes, _, _, bar, _ = drawn[0].axes
    assert bar.get_ylabel() == "critical blocks per cell"
    assert int(axes.collections[0].get_array().sum()) == 720


def test_the_variance_panel_shows_the_bins_of_the_fit(table, model, tmp_path, drawn):
    plot_fit(table, model, tmp_path / "fit.png")
    dots, missed, line = drawn[0].axes[3].lines
    x, variance = line.get_data()
    assert variance == pytest.approx(1e-4 + 2e-3 * x)
    is_finite = np.isfinite(table.y_m_s)
    order = np.argsort(table.pgv_m_s[is_finite])
    x, y = table.pgv_m_s[is_finite][order], table.y_m_s[is_finite][order]
    # 360 points in 18 bins, and two parameters of the line
    residual = (y - 0.002 - 0.72 * x).reshape(18, 20)
    expected = (residual**2).mean(axis=1) * 360.0 / 358.0
    assert dots.get_ydata() == pytest.approx(expected)
    assert dots.get_xdata() == pytest.approx(x.reshape(18, 20).mean(axis=1))
    ratio = (1e-4 + 2e-3 * dots.get_xdata()) / expected
    off = (ratio <= 0.5) | (ratio >= 2.0)
    assert list(missed.get_xdata()) == list(dots.get_xdata()[off])
    assert expected == pytest.approx(1e-4 + 2e-3 * dots.get_xdata(), rel=1.2)


def test_the_equation_is_in_the_title(table, model, tmp_path, drawn):
    plot_fit(table, model, tmp_path / "fit.png")
    title = drawn[0].get_suptitle()
    assert r"(0.00200 + 0.720\,x - y)/\sigma" in title
    assert r"\sigma^2 = 1.00\times10^{-4} + 0.00200\,x\ \mathrm{[m^2/s^2]}" in title
    assert "$x$ = PGV [m/s]" in title


def test_the_failure_lines_have_their_probabilities(table, model, tmp_path, drawn):
    from rbfrag.question.question import predict

    plot_fit(table, model, tmp_path / "fit.png")
    lines = {line.get_label(): line for line in drawn[0].axes[0].lines}
    expected = {
        "2.5 % probability of failure": 0.025,
        "50 % probability of failure": 0.5,
        "97.5 % probability of failure": 0.975,
    }
    assert set(lines) == set(expected)
    for label, probability in expected.items():
        x, y = (values[300] for values in lines[label].get_data())
        answer = predict(1.0, y / 9.80665, pgv_m_s=x, model=model)
        assert answer.probability == pytest.approx(probability, rel=1e-9)


def test_nothing_overlaps(table, model, tmp_path, drawn):
    for term in ("pgv", "pga_tm"):
        other = FragilityModel.from_row(replace(model.row, term=term))
        plot_fit(repeated(table, 2), other, tmp_path / "fit.png")
        figure = drawn[-1]
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        renderer = canvas.get_renderer()
        axes, above, beside, bar, variance = figure.axes
        boxes = [
            figure._suptitle.get_window_extent(renderer),
            above.get_window_extent(renderer),
            above.yaxis.label.get_window_extent(renderer),
            beside.get_window_extent(renderer),
            beside.xaxis.label.get_window_extent(renderer),
            variance.get_window_extent(renderer),
            variance.xaxis.label.get_window_extent(renderer),
            variance.yaxis.label.get_window_extent(renderer),
            axes.yaxis.label.get_window_extent(renderer),
            axes.get_window_extent(renderer),
            bar.get_window_extent(renderer),
            bar.yaxis.label.get_window_extent(renderer),
            figure.legends[0].get_window_extent(renderer),
        ]
        for i, box in enumerate(boxes):
            assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
            assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1
            assert not any(box.overlaps(other) for other in boxes[:i])


def test_logarithmic_axes_show_every_block(table, model, tmp_path, drawn):
    plot_fit(table, model, tmp_path / "fit.png", log=True)
    axes, above, beside, variance = drawn[0].axes
    for item in (axes, variance):
        assert item.get_xscale() == item.get_yscale() == "log"
    assert len(axes.collections[0].get_offsets()) == 360
    assert sum(patch.get_height() for patch in above.patches) == 360
    assert sum(patch.get_width() for patch in beside.patches) == 360


def test_nothing_to_draw_is_rejected(table, model, tmp_path):
    empty = replace(table, status=np.full(N, "below_limit", dtype=object))
    with pytest.raises(InputError, match="no critical value"):
        plot_fit(empty, model, tmp_path / "fit.png")
    outcomes_alone = replace(table, status=np.full(N, "not_searched", dtype=object))
    with pytest.raises(InputError, match="kind toppling have no critical values"):
        plot_fit(outcomes_alone, model, tmp_path / "fit.png")
    with pytest.raises(InputError, match=r"\.jpg"):
        plot_fit(table, model, tmp_path / "fit.jpg")
    assert list(tmp_path.iterdir()) == []


def test_models_of_other_blocks_are_rejected(table, tmp_path):
    row = ModelRow(
        name="slumps", kind="slumping", term="pgv_pga", method="capacity",
        coefficients={"b0": 1.0, "b_ln_excess": 3.0, "b_ln_z": 2.5, "b_ln_k": 1.2},
        covariance=((0.01, 0.0, 0.0, 0.0),) * 4, domain={}, data_fingerprint="",
    )  # fmt: skip
    with pytest.raises(InputError, match="blocks with ks and ps2"):
        plot_fit(table, FragilityModel.from_row(row), tmp_path / "fit.png")


@pytest.mark.parametrize("name", ["toppling-sa", "toppling-pgv_pga"])
def test_models_of_a_spectral_velocity_are_drawn_over_what_they_expect(name, tmp_path, drawn):
    picture = plot.fit(tmp_path / "fit.png", model=name, log=True, db=REFERENCE)
    assert not picture.warnings
    title = drawn[0].get_suptitle()
    assert "spectral velocity at the block's periods" in title
    assert r"\sigma" not in title  # its spectra are known
    axes = drawn[0].axes[0]
    assert "at 50 % probability of failure" in axes.get_xlabel()
    upper, _, lower = (line.get_data() for line in axes.lines)
    assert (upper[1] > upper[0]).all()
    assert (lower[1] < lower[0]).all()
