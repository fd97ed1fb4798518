"""Weights of the branches of a logic tree: numbers, or OpenQuake's table of realizations."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

from rbfrag.errors import InputError
from rbfrag.files import csv_rows, source_text
from rbfrag.hazards.curve import HazardCurve

COLUMNS = ("rlz_id", "weight")
"""What a table of realizations must have; its other column, branch_path, is not read."""

_REALIZATION = re.compile(r"rlz-0*(\d+)")


def realization_weights(
    path: str | os.PathLike[str], curves: Sequence[HazardCurve]
) -> list[float | None]:
    """Return the weight of each curve by OpenQuake's realizations file; None for no branch.

    Args:
        path: CSV with ``rlz_id`` and ``weight``, lines that begin with # left out.

    Raises:
        InputError: the file is none of realizations, or lacks that of a curve.
    """
    text = source_text(path, "the realizations of a logic tree")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    header, *rows = [cells for _, cells in csv_rows("\n".join(lines), path)] or [[]]
    weights: dict[int, float] = {}
    for cells in rows:
        row = dict(zip(header, cells, strict=False))
        try:
            weights[int(row["rlz_id"])] = float(row["weight"])
        except (KeyError, ValueError):
            raise InputError(
                f"{path}: {','.join(cells)[:80]!r} is no realization: the columns rlz_id and "
                "weight hold numbers"
            ) from None
    branches = [_REALIZATION.fullmatch(curve.statistic) for curve in curves]
    if not any(branches):
        raise InputError(
            f"{path} has weights of realizations, and none of the curves is one (kind='rlz-001'): "
            "give the curves of the realizations"
        )
    numbers = [None if match is None else int(match.group(1)) for match in branches]
    for number in numbers:
        if number is not None and number not in weights:
            raise InputError(f"{path}: there is no rlz_id {number}, and a curve is of it")
    return [None if number is None else weights[number] for number in numbers]


Weights = Sequence[float | None] | str | os.PathLike[str]
"""Weights of branches in the order of the curves, or OpenQuake's file of them."""


def stated_weights(
    given: Weights | None, curves: Sequence[HazardCurve]
) -> Sequence[float | None] | None:
    """Return the weight of each curve, None where none are given.

    Args:
        given: numbers in the order of the curves, also as text: 0.5,0.3,0.2; or the name of a file
            of realizations.
    """
    if not isinstance(given, str | os.PathLike):
        return given
    try:
        return [float(part) for part in os.fspath(given).split(",")]
    except ValueError:
        return realization_weights(given, curves)
