"""Failure modes over the block angles, and the yield acceleration over a rotation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from textwrap import shorten
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.plots import canvas
from rbfrag.plots.canvas import halo, write_near
from rbfrag.rockmasses.joint_sets import VARIABLES, Realisations, RockMass
from rbfrag.rockmasses.shaking import FAILS, NO_MODE, ShakenMass
from rbfrag.solver.block.arrays import BlockArray
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.results import FloatArray
from rbfrag.solver.stability.arrays import NOTHING, StabilityArray, stability_arrays, water_held_m
from rbfrag.solver.stability.modes import LOCKED, MODES, STABLE, UNSTABLE, words_of_mode
from rbfrag.solver.stability.rotated_yield import BY_MODE
from rbfrag.solver.stability.single import Stability, stability
from rbfrag.vocabulary.quantities import QUANTITIES, word_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import ContourSet
    from matplotlib.patches import Patch
    from matplotlib.text import Text


MOST_POINTS = 300
"""More blocks than these are drawn as a histogram."""

CELL_DEG = 2.0
"""Cell of the histogram [deg]."""

_STEP_DEG = 0.5
_CELLS = np.arange(-88.5, 90.0, 3.0)
"""Angles of the cells that are followed in time [deg]."""

_OF_CELLS = ("s1_m", "phi_residual_deg")

_OPAQUE = {"fails": 0.85, "stays": 0.35}
_HATCHED = (
    (UNSTABLE, "////", "unstable at rest"),
    (LOCKED, "xxx", "locked: no acceleration\nmoves it in this mode"),
    (NOTHING, "...", "afloat: the water lifts\nit off its base"),
)
_LEVELS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0)
_NARROW_G = 0.4
_MOST_POSITIONS = 80
_LINE_DEG, _LETTER_DEG = 6.6, 3.1
_LEAST_AREA_DEG2 = 60.0
"""Of a line and a letter of a name on the chart, and of the least region with one."""
_VALUE_APART_PX = 2.0
# An image keeps vector files small.
_WHOLE_CHART: dict[str, Any] = {
    "extent": (-90.0, 90.0, -90.0, 90.0),
    "origin": "lower",
    "interpolation": "none",
    "aspect": "equal",
}
_FINE_LEVELS = tuple(0.05 * i for i in range(1, 60))


@canvas.in_own_style
def plot_modes(
    out: canvas.Out = None,
    *,
    phi_deg: float,
    beta_deg: float = 0.0,
    phi_back_deg: float | None = None,
    back_fracture: bool = True,
    alpha1_deg: ArrayLike | None = None,
    alpha3_deg: ArrayLike | None = None,
    title: str = "",
    ended: ShakenMass | None = None,
    **on_base: float,
) -> canvas.Picture:
    """Draw the governing mode of blocks against their angles, and the yield acceleration.

    Dry and without a bond the modes do not depend on the dip of the base if there is a back
    fracture; the yield accelerations, and what is unstable or locked, do.

    Args:
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.
        phi_deg: friction angle of the base [deg].
        beta_deg: dip of the base for the yield accelerations [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        back_fracture: False for blocks that no plane supports from behind.
        alpha1_deg: angles of the heel of blocks to be shown [deg], shape (m,).
        alpha3_deg: angles of the toe of these blocks [deg], shape (m,).
        title: title of the figure; friction and dip if empty.
        ended: what a motion did to the blocks of :func:`chart_cells`: colours are then the modes in
            which they end.
        on_base: ``water_m``, ``cohesion_pa``, ``jrc``, ``jcs_mpa``, ``joint_length_m`` with
            ``density_kg_m3`` as :func:`rbfrag.stability` takes them, and ``s1_m``, the spacing of
            the base fractures of all blocks [m]. Water fills a fracture that is lower.
    """
    canvas.plot_path(out)
    on_base = on_base if ended is None else {"s1_m": 1.0, **on_base}
    planes: Any = {"beta_deg": beta_deg, "phi_deg": phi_deg, "phi_back_deg": phi_back_deg,
                   "back_fracture": back_fracture}  # fmt: skip
    nodes = np.arange(-90.0 + 0.5 * _STEP_DEG, 90.0, _STEP_DEG)
    a1, a3 = np.meshgrid(nodes, nodes)
    is_block = a1 < a3
    # Other angles than a block's are not asked for; their place is taken by one that is.
    s1_m = on_base.get("s1_m", 1.0)
    blocks = _of_one_spacing(np.where(is_block, a1, -1.0), np.where(is_block, a3, 1.0), s1_m)
    strength: dict[str, Any] = {n: v for n, v in on_base.items() if n not in _OF_CELLS}
    ending = strength.keys() - {"density_kg_m3"}
    if ending and "s1_m" not in on_base:
        raise InputError(
            f"{min(ending)} requires s1_m, the spacing of the base fractures: its effect depends "
            "on the weight of the block", fields=("s1_m",),
        )  # fmt: skip
    if "water_m" in strength:
        strength["water_m"] = water_held_m(
            strength["water_m"], s1_m=s1_m, gamma_deg=blocks.gamma_deg, beta_deg=beta_deg
        )
    nan: Any = "propagate" if ending else "raise"  # a block may float
    stability = stability_arrays(blocks, nan=nan, **planes, **strength)
    angles = ((), ()) if alpha1_deg is None or alpha3_deg is None else (alpha1_deg, alpha3_deg)
    shown = [np.asarray(angle, dtype=np.float64) for angle in angles]
    if shown[0].shape != shown[1].shape or shown[0].ndim != 1:
        raise InputError(
            f"alpha1_deg {shown[0].shape} and alpha3_deg {shown[1].shape} must be two lists of "
            "equal length"
        )
    figure = canvas.new_figure(6.4 if len(shown[0]) > MOST_POINTS else 5.6, 5.5)
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    axes = figure.add_subplot()
    chart = _Chart(axes, nodes, is_block, stability)
    # unstable, locked and floating regions hatched, and the borders of the modes
    for code, hatch, _ in _HATCHED:
        mask = chart.in_state(code)
        if mask.any():
            axes.contourf(
                nodes, nodes, mask.astype(float), levels=[0.5, 1.5], colors="none",
                hatches=[hatch], zorder=2,
            ).set_edgecolor("#777777")  # fmt: skip
    for code in range(len(MODES)):
        mask = chart.of_mode(code)
        if mask.any():
            axes.contour(
                nodes, nodes, mask.astype(float), levels=[0.5], colors="black", linewidths=1.2,
                zorder=3,
            )  # fmt: skip
    if ended is None:
        there = is_block & (stability.mode_code != NOTHING)
        axes.imshow(
            np.ma.masked_where(~there, stability.mode_code),
            cmap=ListedColormap([canvas.MODE_COLOURS[mode] for mode in MODES]),
            norm=BoundaryNorm(np.arange(-0.5, len(MODES)), len(MODES)),
            alpha=0.30, zorder=1, **_WHOLE_CHART,
        )  # fmt: skip
    patches = [] if ended is None else _draw_ends(axes, ended)
    contours = _draw_yields(chart) if ended is None else []
    covered = _draw_blocks(axes, nodes, *shown)
    names = _name_regions(chart, back_fracture, covered)
    patches += [
        Patch(facecolor="white", edgecolor="#777777", hatch=hatch, label=text)
        for code, hatch, text in _HATCHED
        if chart.in_state(code).any()
    ]
    if patches:
        axes.legend(
            handles=patches, loc="lower right", fontsize=9, frameon=False, handlelength=2.2,
            handleheight=1.4,
        ).set_zorder(8)  # fmt: skip
    axes.fill([-90, 90, 90], [-90, -90, 90], color="white", zorder=4, lw=0)
    axes.plot([-90, 90], [-90, 90], color="black", lw=1.0, zorder=5)
    low = -38 if ended is None else -12
    axes.text(38, low, r"no block: $\alpha_1 \geq \alpha_3$", ha="center", fontsize=9, zorder=5)
    ticks = range(-90, 91, 30)
    axes.set(xlim=(-90, 90), ylim=(-90, 90), aspect="equal", xticks=ticks, yticks=ticks)
    axes.set_xlabel(r"angle of the heel, $\alpha_1$ [°]")
    axes.set_ylabel(r"angle of the toe, $\alpha_3$ [°]")
    if not title:
        title = _title(phi_deg, phi_back_deg, beta_deg, back_fracture, on_base, ended)
    figure.suptitle(title, fontsize=10)
    figure.draw_without_rendering()  # the extents of texts are known once the layout is
    for lines, region in contours:
        _write_values(chart, lines, region, names)
    return canvas.save_figure(figure, out)


def chart_cells(
    *, phi_deg: float, beta_deg: float = 0.0, phi_back_deg: float | None = None,
    back_fracture: bool = True, s1_m: float = 1.0, **strength: float,
) -> Realisations:  # fmt: skip
    """Return the blocks of the cells of a chart of ultimate modes, row by row of the angle α3.

    Args:
        s1_m: spacing of the base fractures of all blocks [m].
        strength: as ``on_base`` of :func:`plot_modes`, and ``phi_residual_deg``.
    """
    a1, a3 = np.meshgrid(_CELLS, _CELLS)
    cells = _of_one_spacing(a1[a1 < a3], a3[a1 < a3], s1_m)
    inputs = {"phi_deg": phi_deg, "phi_back_deg": phi_back_deg, **strength}
    parameters = {key: inputs.get(key.split(".")[1]) for key in VARIABLES}
    parameters |= {"base.dip_deg": beta_deg, "base.spacing_m": s1_m}
    parameters |= {"block.size_factor": 1.0, "block.kv": 0.0}
    drawn = {
        key: np.full(cells.size, value) for key, value in parameters.items() if value is not None
    }
    drawn["back.dip_deg"] = beta_deg + cells.gamma_deg
    base_m = cells.half_s1_m * (cells.tan_alpha3 - cells.tan_alpha1)
    drawn["back.spacing_m"] = base_m * np.sin(np.radians(cells.gamma_deg))
    return RockMass({}, back_fracture).blocks_of(drawn)


def _of_one_spacing(a1: FloatArray, a3: FloatArray, s1_m: float) -> BlockArray:
    """Return blocks of given angles [deg] with the same spacing of the base fractures [m]."""
    return BlockArray.from_angles(a1, a3, 0.5 * s1_m / np.cos(np.radians(a3)))


def _title(
    phi_deg: float, phi_back_deg: float | None, beta_deg: float, back_fracture: bool,
    on_base: Mapping[str, float], ended: ShakenMass | None,
) -> str:  # fmt: skip
    friction = rf"$\phi$ = {phi_deg:g}°"
    if back_fracture and phi_back_deg is not None and phi_back_deg != phi_deg:
        friction += f" (back {phi_back_deg:g}°)"
    back = "with" if back_fracture else "without"
    for name, value in on_base.items():
        friction += (
            f", {word_of(name).replace('_', ' ')} {value:g} {QUANTITIES[name].unit}".rstrip()
        )
    if ended is not None:
        return (
            f"modes in which blocks end under\n{shorten(ended.shaking.motion.label, 70)}\n"
            rf"lines and names: modes at first, {friction}, $\beta$ = {beta_deg:g}°"
        )
    return (
        f"failure modes {back} back fracture, {friction}\n"
        rf"contours: yield acceleration [g] on a base that dips by $\beta$ = {beta_deg:g}°"
    )


class _Chart(NamedTuple):
    """The axes, the angles of the nodes [deg], the mask of blocks, and their stability."""

    axes: Axes
    nodes: FloatArray
    is_block: NDArray[np.bool_]
    stability: StabilityArray

    def of_mode(self, code: int) -> NDArray[np.bool_]:
        return np.asarray(self.is_block & (self.stability.mode_code == code))

    def in_state(self, code: int) -> NDArray[np.bool_]:
        return np.asarray(self.is_block & (self.stability.state_code == code))


def _draw_ends(axes: Axes, ended: ShakenMass) -> list[Patch]:
    """Colour the cells by the final modes of their blocks; return the legend entries."""
    from matplotlib.colors import to_rgba
    from matplotlib.patches import Patch

    a1, a3 = np.meshgrid(_CELLS, _CELLS)
    final, fails = ended.final_code[0], ended.code[0] == FAILS
    colours = np.ones((*a1.shape, 4))
    cells, patches = colours[a1 < a3], []
    for text, mask in (("fails", fails), ("stays", ~fails)):
        for code in np.unique(final[mask & (final != NO_MODE)]).tolist():
            colour = to_rgba(canvas.MODE_COLOURS[MODES[code]], _OPAQUE[text])
            cells[mask & (final == code)] = colour
            words = f"{text}: {MODES[code].replace('_', ' ')}"
            patches.append(Patch(facecolor=colour, label=words))
    colours[a1 < a3] = cells
    axes.imshow(colours, zorder=1, **_WHOLE_CHART)
    return patches


def _draw_yields(chart: _Chart) -> list[tuple[ContourSet, NDArray[np.bool_]]]:
    """Draw the contours; return the contours and the region of each mode."""
    drawn: list[tuple[ContourSet, NDArray[np.bool_]]] = []
    values = chart.stability.yield_acceleration
    # Mode by mode: between topple and confined topple the yield jumps.
    for code, mode in enumerate(MODES):
        region = chart.of_mode(code) & chart.in_state(STABLE)
        if not region.any() or np.ptp(values[region]) < 1e-9:
            continue
        lines = chart.axes.contour(
            chart.nodes, chart.nodes, np.ma.masked_where(~region, values),
            levels=_LEVELS if np.ptp(values[region]) > _NARROW_G else _FINE_LEVELS,
            colors=canvas.MODE_COLOURS[mode], linewidths=1.0, zorder=3,
        )  # fmt: skip
        drawn.append((lines, region))
    return drawn


def _name_regions(chart: _Chart, back_fracture: bool, covered: NDArray[np.bool_]) -> list[Text]:
    names = []
    for code, mode in enumerate(MODES):
        region = chart.of_mode(code)
        stable = region & chart.in_state(STABLE)
        text = canvas.mode_title(mode)
        if mode == "slump" and not back_fracture:
            text = "turns\nback"
        values = chart.stability.yield_acceleration[stable]
        if values.size and np.ptp(values) < 1e-9:
            text += f"\n{values[0]:.3f} g"
        # Where no block is drawn, or at least where blocks are stable.
        areas = (stable & ~covered, stable, region)
        tried = (_widest_point(area, letters) for letters in (text, "") for area in areas)
        place = next((place for place in tried if place is not None), None)
        if place is None:
            continue
        name = chart.axes.text(
            chart.nodes[place[1]], chart.nodes[place[0]], text, ha="center", va="center",
            fontsize=10, zorder=6, **halo(3.5),
        )  # fmt: skip
        names.append(name)
    return names


def _write_values(
    chart: _Chart, lines: ContourSet, region: NDArray[np.bool_], texts: list[Text]
) -> None:
    """Write contour values at the widest points of their region, without overlap; append them.

    A line without such a place has no value next to it.
    """
    from scipy.ndimage import distance_transform_edt

    axes = chart.axes
    to_rim: Any = distance_transform_edt(np.pad(region, 1))
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        points = np.asarray(path.vertices)
        if not points.size:
            continue
        points = points[:: max(1, len(points) // _MOST_POSITIONS)]
        column, row = np.clip(((points + 90.0) / _STEP_DEG).astype(int), 0, len(region) - 1).T
        value = axes.text(
            0.0, 0.0, f"{level:g}", ha="center", va="center", fontsize=7.5,
            color=lines.get_edgecolor()[0], zorder=4, **halo(2.0),
        )  # fmt: skip
        value.set_in_layout(False)
        taken = [text.get_window_extent() for text in texts]
        for i in np.argsort(-to_rim[row + 1, column + 1], kind="stable"):
            value.set_position(points[i])
            box = value.get_window_extent().padded(_VALUE_APART_PX)
            corners = axes.transData.inverted().transform(box.corners())
            column_of, row_of = np.floor((corners + 90.0) / _STEP_DEG).astype(int).T
            inside = (np.abs(corners) < 90.0).all() and region[row_of, column_of].all()
            if inside and not any(box.overlaps(other) for other in taken):
                texts.append(value)
                break
        else:
            value.remove()


def _widest_point(region: NDArray[np.bool_], text: str = "") -> tuple[int, int] | None:
    """Return the point of a region furthest from its rim at which a text fits.

    None where it does not fit, or the region is too small for any.
    """
    from scipy.ndimage import distance_transform_edt, minimum_filter

    lines = text.splitlines()
    size = [_LINE_DEG * len(lines), _LETTER_DEG * max(map(len, lines), default=0)]
    steps = [max(1, round(length / _STEP_DEG)) for length in size]
    fits = minimum_filter(region, size=steps, mode="constant")
    if np.count_nonzero(region) * _STEP_DEG**2 < _LEAST_AREA_DEG2 or not fits.any():
        return None
    distance: Any = distance_transform_edt(np.pad(region, 1))[1:-1, 1:-1] * fits
    widest = np.argwhere(distance > distance.max() - 0.5)
    # the middle of a band
    row, column = min(widest.tolist(), key=lambda place: math.dist(place, widest.mean(axis=0)))
    return row, column


def _draw_blocks(
    axes: Axes, nodes: FloatArray, a1: FloatArray, a3: FloatArray
) -> NDArray[np.bool_]:
    """Draw the blocks; return the nodes that they cover."""
    edges = np.arange(-90.0, 90.0 + CELL_DEG, CELL_DEG)
    counts = np.histogram2d(a3, a1, bins=(edges, edges))[0]
    per_cell = np.searchsorted(edges, nodes) - 1
    covered: NDArray[np.bool_] = (counts > 0.0)[np.ix_(per_cell, per_cell)]
    if a1.size <= MOST_POINTS:
        axes.plot(a1, a3, "o", ms=4, mfc="white", mec="black", mew=0.8, zorder=7)
        return covered
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    greys = ListedColormap(colormaps["Greys"](np.linspace(0.25, 0.95, 256)))
    cells = axes.imshow(
        np.ma.masked_equal(counts, 0.0), cmap=greys, zorder=2.5, alpha=0.85, **_WHOLE_CHART
    )
    axes.figure.colorbar(
        cells, ax=axes, label=f"blocks per cell of {CELL_DEG:g}° x {CELL_DEG:g}°", shrink=0.8
    )
    return covered


SHARES = (0.0, 0.5, 1.0)
"""Shares of the rotation by which the back plane turns, where nothing else is said."""

_ROTATIONS = 721
_LINES = ("-", "--", ":", "-.")


class YieldLine(NamedTuple):
    """Yield acceleration against rotation for one fraction.

    Args:
        share: by how much of the block's rotation the back plane turns.
        at_rest_g: yield at rest [g].
        least_g: least yield [g].
        least_deg: rotation at which it is [deg].
        end_g: yield at the end of the range [g].
        end_deg: end of the range [deg].
    """

    share: float
    at_rest_g: float
    least_g: float
    least_deg: float
    end_g: float
    end_deg: float


@canvas.in_own_style
def plot_rotation(
    block: Block,
    out: canvas.Out = None,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    back_follows: Sequence[float] = SHARES,
) -> canvas.Picture:
    """Draw the yield acceleration of a slump or a confined topple against its rotation.

    The figures 3.20a, 3.20b and 3.21 of Gibson's dissertation, for any block.

    Args:
        block: the block.
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        back_follows: shares of the rotation by which the back plane turns with the block, from 0
            to 1; at most four.

    Raises:
        InputError: a block of another mode, a share out of range, too many of them.
    """
    canvas.plot_path(out)
    at_rest, curves = _curves(block, beta_deg, phi_deg, phi_back_deg, back_follows)
    figure = canvas.new_figure(7.0, 4.6)
    axes = figure.add_subplot()
    colours = (canvas.MODE_COLOURS[at_rest.mode], canvas.BLUE, canvas.RED, canvas.ROCK)
    for (share, theta, k), style, colour in zip(curves, _LINES, colours, strict=False):
        shown = np.where(np.isfinite(k), k, np.nan)
        label = {0.0: "the back plane stays", 1.0: "it turns with the block"}.get(
            share, f"it turns by {share:g} of the rotation"
        )
        axes.plot(theta, shown, style, color=colour, lw=1.8, label=label)
        least = int(np.argmin(k))
        if 0 < least < k.size - 1:
            axes.plot(theta[least], k[least], "o", color=colour, ms=4)
    axes.axhline(at_rest.ky, color="black", lw=0.8, alpha=0.6)
    write_near(
        axes, "$k_y$, sliding", (1.0, at_rest.ky), (-4, 3), xycoords=("axes fraction", "data"),
        fontsize=8,
    )  # fmt: skip
    axes.set_xlim(0.0, None)
    axes.margins(y=0.12)
    axes.set_xlabel(f"rotation of the block [deg], until {BY_MODE[at_rest.mode].end}")
    axes.set_ylabel("yield acceleration [g]")
    canvas.light_grid(axes)
    axes.legend(fontsize=8.5, framealpha=0.9)
    axes.set_title(
        f"{canvas.mode_title(at_rest.mode)}: $\\alpha_1$ = {block.alpha1_deg:.4g}, $\\alpha_3$ = "
        f"{block.alpha3_deg:.4g}, $\\beta$ = {beta_deg:g}, $\\varphi_1$ = {phi_deg:g}, "
        f"$\\varphi_2$ = {at_rest.phi_back_deg:g} deg",
        fontsize=10,
    )
    return canvas.save_figure(figure, out)


def yield_lines(
    block: Block,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    back_follows: Sequence[float] = SHARES,
) -> tuple[YieldLine, ...]:
    """Return the numbers of the figure; arguments as for :func:`plot_rotation`."""
    lines = []
    for share, theta, k in _curves(block, beta_deg, phi_deg, phi_back_deg, back_follows)[1]:
        least = int(np.argmin(k))
        numbers = (k[0], k[least], theta[least], k[-1], theta[-1])
        lines.append(YieldLine(share, *map(float, numbers)))
    return tuple(lines)


def _curves(
    block: Block,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None,
    shares: Sequence[float],
) -> tuple[Stability, list[tuple[float, FloatArray, FloatArray]]]:
    """Return the stability, and rotations [deg] and yields [g] for each fraction."""
    planes = {"beta_deg": beta_deg, "phi_deg": phi_deg, "phi_back_deg": phi_back_deg}
    at_rest = stability(block, **planes)  # type: ignore[arg-type]
    if at_rest.mode not in BY_MODE:
        raise InputError(
            f"the mode of the block is {words_of_mode(at_rest.mode)}: the yield over a rotation is "
            f"that of {' or '.join(map(words_of_mode, BY_MODE))}, against a back plane"
        )
    if not 1 <= len(shares) <= len(_LINES):
        raise InputError(f"{len(shares)} fractions of the rotation: give 1 to {len(_LINES)}")
    law = BY_MODE[at_rest.mode]
    curves = []
    for share in shares:
        theta = np.linspace(0.0, law.limit_deg(block, back_follows=share), _ROTATIONS)
        curves.append((share, theta, law.yield_g(block, theta, **planes, back_follows=share)))
    return at_rest, curves
