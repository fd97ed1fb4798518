"""Figure of the models of blocks that slide or slump, with the data they were fitted to."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np

from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.method import arrays
from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.canvas import Picture, new_figure, plot_path, save_figure, written_numbers


def plot_other_kinds(
    sliding: FragilityModel, slides: FitData, slumping: FragilityModel, slumps: FitData,
    path: str | PathLike[str],
) -> Picture:  # fmt: skip
    """Draw displacements over PGV²/(k_y g) against k_y/PGA, and outcomes by (1 - r)/r and z.

    Args:
        sliding: a model on PGV and PGA.
        slides: what it was fitted to.
        slumping: a model on PGV and PGA.
        slumps: what it was fitted to.
        path: file to write: .png, .pdf or .svg.

    Raises:
        InputError: a path that cannot be written.
        MissingExtraError: matplotlib is not installed.
    """
    plot_path(path)
    figure = new_figure(9.2, 4.6)
    left, right = figure.subplots(1, 2)
    _slides(left, sliding, slides)
    _slumps(right, slumping, slumps)
    return save_figure(figure, path)


def _slides(axes: Any, model: FragilityModel, data: FitData) -> None:
    v, observed = data.values, data.observed
    r = v["ky"] / v["pga_g"]
    size = v["pgv_m_s"] ** 2 / (v["ky"] * STANDARD_GRAVITY_M_S2)
    share = v["displacement_m"] / size
    rng = np.random.default_rng(0)
    jitter = r + rng.uniform(-0.008, 0.008, r.size)
    axes.plot(
        jitter[observed], share[observed], ".", ms=1.6, color="#9a9a9a", alpha=0.5, rasterized=True
    )
    grid = np.linspace(0.01, 0.97, 120)
    pga, pgv = 0.3, 0.3
    line = {"ky": grid * pga, "pgv_m_s": np.full(120, pgv), "pga_g": np.full(120, pga)}
    line["displacement_m"] = np.ones(120)
    eta = model.form.eta(model.parameters, line, arrays())
    sigma = np.exp(eta.log_sigma)
    norm = pgv**2 / (line["ky"] * STANDARD_GRAVITY_M_S2)
    axes.plot(grid, np.exp(eta.eta * sigma) / norm, color="#b2182b", lw=1.8,
              label="median at PGA 0.3 g, PGV 0.3 m/s")  # fmt: skip
    for side in (-1.645, 1.645):
        axes.plot(
            grid, np.exp((eta.eta + side) * sigma) / norm, "--", color="#b2182b", lw=1.0,
            label="5 % and 95 %" if side > 0 else None,
        )  # fmt: skip
    axes.plot(grid, 0.5 * (1.0 - grid), color="black", lw=1.0, label="rectangular pulse")
    axes.set_yscale("log")
    axes.set_ylim(1e-5, 20.0)
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel(r"$k_y/\mathrm{PGA}$")
    axes.set_ylabel(r"displacement over $\mathrm{PGV}^2/(k_y g)$")
    axes.set_title("sliding", fontsize=10)
    _legend(axes)


def _slumps(axes: Any, model: FragilityModel, data: FitData) -> None:
    b0, b1, b2, b3 = model.parameters
    ks, r = data.grid("ks"), data.grid("ks") / data.grid("pga_g")
    z = data.grid("p") * data.grid("pgv_m_s") / (data.grid("pga_g") * STANDARD_GRAVITY_M_S2)
    excess = (1.0 - r) / r * ks ** (b3 / b1)
    for fails, colour, text in ((0.0, "#7fb2d8", "comes to rest"), (1.0, "#8a8a8a", "fails")):
        chosen = data.failed == fails
        axes.plot(z[chosen], excess[chosen], ".", ms=1.2, color=colour, alpha=0.3, rasterized=True)
        axes.plot([], [], "o", ms=4, color=colour, label=text)
    grid = np.geomspace(float(z.min()), float(z.max()), 60)
    for side in (-1.645, 0.0, 1.645):
        axes.plot(
            grid, np.exp((side - b0 - b2 * np.log(grid)) / b1),
            color="#b2182b", lw=1.0 if side else 1.8, ls="--" if side else "-",
            label={0.0: "P = 0.5", 1.645: "P = 0.05 and 0.95"}.get(side),
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    written_numbers(axes.xaxis, 1.0, 2.0, 5.0)
    written_numbers(axes.yaxis, 1.0)
    axes.set_xlabel(r"$z = p_s\,\mathrm{PGV}/(\mathrm{PGA}\,g)$")
    axes.set_ylabel(rf"$(1-r)/r\cdot k_s^{{{b3 / b1:.2f}}}$, $r=k_s/\mathrm{{PGA}}$")
    axes.set_title("slumping past recovery", fontsize=10)
    _legend(axes)


def _legend(axes: Any) -> None:
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2, fontsize=8.5, frameon=False
    )
