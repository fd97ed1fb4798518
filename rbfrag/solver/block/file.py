"""Block files: outline, angles or fracture spacings, and the planes below and behind the block.

TOML holds one of the three descriptions of a block::

    alpha1_deg = -10.0        s1_m = 1.2            vertices_m = [[0, 0], [1, 0], [1, 2], [0, 2]]
    alpha3_deg = 25.0         s2_m = 0.6            heel = 0
    r3_m = 1.5                gamma_deg = 70.0      toe = 1
                                                    back = 3
                                                    gamma_deg = 90.0

and, where a command needs them, ``beta_deg``, ``phi_deg``, ``phi_back_deg``, ``kv``,
``cohesion_pa``, ``density_kg_m3``, ``water_m``, ``jrc``, ``jcs_mpa``, ``joint_length_m`` and
``back_fracture``.

CSV holds an outline: the columns ``x_m,y_m,contact``, one vertex a row in counter-clockwise
order, ``heel``, ``toe`` and ``back`` in the third column where a vertex is a contact. The other
values stand in comment lines above it, such as ``# gamma_deg = 90``.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rbfrag.errors import InputError
from rbfrag.files import csv_rows, source_text, toml_document
from rbfrag.solver.block.geometry import Block

ANGLES = ("alpha1_deg", "alpha3_deg", "r3_m")
FRACTURES = ("s1_m", "s2_m", "gamma_deg")
POLYGON = ("vertices_m", "heel", "back", "toe", "gamma_deg")
CONDITIONS = (
    "beta_deg", "phi_deg", "phi_back_deg", "kv", "back_fracture", "cohesion_pa", "density_kg_m3",
    "water_m", "jrc", "jcs_mpa", "joint_length_m",
)  # fmt: skip
"""What a file may say about the block's planes; the keywords of `stability`."""

_CONTACTS = ("heel", "back", "toe")
_LARGEST_BYTES = 1_000_000


@dataclass(frozen=True)
class BlockFile:
    """A block read from a file.

    Args:
        path: the file.
        block: the block.
        conditions: keywords of :func:`rbfrag.solver.stability.single.stability` that the file
            states.
    """

    path: str
    block: Block
    conditions: Mapping[str, Any] = field(default_factory=dict)


def read_block(path: str | os.PathLike[str], *, gamma_deg: float | None = None) -> BlockFile:
    """Return the block that a TOML or CSV file describes.

    Args:
        path: file ending in ``.toml`` or ``.csv``.
        gamma_deg: angle of the back plane for a file that does not state it [deg].

    Raises:
        InputError: the file cannot be read, or describes no block; the message names the file
            and, in a CSV, the line.
    """
    source = Path(path)
    suffix = source.suffix.lower()
    if suffix not in (".toml", ".csv"):
        raise InputError(f"{source}: unsupported block file: use .toml or .csv, not {suffix!r}")
    text = source_text(source, "a block file", _LARGEST_BYTES)
    fields = toml_document(text, source) if suffix == ".toml" else _from_csv(source, text)
    if gamma_deg is not None:
        if "gamma_deg" in fields:
            raise InputError(f"{source}: gamma_deg is in the file and given again: give it once")
        fields["gamma_deg"] = gamma_deg
    conditions = {key: fields.pop(key) for key in CONDITIONS if key in fields}
    if not isinstance(conditions.get("back_fracture", True), bool):
        raise InputError(
            f"{source}: back_fracture = {conditions['back_fracture']!r}: use true or false"
        )
    for names, make in (
        (POLYGON, Block.from_polygon),
        (ANGLES, Block.from_angles),
        (FRACTURES, Block.from_fractures),
    ):
        if set(fields) == set(names):
            try:
                return BlockFile(os.fspath(path), make(**fields), conditions)
            except InputError as error:
                raise InputError(f"{source}: {error}") from None
    accepted = {*POLYGON, *ANGLES, *FRACTURES}
    if unknown := sorted(set(fields) - accepted):
        raise InputError(
            f"{source}: unknown key {unknown[0]!r}: the keys of a block file are "
            f"{', '.join(sorted(accepted))}, {', '.join(CONDITIONS)}"
        )
    forms = " or ".join(", ".join(names) for names in (ANGLES, FRACTURES, POLYGON))
    key_list = ", ".join(sorted(fields)) or "none of them"
    raise InputError(
        f"{source}: a block is given by exactly one of {forms}; the file has {key_list}"
    )


def _from_csv(source: Path, text: str) -> dict[str, Any]:
    fields: dict[str, Any] = {"vertices_m": []}
    header: list[str] | None = None
    for line, cells in csv_rows(text, source):
        row = [cell.strip() for cell in cells]
        where = f"{source}, line {line}"
        if not any(row):
            continue
        if row[0].startswith("#"):
            _comment(fields, ",".join(cells).strip()[1:], where)
            continue
        if header is None:
            header = row
            if header != ["x_m", "y_m", "contact"]:
                raise InputError(
                    f"{where}: the columns are {','.join(row)}, but an outline has "
                    "x_m,y_m,contact (contact empty for other vertices)"
                )
            continue
        if len(row) not in (2, 3):
            raise InputError(f"{where}: {len(row)} cells instead of x_m,y_m,contact")
        if contact := row[2].lower() if len(row) == 3 else "":
            if contact not in _CONTACTS:
                raise InputError(
                    f"{where}: unknown contact {row[2]!r}: use heel, back, toe or nothing"
                )
            if contact in fields:
                raise InputError(f"{where}: a second {contact}: each contact is one vertex")
            fields[contact] = len(fields["vertices_m"])
        fields["vertices_m"].append((_number(row[0], "x_m", where), _number(row[1], "y_m", where)))
    if header is None:
        raise InputError(f"{source}: no outline: the header must be x_m,y_m,contact")
    missing = [name for name in _CONTACTS if name not in fields]
    if missing:
        raise InputError(
            f"{source}: no vertex is marked as {' or '.join(missing)} in the column contact"
        )
    return fields


def _comment(fields: dict[str, Any], text: str, where: str) -> None:
    name, separator, value = text.partition("=")
    key = name.strip()
    if not separator or not key.isidentifier():
        return
    if key not in ("gamma_deg", *CONDITIONS):
        raise InputError(
            f"{where}: unknown name {key!r}: use gamma_deg or one of {', '.join(CONDITIONS)}"
        )
    if key in fields:
        raise InputError(f"{where}: {key} is given twice")
    if key == "back_fracture":
        truth = {"true": True, "false": False}
        fields[key] = truth.get(value.strip().lower(), value.strip())
    else:
        fields[key] = _number(value, key, where)


def _number(text: str, name: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where}: {name} = {text.strip()!r} is not a number") from None
