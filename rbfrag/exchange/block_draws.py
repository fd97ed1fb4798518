"""A table of draws: samples of one uncertain block's parameters, one row each, with weights."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_table import opened_table
from rbfrag.fragility.invalid_rows import in_list
from rbfrag.question.classify import has_shape
from rbfrag.question.classify_arrays import classify_blocks
from rbfrag.vocabulary.quantities import BLOCK

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
    fields = [name for name in BLOCK if not name.endswith("_sigma")]
    with opened_table(path, (*fields, "weight"), ()) as table:
        columns, faults, lines = table.read_all()
    if faults:
        row_names = [f"{table.file.word} {lines[i]}" for i in sorted(faults)]
        raise InputError(f"{path}, {in_list(row_names, (faults[i] for i in sorted(faults)))}")
    weight = columns.pop("weight", None)
    drawn = {name: values for name, values in columns.items() if not np.isnan(values).all()}
    if not drawn:
        raise InputError(
            f"{path}: no block parameters: a table of draws must have p2_1_s2 and kr, or the "
            "columns of another kind"
        )
    size = next(iter(drawn.values())).size
    if has_shape(drawn):
        with table.named():
            blocks = classify_blocks(drawn, size, rows=True)
        for group in (*blocks.rejected, *blocks.unstable):
            raise InputError(f"{path}: draw {group.indices[0] + 1}: {group.texts()[0]}")
        if len(blocks.groups) > 1:
            kinds = " and ".join(str(group.kind) for group in blocks.groups)
            raise InputError(f"{path}: all draws of a block must have one kind, not {kinds}")
        drawn = {n: np.broadcast_to(v, (size,)) for n, v in blocks.groups[0].numbers.items()}
    return drawn, np.ones(size) if weight is None else weight
