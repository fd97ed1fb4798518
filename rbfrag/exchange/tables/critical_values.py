"""Critical values imported from the table of another database: `rbfrag db import`."""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import tempfile
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.db.campaigns import CombinationRecord, insert_combinations
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import insert_row
from rbfrag.db.keys import canonical_json, combination_key
from rbfrag.db.merge import MergeReport, merge_databases
from rbfrag.db.motions import recording_id_for
from rbfrag.db.rows import IMPORTED, EarthquakeInfo
from rbfrag.db.schema import MEASURES, campaign, motion
from rbfrag.errors import LONGEST_NAME, InputError
from rbfrag.files import is_number, source_text, toml_document
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.motions.quality import LARGEST_PGA_G
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.question.table import FACTORS, unit_factor
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.results import SEARCH_LIMIT, SearchPoints
from rbfrag.version import __version__
from rbfrag.vocabulary.quantities import QUANTITIES

if TYPE_CHECKING:
    import pandas as pd

NEEDED = ("motion", "event", "p2", "pga_g", "pgv_m_s", "pgd_m")
CRITICAL = ("kr", "kr_over_pga")
WORDS = {"status": ("found", "below_limit", "no_motion"), "polarity": ("forward", "reverse")}
"""What a column's words may mean; where the table has no such column, all rows are the first."""

UNITS = {name: QUANTITIES[name].unit for name in ("p2", *MEASURES)}
FIELDS = tuple(dict.fromkeys((*NEEDED, *CRITICAL, *MEASURES, "magnitude", *WORDS)))
KEY = ("event", "motion", "polarity", "p2")
ABOVE_ZERO = ("p2", "pga_g", "pgv_m_s", "tm_s")


def import_critical_values(
    table: str | os.PathLike[str],
    map: str | os.PathLike[str],
    *,
    db: str | os.PathLike[str] | None = None,
) -> MergeReport:
    """Merge a table of critical values of toppling, with their motions, into the database.

    A motion is its earthquake and its name.

    Args:
        table: CSV, a critical value a line.
        map: TOML with the column and unit of each field (docs/howto/import-a-table.md).
        db: the database (path, URL, or None for the default).

    Raises:
        InputError: a map or line that cannot be read, or that contradicts another or the database.
    """
    source = Path(table)
    columns, search_limit = _read_map(map)
    rows = _read_rows(source, columns)
    settings = {"table": source.name, "columns": columns, "search_limit": search_limit}
    of_file = datetime.fromtimestamp(source.stat().st_mtime, UTC).isoformat(timespec="seconds")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / source.name
        _store(rows, place, settings, of_file)
        return merge_databases(place, db=db)


def _read_map(path: str | os.PathLike[str]) -> tuple[dict[str, dict[str, str]], float]:
    """Return the columns of the fields, and the smallest k_r/PGA that was searched."""
    document, fields = toml_document(source_text(path, "a map of columns"), path), {}
    columns, limit = document.get("columns"), document.get("search_limit", SEARCH_LIMIT)
    if not isinstance(columns, dict) or not is_number(limit) or not 0.0 < limit < 1.0:
        raise InputError(f"{path}: [columns] and search_limit (k_r/PGA, from 0 to 1) are required")
    missing = [name for name in NEEDED if name not in columns]
    if missing or len(columns.keys() & set(CRITICAL)) != 1:
        missing = missing or [" or ".join(CRITICAL)]
        raise InputError(f"{path}: [columns] must name {', '.join(missing)}, each once")
    for field, entry in columns.items():
        about = {"column": entry} if isinstance(entry, str) else entry
        words = ("unit",) if field in UNITS else WORDS.get(field, ())
        if field not in FIELDS:
            raise InputError(
                f"{path}: {field[:60]} is not a field; the fields are {', '.join(FIELDS)}"
            )
        if not (isinstance(about, dict) and {"column"} <= about.keys() <= {"column", *words}):
            keys = ", ".join(f'{word} = "…"' for word in ("column", *words))
            raise InputError(f'{path}: write {field} = "COLUMN" or {field} = {{{keys}}}')
        unit = str(about.get("unit", UNITS.get(field)))
        if field in UNITS and unit_factor(UNITS[field], unit) is None:
            ours = ", ".join(FACTORS[UNITS[field]])
            raise InputError(f"{path}: the unit {unit[:40]!r} of {field} is not one of {ours}")
        fields[field] = {key: str(value) for key, value in about.items()}
    return fields, float(limit)


