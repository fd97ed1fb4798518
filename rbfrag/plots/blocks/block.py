"""Figure of one block on its planes with the resultant at yield, and the lines of the drawing."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbfrag.plots import canvas
from rbfrag.plots.labels import write_near
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.block.polygon import Point
from rbfrag.solver.stability.single import Stability

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    return BlockLines(
        outline=in_the_slope(block.outline),
        contacts=dict(zip(contacts, in_the_slope(contacts.values()), strict=True)),
        planes=in_the_slope(planes),
        rock=in_the_slope(rock),
        resultant=_resultant(stability, _ARROW * size),
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


def _resultant(stability: Stability, length: float) -> Point:
    k = stability.yield_acceleration
    right, down = (k, 1.0 + stability.kv) if math.isfinite(k) else (0.0, 1.0)
    scale = length / math.hypot(right, down)
    return right * scale, -down * scale


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
    figure.suptitle(_title(stability), fontsize=11)
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


def _title(stability: Stability) -> str:
    k = stability.yield_acceleration
    name = canvas.mode_title(stability.mode)
    if stability.state == "locked":
        return f"{name}: locked, no horizontal acceleration moves the block in this mode"
    if stability.state == "unstable":
        held = f" (k = {k:.3f} g)" if math.isfinite(k) else ""
        return f"{name}: fails at rest{held}"
    return f"{name} from k = {k:.3f} g"


def _write_panel(panel: Axes, block: Block, stability: Stability) -> None:
    panel.set_axis_off()
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
        (r"friction $\phi$", _friction(stability)),
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


def _friction(stability: Stability) -> str:
    text = f"{stability.phi_deg:.4g}°"
    if stability.back_fracture and stability.phi_back_deg != stability.phi_deg:
        text += f", back {stability.phi_back_deg:.4g}°"
    return text
