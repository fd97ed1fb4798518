"""Figures of one response over time, and its animation."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from bisect import bisect_right
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.files import output_path, written_whole
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written, write_near
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.results import FloatArray, Outcome, Response, ResponseHistory

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOTION = "#7f7f7f"
STRENGTH = "#c44e52"
BLOCK = canvas.BLUE

QUIET_BEFORE_S = 1.0
QUIET_AFTER_S = 2.0

TALLEST_SHOWN = 6.0
"""Rotation over the critical angle beyond which a toppling block is of no interest."""


@canvas.in_own_style
def plot_response(
    response: Response,
    path: canvas.Out,
    *,
    p2: float,
    kr: float,
    reverse: bool = False,
    title: str = "",
) -> canvas.Picture:
    """Draw one toppling response in the form of Gibson's dissertation and write it to `path`.

    The upper panel shows the driving acceleration k_h/(1 + k_v) against the strength left
    at the present rotation, k_r(theta) = tan(theta_c - theta): the block accelerates
    forward where the first is above the second. The lower panel shows theta/theta_c, where
    1 is the point of balance.

    Args:
        p2: the block's p² [1/s²], for the title.
        kr: the block's k_r, for the title.
    """
    history = response.history
    if history is None:
        raise InputError("this response has no history: use history=True")
    assert response.critical_angle_deg is not None
    theta_c = math.radians(response.critical_angle_deg)
    ratio = history.theta_rad / theta_c
    remaining = theta_c - history.theta_rad
    # tan runs away beyond 90 degrees past balance, where strength means nothing any more
    strength = np.tan(np.clip(remaining, -1.4, 1.4))
    label = r"$k_r(\theta)=\tan(\theta_c-\theta)$"
    figure, upper, lower = _panels(history, strength, f"block: {label}", kr)
    lower.plot(history.time_s, ratio, color=BLOCK, lw=1.3)
    lower.set_ylabel(r"rotation $\theta/\theta_c$")
    seen = ratio if response.toppled_s is None else ratio[history.time_s <= response.toppled_s]
    tallest = min(max(1.0, float(seen.max(initial=0.0))), TALLEST_SHOWN)
    lower.set_ylim(-0.05 * tallest, 1.15 * tallest)
    _mark_balance(lower, 1.0, "balance")
    _mark_toppled((upper, lower), response.toppled_s, "toppling inevitable", 0.97)
    lower.set_xlim(*_window(history.time_s, ratio, response))
    verdict = f"block $p^2$ = {p2:g} s$^{{-2}}$, $k_r$ = {kr:g}: "
    if response.outcome is Outcome.TOPPLED:
        verdict += "topples"
    elif response.peak_theta_n is None:
        verdict += response.outcome.value
    elif response.started_s is None:
        verdict += "never lifts off its base"
    else:
        verdict += f"stays, peak rotation {response.peak_theta_n:.3g} of the critical angle"
    _write_title(figure, title, reverse, verdict)
    return canvas.save_figure(figure, path)


def _mark_balance(axes: Axes, ratio: float, name: str) -> None:
    """Draw the line of a rotation ratio with its name on it."""
    axes.axhline(ratio, color=STRENGTH, lw=0.8, ls="--")
    at = (0.005, ratio)
    write_near(axes, name, at, (1, 3), ha="left", xycoords=("axes fraction", "data"), fontsize=8,
               color=STRENGTH, movable=False)  # fmt: skip


def _mark_toppled(
    panels: tuple[Axes, Axes], time_s: float | None, label: str, height: float
) -> None:
    """Draw the time of toppling, named in the lower panel: above a height, below one at the top."""
    if time_s is None:
        return
    for axes in panels:
        axes.axvline(time_s, color="black", lw=0.8, ls=":")
    write_near(
        panels[1], f"{label} at {time_s:.2f} s", (time_s, height), (-3, 3 if height < 0.5 else -3),
        xycoords=("data", "axes fraction"), rotation=90, fontsize=8,
    )  # fmt: skip


def _panels(
    history: ResponseHistory, strength: FloatArray, label: str, least_top: float
) -> tuple[Figure, Axes, Axes]:
    """Draw acceleration against strength; return the figure, its upper and its empty lower axes."""
    figure = canvas.new_figure(width_in=7.5, height_in=5.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.25, 1.0])
    driving = history.k_h / (1.0 + history.k_v)
    upper.plot(history.time_s, driving, color=MOTION, lw=0.7, label="ground: $k_h/(1+k_v)$")
    upper.plot(history.time_s, strength, color=STRENGTH, lw=1.3, label=label)
    top = 1.15 * max(float(np.abs(driving).max()), least_top) or 1.0
    upper.set_ylim(-top, 1.25 * top)
    upper.axhline(0.0, color="black", lw=0.5)
    upper.set_ylabel("acceleration [g]")
    upper.legend(loc="upper right", fontsize=8, ncols=2, framealpha=0.9)
    lower.set_xlabel("time [s]")
    canvas.light_grid(upper, lower)
    return figure, upper, lower


def _write_title(figure: Figure, name: str, reverse: bool, verdict: str) -> None:
    name = as_written(name + (", reversed" if reverse else ""), 85)
    figure.suptitle(f"{name}\n{verdict}", fontsize=10)


def _window(time_s: FloatArray, ratio: FloatArray, response: Response) -> tuple[float, float]:
    """Return the time range of the motion of the block, with a short rest on both sides."""
    if response.started_s is None:
        return float(time_s[0]), float(max(time_s[-1], time_s[0] + 1e-3))
    first = response.started_s - QUIET_BEFORE_S
    moving = time_s[ratio > 0.0]
    last = float(moving[-1]) if moving.size else response.started_s
    beyond = time_s[ratio > TALLEST_SHOWN]
    if response.toppled_s is not None and beyond.size:
        last = max(float(beyond[0]), response.toppled_s)
    return float(first), last + QUIET_AFTER_S


ROTATION = "#b7791f"


@canvas.in_own_style
def plot_motion(
    response: Response, path: canvas.Out, *, title: str = "", reverse: bool = False
) -> canvas.Picture:
    """Draw the response of a sliding, slumping or confined block and write it to `path`.

    The upper panel shows the driving acceleration k_h/(1 + k_v) against the strength where
    the block is: it gains speed down the slope where the first is above the second. The lower
    panel shows the displacement along the base, and the rotation of a block that rotates.
    """
    history = response.history
    if history is None or history.displacement_m is None or history.strength_g is None:
        raise InputError("this response holds no displacements in time: use history=True")
    has_strength = np.isfinite(history.strength_g)
    label = f"strength of the block{'' if has_strength.all() else ', while its contacts hold'}"
    first_strength = float([*history.strength_g[has_strength], 0.0][0])
    figure, upper, lower = _panels(history, history.strength_g, label, first_strength)
    largest = float(np.abs(history.displacement_m).max())
    factor, unit = (100.0, "cm") if largest < 1.0 else (1.0, "m")
    factor, unit = (1000.0, "mm") if largest < 0.01 else (factor, unit)
    lower.plot(history.time_s, factor * history.displacement_m, color=BLOCK, lw=1.4)
    lower.set_ylabel(f"displacement [{unit}]", color=BLOCK)
    least = float(history.displacement_m.min())
    lower.set_ylim(*_around(factor * float(history.displacement_m.max()), factor * least))
    if response.peak_theta_rad is not None or np.any(history.theta_rad):
        right = lower.twinx()
        right.plot(history.time_s, np.degrees(history.theta_rad), color=ROTATION, lw=1.1, ls="--")
        right.set_ylabel("rotation [deg]", color=ROTATION)
        right.set_ylim(*_around(float(np.degrees(history.theta_rad).max()), 0.0))
    for part in response.parts[1:]:
        for axes in (upper, lower):
            axes.axvline(part.begins_s, color="black", lw=0.9, ls=":")
    if response.started_s is None:
        verdict = "the block never moves"
    elif response.outcome is Outcome.TOPPLED:
        verdict = f"the block fails at {response.toppled_s:.2f} s"
    elif response.displacement_m is None:
        verdict = response.outcome.value
    else:
        verdict = f"displacement {response.displacement_m:.3g} m"
        if response.final_theta_rad is not None:
            verdict += f", rotation {np.degrees(response.final_theta_rad):.3g} deg"
        if response.outcome is not Outcome.STABLE:
            verdict += f" when the model ended ({response.outcome.value})"
    first, last = float(history.time_s[0]), float(history.time_s[-1])
    if response.started_s is None or response.stopped_s is None:
        lower.set_xlim(first, max(last, first + 1e-3))
    else:
        end_s = min(response.stopped_s + QUIET_AFTER_S, last)
        lower.set_xlim(response.started_s - QUIET_BEFORE_S, end_s)
    _write_title(figure, title, reverse, f"{canvas.mode_title(response.kind)}: {verdict}")
    return canvas.save_figure(figure, path)


def _around(largest: float, least: float) -> tuple[float, float]:
    """Return axis limits with a margin that put zero at the same height on both axes."""
    span = largest if largest > 0.0 else 1.0
    return min(-0.06 * span, 1.1 * least), 1.12 * span


@canvas.in_own_style
def plot_rocking(
    response: Response, path: canvas.Out, *, title: str = "", reverse: bool = False
) -> canvas.Picture:
    """Draw the response of a free-standing block and write it to `path`.

    The upper panel shows the driving acceleration k_h/(1 + k_v) against the strength left about
    either corner: the block speeds up forward where it is above the upper line, backward where it
    is below the lower one. The lower panel shows the rotation over the critical angle of its
    sense, forward positive, and the impacts.
    """
    history = response.history
    if history is None or history.impact_s is None:
        raise InputError("this response holds no impacts in time: use history=True")
    assert response.critical_angle_deg is not None
    assert response.critical_backward_deg is not None
    toe, heel = map(math.radians, (response.critical_angle_deg, response.critical_backward_deg))
    theta = history.theta_rad
    # tan runs away beyond 90 degrees past balance, where strength means nothing any more
    forward = np.tan(np.clip(toe - np.maximum(theta, 0.0), -1.4, 1.4))
    backward = -np.tan(np.clip(heel - np.maximum(-theta, 0.0), -1.4, 1.4))
    label = "strength about toe and heel"
    figure, upper, lower = _panels(history, forward, label, max(math.tan(toe), math.tan(heel)))
    upper.plot(history.time_s, backward, color=STRENGTH, lw=1.3)
    ratio = np.where(theta >= 0.0, theta / toe, theta / heel)
    lower.plot(history.time_s, ratio, color=BLOCK, lw=1.2)
    lower.plot(
        history.impact_s, np.zeros(history.impact_s.size), "|", color="black", ms=6, mew=0.7,
        label="impacts",
    )  # fmt: skip
    lower.legend(loc="upper right", fontsize=8, framealpha=0.9)
    for balance, name in ((1.0, "balance on the toe"), (-1.0, "balance on the heel")):
        _mark_balance(lower, balance, name)
    lower.set_ylabel(r"rotation $\theta/\theta_c$, forward up")
    lower.set_ylim(-1.4, 1.6)
    sensitive = " (sensitive)" if response.sensitive else ""
    _mark_toppled((upper, lower), response.toppled_s, "overturning certain", 0.03)
    lower.set_xlim(*_window(history.time_s, np.abs(ratio), response))
    if response.started_s is None:
        verdict = "the block never lifts off its base"
    elif response.outcome is Outcome.TOPPLED:
        over = "forward over its toe" if response.peak_forward_rad is None else "over its heel"
        verdict = f"overturns {over}{sensitive}"
    elif response.peak_theta_n is None:
        verdict = response.outcome.value
    else:
        peak = f"{response.peak_theta_n:.3g} of the critical angle"
        verdict = f"stays, peak rotation {peak}{sensitive}"
    _write_title(figure, title, reverse, f"{canvas.mode_title(response.kind)}: {verdict}")
    return canvas.save_figure(figure, path)


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
    from matplotlib.animation import FFMpegWriter, FuncAnimation, HTMLWriter, PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    time_s, speed = _frame_times(response, history)
    shown = _to_slope(_outlines(block, history, time_s, exaggerate), beta_deg)
    scene, trace = figure.subplots(2, 1, height_ratios=[2.6, 1.0])
    _draw_scene(scene, block, shown, beta_deg, back_fracture)
    (patch,) = scene.fill(*shown[0].T, color=BLOCK, alpha=0.35, lw=0, zorder=3)
    (edge,) = scene.plot(*_closed(shown[0]).T, color=BLOCK, lw=1.6, zorder=4)
    clock = scene.set_title("", fontsize=9)
    driving = history.k_h / (1.0 + history.k_v)
    trace.plot(history.time_s, driving, color=MOTION, lw=0.7, label="ground: $k_h/(1+k_v)$")
    if history.strength_g is not None:
        trace.plot(history.time_s, history.strength_g, color=STRENGTH, lw=1.1, label="strength")
    trace.legend(loc="upper right", fontsize=7, ncols=2)
    trace.set_xlim(time_s[0], time_s[-1])
    top = 1.1 * float(np.abs(driving).max()) or 1.0  # a motion of zeros has a sheet, too
    trace.set_ylim(-top, 1.35 * top)
    trace.set(xlabel="time [s]", ylabel="[g]")
    canvas.light_grid(trace)
    cursor = trace.axvline(time_s[0], color="black", lw=1.0)
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
        number = bisect_right(begins_s[1:], time_s[frame]) + 1
        which = f", motion {number} of {len(begins_s)}" if len(begins_s) > 1 else ""
        clock.set_text(f"{time_s[frame]:.2f} s{which}")
        cursor.set_xdata([time_s[frame], time_s[frame]])
        return patch, edge, clock, cursor

    # the parts find their places once, and stay there
    show(0)
    figure.canvas.draw()
    figure.set_layout_engine("none")
    moving = FuncAnimation(figure, show, frames=time_s.size, interval=1000 // FRAMES_PER_S)
    writers: dict[str, Callable[[], AbstractMovieWriter]] = {
        ".gif": lambda: PillowWriter(fps=FRAMES_PER_S),
        ".mp4": lambda: FFMpegWriter(fps=FRAMES_PER_S, codec="h264", bitrate=BITRATE_KBIT_S),
        ".html": lambda: HTMLWriter(fps=FRAMES_PER_S, embed_frames=True, default_mode="loop"),
    }
    try:
        with written_whole(target, "film") as partial:
            moving.save(str(partial), writer=writers[target.suffix.lower()](), dpi=80)
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
