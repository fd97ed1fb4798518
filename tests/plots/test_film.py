"""Films of a block."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.plots.film import film
from rbfrag.solver.block import Block
from rbfrag.solver.response import respond
from rbfrag.solver.results import Response

BLOCK = Block.from_angles(45, 65, 1.0)


@pytest.fixture(scope="module")
def slump() -> Response:
    motion = GroundMotion.from_nodes([0.0, 0.0, 0.2, 0.2, 0.4], [0.0, 0.9, 0.9, 0.0, 0.0])
    return respond(motion, block=BLOCK, beta_deg=0.0, phi_deg=35.0, history=True)


def test_the_block_moves_in_the_film(slump: Response, tmp_path: Path) -> None:
    path = film(slump, BLOCK, tmp_path / "slump.gif", beta_deg=0.0, exaggerate=3.0, title="pulse")
    with Image.open(path) as moving:
        assert moving.n_frames >= 5
        frames = []
        for n in (0, moving.n_frames - 1):
            moving.seek(n)
            frames.append(np.asarray(moving.convert("L"), dtype=float))
    scene = slice(0, frames[0].shape[0] // 2)
    changed = np.abs(frames[0][scene] - frames[1][scene]) > 20.0
    assert changed.mean() > 0.01
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "exaggerate", "word"),
    [
        ("film.avi", 1.0, "none of .gif, .html"),
        ("nowhere/film.gif", 1.0, "cannot be written"),
        ("film.gif", 0.0, "exaggerate = 0"),
    ],
)
def test_refused(slump: Response, tmp_path: Path, name: str, exaggerate: float, word: str) -> None:
    with pytest.raises(InputError, match=word):
        film(slump, BLOCK, tmp_path / name, beta_deg=0.0, exaggerate=exaggerate)
    assert not list(tmp_path.iterdir())


def test_a_film_needs_the_motion_in_time(slump: Response, tmp_path: Path) -> None:
    motion = GroundMotion(np.zeros(3), 0.1)
    still = respond(motion, block=BLOCK, beta_deg=0.0, phi_deg=35.0)
    with pytest.raises(InputError, match="history"):
        film(still, BLOCK, tmp_path / "film.gif", beta_deg=0.0)
