"""Animation of a block that moves on its planes under a record."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.files import output_path, written_whole
from rbfrag.plots import canvas
from rbfrag.plots.labels import as_written
from rbfrag.plots.response import BLOCK, MOTION, STRENGTH
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.results import FloatArray, Response, ResponseHistory

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter
    from matplotlib.axes import Axes

SUFFIXES = (".gif", ".mp4", ".html")

BITRATE_KBIT_S = 1500
"""Rate of an .mp4: lines and letters stay sharp."""

FRAMES_PER_S = 20

FRAMES_MAX = 100
"""Frames of a film for each motion; a longer one is shown faster."""

MARGIN_S = 0.5
"""Rest shown before the first motion and after the last [s]."""


@canvas.in_own_style
def film(
    response: Response,
    block: Block,
    path: str | os.PathLike[str],
    *,
    beta_deg: float,
    back_fracture: bool = True,
    exaggerate: float = 1.0,
    title: str = "",
) -> Path:
    """Write an animation of a block on its planes, in the frame of the moving ground.

    Args:
        path: .gif, .mp4 (by the program ffmpeg), or .html with buttons.
        beta_deg: dip of the base, out of the slope positive [deg].
        back_fracture: draw the back plane.
        exaggerate: factor on displacement and rotation; 1 is true scale.

    Raises:
        InputError: no history, a factor that is not positive, an unknown suffix, a folder that
            cannot be written, an .mp4 without ffmpeg.
    """
    target = film_path(path)
    if not (math.isfinite(exaggerate) and exaggerate > 0.0):
        raise InputError(f"exaggerate = {exaggerate:g}: give a factor above 0; 1 is true scale")
    history = response.history
    if history is None:
        raise InputError("this response has no history: use history=True")
    figure = canvas.new_figure(width_in=6.4, height_in=6.0)
    from matplotlib.animation import FuncAnimation
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    time_s, speed = _frame_times(response, history)
    shown = _to_slope(_outlines(block, history, time_s, exaggerate), beta_deg)
    scene, trace = figure.subplots(2, 1, height_ratios=[2.6, 1.0])
    _draw_scene(scene, block, shown, beta_deg, back_fracture)
    (patch,) = scene.fill(*shown[0].T, color=BLOCK, alpha=0.35, lw=0, zorder=3)
    (edge,) = scene.plot(*_closed(shown[0]).T, color=BLOCK, lw=1.6, zorder=4)
    clock = scene.set_title("", fontsize=9)
    cursor = _draw_trace(trace, history, time_s)
    begins_s = [part.begins_s for part in response.parts]
    for begin_s in begins_s[1:]:
        trace.axvline(begin_s, color=canvas.ROCK, lw=1.0, ls=":")
    scale = "true scale" if exaggerate == 1.0 else f"displacements times {exaggerate:g}"
    pace = "" if speed == 1.0 else f", {speed:.2g} times as fast as it was"
    verdict = f"{canvas.mode_title(response.kind)}, {scale}{pace}"
    figure.suptitle(f"{as_written(title, 75)}\n{verdict}", fontsize=10)

    def show(frame: int) -> tuple[Any, ...]:
        patch.set_xy(_closed(shown[frame]))
        edge.set_data(*_closed(shown[frame]).T)
        clock.set_text(f"{time_s[frame]:.2f} s{_which(begins_s, time_s[frame])}")
        cursor.set_xdata([time_s[frame], time_s[frame]])
        return patch, edge, clock, cursor

    # the parts find their places once, and stay there
    show(0)
    figure.canvas.draw()
    figure.set_layout_engine("none")
    moving = FuncAnimation(figure, show, frames=time_s.size, interval=1000 // FRAMES_PER_S)
    try:
        with written_whole(target, "film") as partial:
            moving.save(str(partial), writer=_writer(target.suffix.lower()), dpi=80)
    except subprocess.CalledProcessError as error:
        raise InputError(
            f"film {target}: ffmpeg failed (exit status {error.returncode}), perhaps because it "
            "was built without H.264; use .gif or .html, which do not require ffmpeg"
        ) from error
    return target


def film_path(path: str | os.PathLike[str]) -> Path:
    """Return the path after checking that an animation can be saved; call before long work."""
    target = output_path(path, SUFFIXES, "film")
    if target.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise InputError(
            f"film {target}: an .mp4 requires the program ffmpeg, which is not on the PATH: "
            "install it (apt install ffmpeg, brew install ffmpeg, conda install ffmpeg), or use "
            ".gif or .html, which do not require it"
        )
    return target


def _writer(suffix: str) -> AbstractMovieWriter:
    from matplotlib.animation import FFMpegWriter, HTMLWriter, PillowWriter

    if suffix == ".gif":
        return PillowWriter(fps=FRAMES_PER_S)
    if suffix == ".mp4":
        return FFMpegWriter(fps=FRAMES_PER_S, codec="h264", bitrate=BITRATE_KBIT_S)
    return HTMLWriter(fps=FRAMES_PER_S, embed_frames=True, default_mode="loop")


def _frame_times(response: Response, history: ResponseHistory) -> tuple[FloatArray, float]:
    """Return the times of the frames, and the playback speed relative to the earthquake."""
    first, last = float(history.time_s[0]), float(history.time_s[-1])
    if response.started_s is not None:
        moving = np.flatnonzero(np.diff(history.theta_rad) != 0.0)
        if history.displacement_m is not None:
            slipping = np.flatnonzero(np.diff(history.displacement_m) != 0.0)
            moving = np.union1d(moving, slipping)
        end = float(history.time_s[moving[-1] + 1]) if moving.size else response.started_s
        first = max(first, response.started_s - MARGIN_S)
        last = min(last, end + MARGIN_S)
    most = FRAMES_MAX * max(1, len(response.parts))
    n = max(2, min(most, math.ceil((last - first) * FRAMES_PER_S)))
    speed = max(1.0, (last - first) * FRAMES_PER_S / n)
    return np.linspace(first, last, n), 1.0 if speed < 1.02 else speed


def _which(begins_s: Sequence[float], time_s: float) -> str:
    """Return the number of the motion in a sequence, as text."""
    if len(begins_s) < 2:
        return ""
    return f", motion {bisect_right(begins_s[1:], time_s) + 1} of {len(begins_s)}"


def _outlines(
    block: Block, history: ResponseHistory, time_s: FloatArray, exaggerate: float
) -> FloatArray:
    """Return the corners in the base frame for each frame, shape (frames, corners, 2)."""
    start = np.array(block.centroid)
    if history.turned_rad is None or history.centroid_m is None:
        # toppling: the block turns about its toe
        turned = -history.theta_rad
        toe = np.array([block.base_m, 0.0])
        centroid = toe + _rotated((start - toe)[None, :], turned)[:, 0]
    else:
        turned, centroid = history.turned_rad, history.centroid_m
    angle = exaggerate * np.interp(time_s, history.time_s, turned)
    moved = [np.interp(time_s, history.time_s, column) for column in centroid.T]
    centroids = start + exaggerate * (np.stack(moved, axis=1) - start)
    arms = np.array(block.vertices_m) - start
    corners: FloatArray = centroids[:, None, :] + _rotated(arms, angle)
    return corners


def _rotated(arms: FloatArray, angle: FloatArray) -> FloatArray:
    """Return vectors rotated by each of several angles, shape (angles, arms, 2)."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = arms[:, 0], arms[:, 1]
    return np.stack([x * c - y * s, x * s + y * c], axis=2)


