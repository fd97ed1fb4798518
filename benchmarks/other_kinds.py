"""How well models of blocks that slide or slump do, and what y alone costs:

    python -m benchmarks.other_kinds DATABASE [--write]

reads the campaigns of a database (toppling, slumping by 2 degrees and past recovery, sliding), fits
the models, compares them with published regressions, and prints the tables; --write keeps them and
draws the figure of docs/evidence/other-kinds.md. Toppling may be in another database, such as the
shipped one. What the blocks of one earthquake share is that of the shipped models.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection

from benchmarks.other_kinds_figure import plot_other_kinds
from benchmarks.page import ROOT, write_table
from benchmarks.slide_comparison import comparison
from rbfrag.bench.tables import markdown
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow, read_models
from rbfrag.db.queries import combination_table
from rbfrag.fragility.fit.censoring import score_bounds
from rbfrag.fragility.fit.critical import probabilities
from rbfrag.fragility.fit.data import FitData, read_source
from rbfrag.fragility.fit.fitting import Fitted, fit_source, method_of_kind
from rbfrag.fragility.fit.scores import brier, calibration, log_loss
from rbfrag.fragility.joint import event_ranges
from rbfrag.fragility.measures import TERMS
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "evidence" / "other-kinds.md"
FIGURE = ROOT / "docs" / "figures" / "other-kinds.svg"


def fitted(
    connection: Connection, kind: str, term: str = "pgv_pga", rotation_deg: float | None = None
) -> Fitted:
    """Fit a model of a kind."""
    method = method_of_kind(kind, None)
    asked = {"rotation_deg": rotation_deg}
    source = read_source(connection, method.block, kind=kind, rotation_deg=rotation_deg)
    return fit_source(source, TERMS[term], method, kind=kind, selection=asked, shared=False)


def as_slide(slump: FitData, sliding: Fitted, rotation_deg: float) -> FloatArray:
    """Return P of a slump as that of a slide: while theta is small, D = theta g/p_s²."""
    blocks = dict(slump.blocks)
    blocks["ky"] = blocks["ks"]
    blocks["displacement_m"] = math.radians(rotation_deg) * STANDARD_GRAVITY_M_S2 / blocks["ps2"]
    model = sliding.report.model
    other = replace(slump, blocks=blocks)
    return probabilities(model.method, model.form, other, np.array(model.parameters))


def scored(name: str, p: FloatArray, data: FitData) -> list[str]:
    """Return the line of a model: known share, scores, and bounds where some are not known."""
    judged = data.judged
    outcomes = judged.failed, judged.known, judged.weights
    known = np.isfinite(data.failed)
    every = replace(judged, known=known, failed=np.where(known, data.failed, 0.0))
    low, high = score_bounds(every, p, data.read)
    return [
        name,
        f"{100.0 * (1.0 - known.mean()):.0f} %",
        f"{log_loss(p, *outcomes):.3f}",
        f"{brier(p, *outcomes):.3f}",
        f"{calibration(p, *outcomes).slope:.2f}",
        f"{low:.3f} to {high:.3f}",
    ]


def class_lines(
    name: str, p: FloatArray, data: FitData, variable: str, edges: Sequence[float]
) -> list[list[str]]:
    """Return calibration of the classes of a variable: slope, shares predicted and seen."""
    judged, of = data.judged, _class_values(data)[variable]
    lines = []
    for low, high in pairwise(edges):
        here = judged.known & (of >= low) & (of < high)
        counts = judged.counts * here
        if not counts.any():
            continue
        mean = [float((counts * each).sum() / counts.sum()) for each in (p, judged.failed)]
        # where nearly all or none fail there is no slope to speak of
        decided = not 0.01 < mean[1] < 0.99
        slope = calibration(p, judged.failed, here, judged.counts).slope
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


def within_motion(residual: FloatArray, group: NDArray[np.intp]) -> tuple[float, float]:
    """Return the scatter between blocks under one motion, and between motions."""
    count = np.bincount(group)
    mean = np.bincount(group, residual) / np.maximum(count, 1)
    many = count[group] > 1
    inside = residual[many] - mean[group[many]]
    freedom = many.sum() - np.unique(group[many]).size
    within = float(np.sqrt((inside**2).sum() / freedom))
    return within, float(np.std(mean[count > 1]))


def scatter(
    connection: Connection, kind: str, rotation_deg: float | None = None
) -> tuple[float, float]:
    """Return both scatters of ln(y/PGV) at failure, found values alone; y = k g/p."""
    table = combination_table(connection, kind=kind, rotation_deg=rotation_deg)
    found = (table.status == "found") & (table.kr_over_pga < 1.0)
    names = [f"{m} {p}" for m, p in zip(table.motion_id.tolist(), table.polarity, strict=True)]
    group = np.unique(np.array(names)[found], return_inverse=True)[1]
    y = table.kr_over_pga * table.pga_g * STANDARD_GRAVITY_M_S2 / np.sqrt(table.p2)
    return within_motion(np.log(y / table.pgv_m_s)[found], group.astype(np.intp))


def tables(database: str, toppling: str | None) -> tuple[dict[str, str], tuple[Fitted, Fitted]]:
    """Return the tables of the page by name, and the fits that the figure draws."""
    found: dict[str, str] = {}
    with opened_database(database, read_only=True) as engine, engine.connect() as c:
        slides = {term: fitted(c, "sliding", term) for term in ("pgv_pga", "pgv")}
        source = read_source(c, method_of_kind("sliding", None).block, kind="sliding")
        for facing in ("one", "either"):
            found[f"sliding-{facing}"] = comparison(source, facing=facing)
        slumps = {
            (rotation, term): fitted(c, "slumping", term, rotation)
            for rotation in (None, 2.0)
            for term in ("pgv_pga", "pgv")
        }
        scatters = {
            "slumping past recovery, 18 blocks": scatter(c, "slumping"),
            "slumping by 2 degrees, 18 blocks": scatter(c, "slumping", 2.0),
        }
    with opened_database(toppling or database, read_only=True) as engine, engine.connect() as c:
        scatters = {"toppling, six sizes": scatter(c, "toppling"), **scatters}
    sliding, recovery = slides["pgv_pga"], slumps[None, "pgv_pga"]
    rows = []
    for fit in slides.values():
        for variable, edges in (*_ratio_classes(fit), ("d [m]", DISTANCES)):
            rows += class_lines(_name(fit), fit.result.held_out, fit.data, variable, edges)
    found["sliding-classes"] = markdown((CLASS_HEADS, rows))
    rows = [scored(_name(fit), fit.result.held_out, fit.data) for fit in slumps.values()]
    turned = slumps[2.0, "pgv_pga"].data
    rows.append(scored("2 degrees as a slide of 2° g/p_s²", as_slide(turned, sliding, 2.0), turned))
    heads = ["held out", "not known", "log loss", "Brier", "slope", "log loss, bounds"]
    found["slumping-scores"] = markdown((heads, rows))
    rows = []
    for fit in slumps.values():
        classes = (*_ratio_classes(fit), ("p_s² [1/s²]", SIZES), ("k_s", STRENGTHS))
        for variable, edges in classes:
            rows += class_lines(_name(fit), fit.result.held_out, fit.data, variable, edges)
    found["slumping-classes"] = markdown((CLASS_HEADS, rows))
    cells = [
        [name, f"{within:.2f}", f"{between:.2f}"] for name, (within, between) in scatters.items()
    ]
    heads = ["critical values", "between blocks under one motion", "between motions"]
    found["y-scatter"] = markdown((heads, cells))
    return found, (sliding, recovery)


def _ratio_classes(fit: Fitted) -> tuple[tuple[str, tuple[float, ...]], ...]:
    # a model that does not read PGA cannot be level over a ratio to it
    return (("k/PGA", RATIOS),) if "pga_g" in fit.report.model.term.inputs else ()


def _name(fit: Fitted) -> str:
    return f"`{fit.report.name}`"


def dependence_table(models: Sequence[ModelRow]) -> str:
    """Return what the blocks of one earthquake share, of stored models, and what that means."""
    heads = ["model", "earthquake", "site", "component, same side", "component, opposite",
             "one earthquake, P = 0.5"]  # fmt: skip
    cells = []
    for row in models:
        if row.dependence is None:
            continue
        errors = row.dependence["errors"]
        shares = [
            f"{row.dependence[name]:.2f} ± {errors[name]:.2f}"
            for name in ("rho_e", "rho_s", "rho_v", "rho_o")
        ]
        low, high = event_ranges(0.5, row.dependence["rho_e"], 0.95)
        cells.append([f"`{row.name}`", *shares, f"{100 * low:.0f} to {100 * high:.0f} of 100"])
    return markdown((heads, cells))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("database")
    options.add_argument("--toppling", help="database of the toppling campaign, if it is another")
    options.add_argument("--write", action="store_true", help="keep tables, draw the figure")
    chosen = options.parse_args()
    found, (sliding, slumping) = tables(chosen.database, chosen.toppling)
    kinds = ("sliding", "slumping")
    found["dependence"] = dependence_table([m for m in read_models(REFERENCE) if m.kind in kinds])
    for name, table in found.items():
        print(name, table, sep="\n")
        if chosen.write:
            write_table(PAGE, name, table)
    if chosen.write:
        plot_other_kinds(
            sliding.report.model, sliding.data, slumping.report.model, slumping.data, FIGURE
        )
        print(Path(FIGURE).relative_to(ROOT))


if __name__ == "__main__":
    main()
