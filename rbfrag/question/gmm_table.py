"""Medians and sigmas of any ground-motion model, from a table by distance."""

from __future__ import annotations

import math
from collections.abc import Collection
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.files import csv_rows, source_text
from rbfrag.fragility.measures import SCATTERED, SIGMAS
from rbfrag.question.bssa14 import Ordinate
from rbfrag.question.table import columns_in
from rbfrag.vocabulary.spectral import BY_PERIOD

_CONTENT = "a table of medians and sigmas"
_NEAREST_KM = 0.1

Columns = dict[str, NDArray[np.float64]]


def read_gmm_table(path: str | PathLike[str]) -> Columns:
    """Return the columns of a ground-motion table, by field and in the units of the fields, shape
    (rows,).

    Args:
        path: CSV with measures and their standard deviations (``pgv_m_s``, ``pgv_sigma``, …), of
            several rows ``rjb_km``, rising, and ``pgv_tau`` where it is known.

    Raises:
        InputError: the file cannot be read, or a value in it cannot be used.
    """
    rows = [
        entry
        for entry in csv_rows(source_text(path, _CONTENT), path)
        if any(map(str.strip, entry[1]))
    ]
    if not rows:
        raise InputError(f"{path} is empty: give columns such as pgv_m_s and pgv_sigma")
    (_, header), *rest = rows
    fields = {*SIGMAS, *SCATTERED, *BY_PERIOD, "pgv_tau", "rjb_km"}
    table = {}
    for name, column in columns_in(header, path, fields).columns.items():
        place, values = header.index(column.header), []
        for line, row in rest:
            text = row[place] if place < len(row) else ""
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            above = value > 0.0 if name in SIGMAS else value >= 0.0
            if not above or value > 1e9:
                requirement = "a number above 0" if name in SIGMAS else "a number, 0 or more"
                raise InputError(
                    f"{path}, line {line}: {name} = {text[:40]!r} must be {requirement}"
                )
            values.append(column.factor * value)
        table[name] = np.array(values)
    if not rest or not any(name in SIGMAS for name in table):
        raise InputError(f"{path} has no median: add columns such as pgv_m_s and pgv_sigma")
    if "rjb_km" not in table and len(rest) > 1:
        raise InputError(f"{path} has several rows: add the column rjb_km")
    if "rjb_km" in table and (np.diff(np.maximum(table["rjb_km"], _NEAREST_KM)) <= 0.0).any():
        raise InputError(f"{path}: rjb_km must increase from row to row")
    return table


def of_table(path: str | PathLike[str], rjb_km: Any, names: Collection[str]) -> dict[str, Ordinate]:
    """Return intensity measures at a distance: ln median and sigma, interpolated over ln R_JB.

    Args:
        path: as for :func:`read_gmm_table`.
        rjb_km: distance [km], a number or an array; None for a table of one row.
        names: the measures that are wanted; others than those that scatter are passed over.

    Raises:
        InputError: a column is missing, or a distance is outside of the table.
    """
    table = read_gmm_table(path)
    distances = table.get("rjb_km", np.empty(0))
    if distances.size > 1 and rjb_km is None:
        raise InputError(f"{path} has several distances: give rjb_km", fields=("rjb_km",))
    if not distances.size and rjb_km is not None:
        raise InputError(f"{path} has no column rjb_km: omit the distance", fields=("rjb_km",))
    at = np.asarray(distances[0] if rjb_km is None and distances.size else rjb_km, np.float64)
    if distances.size:
        low, high = distances[0] * (1.0 - 1e-9), distances[-1] * (1.0 + 1e-9)
        if ((at < low) | (at > high)).any():
            raise InputError(
                f"rjb_km is outside the range of {path}, which has {distances[0]:g} to "
                f"{distances[-1]:g} km",
                fields=("rjb_km",),
            )

    def between(column: NDArray[np.float64]) -> Any:
        if not distances.size:
            return float(column[0])
        over, place = (np.log(np.maximum(distance, _NEAREST_KM)) for distance in (distances, at))
        value = np.where(np.isnan(at), np.nan, np.interp(place, over, column))
        return float(value) if value.ndim == 0 else value

    result = {}
    for name in names:
        if name not in SIGMAS:
            continue
        for column in (name, SIGMAS[name]):
            if column not in table:
                raise InputError(f"{path} has no column {column}, which the model uses")
        sigma, tau = between(table[SIGMAS[name]]), 0.0
        if name == "pgv_m_s" and "pgv_tau" in table:
            tau = between(table["pgv_tau"])
        within = np.sqrt(np.maximum(sigma * sigma - tau * tau, 0.0))
        median = np.exp(between(np.log(table[name])))
        single = np.ndim(median) == 0
        result[name] = Ordinate(
            float(median) if single else median, tau, float(within) if single else within
        )
    return result
