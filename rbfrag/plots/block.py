"""Figures of a block on its planes, of a free-standing block, and of planes on a stereonet."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written, write_near
from rbfrag.solver.block.geometry import Block, Point
from rbfrag.solver.block.mesh_block import ContactHull, MeshBlock, Weakest
from rbfrag.solver.block.planes import FLAT_DEG, STRIKE_DEG, TILT_DEG, Plane, line_of, section_of
from rbfrag.solver.stability.single import Stability

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.projections.polar import PolarAxes


_BAND, _REACH, _ARROW = 0.09, 0.30, 0.45
"""Thickness of the rock, reach of the planes and length of the arrow, over the block's size."""

_CLOSE = 0.05
"""Distance of contacts whose numbers would cover each other, over the size of the drawing."""


@dataclass(frozen=True)
class BlockLines:
    """Lines of a block to scale on its base and back planes; out of the slope is to the right.

    All points are (out of the slope, up) from the centroid [m].

    Args:
        outline: vertices of the block.
        contacts: the contacts by number: 1 heel, 2 back (where there is a back plane), 3 toe.
        planes: the line of the base plane, from the slope upwards, and of the back plane.
        rock: outline of a band of rock below and behind the planes.
        resultant: tip of an arrow from the centroid: the resultant of weight and inertia at the
            yield acceleration, or the weight of a block that no acceleration moves or that
            none holds.
    """

    outline: tuple[Point, ...]
    contacts: dict[str, Point]
    planes: tuple[Point, ...]
    rock: tuple[Point, ...]
    resultant: Point


def block_lines(block: Block, stability: Stability) -> BlockLines:
    """Return the lines of the drawing of a block."""
    beta = math.radians(stability.beta_deg)
    cosine, sine = math.cos(beta), math.sin(beta)

    def in_the_slope(points: Iterable[Point]) -> tuple[Point, ...]:
        return tuple((x * cosine + y * sine, -x * sine + y * cosine) for x, y in points)

    size = max(math.dist(a, b) for a in block.outline for b in block.outline)
    planes, rock = _planes(block, stability.back_fracture, _BAND * size, _REACH * size)
    contacts = {"1": block.heel, "2": block.back, "3": block.toe}
    if not stability.back_fracture:
        del contacts["2"]
    k = stability.yield_acceleration
    right, down = (k, 1.0 + stability.kv) if math.isfinite(k) else (0.0, 1.0)
    scale = _ARROW * size / math.hypot(right, down)
    return BlockLines(
        outline=in_the_slope(block.outline),
        contacts=dict(zip(contacts, in_the_slope(contacts.values()), strict=True)),
        planes=in_the_slope(planes),
        rock=in_the_slope(rock),
        resultant=(right * scale, -down * scale),
    )


def _planes(
    block: Block, back_fracture: bool, band: float, reach: float
) -> tuple[list[Point], list[Point]]:
    """Return the planes and the rock along them, in the base frame."""
    end = (block.toe[0] + reach, block.toe[1])
    below = (end[0], end[1] - band)
    if not back_fracture:
        start = (block.heel[0] - reach, block.heel[1])
        return [end, start], [end, start, (start[0], start[1] - band), below]
    gamma = math.radians(block.gamma_deg)
    up = (-math.cos(gamma), math.sin(gamma))
    base_y = block.heel[1]
    # Where the planes meet; of a block without its heel's corner that is not the heel.
    corner = (block.back[0] + block.cot_gamma * (block.back[1] - base_y), base_y)
    along = math.dist(corner, block.back) + 0.6 * reach
    top = (corner[0] + up[0] * along, corner[1] + up[1] * along)
    beyond = (top[0] - up[1] * band, top[1] + up[0] * band)
    shift = band * min(math.tan(0.5 * gamma), 4.0)
    line = [end, corner, top]
    return line, [*line, beyond, (corner[0] - shift, corner[1] - band), below]


_INK, _RESULTANT = "#222222", "#b2182b"


@canvas.in_own_style
def plot_block(block: Block, stability: Stability, path: canvas.Out) -> canvas.Picture:
    """Draw a block to scale on its base and back planes, out of the slope to the right.

    The contacts are 1 heel, 2 back and 3 toe, C is the centroid. The arrow is the direction of
    the resultant of weight and inertia at the yield acceleration; a block that no acceleration
    moves, or that none holds, has the direction of its weight.
    """
    canvas.plot_path(path)
    figure = canvas.new_figure(7.4, 4.8)
    axes, panel = figure.subplots(1, 2, width_ratios=[2.6, 1.0])
    draw_block(axes, block, stability)
    _write_panel(panel, block, stability)
    k = stability.yield_acceleration
    title = f" from k = {k:.3f} g"
    if stability.state == "locked":
        title = ": locked, no horizontal acceleration moves the block in this mode"
    elif stability.state == "unstable":
        title = f": fails at rest{f' (k = {k:.3f} g)' if math.isfinite(k) else ''}"
    figure.suptitle(canvas.mode_title(stability.mode) + title, fontsize=11)
    return canvas.save_figure(figure, path)


