"""Critical values, spectra and outcomes of all motions of a database, simulated directly.

A campaign gives the same; here nothing is stored but a file of arrays.
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion, motion_rows
from rbfrag.db.rows import CombinationTable
from rbfrag.db.vertical_pairs import load_vertical
from rbfrag.fragility.fit.data import Y0_OVER_PGV, FitSource, kr_over_pga_of_grid
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.quality import PGD_IN_DOUBT
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.single_run import TOPPLED
from rbfrag.solver.results import DEFAULT_P2
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import runner

POLARITIES: tuple[Polarity, ...] = ("forward", "reverse")


def simulated_source(database: str, *, vertical: bool, cache: Path | None = None) -> FitSource:
    """Return the source of every horizontal motion, both polarities and the usual six p².

    Args:
        database: database with motions and their samples.
        vertical: with the vertical motion of the recording; motions without one are left out.
        cache: file that keeps the answer from one run of a study to the next.
    """
    if cache is not None and cache.exists():
        return _from_file(cache)
    columns: dict[str, list[object]] = {
        field.name: [] for field in fields(CombinationTable) if field.name != "block"
    }
    spectra, outcomes = [], []
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        for row in motion_rows(connection):
            if row.is_vertical:
                continue
            motion = load_motion(connection, row.id)
            upward = load_vertical(connection, row.id) if vertical else None
            if vertical and upward is None:
                continue
            for polarity in POLARITIES:
                drive = excitation(motion, upward, polarity)
                for p2 in DEFAULT_P2:
                    found = critical(motion, p2=p2, vertical=upward, polarity=polarity)
                    y0 = row.pgv_m_s * Y0_OVER_PGV
                    run = runner(drive, p2=p2)
                    outcomes.append([
                        float(run(float(y) * p2**0.5 / STANDARD_GRAVITY_M_S2).outcome == TOPPLED)
                        for y in y0
                    ])  # fmt: skip
                    spectra.append(toppling_spectrum(motion, p2, polarity))
                    values = {
                        "combination_id": len(spectra),
                        "motion_id": row.id,
                        "event_id": row.event_id,
                        "event_guessed": row.event_guessed,
                        "polarity": polarity,
                        "p2": p2,
                        "status": found.status,
                        "search_limit": found.search_limit,
                        "kr_over_pga": found.kr_over_pga,
                        "kr": found.kr,
                        "y_m_s": found.y_m_s,
                        "pga_g": row.pga_g,
                        "pgv_m_s": row.pgv_m_s,
                        "pgd_m": None if PGD_IN_DOUBT & set(row.flags) else row.pgd_m,
                        "tm_s": row.tm_s,
                        "natural_key": f"{row.sha256} {polarity} {p2:g} {vertical}",
                    }
                    for name, value in values.items():
                        columns[name].append(value)
    texts = ("event_id", "polarity", "status", "natural_key")
    kinds = {"combination_id": np.int64, "motion_id": np.int64, "event_guessed": np.bool_}
    arrays = {
        name: np.array(
            [np.nan if v is None else v for v in column],
            dtype=object if name in texts else kinds.get(name, np.float64),
        )
        for name, column in columns.items()
    }
    source = _source(
        arrays,
        np.array(spectra, dtype=np.float64),
        np.array(outcomes, dtype=np.float64).reshape(-1, Y0_OVER_PGV.size),
    )
    if cache is not None:
        flat = {name: a.astype(str) if a.dtype == object else a for name, a in arrays.items()}
        np.savez_compressed(cache, xp_m_s=source.xp_m_s, failed=source.failed, **flat)  # type: ignore[arg-type]
    return source


def _from_file(cache: Path) -> FitSource:
    with np.load(cache) as stored:
        arrays = {name: stored[name] for name in stored.files}
    xp_m_s, failed = arrays.pop("xp_m_s"), arrays.pop("failed")
    table = {n: a.astype(object) if a.dtype.kind == "U" else a for n, a in arrays.items()}
    return _source(table, xp_m_s, failed)


def _source(
    columns: dict[str, NDArray[Any]], xp_m_s: NDArray[np.float64], failed: NDArray[np.float64]
) -> FitSource:
    columns["block"] = np.full(xp_m_s.size, None, dtype=object)
    table = CombinationTable(**columns)
    k = kr_over_pga_of_grid(table.p2, table.pgv_m_s, table.pga_g)
    return FitSource(table, xp_m_s, k, failed)
