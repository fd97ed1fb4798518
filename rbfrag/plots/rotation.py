"""Figure of the yield acceleration of a block that rotates against its back plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rbfrag.errors import InputError
from rbfrag.plots import canvas
from rbfrag.plots.labels import write_near
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.results import FloatArray
from rbfrag.solver.stability.modes import words_of_mode
from rbfrag.solver.stability.rotated_yield import BY_MODE
from rbfrag.solver.stability.single import Stability, stability

SHARES = (0.0, 0.5, 1.0)
"""Shares of the rotation by which the back plane turns, where nothing else is said."""

_POINTS = 721
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
    judged, curves = _curves(block, beta_deg, phi_deg, phi_back_deg, back_follows)
    figure = canvas.new_figure(7.0, 4.6)
    axes = figure.add_subplot()
    colours = (canvas.MODE_COLOURS[judged.mode], canvas.BLUE, canvas.RED, canvas.ROCK)
    for (share, theta, k), style, colour in zip(curves, _LINES, colours, strict=False):
        shown = np.where(np.isfinite(k), k, np.nan)
        label = {0.0: "the back plane stays", 1.0: "it turns with the block"}.get(
            share, f"it turns by {share:g} of the rotation"
        )
        axes.plot(theta, shown, style, color=colour, lw=1.8, label=label)
        least = int(np.argmin(k))
        if 0 < least < k.size - 1:
            axes.plot(theta[least], k[least], "o", color=colour, ms=4)
    axes.axhline(judged.ky, color="black", lw=0.8, alpha=0.6)
    write_near(
        axes, "$k_y$, sliding", (1.0, judged.ky), (-4, 3), xycoords=("axes fraction", "data"),
        fontsize=8,
    )  # fmt: skip
    axes.set_xlim(0.0, None)
    axes.margins(y=0.12)
    axes.set_xlabel(f"rotation of the block [deg], until {BY_MODE[judged.mode].end}")
    axes.set_ylabel("yield acceleration [g]")
    canvas.light_grid(axes)
    axes.legend(fontsize=8.5, framealpha=0.9)
    axes.set_title(
        f"{canvas.mode_title(judged.mode)}: $\\alpha_1$ = {block.alpha1_deg:.4g}, $\\alpha_3$ = "
        f"{block.alpha3_deg:.4g}, $\\beta$ = {beta_deg:g}, $\\varphi_1$ = {phi_deg:g}, "
        f"$\\varphi_2$ = {judged.phi_back_deg:g} deg",
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
    judged = stability(block, **planes)  # type: ignore[arg-type]
    if judged.mode not in BY_MODE:
        raise InputError(
            f"the mode of the block is {words_of_mode(judged.mode)}: the yield over a rotation is "
            f"that of {' or '.join(map(words_of_mode, BY_MODE))}, against a back plane"
        )
    if not 1 <= len(shares) <= len(_LINES):
        raise InputError(f"{len(shares)} fractions of the rotation: give 1 to {len(_LINES)}")
    law = BY_MODE[judged.mode]
    curves = []
    for share in shares:
        theta = np.linspace(0.0, law.limit_deg(block, back_follows=share), _POINTS)
        curves.append((share, theta, law.yield_g(block, theta, **planes, back_follows=share)))
    return judged, curves
