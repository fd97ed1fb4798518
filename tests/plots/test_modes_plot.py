"""The chart of modes shows what the solver says, and the blocks where they belong."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex

from rbfrag.campaign.rock_mass_answer import shake
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.plots import modes as module
from rbfrag.plots.canvas import MODE_COLOURS
from rbfrag.plots.modes import MOST_POINTS, plot_modes
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import MODES
from rbfrag.solver.stability.single import stability


def images(figure):
    return list(figure.axes[0].images)


def names(figure):
    return [t for t in figure.axes[0].texts if t.get_fontsize() == 10.0]


@pytest.mark.parametrize("back", [True, False])
@pytest.mark.parametrize(("phi", "beta"), [(35.0, 0.0), (20.0, 10.0), (50.0, -15.0)])
def test_the_regions_are_the_modes_of_the_solver(phi, beta, back, tmp_path, figures, overlapping):
    plot_modes(tmp_path / "a.png", phi_deg=phi, beta_deg=beta, back_fracture=back)
    (figure,) = figures
    (image,) = images(figure)
    shown = image.get_array()
    size = shown.shape[0]
    random = np.random.default_rng(1)
    for _ in range(300):
        i1, i3 = random.integers(0, size, 2)
        a1, a3 = (-90.0 + 180.0 * (i + 0.5) / size for i in (i1, i3))
        if a1 >= a3:
            assert shown.mask[i3, i1]
            continue
        judgement = stability(
            Block.from_angles(a1, a3, 1.0), beta_deg=beta, phi_deg=phi, back_fracture=back
        )
        assert MODES[shown[i3, i1]] == judgement.mode
    texts = [t.get_text() for t in names(figure)]
    assert {"topple"} < set(texts)
    assert any(t.startswith("slide\n") and t.endswith(" g") for t in texts)
    assert ("confined topple" in texts) == back
    assert ("slump" in texts) == back
    assert f"{phi:g}°" in figure.get_suptitle()
    axes = figure.axes[0]
    assert "°" in axes.get_xlabel()
    assert "°" in axes.get_ylabel()
    assert overlapping(figure, [*names(figure), *axes.get_legend().get_texts()]) == []


def test_a_name_stands_in_its_region(tmp_path, figures):
    plot_modes(tmp_path / "a.png", phi_deg=35.0, beta_deg=20.0)
    for text in names(figures[0]):
        a1, a3 = text.get_position()
        judgement = stability(Block.from_angles(a1, a3, 1.0), beta_deg=20.0, phi_deg=35.0)
        assert text.get_text().split("\n")[0] == judgement.mode.replace("_", " ")
        assert judgement.state == "stable"


@pytest.mark.parametrize("back", [True, False])
@pytest.mark.parametrize(("phi", "beta"), [(35.0, 0.0), (40.0, 20.0), (50.0, -15.0)])
def test_a_value_stands_on_its_contour_in_its_region(
    phi, beta, back, tmp_path, figures, overlapping
):
    plot_modes(tmp_path / "a.png", phi_deg=phi, beta_deg=beta, back_fracture=back)
    (figure,) = figures
    axes = figure.axes[0]
    values = [text for text in axes.texts if text.get_fontsize() == 7.5]
    assert len(values) > 3
    by_colour = {colour: mode for mode, colour in MODE_COLOURS.items()}
    for text in values:
        a1, a3 = text.get_position()
        judgement = stability(
            Block.from_angles(a1, a3, 1.0), beta_deg=beta, phi_deg=phi, back_fracture=back
        )
        assert judgement.mode == by_colour[to_hex(text.get_color())]
        assert judgement.yield_acceleration == pytest.approx(
            float(text.get_text()), rel=0.05, abs=0.01
        )
    assert overlapping(figure, [*names(figure), *values]) == []
    frame = axes.get_window_extent()
    for box in (text.get_window_extent() for text in values):
        assert frame.contains(*box.min)
        assert frame.contains(*box.max)


@pytest.mark.parametrize("phi", [2.0, 5.0, 60.0, 85.0])
def test_names_of_narrow_regions_do_not_cover_each_other(phi, tmp_path, figures, overlapping):
    plot_modes(tmp_path / "a.png", phi_deg=phi)
    (figure,) = figures
    assert len(names(figure)) >= 3
    assert overlapping(figure, [*names(figure), figure._suptitle]) == []


def test_a_few_blocks_are_points_and_many_a_histogram(tmp_path, figures):
    a1 = np.random.default_rng(1).uniform(-30.0, 10.0, MOST_POINTS + 1)
    a3 = a1 + 25.0
    for count in (3, MOST_POINTS, MOST_POINTS + 1):
        plot_modes(tmp_path / "a.png", phi_deg=35.0, alpha1_deg=a1[:count], alpha3_deg=a3[:count])
    few, most, many = figures
    for figure, count in ((few, 3), (most, MOST_POINTS)):
        points = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
        assert [line.get_xdata().size for line in points] == [count]
        assert len(images(figure)) == 1
    _, counts = images(many)
    assert counts.get_array().sum() == MOST_POINTS + 1
    row, column = np.argwhere(~np.ma.getmaskarray(counts.get_array()))[0]
    low1, low3 = -90.0 + 2.0 * column, -90.0 + 2.0 * row
    inside = (a1 >= low1) & (a1 < low1 + 2.0) & (a3 >= low3) & (a3 < low3 + 2.0)
    assert counts.get_array()[row, column] == inside.sum() > 0
    assert "blocks per cell" in many.axes[1].get_ylabel()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"phi_deg": 90.0}, "phi_deg"),
        ({"phi_deg": float("nan")}, "phi_deg"),
        ({"phi_deg": 35.0, "beta_deg": 95.0}, "beta_deg"),
        ({"phi_deg": 35.0, "phi_back_deg": -1.0}, "phi_back_deg"),
        ({"phi_deg": 35.0, "alpha1_deg": [1.0, 2.0], "alpha3_deg": [3.0]}, "equal length"),
    ],
)
def test_rejections_leave_no_file(changes, words, tmp_path):
    with pytest.raises(InputError, match=words):
        plot_modes(tmp_path / "a.png", **changes)
    assert list(tmp_path.iterdir()) == []


def test_water_moves_the_regions_of_blocks_of_one_spacing(tmp_path, figures):
    on = {"water_m": 1.0, "density_kg_m3": 2650.0}
    plot_modes(tmp_path / "a.png", phi_deg=35.0, beta_deg=5.0, s1_m=2.0, **on)
    (image,) = images(figures[0])
    shown, size = image.get_array(), len(image.get_array())
    random = np.random.default_rng(4)
    modes, afloat = set(), 0
    for _ in range(200):
        a1, a3 = np.sort(random.integers(0, size, 2)) * 0.5 - 89.75
        at = round((a3 + 89.75) * 2), round((a1 + 89.75) * 2)
        if a1 == a3:
            continue
        block = Block.from_angles(a1, a3, 1.0 / np.cos(np.radians(a3)))
        top_m = 2.0 * (np.cos(np.radians(5.0)) + block.cot_gamma * np.sin(np.radians(5.0)))
        held = {**on, "water_m": float(np.clip(top_m, 0.0, 1.0))}
        try:
            judgement = stability(block, beta_deg=5.0, phi_deg=35.0, **held)
        except InputError:
            afloat += 1
            assert shown.mask[at]
            continue
        assert MODES[shown[at]] == judgement.mode
        modes.add(judgement.mode)
    assert len(modes) == 4
    assert afloat > 0
    assert "s1 2 m, water 1 m" in figures[0].get_suptitle()
    with pytest.raises(InputError, match="water_m requires s1_m"):
        plot_modes(tmp_path / "a.png", phi_deg=35.0, **on)


def test_cells_are_blocks_of_their_angles_and_coloured_as_they_end(tmp_path, figures):
    cells = module.chart_cells(phi_deg=35.0, beta_deg=15.0, s1_m=2.0)
    a1, a3 = np.meshgrid(module._CELLS, module._CELLS)
    assert np.allclose(cells.blocks.alpha1_deg, a1[a1 < a3], atol=1e-9)
    assert np.allclose(cells.blocks.alpha3_deg, a3[a1 < a3], atol=1e-9)
    assert (cells.s1_m == 2.0).all()
    ended = shake(cells, GroundMotion(np.array([0.0, 0.45, 0.0]), 0.05), jobs=1)
    plot_modes(tmp_path / "a.png", phi_deg=35.0, beta_deg=15.0, s1_m=2.0, ended=ended)
    (image,) = images(figures[0])
    shown = np.asarray(image.get_array())[a1 < a3]
    moved = ended.final_code[0] >= 0
    assert 300 < moved.sum() < moved.size
    assert (shown[~moved] == 1.0).all()
    for at in np.flatnonzero(moved)[::50]:
        assert to_hex(shown[at, :3]) == MODE_COLOURS[MODES[ended.final_code[0, at]]]
    labels = [t.get_text() for t in figures[0].axes[0].get_legend().get_texts()]
    assert "stays: slide" in labels
    assert "unstable at rest" in labels