def draw_block(axes: Axes, block: Block, stability: Stability) -> None:
    """Draw the block of :func:`plot_block` into axes."""
    lines = block_lines(block, stability)
    axes.fill(*zip(*lines.rock, strict=True), facecolor="#e9e5de", edgecolor=canvas.ROCK,
              hatch="////", lw=0.0)  # fmt: skip
    axes.plot(*zip(*lines.planes, strict=True), color=canvas.ROCK, lw=1.4, zorder=1)
    outline, colour = lines.outline, canvas.MODE_COLOURS[stability.mode]
    axes.fill(*zip(*outline, strict=True), color=colour, alpha=0.28, lw=0, zorder=2)
    axes.plot(*zip(*[*outline, outline[0]], strict=True), color=colour, lw=1.6, zorder=3)
    near = _CLOSE * max(math.dist(a, b) for a in lines.rock for b in lines.rock)
    for name, (x, y) in lines.contacts.items():
        axes.plot([0.0, x], [0.0, y], color=_INK, lw=0.6, ls=":", zorder=4)
        axes.plot(x, y, "o", ms=5, mfc="white", mec=_INK, zorder=6)
        outwards = 13.0 / math.hypot(x, y)
        # contacts of a slab may be closer to each other than their numbers are wide
        close = any(0.0 < math.dist(at, (x, y)) < near for at in lines.contacts.values())
        write_near(axes, name, (x, y), (outwards * x, outwards * y), ha="center", va="center",
                   fontsize=9, movable=close)  # fmt: skip
    tip = lines.resultant
    axes.plot([0.0, 1.5 * tip[0]], [0.0, 1.5 * tip[1]], color=_RESULTANT, lw=0.7, ls="--", zorder=4)
    arrow = {"arrowstyle": "-|>", "color": _RESULTANT, "lw": 1.8, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=tip, xytext=(0.0, 0.0), arrowprops=arrow, zorder=5)
    axes.plot(0.0, 0.0, "o", ms=5, color=_INK, zorder=6)
    write_near(axes, "C", (0.0, 0.0), (-5, 5), fontsize=10)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.04)
    axes.ticklabel_format(scilimits=(-2, 5), useMathText=True)
    axes.set_xlabel("horizontal distance from the centroid, out of the slope [m]")
    axes.set_ylabel("height above the centroid [m]")
    canvas.light_grid(axes)


def _write_panel(panel: Axes, block: Block, stability: Stability) -> None:
    panel.set_axis_off()
    friction = f"{stability.phi_deg:.4g}°"
    if stability.back_fracture and stability.phi_back_deg != stability.phi_deg:
        friction += f", back {stability.phi_back_deg:.4g}°"
    k = stability.yield_acceleration
    rows = [
        ("mode", canvas.mode_title(stability.mode)),
        ("state", stability.state),
        ("yield $k$", f"{k:.4f} g" if math.isfinite(k) else "none"),
        ("sliding $k_y$", f"{stability.ky:.4f} g" if math.isfinite(stability.ky) else "none"),
        ("", ""),
        (r"$\alpha_1$", f"{block.alpha1_deg:.2f}°"),
        (r"$\alpha_3$", f"{block.alpha3_deg:.2f}°"),
        (r"$\gamma$", f"{block.gamma_deg:.2f}°" if stability.back_fracture else "no back plane"),
        (r"dip $\beta$", f"{stability.beta_deg:.2f}°"),
        (r"friction $\phi$", friction),
        ("", ""),
        ("$S_1$", f"{block.s1_m:.3g} m"),
        ("$S_2$", f"{block.s2_m:.3g} m"),
        ("base 1–3", f"{block.base_m:.3g} m"),
        ("$r_3$", f"{block.r3_m:.3g} m"),
        ("area", f"{block.area_m2:.3g} m²"),
        ("$p^2$", f"{block.p2:.3g} s$^{{-2}}$"),
    ]
    if stability.kv:
        rows.insert(4, ("vertical $k_v$", f"{stability.kv:.3g} g"))
    for i, (name, value) in enumerate(rows):
        height = 0.97 - i * 0.92 / len(rows)
        panel.text(0.0, height, name, transform=panel.transAxes, fontsize=9, va="top")
        panel.text(0.47, height, value, transform=panel.transAxes, fontsize=9, va="top")
    panel.plot([0.0, 0.14], [0.01, 0.01], color=_RESULTANT, lw=1.8, transform=panel.transAxes)
    text = "resultant at yield" if math.isfinite(k) else "weight"
    panel.text(0.19, 0.01, text, transform=panel.transAxes, fontsize=9, va="center")