def _read_rows(source: Path, columns: Mapping[str, Mapping[str, str]]) -> pd.DataFrame:
    """Return the fields of each line, in the units of the database, indexed by line number."""
    import pandas as pd

    text = source_text(source, "a table of critical values")
    try:
        raw = pd.read_csv(
            io.StringIO(text), sep=max(",;\t", key=text.partition("\n")[0].count), dtype=str,
            na_values=["", "NULL", "\\N"], keep_default_na=False, skip_blank_lines=False,
        )  # fmt: skip
        if not isinstance(raw.index, pd.RangeIndex):
            raise ValueError("line 2 has more cells than the line of the names")
    except ValueError as error:  # pandas' own errors, which name the line
        raise InputError(f"{source}: not a CSV file: {error}") from None
    raw = raw.set_axis(raw.index + 2).dropna(how="all")
    rows = pd.DataFrame(index=raw.index)

    def reject(bad: pd.Series[bool], field: str, why: str) -> None:
        if bad.any():
            line = bad.idxmax()
            cell = raw[columns[field]["column"]][line]
            raise InputError(f"{source}, line {line}: {field} is {cell!r}: {why}")

    for field, about in columns.items():
        if about["column"] not in raw:
            header = ", ".join(map(str, raw))[:200]
            raise InputError(f"{source} has no column {about['column']!r} of {field}: {header}")
        cells = raw[about["column"]]
        if field in KEY[:2]:
            rows[field] = cells
            reject(cells.isna() | (cells.str.len() > LONGEST_NAME), field, "give it a name")
        elif field in WORDS:
            meant = {about.get(word, word): word for word in WORDS[field]}
            rows[field] = cells.map(meant)
            reject(rows[field].isna(), field, f"the map knows {', '.join(map(repr, meant))}")
        else:
            unit = UNITS.get(field, "")
            factor = unit_factor(unit, about.get("unit", unit))
            rows[field] = numbers = pd.to_numeric(cells, errors="coerce") * factor
            bad = ~np.isfinite(numbers) | (numbers < 0.0) & (field != "magnitude")
            bad |= (numbers == 0.0) & (field in ABOVE_ZERO)
            reject(bad & (cells.notna() | (field in NEEDED)), field, "it must be a number above 0")
    reject(rows["pga_g"] > 4.0 * LARGEST_PGA_G, "pga_g", "no ground shakes so: check its unit")
    for field, words in WORDS.items():
        rows[field] = rows.get(field, words[0])
    observed, field = rows["status"] == "found", "kr" if "kr" in columns else "kr_over_pga"
    ratio = (rows[field] / (rows["pga_g"] if field == "kr" else 1.0)).where(observed)
    reject(observed & ~(ratio > 0.0), field, "where no block topples, say so by the status")
    reject(ratio > 1.01, field, "it is above PGA, where no block moves: check both units")
    rows["kr_over_pga"] = ratio
    reject(rows.duplicated([*KEY]), "motion", "its p² and polarity stand above: keep one")
    for field in columns.keys() & {*MEASURES, "magnitude"}:
        first = rows.groupby([*KEY[:2]])[field].transform("first")
        reject(first.notna() & (rows[field] != first), field, "its motion has another above")
    return rows


def _store(rows: pd.DataFrame, place: Path, settings: Mapping[str, Any], started: str) -> None:
    """Write the rows into a database of their own."""
    about = {"numerics_version": IMPORTED, "rbfrag_version": __version__, "started": started}
    about |= {"settings": canonical_json(settings), "finished": started}
    common = {"kind": TOPPLING_BLOCK.kind, "settings": {}, "numerics_version": IMPORTED}
    records = []
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        for (event, name), group in rows.groupby([*KEY[:2]]):
            first_row = {k: v for k, v in group.iloc[0].items() if v == v}
            info = EarthquakeInfo(event, magnitude=first_row.get("magnitude"), guessed=False)
            sha256 = hashlib.sha256(canonical_json({IMPORTED: [event, name]}).encode()).hexdigest()
            values = {
                "recording_id": recording_id_for(connection, info, name, ""),
                "component": "", "is_vertical": False, "dt_s": 1.0, "npts": 1, "processing": "",
                "final_velocity_m_s": 0.0, "final_displacement_m": 0.0, "source_file": name,
                "trace_index": 0, "file_format": IMPORTED, "flags": json.dumps([IMPORTED]),
                "remarks": "[]", "source_sha256": sha256, "added": started,
                "samples_sha256": sha256, **{field: first_row.get(field) for field in MEASURES},
            }  # fmt: skip
            motion_id = insert_row(connection, motion, values)
            samples: dict[str, Any] = {"motion_sha256": sha256, "dt_s": 1.0}
            for row in group.to_dict("records"):
                inputs: dict[str, Any] = {"polarity": row["polarity"], "p2": row["p2"], **common}
                key = combination_key(**samples, vertical_sha256=None, **inputs)
                result = _result(row, settings)
                records.append(CombinationRecord(key, motion_id, None, result=result, **inputs))
        insert_combinations(connection, insert_row(connection, campaign, about), records)


def _result(row: Mapping[str, Any], settings: Mapping[str, Any]) -> CriticalResult:
    """Return a critical value in the form of a search result: its block was observed to topple."""
    ratio, p2, kr = row["kr_over_pga"], row["p2"], row["kr_over_pga"] * row["pga_g"]
    values = {"kr_over_pga": ratio, "kr": kr, "y_m_s": kr * STANDARD_GRAVITY_M_S2 / math.sqrt(p2)}
    seen = np.array([ratio] if ratio > 0.0 else [])
    points = SearchPoints(seen, np.full(seen.size, np.nan), ("toppled",) * seen.size)
    of_row = {name: row[name] for name in ("polarity", "pga_g", "status")}
    every = {**of_row, **(values if seen.size else {}), "search_limit": settings["search_limit"]}
    return CriticalResult(kind=TOPPLING_BLOCK.kind, p2=p2, points=points, **every)
