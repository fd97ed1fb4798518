"""Natural keys: the hash of everything that decides a stored result."""

from __future__ import annotations

import hashlib
import json
import math
import numbers
from collections.abc import Mapping

from rbfrag.errors import InputError


def combination_key(
    *,
    motion_sha256: str,
    dt_s: float,
    vertical_sha256: str | None,
    polarity: str,
    kind: str,
    p2: float | None,
    settings: Mapping[str, object],
    numerics_version: str,
    linear: bool = False,
    block: Mapping[str, object] | None = None,
) -> str:
    """Return the key of one critical search: equal inputs, equal key, on every machine.

    Args:
        motion_sha256: hash of the horizontal samples.
        dt_s: their interval [s].
        vertical_sha256: hash of the vertical samples; None without vertical motion.
        polarity: ``forward`` or ``reverse``.
        kind: response kind (``toppling``).
        p2: block frequency parameter p² [1/s²]; None for sliding.
        settings: whatever else changes the answer (search limit, resolution, ...).
        numerics_version: of the solver.
        linear: True for the linear verification model.
        block: what else says which block it is; None for toppling.

    Returns:
        SHA-256 as 64 hexadecimal digits.

    Raises:
        InputError: a number that is not finite.
    """
    inputs = {
        "motion": motion_sha256,
        "dt_s": float(dt_s),
        "vertical": vertical_sha256 or "-",
        "polarity": polarity,
        "kind": kind,
        "linear": bool(linear),
        "p2": None if p2 is None else float(p2),
        "settings": settings,
        "numerics": numerics_version,
    }
    return _digest(inputs if block is None else {**inputs, "block": block})


def response_key(
    *,
    motion_sha256: str,
    dt_s: float,
    vertical_sha256: str | None,
    polarity: str,
    kind: str,
    p2: float,
    kr: float,
    numerics_version: str,
    linear: bool = False,
) -> str:
    """Return the key of one stored response: that of its block under its motion.

    Args:
        motion_sha256: hash of the horizontal samples.
        dt_s: their interval [s].
        vertical_sha256: hash of the vertical samples; None without vertical motion.
        polarity: ``forward`` or ``reverse``.
        kind: response kind (``toppling``).
        p2: block frequency parameter p² [1/s²].
        kr: rocking acceleration coefficient.
        numerics_version: of the solver.
        linear: True for the linear verification model.

    Returns:
        SHA-256 as 64 hexadecimal digits.

    Raises:
        InputError: a number that is not finite.
    """
    return _digest(
        {
            "motion": motion_sha256,
            "dt_s": float(dt_s),
            "vertical": vertical_sha256 or "-",
            "polarity": polarity,
            "kind": kind,
            "linear": bool(linear),
            "p2": float(p2),
            "kr": float(kr),
            "numerics": numerics_version,
        }
    )


def canonical_json(value: object) -> str:
    """Return JSON text that is equal for equal values: sorted keys, shortest exact floats.

    Args:
        value: mappings, sequences, text, numbers (numpy's too), booleans and None.

    Raises:
        InputError: a number that is not finite, or something JSON has no word for.
    """
    plain = _plain(value)
    return json.dumps(plain, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def _digest(value: object) -> str:
    return hashlib.sha256(canonical_json(value).encode("ascii")).hexdigest()


def _plain(value: object) -> object:
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
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    raise InputError(f"{value!r} ({type(value).__name__}) cannot be stored as a setting")
