"""Tables of blocks as commands read them: the blocks, and the rows that cannot be used."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_table import BLOCK_FIELDS, read_cells
from rbfrag.files import as_path
from rbfrag.fragility.methods import TOPPLING_BLOCK
from rbfrag.fragility.unusable import refuse, unusable_in_words
from rbfrag.question.answers import block_reasons_of
from rbfrag.question.blocks import NUMBERS, OF_A_SHAPE, SHAPES, kinds_by_numbers, many_blocks
from rbfrag.question.fields import column_of
from rbfrag.solver.kinds import KINDS, facts_of

Columns = Mapping[str, NDArray[Any]]

PLACE = ("lon", "lat")
"""Columns of where blocks stand [deg]."""

TEXTS = ("block_id", "site_id", "kind", "mode")
"""Columns of texts."""

PORTFOLIO = ("count", "weight", "loss", "loss_sigma")
"""Columns of how many like blocks a row is, what a failure counts and costs, and its scatter."""

IF_EMPTY = {"loss_sigma": 0.0, "count": 1.0, "weight": 1.0}
"""What an empty cell of a column stands for."""

_SIDES = frozenset(OF_A_SHAPE)
"""Fields that answers do not read but by the numbers of a block."""


@dataclass(frozen=True, eq=False)
class BlockRows:
    """The blocks of a table that wait for an earthquake, and its rows that cannot be used.

    Args:
        blocks: columns of the blocks; ``block_id`` are texts, numbers from 1 on where there are
            none, ``row`` the index in the table, ``line`` the number in the file.
        refused: the same columns of the other rows, and their ``reason``.
        source: what messages call the table.
        word: what ``line`` counts: lines, rows or features.
        named: whether the table names its blocks.
        remarks: which columns are converted, and which are not read.
    """

    blocks: Columns
    refused: Columns
    source: str
    word: str
    named: bool
    remarks: tuple[str, ...] = ()

    @property
    def places(self) -> list[str]:
        """Where the rows that cannot be used stand: "line 3 (block A7)"."""
        lines, names = self.refused["line"].tolist(), self.refused["block_id"].tolist()
        return [
            f"{self.word} {line}" + (f" (block {name})" if self.named and name else "")
            for line, name in zip(lines, names, strict=True)
        ]

    @property
    def refused_count(self) -> int:
        """Number of rows that cannot be used."""
        return int(self.refused["row"].size)

    @property
    def size(self) -> int:
        """Number of rows."""
        return int(self.blocks["row"].size) + self.refused_count

    def without(self, wrong: NDArray[np.bool_], reason: Callable[[int], str]) -> BlockRows:
        """Return the table with some more of its rows refused.

        Args:
            wrong: which of the blocks, shape (m,).
            reason: why, by the index among the blocks.

        Raises:
            InputError: no block is left.
        """
        if not wrong.any():
            return self
        reasons = [reason(i) for i in np.flatnonzero(wrong).tolist()]
        more = {name: column[wrong] for name, column in self.blocks.items()}
        more["reason"] = np.array(reasons, dtype=object)
        refused = {
            name: np.concatenate([column, more[name]]) for name, column in self.refused.items()
        }
        order = np.argsort(refused["row"], kind="stable")
        return replace(
            self,
            blocks={name: column[~wrong] for name, column in self.blocks.items()},
            refused={name: column[order] for name, column in refused.items()},
        ).checked()

    def checked(self) -> BlockRows:
        """Return the table itself, or refuse one without a block, or of blocks without weight."""
        if not self.size:
            raise InputError(f"{self.source}: there is no block in the file")
        if self.refused_count == self.size:
            self._refuse("")
        weight = self.blocks.get("weight")
        if weight is not None and not weight.sum() > 0.0:
            raise InputError(f"{self.source}: the weights of the blocks sum to zero")
        return self

    def whole(self, why: str = "all of them are needed") -> Columns:
        """Return the blocks of a table whose rows all can be used, or refuse it.

        Args:
            why: the reason for which the others do not do.
        """
        if self.refused_count:
            self._refuse(why)
        return self.blocks

    def unusable_in_words(self, effect: str = "") -> tuple[str, ...]:
        """Return what is to be said of the columns, and of the rows that cannot be used.

        Args:
            effect: what becomes of these rows in numbers of several blocks.
        """
        reasons = self.refused["reason"].tolist()
        unusable = unusable_in_words(self.refused_count, self.size, self.places, reasons, effect)
        return (*self.remarks, *unusable)

    def with_refused(
        self, answers: Columns, row: NDArray[np.int_] | None = None
    ) -> dict[str, NDArray[Any]]:
        """Return a table of answers with the rows that cannot be used, in the order of the table.

        Args:
            answers: columns, a row for each block; NaN of those that cannot be used.
            row: index in the table of the block of each answer; None for all blocks.
        """
        if not self.refused_count:
            return dict(answers)
        row = self.blocks["row"] if row is None else row
        order = np.argsort(np.concatenate([row, self.refused["row"]]), kind="stable")
        empty = {"f": np.nan, "b": False, "O": ""}
        columns = {}
        for name, column in answers.items():
            nothing = np.full(self.refused_count, empty[column.dtype.kind], dtype=column.dtype)
            columns[name] = np.concatenate([column, self.refused.get(name, nothing)])[order]
        return columns

    def refused_by_row(self) -> dict[int, dict[str, str]]:
        """Return ``block_id``, ``site_id`` and ``reason`` of what cannot be used, by its row."""
        names = [name for name in ("block_id", "site_id", "reason") if name in self.refused]
        texts = zip(*(self.refused[name].tolist() for name in names), strict=True)
        return {
            row: dict(zip(names, each, strict=True))
            for row, each in zip(self.refused["row"].tolist(), texts, strict=True)
        }

    def _refuse(self, why: str) -> NoReturn:
        refuse(self.source, self.places, self.refused["reason"].tolist(), self.size, why)


Blocks = str | os.PathLike[str] | Mapping[str, Any] | BlockRows
"""A table of blocks: its file, its columns by name, such as a pandas table, or as it was read."""


def waiting_blocks(source: Blocks, kind: str | None = None) -> Columns:
    """Return the blocks of a table whose rows all can be used; see :func:`read_blocks`."""
    return read_blocks(source, kind).whole()


def read_blocks(
    source: Blocks,
    kind: str | None = None,
    *,
    reads: Collection[str] = (*PLACE, *PORTFOLIO),
    one_kind: bool = False,
    only: Collection[str] = (),
    for_all: Mapping[str, float] | None = None,
) -> BlockRows:
    """Return the blocks of a table, and its rows that cannot be used, each with its reason.

    Args:
        source: file (.csv, .xlsx, .parquet), GeoJSON, or columns by name: fields of blocks under
            any of their names, by numbers or by shape, dip and friction; and, if it has them,
            ``block_id``, ``site_id``, ``kind``, ``mode`` and the columns that are read.
        kind: kind of the rows that state none; None for what they are given by.
        reads: which of ``lon`` and ``lat`` [deg], ``weight``, ``count``, ``loss`` and
            ``loss_sigma`` the answer needs; what is wrong with others is no concern.
        one_kind: all are answered as of one kind, that which is named, or else that of most rows:
            others cannot be used.
        only: numbers that the answer reads of a block; () for those of every kind.
        for_all: fields that are stated of all blocks; a cell goes before.

    Returns:
        The blocks, by the columns of the numbers that their kinds read, NaN where a kind does not,
        and ``kind``.

    Raises:
        InputError: the file cannot be read, or no row of it can be used.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    if isinstance(source, BlockRows):
        return source
    if kind is not None:
        facts_of(kind)  # refuses a kind that there is not
    name = "blocks"
    if not hasattr(source, "items"):
        source = as_path(source, "blocks", "a table of blocks")
        name = str(source)
    cells = read_cells(source, (*BLOCK_FIELDS, *reads), TEXTS)
    columns, size = cells.columns, len(cells.lines)
    values = {f: columns.pop(c) for c, f in BLOCK_FIELDS.items() if c in columns}
    for field in values:
        if field.endswith("_sigma"):
            values[field] = np.nan_to_num(values[field], nan=0.0, posinf=np.inf, neginf=-np.inf)
    for field, value in (for_all or {}).items():
        own = values.get(field, np.full(size, np.nan))
        values[field] = np.where(np.isnan(own), value, own)
    if not kinds_by_numbers(values) and not any(values.keys() >= {*shape} for shape in SHAPES):
        missing = next(column_of(n) for n in TOPPLING_BLOCK.names if n not in values)
        raise InputError(
            f"{name}: there is no column {missing}: a table of blocks has p2_1_s2 and kr, or "
            "height_m and width_m, or the numbers of another kind"
        )
    if ("lon" in columns) != ("lat" in columns):
        raise InputError(f"{name}: lon and lat go together: give both columns, or neither")
    named = "block_id" in columns
    if not named:
        columns["block_id"] = np.array([str(i + 1) for i in range(size)], dtype=object)
    for column, value in IF_EMPTY.items():
        if column in columns:
            columns[column] = np.nan_to_num(
                columns[column], nan=value, posinf=np.inf, neginf=-np.inf
            )
    kinds = [str(each or "").strip() or kind or "" for each in columns.get("kind", [""] * size)]
    modes = columns["mode"].tolist() if "mode" in columns else None
    blocks = many_blocks(values, size, kinds=kinds, modes=modes, rows=True)
    for field in for_all or ():
        if field not in blocks.read:
            raise InputError(f"{field} does not go with the blocks of {name}", fields=(field,))
    reasons = block_reasons_of(blocks, size)
    known = {column_of(n): v for n, v in values.items() if n in (*NUMBERS, *blocks.read)}
    known = {column: v.copy() for column, v in known.items() if BLOCK_FIELDS[column] not in _SIDES}
    for group in blocks.groups:
        for field, value in group.numbers.items():
            column = column_of(field)
            known.setdefault(column, np.full(size, np.nan))[group.places] = value
    columns |= known
    assert blocks.kinds is not None
    columns["kind"] = np.array([*KINDS, ""], dtype=object)[blocks.kinds]
    _refuse_kinds(columns["kind"], reasons, kind, one_kind=one_kind, only=only)
    _refuse_columns(columns, reasons)
    for i, fault in cells.faults.items():
        reasons[i] = fault
    read = {*map(column_of, blocks.read), *TEXTS, *PLACE, *PORTFOLIO, "reason"}
    remarks = (
        *blocks.remarks,
        *cells.stated.remarks,
        *cells.stated.unread(cells.header, read),
    )
    sound = np.asarray(reasons == "", dtype=bool)
    columns |= {"row": np.arange(size), "line": np.array(cells.lines, dtype=np.int64)}
    refused = {column: values[~sound] for column, values in columns.items()}
    usable = {column: values[sound] for column, values in columns.items()}
    refused["reason"] = reasons[~sound]
    return BlockRows(usable, refused, name, cells.word, named, remarks).checked()


