"""Films of a block."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.plots.response import FRAMES_PER_S, film
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.respond import respond
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


def test_a_film_of_no_motion_is_one_of_rest(tmp_path: Path) -> None:
    still = GroundMotion(np.zeros(30), 0.1)
    rest = respond(still, block=BLOCK, beta_deg=0.0, phi_deg=35.0, history=True)
    path = film(rest, BLOCK, tmp_path / "rest.gif", beta_deg=0.0, title="none of $5 and $6")
    assert path.stat().st_size > 1000


def test_a_film_of_two_motions_shows_both(tmp_path: Path) -> None:
    motion = GroundMotion.from_nodes([0.0, 0.0, 0.2, 0.2, 4.0], [0.0, 0.9, 0.9, 0.0, 0.0])
    planes = {"block": BLOCK, "beta_deg": 0.0, "phi_deg": 35.0}
    both = respond([motion, motion], history=True, **planes)  # type: ignore[arg-type]
    path = film(both, BLOCK, tmp_path / "both.gif", beta_deg=0.0, exaggerate=3.0)
    with Image.open(path) as moving:
        # the rest between them, 4 s, is shown as long as it was
        last = moving.n_frames - 1
        assert last >= 4 * FRAMES_PER_S
        frames = []
        for n in (last // 2, last):
            moving.seek(n)
            frames.append(np.asarray(moving.convert("L"), dtype=float))
    scene = slice(frames[0].shape[0] // 6, frames[0].shape[0] // 2)
    assert (np.abs(frames[0][scene] - frames[1][scene]) > 20.0).mean() > 0.005


@pytest.mark.skipif(
    shutil.which("ffmpeg") is None or shutil.which("ffprobe") is None,
    reason="ffmpeg and ffprobe, which make and read an .mp4, are not installed",
)
def test_a_film_as_mp4(slump: Response, tmp_path: Path) -> None:
    path = film(slump, BLOCK, tmp_path / "slump.mp4", beta_deg=0.0, exaggerate=3.0, title="pulse")
    assert list(tmp_path.iterdir()) == [path]
    question = ("codec_name", "pix_fmt", "r_frame_rate", "nb_read_frames")
    output = subprocess.run(
        ["ffprobe", "-v", "error", "-count_frames", "-show_entries", f"stream={','.join(question)}",
         "-of", "default=noprint_wrappers=1", path],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    about = dict(line.split("=") for line in output.splitlines())
    # what browsers and slides play
    assert (about["codec_name"], about["pix_fmt"]) == ("h264", "yuv420p")
    assert about["r_frame_rate"] == f"{FRAMES_PER_S}/1"
    assert int(about["nb_read_frames"]) >= 5
    for at, name in (("0", "first.png"), ("0.35", "later.png")):
        subprocess.run(
            ["ffmpeg", "-v", "error", "-ss", at, "-i", path, "-frames:v", "1", tmp_path / name],
            check=True,
        )
    first, later = (
        np.asarray(Image.open(tmp_path / name).convert("L"), dtype=float)
        for name in ("first.png", "later.png")
    )
    scene = slice(0, first.shape[0] // 2)
    assert (np.abs(first[scene] - later[scene]) > 20.0).mean() > 0.005


def test_without_ffmpeg_a_film_as_mp4_is_rejected_with_the_remedy(
    slump: Response, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"install it \(apt install ffmpeg.* or use \.gif"):
        film(slump, BLOCK, tmp_path / "slump.mp4", beta_deg=0.0)
    assert not list(tmp_path.iterdir())


def test_an_ffmpeg_that_fails_is_told(
    slump: Response, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "bin" / "ffmpeg"
    broken.parent.mkdir()
    broken.write_text("#!/bin/sh\ncat > /dev/null\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", f"{broken.parent}{os.pathsep}{os.environ['PATH']}")
    with pytest.raises(InputError, match=r"ffmpeg failed \(exit status 3\)"):
        film(slump, BLOCK, tmp_path / "slump.mp4", beta_deg=0.0)
    assert list(tmp_path.iterdir()) == [broken.parent]


@pytest.mark.parametrize(
    ("name", "exaggerate", "word"),
    [
        ("film.avi", 1.0, "unsupported suffix '.avi'; use .gif, .mp4, .html"),
        ("nowhere/film.gif", 1.0, "create the folder"),
        ("film.gif", 0.0, "exaggerate = 0"),
    ],
)
def test_rejected(slump: Response, tmp_path: Path, name: str, exaggerate: float, word: str) -> None:
    with pytest.raises(InputError, match=word):
        film(slump, BLOCK, tmp_path / name, beta_deg=0.0, exaggerate=exaggerate)
    assert not list(tmp_path.iterdir())


def test_a_film_needs_the_motion_in_time(slump: Response, tmp_path: Path) -> None:
    motion = GroundMotion(np.zeros(3), 0.1)
    still = respond(motion, block=BLOCK, beta_deg=0.0, phi_deg=35.0)
    with pytest.raises(InputError, match="history"):
        film(still, BLOCK, tmp_path / "film.gif", beta_deg=0.0)
