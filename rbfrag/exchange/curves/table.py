"""Hazard curves in two columns of a CSV file."""

from __future__ import annotations

import csv
import re

import numpy as np

from rbfrag.errors import InputError
from rbfrag.hazards.curve import HazardCurve, hazard_curve, rates_from_probabilities
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

_LEVELS = {
    "pga_g": ("pga_g", 1.0),
    "pga_m_s2": ("pga_g", 1.0 / STANDARD_GRAVITY_M_S2),
    "pgv_m_s": ("pgv_m_s", 1.0),
    "pgv_cm_s": ("pgv_m_s", 0.01),
}
_SPECTRAL = re.compile(r"sa\(([0-9.]+)\)_g")
_POE = re.compile(r"poe_([0-9.]+)_years?")

HEADER_HELP = (
    "the first line names both columns with their unit: pga_g, pga_m_s2, pgv_m_s, pgv_cm_s or "
    "sa(PERIOD)_g, and annual_rate or poe_YEARS_years, such as  pgv_m_s,annual_rate"
)


def table_curves(text: str, source: str) -> list[HazardCurve]:
    """Return the curve of a two-column CSV file, as a list of one.

    The header says what the numbers are: levels ``pga_g``, ``pga_m_s2``, ``pgv_m_s``,
    ``pgv_cm_s`` or ``sa(0.5)_g``; and ``annual_rate`` [1/a] or ``poe_50_years``, the
    probability of exceedance in 50 years.

    Args:
        text: content of the file.
        source: its path, for messages.

    Raises:
        InputError: a header or a row that cannot be used, with its line.
    """
    rows = [
        (number, [cell.strip() for cell in row])
        for number, row in enumerate(csv.reader(text.splitlines()), start=1)
        if row and not row[0].lstrip().startswith("#")
    ]
    if not rows:
        raise InputError(f"{source}: there is no curve: {HEADER_HELP}")
    line, header = rows[0]
    if len(header) != 2:
        raise InputError(f"{source}, line {line}: {len(header)} columns, not two: {HEADER_HELP}")
    measure, factor, period = _levels(header[0].lower(), f"{source}, line {line}")
    years = _years(header[1].lower(), f"{source}, line {line}")
    levels, values = [], []
    for number, row in rows[1:]:
        if len(row) != 2:
            raise InputError(f"{source}, line {number}: {len(row)} cells, not two")
        try:
            levels.append(factor * float(row[0]))
            values.append(float(row[1]))
        except ValueError:
            raise InputError(
                f"{source}, line {number}: {','.join(row)!r} are not two numbers"
            ) from None
        if years is not None and not 0.0 <= values[-1] <= 1.0:
            raise InputError(
                f"{source}, line {number}: {values[-1]:g} is no probability: {header[1]} lies "
                "between 0 and 1"
            )
    rates = np.array(values)
    if years is not None:
        with np.errstate(divide="ignore"):
            rates = rates_from_probabilities(rates, years)
    return [hazard_curve(measure, levels, rates, source=source, period_s=period)]


def _levels(name: str, where: str) -> tuple[str, float, float | None]:
    if name in _LEVELS:
        return *_LEVELS[name], None
    match = _SPECTRAL.fullmatch(name)
    if match:
        return "sa_g", 1.0, float(match.group(1))
    raise InputError(f"{where}: column {name!r} is not known: {HEADER_HELP}")


def _years(name: str, where: str) -> float | None:
    if name == "annual_rate":
        return None
    match = _POE.fullmatch(name)
    if match and float(match.group(1)) > 0.0:
        return float(match.group(1))
    raise InputError(
        f"{where}: column {name!r} does not say whether it is a rate or a probability: "
        + HEADER_HELP
    )