def _to_slope(points: FloatArray, beta_deg: float) -> FloatArray:
    """Return points rotated from the base frame by the dip: x horizontal out of the slope, y up."""
    c, s = math.cos(math.radians(beta_deg)), math.sin(math.radians(beta_deg))
    x, y = points[..., 0], points[..., 1]
    return np.stack([x * c + y * s, y * c - x * s], axis=-1)


def _closed(outline: FloatArray) -> FloatArray:
    return np.concatenate([outline, outline[:1]])


def _draw_scene(
    axes: Axes, block: Block, shown: FloatArray, beta_deg: float, back_fracture: bool
) -> None:
    """Draw the planes and the block at rest, with limits for all positions of the block."""
    low, high = shown.min(axis=(0, 1)), shown.max(axis=(0, 1))
    size = float((high - low).max())
    gamma = math.radians(block.gamma_deg)
    up = np.array([-math.cos(gamma), math.sin(gamma)])
    root = np.array([0.0, 0.0])
    base = _to_slope(np.array([root, [3.0 * size, 0.0]]), beta_deg)
    axes.plot(*base.T, color=canvas.ROCK, lw=2.0, zorder=2)
    back = np.array([root, 3.0 * size * up] if back_fracture else [[-3.0 * size, 0.0], root])
    axes.plot(*_to_slope(back, beta_deg).T, color=canvas.ROCK, lw=2.0, zorder=2)
    axes.plot(*_closed(shown[0]).T, color=canvas.ROCK, lw=1.0, ls="--", zorder=1)
    margin = 0.12 * size
    axes.set_xlim(low[0] - 2.0 * margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set(xlabel="out of the slope [m]", ylabel="up [m]")


def _draw_trace(axes: Axes, history: ResponseHistory, time_s: FloatArray) -> Any:
    """Draw the ground motion below the scene; return the line that marks the current time."""
    driving = history.k_h / (1.0 + history.k_v)
    axes.plot(history.time_s, driving, color=MOTION, lw=0.7, label="ground: $k_h/(1+k_v)$")
    if history.strength_g is not None:
        axes.plot(history.time_s, history.strength_g, color=STRENGTH, lw=1.1, label="strength")
    axes.legend(loc="upper right", fontsize=7, ncols=2)
    axes.set_xlim(time_s[0], time_s[-1])
    top = 1.1 * float(np.abs(driving).max()) or 1.0  # a motion of zeros has a sheet, too
    axes.set_ylim(-top, 1.35 * top)
    axes.set(xlabel="time [s]", ylabel="[g]")
    canvas.light_grid(axes)
    return axes.axvline(time_s[0], color="black", lw=1.0)