_AZIMUTHS_DEG = np.arange(361.0)
_LINES = ("-", "--", "-.", ":")
"""For contacts within the heights that an answer is repeated with, in rising order."""


@canvas.in_own_style
def plot_mesh_block(block: MeshBlock, path: canvas.Out) -> canvas.Picture:
    """Draw the contacts of a block in plan, and k_r towards every azimuth.

    At the left the contact points, their hull and the whole block from above, C being the centre
    of mass. At the right k_r towards each azimuth, for the heights of contact of the sensitivity;
    the arrow at the left and the point at the right are the weakest azimuth.
    """
    canvas.plot_path(path)
    figure = canvas.new_figure(10.0, 5.4)
    plan = figure.add_subplot(1, 2, 1)
    polar = cast("PolarAxes", figure.add_subplot(1, 2, 2, projection="polar"))
    weakest = block.hull.weakest()
    _draw_plan(plan, block, weakest)
    _draw_polar(polar, block, weakest)
    figure.suptitle(
        f"{as_written(block.name, 60)}: "
        f"least $k_r$ = {weakest.kr:.4g} towards {weakest.azimuth_deg:.0f}°, "
        f"$p^2$ = {weakest.p2:.3g} s$^{{-2}}$, contacts within {block.hull.contact_mm:g} mm",
        fontsize=11,
    )
    canvas.legend_below(figure, 4)
    return canvas.save_figure(figure, path)


def _draw_plan(axes: Axes, block: MeshBlock, weakest: Weakest) -> None:
    hull = block.hull
    axes.fill(*block.outline_m.T, color=canvas.ROCK, alpha=0.15, lw=0, label="block from above")
    axes.fill(
        *hull.corners_m.T, facecolor="none", edgecolor=canvas.BLUE, lw=1.4, label="hull of contacts"
    )
    axes.plot(
        *hull.points_m.T, "o", ms=3.5, mfc="white", mec=canvas.BLUE, mew=0.8, label="contacts"
    )
    turn = math.radians(weakest.azimuth_deg)
    x = weakest.kr * hull.height_m
    tip = (x * math.cos(turn), x * math.sin(turn))
    arrow = {"arrowstyle": "-|>", "color": canvas.RED, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=tip, xytext=(0.0, 0.0), arrowprops=arrow, zorder=4)
    axes.plot(0.0, 0.0, "o", ms=5, color="black", zorder=5)
    write_near(axes, "C", (0.0, 0.0), (-9.0 * math.cos(turn), -9.0 * math.sin(turn)),
               fontsize=10)  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    first, second = ("xyz"[i] for i in (("xyz".index(block.up) + k) % 3 for k in (1, 2)))
    axes.set_xlabel(f"{first} of the mesh from the centre of mass [m]")
    axes.set_ylabel(f"{second} of the mesh from the centre of mass [m]")
    canvas.light_grid(axes)


def _draw_polar(axes: PolarAxes, block: MeshBlock, weakest: Weakest) -> None:
    from matplotlib.ticker import MaxNLocator

    turn = np.radians(_AZIMUTHS_DEG)
    lines = iter(_LINES)
    for hull in block.hulls:
        style: dict[str, Any] = {"color": canvas.BLUE, "lw": 2.6, "alpha": 0.6}
        if hull is not block.hull:
            style = {"color": "#333333", "lw": 0.9, "ls": next(lines)}
        if hull.stands:
            axes.plot(turn, _kr(hull), label=f"contacts within {hull.contact_mm:g} mm", **style)
    axes.plot(math.radians(weakest.azimuth_deg), weakest.kr, "o", ms=6, color=canvas.RED,
              label="weakest azimuth")  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.set_title("$k_r$ [g] towards each azimuth [deg]", fontsize=10)
    axes.tick_params(labelsize=8)
    # where the numbers have most space before they meet a curve
    axes.set_rlabel_position(float(_AZIMUTHS_DEG[_kr(block.hull).argmax()]))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    canvas.light_grid(axes)


def _kr(hull: ContactHull) -> NDArray[np.float64]:
    return hull.rocking(_AZIMUTHS_DEG).kr_forward


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
