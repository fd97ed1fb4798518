"""Figure of a free-standing block: its contacts in plan, and k_r over azimuth."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from rbfrag.plots import canvas
from rbfrag.plots.labels import as_written, write_near
from rbfrag.solver.block.mesh_block import ContactHull, MeshBlock, Weakest

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.projections.polar import PolarAxes

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
