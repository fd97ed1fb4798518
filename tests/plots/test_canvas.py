import subprocess
import sys

import pytest
from matplotlib import rc_context, rcParams

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.plots import plot
from rbfrag.plots.canvas import new_figure, plot_path, save_figure, written_numbers
from rbfrag.solver.block.geometry import Block

BEGINNINGS = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}


@pytest.fixture
def figure():
    figure = new_figure(3, 2)
    figure.add_subplot().plot([0, 1], [1, 0])
    return figure


@pytest.mark.parametrize("kind", BEGINNINGS)
def test_the_suffix_chooses_the_format_and_nothing_else_stays(figure, tmp_path, kind):
    path = tmp_path / f"figure.{kind.upper()}"
    path.write_text("older")
    assert save_figure(figure, str(path)).path == path
    assert path.read_bytes().startswith(BEGINNINGS[kind])
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["figure", "figure.jpg", "figure.gif", "none/figure.png"])
def test_paths_that_cannot_be_written_are_rejected(figure, tmp_path, name):
    with pytest.raises(InputError, match="plot file"):
        save_figure(figure, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_no_file(tmp_path):
    (tmp_path / "a.png").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        plot_path(tmp_path / "a.png")


def test_a_failure_while_drawing_leaves_nothing(figure, tmp_path, monkeypatch):
    old = tmp_path / "figure.png"
    old.write_text("older")

    def fail(stream, **_):
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure, "savefig", fail)
    with pytest.raises(InputError, match="No space left"):
        save_figure(figure, old)
    assert old.read_text() == "older"
    assert list(tmp_path.iterdir()) == [old]


def test_without_matplotlib_the_extra_is_named(tmp_path):
    program = """
import sys
sys.modules["matplotlib"] = None
from rbfrag.errors import MissingExtraError
from rbfrag.plots.canvas import new_figure
try:
    new_figure()
except MissingExtraError as error:
    print(error)
"""
    process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert "pip install 'rbfrag[plot]'" in process.stdout, process.stderr


def test_figures_do_not_depend_on_the_settings_of_the_user(tmp_path, figures):
    block = Block.from_angles(45.0, 65.0, 1.0)
    mine = {"text.usetex": True, "axes.facecolor": "black", "font.size": 30.0, "lines.color": "red"}
    for settings in ({}, mine):
        with rc_context(settings):
            plot.rotation(block, tmp_path / "a.png", beta_deg=0.0, phi_deg=35.0)
            assert rcParams["text.usetex"] is bool(settings)
    assert [figure.axes[0].xaxis.label.get_fontsize() for figure in figures] == [10.0, 10.0]
    assert [figure.axes[0].get_facecolor() for figure in figures] == [(1.0, 1.0, 1.0, 1.0)] * 2


@pytest.mark.parametrize(
    ("ends", "written"),
    [
        ((0.5, 300.0), {"1", "10", "100"}),
        ((5e-6, 2e-3), {"$10^{-5}$", "0.0001", "0.001"}),
        ((5e4, 2e7), {"100000", "$10^{6}$", "$10^{7}$"}),
        ((1e-4, 1e6), set()),
    ],
)
def test_numbers_beside_a_logarithmic_axis(figure, ends, written):
    axes = figure.axes[0]
    axes.set_xscale("log")
    written_numbers(axes.xaxis, 1.0, 3.0)
    axes.set_xlim(*ends)
    shown = {axes.xaxis.get_major_formatter()(place) for place in axes.get_xticks()}
    assert written <= shown
    assert len([place for place in axes.get_xticks() if ends[0] <= place <= ends[1]]) >= 3
    assert not [text for text in shown if "e-" in text or "e+" in text]


def test_letters_that_the_font_lacks_are_no_trouble(tmp_path):
    motion = GroundMotion.from_nodes([0.0, 1.0, 2.0], [0.0, 0.3, 0.0], station="臺北 $1 _a")
    plot.spectrum(motion, tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 1000
