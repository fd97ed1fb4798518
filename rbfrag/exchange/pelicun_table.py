"""Fragility tables of pelicun and SimCenter's damage and loss library."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, checked_name
from rbfrag.exchange.fragility_function import (
    FragilityFunction,
    discrete_function,
    lognormal_function,
)
from rbfrag.files import csv_rows, source_text
from rbfrag.hazards.measure_type import IntensityType
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.version import __version__

_DEMANDS = {"pga_g": ("Peak Ground Acceleration", "g"), "pgv_m_s": ("Peak Ground Velocity", "mps")}

_UNITS = {
    ("Peak Ground Acceleration", "g"): IntensityType("pga_g", 1.0),
    ("Peak Ground Acceleration", "mps2"): IntensityType("pga_g", 1.0 / STANDARD_GRAVITY_M_S2),
    ("Peak Ground Velocity", "mps"): IntensityType("pgv_m_s", 1.0),
    ("Peak Ground Velocity", "cmps"): IntensityType("pgv_m_s", 0.01),
    ("Peak Ground Velocity", "inps"): IntensityType("pgv_m_s", 0.0254),
}

_HEAD = ("ID", "Incomplete", "Demand-Type", "Demand-Unit", "Demand-Offset", "Demand-Directional")
_APART = 1.5e-8
_LIMIT = ("Family", "Theta_0", "Theta_1", "DamageStateWeights")


def pelicun_text(functions: Sequence[FragilityFunction]) -> str:
    """Return the table as CSV: PGA in g, PGV in mps, one limit state a function.

    A lognormal function keeps median and standard deviation of the logarithm; any other is a
    ``multilinear_CDF`` through its levels, completed to run from 0 to 1 and rounded to the six
    digits that pelicun keeps.
    """
    if not functions:
        raise InputError("there is no fragility function to write")
    _check_names([function.name for function in functions])
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow([*_HEAD, *(f"LS1-{name}" for name in _LIMIT)])
    for function in functions:
        if function.kind.measure not in _DEMANDS:
            raise InputError(
                f"{function.name}: pelicun has no demand for {function.kind.imt}: export PGV or PGA"
            )
        demand, unit = _DEMANDS[function.kind.measure]
        # offset 0, not directional: as the rows of PGV in SimCenter's library are
        row: list[object] = [function.name, 0, demand, unit, 0, 0]
        if function.is_lognormal:
            row += ["lognormal", _text(function.median), _text(function.beta), ""]
        else:
            levels, probability = _whole(function)
            theta = f"{_list(levels)}|{_list(probability)}"
            row += ["multilinear_CDF", theta, "", ""]
        table.writerow(row)
    return out.getvalue()


def without_dashes(
    functions: Sequence[FragilityFunction],
) -> tuple[list[FragilityFunction], list[str]]:
    """Return the functions with dots for dashes in their names, and a warning where there are any.

    Loaders of these tables split an ID at its dashes into the levels of an index.
    """
    dashed = [function.name for function in functions if "-" in function.name]
    named = [replace(function, name=function.name.replace("-", ".")) for function in functions]
    if not dashed:
        return named, []
    return named, [
        f"{len(dashed)} of {len(functions)} IDs have dots for dashes, at which the loader splits "
        f"an ID: {dashed[0]!r} is written as {dashed[0].replace('-', '.')!r}"
    ]


def metadata_text(
    functions: Sequence[FragilityFunction],
    descriptions: Sequence[str],
    about: tuple[str, ...],
) -> str:
    """Return what goes beside the table as ``fragility.json``, as simcenter-dlml 3 has it."""
    model, term, method = about
    document: dict[str, object] = {
        "_GeneralInformation": {
            "ShortName": "Rock blocks in earthquakes",
            "Description": "Probability that rock blocks which rest on a slope fail in an "
            "earthquake. Peak ground velocity and acceleration are those of one horizontal "
            "component of any direction: run pelicun with NonDirectionalMultipliers ALL = 1.0.",
            "Version": __version__,
            "ComponentGroups": ["Rock blocks"],
        },
        "References": {
            "rbfrag": f"The rbfrag developers. rbfrag: seismic fragility of rock blocks, version "
            f"{__version__}. Software.",
        },
    }
    for function, description in zip(functions, descriptions, strict=True):
        document[function.name] = {
            "Description": description,
            "Comments": f"Model {model}: method {method}, intensity term {term}.",
            "SuggestedComponentBlockSize": "1 EA",
            "RoundUpToIntegerQuantity": "True",
            "Reference": ["rbfrag"],
            "LimitStates": {
                "LS1": {"DS1": {"Description": f"The block has failed ({function.limit_state})."}}
            },
        }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _check_names(names: list[str]) -> None:
    """Refuse IDs that a table of the library cannot have."""
    for name in names:
        if not name.strip() or "-" in name or name.startswith("_") or name == "References":
            raise InputError(
                f"block {name!r}: an ID of a fragility table has no dash, does not begin with _ "
                "and is neither empty nor References: give the block another block_id"
            )
        if names.count(name) > 1:
            raise InputError(f"block {name!r} is there twice: give every block its own block_id")


def read_pelicun(path: str | os.PathLike[str]) -> list[FragilityFunction]:
    """Return the functions of peak ground acceleration and velocity of a table.

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
        kind = _UNITS.get((row["Demand-Type"], row["Demand-Unit"]))
        if row.get("Incomplete", "0") not in ("", "0") or not states:
            continue
        of_ground = row["Demand-Type"] in ("Peak Ground Acceleration", "Peak Ground Velocity")
        if of_ground and kind is None:
            raise InputError(
                f"{path}, line {line}: {row['Demand-Type']} in {row['Demand-Unit']!r} is not "
                "known: g, mps2; mps, cmps, inps"
            )
        if kind is not None:
            functions += [
                _function(row, state, kind, f"{path}, line {line}, {state}") for state in states
            ]
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
    raise InputError(f"{where}: family {family!r} is not known: lognormal and multilinear_CDF are")


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: {text!r} is not a finite number")
    return value


def _whole(function: FragilityFunction) -> tuple[list[float], list[float]]:
    """Return levels and probabilities from 0 to 1, strictly rising as pelicun wants them."""
    assert function.levels is not None
    assert function.probability is not None
    x: NDArray[np.float64] = function.levels
    p: NDArray[np.float64] = function.probability
    if p[0] > 0.0:
        x, p = np.concatenate([[0.0], x]), np.concatenate([[0.0], p])
    if p[-1] < 1.0:
        last = (1.0 - p[-1]) / max((p[-1] - p[-2]) / (x[-1] - x[-2]), 1e-3)
        x, p = np.append(x, x[-1] + min(last, x[-1])), np.append(p, 1.0)
    # pelicun keeps six digits and refuses neighbours that are then equal
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