def _refuse_kinds(
    kinds: NDArray[np.object_],
    reasons: NDArray[np.object_],
    kind: str | None,
    *,
    one_kind: bool,
    only: Collection[str],
) -> None:
    """Say of rows whose kind the answer is not for why they cannot be used."""
    usable = np.asarray(reasons == "", dtype=bool)
    if only:
        for own in dict.fromkeys(kinds[usable].tolist()):
            if {*only} - {*facts_of(own).parameters}:
                reasons[usable & (kinds == own)] = (
                    f"a block of kind {own} is not described by {' and '.join(only)}"
                )
    usable = np.asarray(reasons == "", dtype=bool)
    if one_kind and usable.any():
        counts = {own: int((kinds[usable] == own).sum()) for own in dict.fromkeys(kinds[usable])}
        one = kind or max(counts, key=counts.__getitem__)
        for own in counts:
            if own != one:
                reasons[usable & (kinds == own)] = (
                    f"the block's kind is {own}, and the answer is for kind {one}"
                )


def _refuse_columns(columns: Columns, reasons: NDArray[np.object_]) -> None:
    """Say of rows why their place, count, weight or loss cannot be used."""

    def say(wrong: NDArray[np.bool_], text: Callable[[int], str]) -> None:
        for i in np.flatnonzero(wrong & (reasons == "")).tolist():
            reasons[i] = text(i)

    if "lon" in columns:
        lon, lat = columns["lon"], columns["lat"]
        on_map = (np.abs(lon) <= 180.0) & (np.abs(lat) <= 90.0)
        say(~on_map, lambda i: f"lon = {lon[i]:g}, lat = {lat[i]:g} is no place on the map")
    for name in {*PORTFOLIO} & {*columns}:
        numbers = columns[name]
        wrong = (numbers < 0.0) | (numbers == np.inf)
        say(wrong, partial(_not_negative, name, numbers))
    if "count" in columns:
        count = columns["count"]
        say(
            (count < 1.0) | (count != np.rint(count)),
            lambda i: (
                f"count = {count[i]:g}: give the number of like blocks, a whole number from 1 on, "
                "or a weight"
            ),
        )


def _not_negative(name: str, numbers: NDArray[np.float64], i: int) -> str:
    return f"{name} = {numbers[i]:g}: give a number not below zero"
