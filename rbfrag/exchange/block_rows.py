"""Tables of blocks as commands read them: the blocks, and the rows that cannot be used."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_table import (
    BLOCK_COLUMNS,
    FRICTION,
    NUMBERS,
    RECTANGLE,
    SIGMAS,
    is_of_rectangles,
    read_cells,
    rectangle_columns,
    rectangle_reasons,
    sliding_reasons,
)
from rbfrag.files import as_path
from rbfrag.fragility.lookup import block_of
from rbfrag.fragility.methods import TOPPLING_BLOCK
from rbfrag.fragility.unusable import block_reasons, refuse, unusable_in_words
from rbfrag.solver.kinds import KINDS, facts_of

Columns = Mapping[str, NDArray[Any]]

PLACE = ("lon", "lat")
"""Columns of where blocks stand [deg]."""

TEXTS = ("block_id", "site_id", "kind", "mode")
"""Columns of texts."""

PORTFOLIO = ("count", "weight", "loss", "loss_sigma")
"""Columns of how many like blocks a row is, what a failure counts and costs, and its scatter."""

IF_EMPTY = {**dict.fromkeys((*SIGMAS, "loss_sigma"), 0.0), "count": 1.0, "weight": 1.0}
"""What an empty cell of a column stands for."""


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
) -> BlockRows:
    """Return the blocks of a table, and its rows that cannot be used, each with its reason.

    Args:
        source: file (.csv, .xlsx, .parquet), GeoJSON, or columns by name, with ``p2_1_s2`` [1/s²]
            and ``kr``, or ``height_m`` and ``width_m`` (and ``dip_deg``); and, if it has them,
            ``block_id``, ``site_id``, ``kind``, ``mode``, ``restitution``, ``p2_sigma``,
            ``kr_sigma`` and the columns that are read.
        kind: kind of the rows that state none, None for toppling; of a free-standing kind
            rectangles are not backed by a slope.
        reads: which of ``lon`` and ``lat`` [deg], ``weight``, ``count``, ``loss`` and
            ``loss_sigma`` the answer needs; what is wrong with others is no concern.
        one_kind: all are answered as of that kind: rows that state another cannot be used.

    Raises:
        InputError: the file cannot be read, or no row of it can be used.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    if isinstance(source, BlockRows):
        return source
    name = "blocks"
    if not hasattr(source, "items"):
        source = as_path(source, "blocks", "a table of blocks")
        name = str(source)
    cells = read_cells(
        source,
        (*NUMBERS, *SIGMAS, *RECTANGLE, FRICTION, "restitution", *reads),
        TEXTS,
    )
    columns, size = cells.columns, len(cells.lines)
    rectangles = is_of_rectangles(columns)
    read = {*columns} if rectangles else {*columns} - {*RECTANGLE, FRICTION}
    remarks = (
        *cells.stated.remarks,
        *cells.stated.unread(cells.header, (*read, *TEXTS, *PLACE, *PORTFOLIO, "reason")),
    )
    named = "block_id" in columns
    if not named:
        columns["block_id"] = np.array([str(i + 1) for i in range(size)], dtype=object)
    default = kind or TOPPLING_BLOCK.kind
    faults = foreign_reasons(columns, default, one_kind=one_kind) | cells.faults
    kinds = np.array([each or default for each in columns.get("kind", [""] * size)], dtype=object)
    if rectangles:
        faults = rectangle_reasons(columns) | faults
        for own in dict.fromkeys(kinds.tolist()):
            slide = sliding_reasons(columns, own)
            faults = {i: text for i, text in slide.items() if kinds[i] == own} | faults
        columns |= _rectangles(columns, kinds)
    for needed in NUMBERS:
        if needed not in columns:
            raise InputError(
                f"{name}: there is no column {needed}: a table of blocks has p2_1_s2 and kr, or "
                "height_m and width_m"
            )
    if ("lon" in columns) != ("lat" in columns):
        raise InputError(f"{name}: lon and lat go together: give both columns, or neither")
    for column, value in IF_EMPTY.items():
        if column in columns:
            columns[column] = np.nan_to_num(
                columns[column], nan=value, posinf=np.inf, neginf=-np.inf
            )
    reasons = _reasons(columns, kinds)
    for i, fault in faults.items():
        reasons[i] = fault
    sound = np.asarray(reasons == "", dtype=bool)
    columns |= {"row": np.arange(size), "line": np.array(cells.lines, dtype=np.int64)}
    refused = {column: values[~sound] for column, values in columns.items()}
    blocks = {column: values[sound] for column, values in columns.items()}
    refused["reason"] = reasons[~sound]
    return BlockRows(blocks, refused, name, cells.word, named, remarks).checked()


