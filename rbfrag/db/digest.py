"""Digest of each row: a hash of its values, which reveals altered rows.

Standard library only: a model that `rbfrag predict` reads can be verified without SQLAlchemy.
"""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import Any, Literal

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
