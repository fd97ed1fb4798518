"""Stereonet of a block's planes: lower hemisphere, equal area (Schmidt)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.plots import canvas
from rbfrag.solver.block.planes import FLAT_DEG, STRIKE_DEG, TILT_DEG, Plane, line_of, section_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = {"face": "#444444", "base": canvas.BLUE, "back": canvas.RED}
_SHADE = "#8a8a8a"


def projected(
    plunge_deg: np.ndarray | float, trend_deg: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions of lines on the net, east and north of its centre, of radius 1.

    Args:
        plunge_deg: plunges, 0 to 90 [deg].
        trend_deg: azimuths of the lines downwards [deg].
    """
    radius = math.sqrt(2.0) * np.sin(np.radians(90.0 - np.asarray(plunge_deg)) / 2.0)
    trend = np.radians(trend_deg)
    return radius * np.sin(trend), radius * np.cos(trend)


def great_circle(plane: Plane) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of a plane on the net, from one end of its strike to the other."""
    off = np.linspace(-90.0, 90.0, 181)
    if plane.dip_deg == 90.0:
        lines = 90.0 - np.abs(off), np.where(off < 0.0, -90.0, 90.0)
    else:
        across = math.tan(math.radians(plane.dip_deg)) * np.cos(np.radians(off))
        lines = np.degrees(np.arctan(across)), off
    return projected(lines[0], lines[1] + plane.direction_deg)


@canvas.in_own_style
def plot_planes(planes: Mapping[str, Plane], path: canvas.Out) -> canvas.Picture:
    """Draw planes and their poles, the line of base and back, and excluded directions.

    Args:
        planes: face, base and, if there is one, back.
    """
    canvas.plot_path(path)
    figure = canvas.new_figure(6.2, 6.8)
    axes = figure.add_subplot()
    _draw_net(axes, planes["face"])
    for name, plane in planes.items():
        axes.plot(*great_circle(plane), color=_COLOURS[name], lw=1.8, label=f"{name} {plane}")
        pole = projected(90.0 - plane.dip_deg, plane.direction_deg + 180.0)
        axes.plot(*pole, "o", ms=7, color=_COLOURS[name], mec="white", label=f"_{name}", zorder=5)
    base, back = planes["base"], planes.get("back")
    if back is not None and base.pole != back.pole:
        plunge, trend = line_of(base, back)
        axes.plot(
            *projected(max(plunge, 0.0), trend), "k^", ms=8, mec="white", zorder=6,
            label=f"line of base and back {plunge:.0f} → {trend:03.0f}",
        )  # fmt: skip
    try:
        section = section_of(planes["face"], base, back)
    except InputError as error:
        title = "No section: rejected"
        notes: tuple[str, ...] = (str(error),)
    else:
        gamma = "" if section.gamma_deg is None else f", gamma = {section.gamma_deg:.1f}°"
        title, notes = f"In the section beta = {section.beta_deg:.1f}°{gamma}", section.remarks
    axes.set_title(f"{title}\nlower hemisphere, equal area; dots are poles", fontsize=10, pad=18)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return replace(canvas.save_figure(figure, path), warnings=notes)


def _draw_net(axes: Axes, face: Plane) -> None:
    """Draw the rim, and shade the poles of planes whose strike is rejected."""
    from matplotlib.patches import Wedge

    east = 90.0 - face.direction_deg
    shaded: dict[str, Any] = {"color": _SHADE, "alpha": 0.2, "lw": 0.0, "zorder": 0.5}
    label = f"poles rejected: strike over {STRIKE_DEG:g}° off"
    half = 90.0 - STRIKE_DEG
    for middle in (east + 90.0, east - 90.0):
        axes.add_patch(Wedge((0.0, 0.0), 1.0, middle - half, middle + half, label=label, **shaded))
        label = "_rejected"
    # poles of planes flat enough for any strike are exempt
    off = np.arange(0.5, 360.0)
    sine = np.abs(np.sin(np.radians(off)))
    dips = np.degrees(np.arctan(math.tan(math.radians(TILT_DEG)) / sine))
    flat = projected(90.0 - np.minimum(dips, FLAT_DEG), off + face.direction_deg)
    axes.fill(*flat, facecolor="white", lw=0.8, edgecolor=_SHADE, label="_flat", zorder=0.9)
    around = np.radians(np.arange(0.0, 361.0))
    axes.plot(np.sin(around), np.cos(around), color="black", lw=1.0, label="_rim")
    for azimuth in range(0, 360, 30):
        x, y = math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth))
        axes.text(1.07 * x, 1.07 * y, f"{azimuth:03d}", ha="center", va="center", fontsize=8)
    axes.set(xlim=(-1.15, 1.15), ylim=(-1.15, 1.15), aspect="equal")
    axes.set_axis_off()
