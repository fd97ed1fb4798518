"""Blocks of five earthquakes and models fitted without them, for a test without records:
python -m benchmarks.held_out_rows

Fits the models of `benchmarks.model_aims` to all other earthquakes of the built-in data set (--db
DATABASE: another) and writes their coefficients and regressions with log loss and slope on the
five, and the outcomes of their blocks, as small tables to tests/fragility/held_out.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.model_aims import REQUIRED_ONLY, SA_1, SA_3, SA_21, WITH_PGV, WITH_TM, MeasureSet
from benchmarks.page import parser
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.completion import (
    decode_regression,
    encode_regressions,
    key_of,
    used_inputs,
)
from rbfrag.fragility.fit.data import KR, FitData, FitSource, fit_data, read_source
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.methods import method_named
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, spectral_name
from tests.fragility.held_out import FOLDER, blocks, loss_and_slope, probabilities

FIVE = ("san-fernando-1971", "mammoth-l", "dinar", "kaikoura-2016", "baja")
"""Earthquakes of magnitude 5.5 to 7.8, with PGV from .06 to 1.1 m/s."""

MOST_BLOCKS = 6000
"""Blocks of a kind that are kept: of more, every second, third, ... one."""

OF_A_BLOCK = ("xp_m_s", "failed")
"""Columns other than those that describe the block which differ from one block to another."""


class Fit(NamedTuple):
    """A model that is fitted without the five.

    Args:
        kind: response kind.
        method: how it is fitted.
        term: the intensity measures that it requires.
        sets: what is given in addition.
    """

    kind: str
    method: str
    term: str
    sets: tuple[MeasureSet, ...] = (REQUIRED_ONLY,)


FITS = {
    "toppling-pgv_pga": Fit(
        "toppling", "toppling", "pgv_pga", (REQUIRED_ONLY, WITH_TM, SA_3, SA_21)
    ),
    "toppling-pga": Fit("toppling", "toppling", "pga", (WITH_TM, SA_3, SA_21)),
    "toppling-sa": Fit("toppling", "toppling", "sa", (SA_1, SA_3, SA_21)),
    "toppling-pgv": Fit("toppling", "toppling", "pgv"),
    "record-xp": Fit("toppling", "record", "xp"),
    "rocking-pga": Fit(
        "rocking",
        "rocking",
        "pga",
        (WITH_PGV, WITH_TM, MeasureSet(scalars=("magnitude",)), SA_3, SA_21),
    ),
    "rocking-sa": Fit("rocking", "rocking", "sa", (SA_1, SA_21)),
    "rocking-pgv": Fit("rocking", "rocking", "pgv"),
    **{
        f"sliding-{term}": Fit("sliding", "displacement", term)
        for term in ("pgv_pga_m", "pgv_pga", "pgv_pga_ia")
    },
}

Columns = dict[str, NDArray[np.float64]]


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the tables."""
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes")
    chosen = options.parse_args(arguments)
    models: dict[str, dict[str, Any]] = {}
    tables: dict[str, Columns] = {}
    with opened_database(chosen.db, read_only=True) as engine, engine.connect() as connection:
        sources: dict[str, FitSource] = {}
        for name, fit in FITS.items():
            if fit.kind not in sources:
                block = method_named(fit.method).block
                sources[fit.kind] = read_source(connection, block, kind=fit.kind)
            models[name] = fitted_without(sources[fit.kind], fit)
            columns = blocks_of(sources[fit.kind], fit)
            before = tables.setdefault(fit.kind, columns)
            if before["failed"].tobytes() != columns["failed"].tobytes():
                raise SystemExit(f"{name} is judged on other blocks than those before it")
            before.update(columns)
            print(name, models[name]["coefficients"], flush=True)
    for kind, columns in tables.items():
        write(kind, columns)
    for stored in models.values():
        failed = blocks(stored["kind"])["failed"]
        for inputs, scores in stored["scores"].items():
            loss, slope = loss_and_slope(probabilities(stored, inputs), failed)
            scores |= {"log_loss": round(loss, 5), "slope": round(slope, 4)}
    text = json.dumps(models, indent=1)
    (FOLDER / "models.json").write_text(text + "\n", encoding="utf-8")


