"""The map of islands as a figure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from typer.testing import CliRunner

from rbfrag.cli.main import app
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.plots import canvas
from rbfrag.plots.critical_strength import enlarged_range, plot_islands, rotations
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import excitation
from rbfrag.solver.search.critical import critical
from tests.synthetic import write_at2


def shaking(seed: int, npts: int = 1500) -> GroundMotion:
    rng = np.random.default_rng(seed)
    smooth = np.convolve(rng.standard_normal(npts + 40), np.hanning(24), "same")[20:-20]
    samples = smooth * np.hanning(npts)
    return GroundMotion(samples * (0.5 / np.abs(samples).max()), 0.01)


WITH_ISLANDS, P2 = 17, 10.0


@pytest.fixture(scope="module")
def searched() -> tuple[GroundMotion, CriticalResult]:
    motion = shaking(WITH_ISLANDS)
    result = critical(motion, p2=P2, full_map=True, map_depth=1e-7)
    assert result.reentrant
    return motion, result


def test_figure_shows_map_curve_and_values(
    searched: tuple[GroundMotion, CriticalResult],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    motion, result = searched
    figures = []
    monkeypatch.setattr(canvas, "save_figure", lambda figure, path: figures.append(figure))
    plot_islands(motion, result, tmp_path / "islands.png", title="made up")
    (figure,) = figures
    FigureCanvasAgg(figure).draw()
    full, part = figure.axes
    assert "made up" in figure.get_suptitle()
    assert f"{result.lower:.6g}" in figure.get_suptitle()
    low, high = part.get_xlim()
    assert 0.01 <= low < high
    words = {text.get_text() for text in full.get_legend().get_texts()}
    assert words == {"all topple", "all stay", "peak rotation", "critical value", "$K_{up}$"}
    at = [line.get_xdata()[0] for line in full.lines if len(set(line.get_xdata())) == 1]
    assert result.lower in at
    assert result.k_up_over_pga in at
    # the bands are those of the map
    spans = len(part.patches)
    inside = [
        outcome
        for k_lo, k_hi, outcome in zip(
            result.intervals.k_lo, result.intervals.k_hi, result.intervals.outcome, strict=True
        )
        if outcome != "undecided" and k_hi > low and k_lo < high
    ]
    assert spans == len(inside)
    assert "safe" in inside[1:-1]


def test_curve_is_broken_exactly_where_the_map_says_that_blocks_topple(
    searched: tuple[GroundMotion, CriticalResult],
) -> None:
    motion, result = searched
    low, high, words = enlarged_range(result)
    assert "safe island" in words
    ratios, theta_n = rotations(excitation(motion), result, low, high, logarithmic=False)
    assert np.all(np.diff(ratios) >= 0.0)
    at = np.minimum(np.searchsorted(result.intervals.k_hi, ratios), result.intervals.k_hi.size - 1)
    outcomes = np.array(result.intervals.outcome)[at]
    assert np.all(np.isnan(theta_n[outcomes == "topples"]))
    assert np.all(np.isfinite(theta_n[outcomes == "safe"]))
    assert (outcomes == "topples").any()
    assert (outcomes == "safe").any()


def test_without_an_island_the_critical_value_is_enlarged() -> None:
    pulse = GroundMotion.from_nodes([0.0, 0.2, 0.4], [0.0, 0.5, 0.0])
    result = critical(pulse, p2=5.0, full_map=True)
    low, high, words = enlarged_range(result)
    assert words == "at the critical value"
    assert result.lower is not None
    assert low < result.lower < high


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_command_writes_the_figure(tmp_path: Path, suffix: str) -> None:
    record = write_at2(tmp_path / "made.AT2", shaking(WITH_ISLANDS).acceleration_g, dt_s=0.01)
    figure = tmp_path / f"islands.{suffix}"
    arguments = ["critical", str(record), "--p2", "10", "--plot", str(figure)]
    plain = CliRunner().invoke(app, arguments[:-2])
    drawn = CliRunner().invoke(app, arguments)
    assert drawn.exit_code == 0, drawn.output
    assert figure.stat().st_size > 10_000
    # the map is made for the figure, and printed only when asked for
    assert drawn.stdout.splitlines()[0] == plain.stdout.splitlines()[0]
    assert "undecided" not in drawn.stdout.splitlines()[-1]


def test_bad_file_and_nothing_to_draw_are_said_in_one_sentence(tmp_path: Path) -> None:
    record = write_at2(tmp_path / "made.AT2", shaking(1).acceleration_g, dt_s=0.01)
    bad = CliRunner().invoke(app, ["critical", str(record), "--p2", "3", "--plot", "map.bmp"])
    assert bad.exit_code == 2
    rest = GroundMotion(np.zeros(10), 0.01)
    with pytest.raises(InputError, match="no map of outcomes"):
        plot_islands(rest, critical(rest, p2=1.0, full_map=True), tmp_path / "map.png")
    assert not (tmp_path / "map.png").exists()