def foreign_reasons(
    columns: Mapping[str, Any], default: str, *, one_kind: bool = True
) -> dict[int, str]:
    """Return by index which rows fail in a way that the answer says nothing about, in words.

    Args:
        columns: ``kind`` and ``mode`` of the rows, texts, if there are any.
        default: kind that answers for rows that state none.
        one_kind: it answers alone; otherwise each row's own does.
    """
    facts_of(default)  # refuses a kind that there is not
    stated = [columns[name] for name in ("kind", "mode") if name in columns]
    if not stated:
        return {}
    kinds = columns.get("kind", [""] * len(stated[0]))
    modes = columns.get("mode", [""] * len(stated[0]))

    @cache
    def why(kind: str, mode: str) -> str:
        own = kind or default
        if own not in KINDS:
            return f"kind = {own[:40]!r} is none of {', '.join(sorted(KINDS))}"
        if one_kind and own != default:
            return f"the block's kind is {own}, and the answer is for kind {default}"
        if not one_kind and block_of(_NAMES, own).kind != own:
            return f"a block of kind {own} is not described by {' and '.join(NUMBERS)}"
        if mode and mode != facts_of(own).mode:
            shown = mode[:40].replace("_", " ")
            return f"the block's mode is {shown}: the {own} model says nothing about it"
        return ""

    pairs = (
        (str(k or "").strip(), str(m or "").strip()) for k, m in zip(kinds, modes, strict=True)
    )
    return {i: reason for i, pair in enumerate(pairs) if (reason := why(*pair))}


_NAMES = TOPPLING_BLOCK.names


def _reasons(columns: Columns, kinds: NDArray[np.object_]) -> NDArray[np.object_]:
    """Return why rows cannot be used; empty texts for those that can."""
    reasons = np.full(kinds.size, "", dtype=object)
    given = {**BLOCK_COLUMNS, **{name: name for name in SIGMAS}}
    for kind in dict.fromkeys(kinds.tolist()):
        own, block = np.asarray(kinds == kind), block_of(_NAMES, kind)
        known = (*block.names, *block.options, *block.sigmas)
        values = {
            name: columns[column][own]
            for column, name in given.items()
            if column in columns and name in known
        }
        reasons[own] = block_reasons(block, values)

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
    return reasons


def _not_negative(name: str, numbers: NDArray[np.float64], i: int) -> str:
    return f"{name} = {numbers[i]:g}: give a number not below zero"


def _rectangles(columns: Columns, kinds: NDArray[np.object_]) -> dict[str, NDArray[Any]]:
    """Return the numbers of rectangles, each by its kind: those of free-standing ones differ."""
    backed = rectangle_columns(columns)
    is_free = {name for name, model in KINDS.items() if model.free_standing}
    free = np.array([kind in is_free for kind in kinds.tolist()], dtype=bool)
    if not free.any():
        return backed
    free_standing = rectangle_columns(columns, free_standing=True)
    numbers_of = {name: np.where(free, free_standing[name], backed[name]) for name in NUMBERS}
    stated = columns.get("restitution", np.full(free.size, np.nan))
    own = np.where(free & np.isnan(stated), free_standing["restitution"], stated)
    return {**numbers_of, "restitution": own}
