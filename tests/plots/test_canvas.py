import subprocess
import sys

import pytest

from rbfrag.errors import InputError
from rbfrag.plots.canvas import new_figure, plot_path, save_figure

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
    assert save_figure(figure, str(path)) == path
    assert path.read_bytes().startswith(BEGINNINGS[kind])
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["figure", "figure.jpg", "figure.gif", "none/figure.png"])
def test_paths_that_cannot_be_written_are_refused(figure, tmp_path, name):
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
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert "pip install 'rbfrag[plot]'" in done.stdout, done.stderr
