"""Blocks of a question, given by fields or as a table, and the inputs that models use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import BlockRows, Blocks, read_blocks
from rbfrag.fragility.invalid_rows import reject_elements
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.fragility.model_selection import block_of
from rbfrag.question.classify import (
    classify_block,
    has_shape,
    kinds_by_numbers,
    numbers_in,
    taken_as_medians,
)
from rbfrag.question.predict_arrays import block_reasons_of, blocks_of_arrays
from rbfrag.vocabulary.quantities import BLOCK, column_of


def collect_blocks(
    inputs: Mapping[str, Any],
    blocks: Blocks | None,
    *,
    reads: Sequence[str] = (),
    one_kind: bool = True,
) -> BlockRows:
    """Return the blocks of a question, given by fields or as a table.

    Raises:
        InputError: blocks given in no way or in two, or none that waits for an earthquake.
    """
    fields = dict(inputs)
    kind = fields.pop("kind", None)
    if blocks is not None:
        if fields:
            raise InputError(f"blocks describes the blocks: omit {' and '.join(fields)}")
        return read_blocks(blocks, kind, reads=reads, one_kind=one_kind)
    if not has_shape(fields) and not kinds_by_numbers(fields):
        missing = next((name for name in TOPPLING_BLOCK.names if name not in fields), "p2")
        raise InputError(f"{missing} is missing: give p2 and kr, or a table of blocks")
    if {"block", "back_fracture"} & {*fields}:
        described = classify_block(fields, kind)
        (group,) = described.groups
        rows = collect_blocks({**group.numbers, "kind": group.kind}, None, reads=reads)
        return replace(rows, remarks=described.remarks)
    reasons = block_reasons_of(*blocks_of_arrays(inputs))
    reject_elements(reasons, fields=BLOCK)
    try:
        arrays = np.broadcast_arrays(*map(np.atleast_1d, fields.values()))
    except ValueError:
        raise InputError(f"{', '.join(fields)} differ in length") from None
    columns = {column_of(name): array for name, array in zip(fields, arrays, strict=True)}
    return read_blocks(columns, kind, reads=reads, one_kind=one_kind)


def read_by_models(rows: BlockRows) -> tuple[str, dict[str, Any], tuple[str, ...]]:
    """Return the kind of blocks of one kind, the inputs of its models, and the warnings."""
    kind = str(rows.blocks["kind"][0])
    numbers, remarks = taken_as_medians(numbers_in(rows.blocks))
    fields = {name: values for name, values in numbers.items() if not np.isnan(values).all()}
    block = block_of(fields, kind)
    return kind, {n: fields[n] for n in fields if n in (*block.names, *block.options)}, remarks
