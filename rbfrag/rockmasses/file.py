"""Rock mass files.

TOML::

    realisations = 20000
    seed = 1

    [base]
    dip_deg = { distribution = "normal", mean = 20.0, sd = 5.0 }
    spacing_m = { distribution = "lognormal", median = 1.0, sd_ln = 0.1, low = 0.5 }

    [back]
    dip_deg = { distribution = "measured", values = [41.0, 44.5, 47.0] }
    spacing_m = 0.6
    water_m = 0.3
    drainage = "undrained"

    [friction]
    phi_deg = 40.0

    [block]
    size_factor = 1.0
    back_fracture = true

With ``[face] plane = "70/090"`` base and back may be planes in space (dip/dip direction) in the
place of their dips: ``plane = "25/102"``, a list of measured ones, or a CSV of dip and dip
direction next to the file.

CSV: the columns ``variable,distribution`` and, as needed, ``value, mean, median, sd, sd_ln, kappa,
low, high, values``, one variable a row such as ``base.dip_deg,normal``; measurements stand in
``values`` with blanks between them. A plane is a ``value``, 25/102 or the CSV of a set, or a list
in ``values``. ``realisations``, ``seed``, ``block.back_fracture`` and ``back.drainage`` are rows
with a ``value`` and no distribution.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from rbfrag.errors import InputError
from rbfrag.files import csv_rows, source_text, toml_document
from rbfrag.rockmasses.joint_sets import DRAINAGE, RockMass
from rbfrag.solver.block.planes import plane_of

COLUMNS = (
    "variable", "distribution", "value", "mean", "median", "sd", "sd_ln", "kappa", "low", "high",
    "values",
)  # fmt: skip
"""Columns of the CSV form; only the first is always needed."""

_SECTIONS = ("face", "base", "back", "friction", "block")
_PLANE = ".plane"
_LARGEST_BYTES = 10_000_000


def read_rock_mass(path: str | os.PathLike[str]) -> RockMass:
    """Read a rock mass from a TOML or CSV file.

    Args:
        path: file ending in ``.toml`` or ``.csv``.

    Raises:
        InputError: the file cannot be read or describes no rock mass; the message names the
            file and the key.
    """
    source = Path(path)
    suffix = source.suffix.lower()
    if suffix not in (".toml", ".csv"):
        raise InputError(f"{source}: unsupported rock mass file: use .toml or .csv, not {suffix!r}")
    text = source_text(source, "a rock mass", _LARGEST_BYTES)
    try:
        described = _from_csv(text) if suffix == ".csv" else _flat(toml_document(text))
        for name, value in described.items():
            is_plane = name.endswith(_PLANE) and isinstance(value, str)
            if is_plane and str(value).lower().endswith(".csv"):
                described[name] = read_planes(source.parent / str(value))
        return RockMass.of(described)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None


def read_planes(path: str | os.PathLike[str]) -> list[str]:
    """Return the planes of a CSV of dip and dip direction [deg], as texts dip/direction.

    Raises:
        InputError: the file cannot be read, or a row is no plane; the line is named.
    """
    source = Path(path)
    planes: list[str] = []
    for line, cells in csv_rows(source_text(source, "planes", _LARGEST_BYTES)):
        row = [cell.strip() for cell in cells]
        if not any(row) or row[0].startswith("#"):
            continue
        try:
            float(row[0])
        except ValueError:
            if not planes:  # a header
                continue
        try:
            planes.append("/".join(row[:2]))
            plane_of(planes[-1], "plane")
        except InputError as error:
            raise InputError(f"{source}: line {line}: {error}") from None
    return planes


def rock_mass_of_toml(text: str) -> RockMass:
    """Return the rock mass described in TOML.

    Raises:
        InputError: it is not TOML, or describes no rock mass; the message names the key.
    """
    return rock_mass_of_tables(toml_document(text))


def rock_mass_of_csv(text: str) -> RockMass:
    """Return the rock mass described in CSV.

    Raises:
        InputError: it is not CSV, or describes no rock mass; the message names the line or key.
    """
    return RockMass.of(_from_csv(text))


def rock_mass_of_tables(document: Mapping[str, object]) -> RockMass:
    """Return the rock mass described by the tables of a TOML or JSON document.

    Raises:
        InputError: they describe no rock mass; the message names the key.
    """
    return RockMass.of(_flat(document))


def _flat(document: Mapping[str, object]) -> dict[str, object]:
    """Return the keys of all tables of a document, each with its table name."""
    description: dict[str, object] = {}
    for name, content in document.items():
        if name not in _SECTIONS:
            description[name] = content
            continue
        if not isinstance(content, dict):
            raise InputError(f"{name} = {content!r} is not a table: write [{name}] and its keys")
        description |= {f"{name}.{key}": value for key, value in content.items()}
    return description


def _from_csv(text: str) -> dict[str, object]:
    description: dict[str, object] = {}
    header: list[str] = []
    for line, cells in csv_rows(text):
        row = [cell.strip() for cell in cells]
        if not any(row) or row[0].startswith("#"):
            continue
        if not header:
            header, unknown = row, [name for name in row if name not in COLUMNS]
            if "variable" not in row or unknown or len(set(row)) < len(row):
                raise InputError(
                    f"line {line}: the columns are {','.join(row)}, but a rock mass has variable "
                    f"and any of {','.join(COLUMNS[1:])}, each once"
                )
            continue
        if len(row) > len(header):
            raise InputError(f"line {line}: {len(row)} cells under {len(header)} columns")
        keys = {name: cell for name, cell in zip(header, row, strict=False) if cell}
        variable = keys.pop("variable", "")
        if variable in description:
            raise InputError(f"line {line}: {variable} is given twice")
        description[variable] = _row(keys, variable, line)
    return description


def _row(keys: dict[str, str], variable: str, line: int) -> object:
    law = keys.pop("distribution", None)
    numbers: dict[str, object] = {}
    for name, text in keys.items():
        where = f"line {line}: {variable}: {name}"
        if variable.endswith(_PLANE) and name in ("value", "values"):
            numbers["value"] = text.split() if name == "values" else text
        elif name == "values":
            numbers[name] = [_number(part, where) for part in text.split()]
        elif variable == DRAINAGE:
            numbers[name] = text
        elif text.lower() in ("true", "false"):
            numbers[name] = text.lower() == "true"
        else:
            numbers[name] = _number(text, where)
    if law is None:
        if set(numbers) != {"value"}:
            raise InputError(f"line {line}: {variable}: without a distribution give value only")
        return numbers["value"]
    return {"distribution": law, **numbers}


def _number(text: str, where: str) -> float | int:
    try:
        return int(text)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where} = {text!r} is not a number") from None
