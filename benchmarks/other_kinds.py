"""How well models of blocks that slide or slump do, and what y alone costs:

    python -m benchmarks.other_kinds DATABASE [--write]

reads the campaigns of a database (toppling, slumping by 2 degrees and past recovery, sliding), fits
the models, compares them with published regressions, and writes the tables and the figure of
docs/theory/other-kinds.md.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr
from sqlalchemy import Connection

from benchmarks.other_kinds_figure import plot_other_kinds
from benchmarks.page import ROOT, replaced
from rbfrag.bench.tables import markdown
from rbfrag.db.engine import opened_database
from rbfrag.db.queries import combination_table
from rbfrag.fragility.fit.critical import probabilities
from rbfrag.fragility.fit.data import FitData, read_source
from rbfrag.fragility.fit.fitting import Fitted, fit_source, method_of_kind
from rbfrag.fragility.fit.scores import brier, calibration, log_loss
from rbfrag.fragility.measures import TERMS
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "theory" / "other-kinds.md"
FIGURE = ROOT / "docs" / "figures" / "other-kinds.svg"


def jibson_2007(values: dict[str, FloatArray]) -> FloatArray:
    """Return P(D > d) by eq. (6) of Jibson (2007): log10 D [cm] on the ratio alone, sd 0.510."""
    r = values["ky"] / values["pga_g"]
    mean = 0.215 + np.log10((1.0 - r) ** 2.341 * r**-1.438)
    return np.asarray(ndtr((mean - np.log10(100.0 * values["displacement_m"])) / 0.510))


def saygili_rathje_2008(values: dict[str, FloatArray]) -> FloatArray:
    """Return P(D > d) by eq. (6) of Saygili & Rathje (2008), on PGA [g] and PGV [cm/s]."""
    r = values["ky"] / values["pga_g"]
    mean = -1.56 - 4.58 * r - 20.84 * r**2 + 44.75 * r**3 - 30.50 * r**4
    mean = mean - 0.64 * np.log(values["pga_g"]) + 1.55 * np.log(100.0 * values["pgv_m_s"])
    sigma = 0.405 + 0.524 * r
    return np.asarray(ndtr((mean - np.log(100.0 * values["displacement_m"])) / sigma))


def fitted(
    connection: Connection, kind: str, term: str = "pgv_pga", rotation_deg: float | None = None
) -> Fitted:
    """Fit a model of a kind."""
    method = method_of_kind(kind, None)
    asked = {"rotation_deg": rotation_deg}
    source = read_source(connection, method.block, kind=kind, rotation_deg=rotation_deg)
    return fit_source(source, TERMS[term], method, kind=kind, selection=asked)


def as_slide(slump: FitData, sliding: Fitted, rotation_deg: float) -> FloatArray:
    """Return P of a slump as that of a slide: while theta is small, D = theta g/p_s²."""
    blocks = dict(slump.blocks)
    blocks["ky"] = blocks["ks"]
    blocks["displacement_m"] = math.radians(rotation_deg) * STANDARD_GRAVITY_M_S2 / blocks["ps2"]
    model = sliding.report.model
    other = replace(slump, blocks=blocks)
    return probabilities(model.method, model.form, other, np.array(model.parameters))


def scored(name: str, p: FloatArray, data: FitData) -> list[str]:
    judged = data.judged
    return [
        name,
        f"{log_loss(p, judged.failed, judged.known):.3f}",
        f"{brier(p, judged.failed, judged.known):.3f}",
        f"{calibration(p, judged.failed, judged.known).slope:.2f}",
    ]


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


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("database")
    options.add_argument("--toppling", help="database of the toppling campaign, if it is another")
    options.add_argument("--write", action="store_true", help="write page and figure")
    chosen = options.parse_args()
    heads = ["model", "log loss", "Brier", "calibration slope"]
    with opened_database(chosen.database, read_only=True) as engine, engine.connect() as c:
        sliding = fitted(c, "sliding")
        only_pgv = fitted(c, "sliding", "pgv")
        slumps = {
            (rotation, term): fitted(c, "slumping", term, rotation)
            for rotation in (None, 2.0)
            for term in ("pgv_pga", "pgv")
        }
        slump_scatters = {r: scatter(c, "slumping", r) for r in (None, 2.0)}
    recovery, turned = slumps[None, "pgv_pga"].data, slumps[2.0, "pgv_pga"].data
    place = chosen.toppling or chosen.database
    with opened_database(place, read_only=True) as engine, engine.connect() as c:
        topples = scatter(c, "toppling")
    rows = [
        scored("`sliding-pgv_pga`, held out", sliding.result.held_out, sliding.data),
        scored("`sliding-pgv`, held out", only_pgv.result.held_out, only_pgv.data),
        scored(
            "Saygili & Rathje (2008), PGA and PGV",
            saygili_rathje_2008(sliding.data.blocks),
            sliding.data,
        ),
        scored("Jibson (2007), k_y/PGA", jibson_2007(sliding.data.blocks), sliding.data),
    ]
    first = markdown((heads, rows))
    rows = [
        scored(f"`{fit.report.name}`, held out", fit.result.held_out, fit.data)
        for fit in slumps.values()
    ]
    rows.append(scored("2 degrees as a slide of 2° g/p_s²", as_slide(turned, sliding, 2.0), turned))
    second = markdown((heads, rows))
    cells = [
        [name, f"{within:.2f}", f"{between:.2f}"]
        for name, (within, between) in (
            ("toppling, six sizes", topples),
            ("slumping past recovery, 18 blocks", slump_scatters[None]),
            ("slumping by 2 degrees, 18 blocks", slump_scatters[2.0]),
        )
    ]
    third = markdown(
        (["critical values", "between blocks under one motion", "between motions"], cells)
    )
    for name, table in (
        ("sliding-scores", first),
        ("slumping-scores", second),
        ("y-scatter", third),
    ):
        print(name, table, sep="\n")
        if chosen.write:
            PAGE.write_text(
                replaced(PAGE.read_text(encoding="utf-8"), name, table), encoding="utf-8"
            )
    if chosen.write:
        slump = slumps[None, "pgv_pga"].report.model
        plot_other_kinds(sliding.report.model, sliding.data, slump, recovery, FIGURE)
        print(Path(FIGURE).relative_to(ROOT))


if __name__ == "__main__":
    main()
