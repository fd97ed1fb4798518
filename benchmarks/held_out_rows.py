"""Blocks of five earthquakes and models that have not seen them, for a test without records:
python -m benchmarks.held_out_rows --db DATABASE

Fits the models of `benchmarks.model_choice` to all other earthquakes of a full database and writes
their coefficients with log loss and slope on the five, and what their blocks did, as small tables
to tests/fragility/held_out.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.model_choice import MODELS, Aims
from benchmarks.page import parser
from rbfrag.db.engine import opened_database
from rbfrag.fragility.fit.data import FitData, FitSource, fit_data, read_source
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.methods import method_named
from tests.fragility.held_out import FOLDER, blocks, loss_and_slope, probabilities

FIVE = ("san-fernando-1971", "mammoth-l", "dinar", "kaikoura-2016", "baja")
"""Earthquakes of magnitude 5.5 to 7.8, with PGV from .06 to 1.1 m/s."""

MOST_BLOCKS = 6000
"""Blocks of a kind that are kept: of more, every second, third, ... one."""

OF_A_BLOCK = ("xp_m_s", "failed")
"""Columns beside those that describe the block which differ from one block to another."""

Columns = dict[str, NDArray[np.float64]]


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the tables."""
    options = parser(__doc__)
    options.add_argument("--db", required=True, help="full database of the collections")
    chosen = options.parse_args(arguments)
    models: dict[str, Any] = {}
    tables: dict[str, Columns] = {}
    with opened_database(chosen.db, read_only=True) as engine, engine.connect() as connection:
        sources: dict[str, FitSource] = {}
        for name, aims in MODELS.items():
            if aims.loss is None:
                continue
            if aims.kind not in sources:
                block = method_named(aims.method).block
                sources[aims.kind] = read_source(connection, block, kind=aims.kind)
            models[name] = fitted_without(sources[aims.kind], aims)
            columns = blocks_of(sources[aims.kind], aims)
            before = tables.setdefault(aims.kind, columns)
            if before["failed"].tobytes() != columns["failed"].tobytes():
                raise SystemExit(f"{name} is judged on other blocks than those before it")
            before.update(columns)
            print(name, models[name]["coefficients"], flush=True)
    for kind, columns in tables.items():
        write(kind, columns)
    for stored in models.values():
        loss, slope = loss_and_slope(probabilities(stored), blocks(stored["kind"])["failed"])
        stored |= {"log_loss": round(loss, 5), "slope": round(slope, 4)}
    text = json.dumps(models, indent=1)
    (FOLDER / "models.json").write_text(text + "\n", encoding="utf-8")


def fitted_without(source: FitSource, aims: Aims) -> dict[str, object]:
    """Return a model that is fitted to all earthquakes but the five."""
    training = source.only(~np.isin(source.table.event_id.astype(str), FIVE))
    term, method = TERMS[aims.term], method_named(aims.method)
    row = fit_source(training, term, method, kind=aims.kind).report.model.row
    settings = {"kind": aims.kind, "method": aims.method, "term": aims.term}
    return {**settings, "coefficients": {k: float(f"{v:.9g}") for k, v in row.coefficients.items()}}


def blocks_of(source: FitSource, aims: Aims) -> Columns:
    """Return the blocks of the five that a model is judged on, in an order of their own."""
    method, term = method_named(aims.method), TERMS[aims.term]
    held_out = source.only(np.isin(source.table.event_id.astype(str), FIVE))
    data = fit_data(held_out, method, term, kind=aims.kind)
    is_known = data.judged.is_known
    block = (*method.block.names, *method.block.stored)
    columns = {name: _of(data, name)[is_known] for name in (*block, *term.inputs)}
    motion = held_out.table.motion_id[data.combination]
    columns |= {"failed": data.failed[is_known]}
    columns |= {"motion": np.broadcast_to(motion[:, None], is_known.shape)[is_known].astype(float)}
    side = np.broadcast_to(data.polarity[:, None], is_known.shape)[is_known]
    order = np.lexsort([*(columns[name] for name in block), side, columns["motion"]])
    order = order[:: math.ceil(order.size / MOST_BLOCKS)]
    return {name: values[order] for name, values in columns.items()}


def _of(data: FitData, name: str) -> NDArray[np.float64]:
    return np.array(data.grid(name), dtype=np.float64)


def write(kind: str, columns: Columns) -> None:
    """Write what is of a motion and what is of a block to a table each."""
    block = method_block(kind)
    of_block = [name for name in columns if name in (*block, *OF_A_BLOCK)]
    of_motion = [name for name in columns if name not in of_block]
    _, first = np.unique(columns["motion"], return_index=True)
    _write(f"{kind}-motions.csv", of_motion, columns, first)
    _write(f"{kind}-blocks.csv", ["motion", *of_block], columns, np.arange(columns["failed"].size))


def method_block(kind: str) -> tuple[str, ...]:
    """Return what describes the blocks of a kind in its table."""
    block = next(method_named(a.method).block for a in MODELS.values() if a.kind == kind)
    return (*block.names, *block.stored)


def _write(name: str, columns: list[str], values: Columns, rows: NDArray[np.intp]) -> None:
    with (FOLDER / name).open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(columns)
        for row in rows.tolist():
            table.writerow([f"{values[column][row]:.6g}" for column in columns])


if __name__ == "__main__":
    main()
