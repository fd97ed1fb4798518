"""A table of draws: what one block may be, a row each, with weights."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_table import (
    BLOCK_COLUMNS,
    FRICTION,
    RECTANGLE,
    is_of_rectangles,
    read_columns,
    rectangle_columns,
    sliding_reasons,
)
from rbfrag.fragility.methods import TOPPLING_BLOCK

FloatArray = NDArray[np.float64]


def read_draws(path: str | os.PathLike[str]) -> tuple[dict[str, FloatArray], FloatArray]:
    """Return the draws of one block by the names of :func:`rbfrag.predict`, and their weights.

    Args:
        path: table of blocks, ``.csv`` or ``.parquet``; a column ``weight`` is read if there is
            one. Columns that are empty throughout are left out.

    Raises:
        InputError: the file cannot be read, describes no block, or weights that are none.
        MissingExtraError: a Parquet file without pyarrow.
    """
    columns: dict[str, Any] = read_columns(
        path, (), optional=(*BLOCK_COLUMNS, *RECTANGLE, FRICTION, "weight")
    )
    weight = columns.pop("weight", None)
    if is_of_rectangles(columns):
        for i, reason in sliding_reasons(columns, TOPPLING_BLOCK.kind).items():
            raise InputError(f"{path}: draw {i + 1}: {reason}")
        columns |= rectangle_columns(columns)
        columns.pop("dip_deg", None)
    drawn = {
        name: columns[column]
        for column, name in BLOCK_COLUMNS.items()
        if column in columns and not np.isnan(columns[column]).all()
    }
    if not drawn:
        raise InputError(
            f"{path}: no row says anything of a block: a table of draws has p2_1_s2 and kr, or the "
            "columns of another kind"
        )
    size = next(iter(drawn.values())).size
    return drawn, np.ones(size) if weight is None else weight
