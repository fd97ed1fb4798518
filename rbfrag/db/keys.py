"""Hashes: natural keys of results, and digests of rows, which reveal altered ones.

Standard library only: a model that `rbfrag predict` reads can be verified without SQLAlchemy.
"""

from __future__ import annotations

import hashlib
import json
import math
import numbers
from collections.abc import Mapping, Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING, Any, Literal

from rbfrag.errors import InputError

if TYPE_CHECKING:
    from sqlalchemy import RowMapping


def combination_key(
    *,
    p2: float | None,
    settings: Mapping[str, object],
    block: Mapping[str, object] | None = None,
    **inputs: Any,
) -> str:
    """Return the key of one combination: equal inputs give equal keys on every machine.

    Args:
        p2: block frequency parameter p² [1/s²]; None where the block needs none.
        settings: whatever else changes the answer (search limit, tolerance, ...).
        block: what else says which block it is; None where p² says all.
        inputs: `motion_sha256`, hash of the horizontal samples; `dt_s`, their interval [s];
            `vertical_sha256`, hash of the vertical samples or None; `polarity`, ``forward`` or
            ``reverse``; `kind`, the response kind; `numerics_version`, of the solver; `linear`,
            True for the linear verification model (False when left out).

    Returns:
        SHA-256 as 64 hexadecimal digits.
    """
    content = _inputs(**inputs) | {"p2": None if p2 is None else float(p2), "settings": settings}
    return _digest(content if block is None else {**content, "block": block})


def response_key(*, p2: float, kr: float, **inputs: Any) -> str:
    """Return the key of one stored response, from its block and its motion.

    Args:
        p2: block frequency parameter p² [1/s²].
        kr: rocking acceleration coefficient.
        inputs: motions, polarity, kind, numerics and model, as for :func:`combination_key`.

    Returns:
        SHA-256 as 64 hexadecimal digits.
    """
    return _digest({**_inputs(**inputs), "p2": float(p2), "kr": float(kr)})


def pair_key(
    *, first_sha256: str, first_dt_s: float, block: Mapping[str, object], **inputs: Any
) -> str:
    """Return the key of one block under two motions.

    Args:
        first_sha256: hash of the samples of the first motion.
        first_dt_s: their interval [s].
        inputs: the second motion without a vertical one, polarity, kind and numerics, as for
            :func:`combination_key`.

    Returns:
        SHA-256 as 64 hexadecimal digits.
    """
    first = {"first": first_sha256, "first_dt_s": float(first_dt_s)}
    return _digest({**_inputs(vertical_sha256=None, **inputs), **first, "block": block})


def key_of_row(
    row: Mapping[str, Any] | RowMapping, samples: Mapping[int, tuple[str, float]]
) -> str:
    """Return the natural key of a stored result from its columns.

    Args:
        row: of `combination`, `response` or `shock_pair`.
        samples: SHA-256 of the samples and their interval [s] of each motion, by row id.
    """
    inputs = {name: row[name] for name in ("polarity", "kind", "numerics_version")}
    if "first_motion_id" in row:
        first_sha256, first_dt_s = samples[row["first_motion_id"]]
        sha256, dt_s = samples[row["second_motion_id"]]
        inputs |= {"motion_sha256": sha256, "dt_s": dt_s, "block": json.loads(row["block"])}
        return pair_key(first_sha256=first_sha256, first_dt_s=first_dt_s, **inputs)
    sha256, dt_s = samples[row["motion_id"]]
    vertical_id = row["vertical_motion_id"]
    vertical_sha256 = None if vertical_id is None else samples[vertical_id][0]
    inputs |= {"motion_sha256": sha256, "dt_s": dt_s, "vertical_sha256": vertical_sha256}
    inputs |= {"linear": row["linear"], "p2": row["p2"]}
    if "settings" not in row:
        return response_key(kr=row["kr"], **inputs)
    block = None if row["block"] is None else json.loads(row["block"])
    return combination_key(settings=json.loads(row["settings"]), block=block, **inputs)


def _inputs(
    *,
    motion_sha256: str,
    dt_s: float,
    vertical_sha256: str | None,
    polarity: str,
    kind: str,
    numerics_version: str,
    linear: bool = False,
) -> dict[str, object]:
    return {
        "motion": motion_sha256,
        "dt_s": float(dt_s),
        "vertical": vertical_sha256 or "-",
        "polarity": polarity,
        "kind": kind,
        "linear": bool(linear),
        "numerics": numerics_version,
    }


def canonical_json(value: object) -> str:
    """Return canonical JSON text: sorted keys, shortest exact floats.

    Args:
        value: mappings, sequences, text, numbers (numpy's too), booleans and None.

    Raises:
        InputError: a number that is not finite, or something JSON has no word for.
    """
    storable = _storable(value)
    return json.dumps(storable, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def _digest(value: object) -> str:
    return hashlib.sha256(canonical_json(value).encode("ascii")).hexdigest()


def _storable(value: object) -> object:
    if value is None or isinstance(value, bool | str):
        return str(value) if isinstance(value, str) else value
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, numbers.Real):
        number = float(value)
        if not math.isfinite(number):
            raise InputError(f"{number} cannot be stored: numbers must be finite")
        return number
    if isinstance(value, Mapping):
        return {str(key): _storable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_storable(item) for item in value]
    raise InputError(f"{value!r} ({type(value).__name__}) cannot be stored as a setting")


ValueType = Literal["float", "integer", "boolean", "text", "bytes"]

NOT_DIGESTED = ("id", "digest")
"""Columns outside the digest: the row number, which only its insertion gives, and itself."""


def row_digests(types: Sequence[ValueType], columns: Sequence[Sequence[Any]]) -> list[int]:
    """Return the digest of each row: the first 8 bytes of a BLAKE2b hash, as a signed integer.

    It is that of the values as both databases give them back: integral numbers in a column of
    float64 are floats, -0.0 is 0.0, arrays stand for themselves by their own hash.

    Args:
        types: of the columns, in the order of the columns' names.
        columns: the values of each column, None where missing.
    """
    rows = zip(*map(_canonical, types, columns), strict=True)
    return [
        int.from_bytes(blake2b(ascii(row).encode("ascii"), digest_size=8).digest(), signed=True)
        for row in rows
    ]


def _canonical(kind: ValueType, values: Sequence[Any]) -> list[Any]:
    if kind == "float":
        return [None if v is None else float(v) + 0.0 for v in values]
    if kind == "text":
        return [None if v is None else str(v) for v in values]
    if kind == "integer":
        return [None if v is None else int(v) for v in values]
    if kind == "boolean":
        return [None if v is None else bool(v) for v in values]
    return [None if v is None else blake2b(v, digest_size=16).hexdigest() for v in values]
