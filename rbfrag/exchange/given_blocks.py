"""The blocks of an answer, by their fields or as a table, and what a model reads of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import BlockRows, Blocks, read_blocks
from rbfrag.fragility.lookup import block_of
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.fragility.unusable import refuse_elements
from rbfrag.question.answers import block_reasons_of, blocks_of_arrays
from rbfrag.question.blocks import (
    has_shape,
    kinds_by_numbers,
    numbers_in,
    one_block,
    taken_as_medians,
)
from rbfrag.vocabulary.quantities import BLOCK, column_of


def given_blocks(
    given: Mapping[str, Any],
    blocks: Blocks | None,
    *,
    reads: Sequence[str] = (),
    one_kind: bool = True,
) -> BlockRows:
    """Return the blocks of a question.

    Raises:
        InputError: blocks given in no way or in two, or none that waits for an earthquake.
    """
    known = dict(given)
    kind = known.pop("kind", None)
    if blocks is not None:
        if known:
            raise InputError(f"blocks describes the blocks: omit {' and '.join(known)}")
        return read_blocks(blocks, kind, reads=reads, one_kind=one_kind)
    if not has_shape(known) and not kinds_by_numbers(known):
        missing = next((name for name in TOPPLING_BLOCK.names if name not in known), "p2")
        raise InputError(f"{missing} is missing: give p2 and kr, or a table of blocks")
    if {"block", "back_fracture"} & {*known}:
        described = one_block(known, kind)
        (group,) = described.groups
        rows = given_blocks({**group.numbers, "kind": group.kind}, None, reads=reads)
        return replace(rows, remarks=described.remarks)
    reasons = block_reasons_of(*blocks_of_arrays(given))
    refuse_elements(reasons, fields=BLOCK)
    try:
        arrays = np.broadcast_arrays(*map(np.atleast_1d, known.values()))
    except ValueError:
        raise InputError(f"{', '.join(known)} differ in length") from None
    columns = {column_of(name): each for name, each in zip(known, arrays, strict=True)}
    return read_blocks(columns, kind, reads=reads, one_kind=one_kind)


def read_by_models(rows: BlockRows) -> tuple[str, dict[str, Any], tuple[str, ...]]:
    """Return the kind of blocks of one kind, the numbers that its models read, and what is said."""
    kind = str(rows.blocks["kind"][0])
    stated, remarks = taken_as_medians(numbers_in(rows.blocks))
    known = {name: values for name, values in stated.items() if not np.isnan(values).all()}
    block = block_of(known, kind)
    return kind, {n: known[n] for n in known if n in (*block.names, *block.options)}, remarks
