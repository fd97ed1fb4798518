"""Fragility tables of pelicun and SimCenter's damage and loss library."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, checked_name
from rbfrag.exchange.fragility_function import (
    FragilityFunction,
    assets_of,
    discrete_function,
    lognormal_function,
)
from rbfrag.files import csv_rows, source_text
from rbfrag.hazards.curve import IntensityType
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.version import __version__

_UNITS = {
    "Peak Ground Acceleration": ("pga_g", {"g": 1.0, "mps2": 1.0 / STANDARD_GRAVITY_M_S2}),
    "Peak Ground Velocity": ("pgv_m_s", {"mps": 1.0, "cmps": 0.01, "inps": 0.0254}),
    "Spectral Acceleration": ("sa_g", {"g": 1.0, "mps2": 1.0 / STANDARD_GRAVITY_M_S2}),
}
"""The measure of a demand, and its units; a period follows the name of the last, behind a bar."""

_HEAD = ("ID", "Incomplete", "Demand-Type", "Demand-Unit", "Demand-Offset", "Demand-Directional")
_APART = 1.5e-8
_LIMIT = ("Family", "Theta_0", "Theta_1", "DamageStateWeights")


def pelicun_text(functions: Sequence[FragilityFunction]) -> str:
    """Return the table as CSV: PGA and SA in g, PGV in mps, a row for each asset.

    A lognormal function keeps median and standard deviation of the logarithm; any other is a
    ``multilinear_CDF`` through its levels, completed to run from 0 to 1 and rounded to the six
    digits that pelicun keeps.

    Args:
        functions: the functions; those of one asset one after the other, each a limit state.
    """
    assets = assets_of(functions)
    states = range(1, 1 + max(len(group) for group in assets.values()))
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow([*_HEAD, *(f"LS{state}-{name}" for state in states for name in _LIMIT)])
    for name, group in assets.items():
        if not name.strip() or "-" in name or name.startswith("_") or name == "References":
            raise InputError(
                f"block {name!r}: an ID of a fragility table has no dash, does not begin with _ "
                "and is neither empty nor References: give the block another block_id"
            )
        kind = group[0].kind
        demand, (unit, *_) = next(
            (demand, units)
            for demand, (measure, units) in _UNITS.items()
            if measure == kind.measure
        )
        demand += "" if kind.period_s is None else f"|{kind.period_s}"
        # directional: the demand is taken as it is given, where pelicun would multiply it by 1.2
        row: list[object] = [name, 0, demand, unit, 0, 1]
        for function in group:
            if function.is_lognormal:
                row += ["lognormal", _text(function.median), _text(function.beta), ""]
            else:
                levels, probability = _extend_to_limits(function)
                row += ["multilinear_CDF", f"{_list(levels)}|{_list(probability)}", "", ""]
        table.writerow(row)
    return out.getvalue()


def metadata_text(
    functions: Sequence[FragilityFunction],
    descriptions: Sequence[str],
    about: tuple[str, ...],
    shaking: str,
) -> str:
    """Return the metadata of the table, ``fragility.json``, by simcenter-dlml 3."""
    model, term, method = about
    document: dict[str, object] = {
        "_GeneralInformation": {
            "ShortName": "Rock blocks in earthquakes",
            "Description": "Probability that rock blocks which rest on a slope fail in an "
            f"earthquake. The demand is that of {shaking}, and is taken as it is given in the "
            "direction of the component (Demand-Directional = 1).",
            "Version": __version__,
            "ComponentGroups": ["Rock blocks"],
        },
        "References": {
            "rbfrag": f"The rbfrag developers. rbfrag: seismic fragility of rock blocks, version "
            f"{__version__}. Software.",
        },
    }
    assets = assets_of(functions)
    for (name, group), description in zip(assets.items(), descriptions, strict=True):
        states = {
            f"LS{i}": {f"DS{i}": {"Description": f"What has failed: {function.limit_state}."}}
            for i, function in enumerate(group, start=1)
        }
        document[name] = {
            "Description": description,
            "Comments": f"Model {model}: method {method}, intensity term {term}.",
            "SuggestedComponentBlockSize": "1 EA",
            "RoundUpToIntegerQuantity": "True",
            "Reference": ["rbfrag"],
            "LimitStates": states,
        }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def read_pelicun(path: str | os.PathLike[str]) -> list[FragilityFunction]:
    """Return the functions of PGA, PGV and SA of a table.

    Rows of other demands (floor acceleration, drift …) are passed over, and those that are marked
    incomplete or hold no parameters.

    Raises:
        InputError: not such a table, or a row whose numbers make no function, with its line.
    """
    text = source_text(path, "a pelicun fragility table")
    rows = csv_rows(text, path)
    header = [name.strip() for name in next(rows)[1]]
    for name in ("ID", "Demand-Type", "Demand-Unit", "LS1-Family", "LS1-Theta_0"):
        if name not in header:
            raise InputError(f"{path}, line 1: there is no column {name}: not a pelicun table")
    functions: list[FragilityFunction] = []
    for line, cells in rows:
        if not cells:
            continue
        if len(cells) != len(header):
            raise InputError(f"{path}, line {line}: {len(cells)} cells under {len(header)} columns")
        row = {name: cell.strip() for name, cell in zip(header, cells, strict=True)}
        checked_name(row["ID"], f"{path}, line {line}: the fragility")
        states = [
            name.removesuffix("-Family")
            for name in header
            if name.endswith("-Family") and row[name]
        ]
        if row.get("Incomplete", "0") not in ("", "0") or not states:
            continue
        demand, unit, where = row["Demand-Type"], row["Demand-Unit"], f"{path}, line {line}"
        name, period = demand, ""
        if "Spectral" in demand:
            name, _, period = demand.removeprefix("Peak ").partition("|")
        if name not in _UNITS:
            continue  # not a measure of the ground motion
        measure, units = _UNITS[name]
        if unit not in units:
            use = ", ".join(units)
            raise InputError(f"{where}: {demand} in {unit!r} is not supported: use {use}")
        period_s = _number(period, where) if measure == "sa_g" else None
        kind = IntensityType(measure, units[unit], period_s)
        functions += [_function(row, state, kind, f"{where}, {state}") for state in states]
    return functions


def _function(
    row: dict[str, str], state: str, kind: IntensityType, where: str
) -> FragilityFunction:
    family = row[f"{state}-Family"]
    if family == "lognormal":
        median, beta = (
            _number(row.get(f"{state}-{key}", ""), f"{where}, {key}")
            for key in ("Theta_0", "Theta_1")
        )
        return lognormal_function(row["ID"], state, kind, kind.factor * median, beta, where)
    if family == "multilinear_CDF":
        parts = row[f"{state}-Theta_0"].split("|")
        if len(parts) != 2:
            raise InputError(f"{where}: Theta_0 is not 'levels|probabilities'")
        x, p = (np.array([_number(w, where) for w in part.split(",")]) for part in parts)
        return discrete_function(row["ID"], state, kind, kind.factor * x, p, where)
    raise InputError(
        f"{where}: family {family!r} is not supported: use lognormal or multilinear_CDF"
    )


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: {text!r} is not a finite number")
    return value


def _extend_to_limits(function: FragilityFunction) -> tuple[list[float], list[float]]:
    """Return levels and probabilities from 0 to 1, strictly increasing as pelicun requires."""
    assert function.levels is not None
    assert function.probability is not None
    x: NDArray[np.float64] = function.levels
    p: NDArray[np.float64] = function.probability
    begins = int(np.searchsorted(p, _APART)) - 1  # chords from the last level that is safe
    x, p = (x[begins:], p[begins:]) if begins > 0 else (x, p)
    if p[0] > 0.0:
        x, p = np.concatenate([[0.0], x]), np.concatenate([[0.0], p])
    if p[-1] < 1.0:
        slope = (p[-1] - p[-2]) / (x[-1] - x[-2]) if p.size > 1 else 0.0
        last = (1.0 - p[-1]) / max(slope, 1e-3)
        x, p = np.append(x, x[-1] + min(last, x[-1])), np.append(p, 1.0)
    # pelicun keeps six digits and rejects neighbours that are then equal
    x, p = _rounded(x), _rounded(p)
    keep = [0]
    for i in range(1, x.size - 1):
        before = p[i] - p[keep[-1]] > _APART and x[i] - x[keep[-1]] > _APART
        if before and p[-1] - p[i] > _APART and x[-1] - x[i] > _APART:
            keep.append(i)
    keep.append(x.size - 1)
    return x[keep].tolist(), p[keep].tolist()


def _rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([float(f"{value:.6g}") for value in values.tolist()])


def _text(value: float | None) -> str:
    return "" if value is None else repr(float(value))


def _list(values: list[float]) -> str:
    return ",".join(map(repr, values))
