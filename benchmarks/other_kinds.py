"""How well models of blocks that slide, slump or topple confined do:

    python -m benchmarks.other_kinds DATABASE [--slumping DATABASE] [--suite NAME] [--write]

reads the campaigns of a database (sliding, slumping by 2 degrees and past recovery, confined
toppling), fits the models and prints the tables (`benchmarks.sliding_models` compares those of
sliding); --write keeps them and draws the figure of docs/evidence/other-kinds.md. All but sliding
may be in another database, there run under the motions of a suite alone. What the blocks of one
earthquake share is that of the shipped models.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection

from benchmarks.page import ROOT, markdown, write_table
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow, read_models
from rbfrag.db.rows import Selection
from rbfrag.fragility.fit.data import FitData, read_source
from rbfrag.fragility.fit.fitting import Fitted, fit_source, method_of_kind
from rbfrag.fragility.fit.maximum_likelihood import probabilities
from rbfrag.fragility.fit.result import brier, calibration, log_loss
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import arrays
from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.canvas import Picture, new_figure, plot_path, save_figure, written_numbers

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "evidence" / "other-kinds.md"
FIGURE = ROOT / "docs" / "figures" / "other-kinds.svg"


def fitted(
    connection: Connection, kind: str, term: str = "pgv_pga", **selection: Unpack[Selection]
) -> Fitted:
    """Fit a model of a kind."""
    method = method_of_kind(kind, None)
    source = read_source(connection, method.block, kind=kind, **selection)
    return fit_source(source, TERMS[term], method, kind=kind, selection=selection)


def as_slide(slump: FitData, sliding: Fitted, rotation_deg: float) -> FloatArray:
    """Return P of a slump as that of a slide: while theta is small, D = theta g/p_s²."""
    blocks = dict(slump.blocks)
    blocks["ky"] = blocks["ks"]
    blocks["displacement_m"] = math.radians(rotation_deg) * STANDARD_GRAVITY_M_S2 / blocks["ps2"]
    model = sliding.report.model
    other = replace(slump, blocks=blocks)
    return probabilities(model.method, model.form, other, np.array(model.parameters))


def scored(name: str, p: FloatArray, data: FitData) -> list[str]:
    """Return the line of a model: scores, and how many outcomes are undecided."""
    judged = data.judged
    outcomes = judged.failed, judged.is_known
    undecided = 1.0 - judged.is_known[data.read].mean()
    return [
        name,
        f"{log_loss(p, *outcomes):.4f}",
        f"{brier(p, *outcomes):.4f}",
        f"{calibration(p, *outcomes).slope:.2f}",
        f"{int(judged.is_known.sum()):,}",
        f"{100.0 * undecided:.1f} %",
    ]


def coefficient_lines(fits: Sequence[Fitted]) -> str:
    """Return the coefficients of some fits with their clustered errors, one fit a row."""
    names = list(dict.fromkeys(name for fit in fits for name in fit.result.coefficients))
    rows = [
        [_name(fit)]
        + [
            f"{fit.result.coefficients[name]:.3f} ± {fit.result.standard_errors[name]:.3f}"
            if name in fit.result.coefficients
            else ""
            for name in names
        ]
        for fit in fits
    ]
    return markdown((["model", *(f"`{name}`" for name in names)], rows))


def class_lines(
    name: str, p: FloatArray, data: FitData, variable: str, edges: Sequence[float]
) -> list[list[str]]:
    """Return calibration of the classes of a variable: slope, shares predicted and seen."""
    judged, of = data.judged, _class_values(data)[variable]
    lines = []
    for low, high in pairwise(edges):
        in_class = judged.is_known & (of >= low) & (of < high)
        if not in_class.any():
            continue
        mean = [float(column[in_class].mean()) for column in (p, judged.failed)]
        # where nearly all or none fail there is no slope to speak of
        decided = not 0.01 < mean[1] < 0.99
        slope = calibration(p, judged.failed, in_class).slope
        text = f"{low:g} to {high:g}" if np.isfinite(high) else f"from {low:g}"
        lines.append([
            name, f"{variable} {text}", "" if decided else f"{slope:.2f}",
            f"{mean[0]:.3f}", f"{mean[1]:.3f}",
        ])  # fmt: skip
    return lines


def _class_values(data: FitData) -> dict[str, FloatArray]:
    strength = next(name for name in ("ky", "ks") if name in data.blocks)
    of = {"k/PGA": data.grid(strength) / data.grid("pga_g")}
    for word, name in (("d [m]", "displacement_m"), ("p_s² [1/s²]", "ps2"), ("k_s", "ks")):
        if name in data.blocks:
            of[word] = data.grid(name)
    return of


CLASS_HEADS = ["model", "class", "slope", "mean P", "failed"]
RATIOS, DISTANCES = (0.0, 0.1, 0.3, 0.6, 1.0), (0.0, 0.02, 0.1, 0.2, math.inf)
SIZES, STRENGTHS = (0.0, 3.0, 8.0, math.inf), (0.0, 0.2, math.inf)


def tables(
    database: str, slumping: str | None, suite: str | None
) -> tuple[dict[str, str], tuple[Fitted, Fitted]]:
    """Return the tables of the page by name, and the fits that the figure draws."""
    tables_by_name: dict[str, str] = {}
    with opened_database(database, read_only=True) as engine, engine.connect() as c:
        slides = {term: fitted(c, "sliding", term) for term in ("pgv_pga", "pgv")}
    with opened_database(slumping or database, read_only=True) as engine, engine.connect() as c:
        slumps = [
            fitted(c, "slumping", term, rotation_deg=rotation, suite=suite)
            for rotation in (None, 2.0)
            for term in ("pgv_pga_m", "pgv_pga")
        ]
        confined = [
            fitted(c, "confined_toppling", term, suite=suite) for term in ("pgv_pga_m", "pgv_pga")
        ]
    sliding, turned = slides["pgv_pga"], slumps[-1].data
    rows = []
    for fit in slides.values():
        for variable, edges in (*_ratio_classes(fit), ("d [m]", DISTANCES)):
            rows += class_lines(_name(fit), fit.result.held_out, fit.data, variable, edges)
    tables_by_name["sliding-classes"] = markdown((CLASS_HEADS, rows))
    rows = [scored(_name(fit), fit.result.held_out, fit.data) for fit in slumps]
    rows.append(scored("2 degrees as a slide of 2° g/p_s²", as_slide(turned, sliding, 2.0), turned))
    heads = ["held out", "log loss", "Brier", "slope", "outcomes", "undecided"]
    tables_by_name["slumping-scores"] = markdown((heads, rows))
    tables_by_name["slumping-coefficients"] = coefficient_lines(slumps)
    rows = [scored(_name(fit), fit.result.held_out, fit.data) for fit in confined]
    tables_by_name["confined-scores"] = markdown((heads, rows))
    tables_by_name["confined-coefficients"] = coefficient_lines(confined)
    rows = []
    for fit in slumps:
        classes = (*_ratio_classes(fit), ("p_s² [1/s²]", SIZES), ("k_s", STRENGTHS))
        for variable, edges in classes:
            rows += class_lines(_name(fit), fit.result.held_out, fit.data, variable, edges)
    tables_by_name["slumping-classes"] = markdown((CLASS_HEADS, rows))
    return tables_by_name, (sliding, slumps[1])


def _ratio_classes(fit: Fitted) -> tuple[tuple[str, tuple[float, ...]], ...]:
    # a model that does not read PGA cannot be level over a ratio to it
    return (("k/PGA", RATIOS),) if "pga_g" in fit.report.model.term.inputs else ()


def _name(fit: Fitted) -> str:
    return f"`{fit.report.name}`"


def dependence_table(models: Sequence[ModelRow]) -> str:
    """Return what the blocks of one earthquake share, of stored models."""
    heads = ["model", "earthquake", "site", "component, same side", "component, opposite"]
    cells = []
    for row in models:
        if row.dependence is None:
            continue
        errors = row.dependence["errors"]
        shares = [
            f"{row.dependence[name]:.2f} ± {errors[name]:.2f}"
            for name in ("rho_e", "rho_s", "rho_v", "rho_o")
        ]
        cells.append([f"`{row.name}`", *shares])
    return markdown((heads, cells))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("database")
    options.add_argument(
        "--slumping", help="database of slumping and confined toppling, if it is another"
    )
    options.add_argument("--suite", help="of the motions of these campaigns")
    options.add_argument("--write", action="store_true", help="keep tables, draw the figure")
    chosen = options.parse_args()
    tables_by_name, (sliding, slumping) = tables(chosen.database, chosen.slumping, chosen.suite)
    kinds = ("sliding", "slumping", "confined_toppling")
    tables_by_name["dependence"] = dependence_table(
        [m for m in read_models(REFERENCE) if m.kind in kinds]
    )
    for name, table in tables_by_name.items():
        print(name, table, sep="\n")
        if chosen.write:
            write_table(PAGE, name, table)
    if chosen.write:
        plot_other_kinds(
            sliding.report.model, sliding.data, slumping.report.model, slumping.data, FIGURE
        )
        print(Path(FIGURE).relative_to(ROOT))


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
    left_axes, right = figure.subplots(1, 2)
    _slides(left_axes, sliding, slides)
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


if __name__ == "__main__":
    main()