def fitted_without(source: FitSource, fit: Fit) -> dict[str, Any]:
    """Return a model that is fitted to all earthquakes but the five."""
    training = source.only(~np.isin(source.table.event_id.astype(str), FIVE))
    term, method = TERMS[fit.term], method_named(fit.method)
    row = fit_source(training, term, method, kind=fit.kind).report.model.row
    velocity = method.forms[fit.term].velocity
    regressions, scores = {}, {}
    for measures in fit.sets:
        used = used_inputs(term, velocity, (*term.inputs, *measures.names))
        scores[key_of(used)] = {"measures": measures.words}
        regression = decode_regression(row.completions, used)
        if regression is not None:
            lines = [[float(f"{value:.7g}") for value in line] for line in regression.coefficients]
            sigma = [float(f"{value:.7g}") for value in regression.sigma]
            regressions[key_of(used)] = regression._replace(
                coefficients=lines, sigma=sigma, shared=(), steps=()
            )
    return {
        "kind": fit.kind,
        "method": fit.method,
        "term": fit.term,
        "coefficients": {k: float(f"{v:.9g}") for k, v in row.coefficients.items()},
        "completions": encode_regressions(regressions).splitlines(),
        "scores": scores,
    }


def blocks_of(source: FitSource, fit: Fit) -> Columns:
    """Return the scored blocks of the five, sorted by motion and block."""
    method, term = method_named(fit.method), TERMS[fit.term]
    held_out = source.only(np.isin(source.table.event_id.astype(str), FIVE))
    data = fit_data(held_out, method, term, kind=fit.kind)
    chosen = data.judged.is_known
    if "kr" in data.blocks:
        chosen = chosen & (data.grid("kr") <= KR[1])
    block = (*method.block.names, *method.block.stored)
    columns = {name: _of(data, name)[chosen] for name in block}
    scalars = {name for measures in fit.sets for name in measures.scalars}
    of_motions = {
        name: held_out.table.measure(name) for name in (*scalars, *term.inputs) if name != "xp_m_s"
    }
    if SA_21 in fit.sets and held_out.spectra is not None:
        names = map(spectral_name, SPECTRUM_PERIODS_S)
        of_motions |= dict(zip(names, held_out.spectra.T, strict=True))
    of_motions["motion"] = held_out.table.motion_id.astype(np.float64)
    if "xp_m_s" in term.inputs:
        of_motions["xp_m_s"] = held_out.xp_m_s
    for name, values in of_motions.items():
        of_rows = values[data.combination][:, None]
        columns[name] = np.broadcast_to(of_rows, chosen.shape)[chosen]
    columns["failed"] = data.failed[chosen]
    side = np.broadcast_to(data.polarity[:, None], chosen.shape)[chosen]
    order = np.lexsort([*(columns[name] for name in block), side, columns["motion"]])
    order = order[:: math.ceil(order.size / MOST_BLOCKS)]
    return {name: values[order] for name, values in columns.items()}


def _of(data: FitData, name: str) -> NDArray[np.float64]:
    return np.array(data.grid(name), dtype=np.float64)


def write(kind: str, columns: Columns) -> None:
    """Write the columns of motions and those of blocks to a table each."""
    block = method_block(kind)
    of_block = [name for name in columns if name in (*block, *OF_A_BLOCK)]
    of_motion = [name for name in columns if name not in of_block]
    _, first = np.unique(columns["motion"], return_index=True)
    _write(f"{kind}-motions.csv", of_motion, columns, first)
    _write(f"{kind}-blocks.csv", ["motion", *of_block], columns, np.arange(columns["failed"].size))


def method_block(kind: str) -> tuple[str, ...]:
    """Return the columns that describe the blocks of a kind."""
    block = next(method_named(fit.method).block for fit in FITS.values() if fit.kind == kind)
    return (*block.names, *block.stored)


def _write(name: str, columns: list[str], values: Columns, rows: NDArray[np.intp]) -> None:
    with (FOLDER / name).open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(columns)
        for row in rows.tolist():
            table.writerow([f"{values[column][row]:.6g}" for column in columns])


if __name__ == "__main__":
    main()
