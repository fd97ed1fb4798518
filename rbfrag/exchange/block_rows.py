"""Tables of blocks as read by the commands: the blocks, the rejected rows, and draws of a block."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange.block_table import TEXTS, opened_table
from rbfrag.files import as_path
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.fragility.model_selection import block_of
from rbfrag.fragility.validation import describe_invalid, in_list, reject, reject_elements
from rbfrag.question.classify import classify_block, has_shape, kinds_by_numbers, numbers_in
from rbfrag.question.classify_arrays import classify_blocks
from rbfrag.question.drained_bound import is_wet, without_water
from rbfrag.question.predict_arrays import block_reasons_of, blocks_of_arrays
from rbfrag.question.shape_validation import OF_A_SHAPE, PLANE_TEXTS
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.solver.kinds import KINDS, facts_of
from rbfrag.vocabulary.quantities import BLOCK, BY_ROW, NUMBERS, column_of

Columns = Mapping[str, NDArray[Any]]

PLACE = ("lon", "lat")
"""Columns of where blocks stand [deg]."""

PORTFOLIO = ("count", "weight", "loss", "loss_sigma")
"""Columns of how many like blocks a row is, what a failure counts and costs, and its scatter."""


@dataclass(frozen=True, eq=False)
class BlockRows:
    """The blocks of a table that are stable at rest, and its rejected rows.

    Args:
        columns: columns of all rows; ``block_id`` are texts, numbers from 1 on where there are
            none, ``row`` the index in the table, ``line`` the number in the file.
        reasons: why rows cannot be used, empty texts for blocks.
        source: what messages call the table.
        word: what ``line`` counts: lines, rows or features.
        named: whether the table names its blocks.
        remarks: which columns are converted, and which are not read.
        wet: behind which rows water stands, shape (m,); None for none.
    """

    columns: Columns
    reasons: NDArray[np.object_]
    source: str
    word: str
    named: bool
    remarks: tuple[str, ...] = ()
    wet: NDArray[np.bool_] | None = None

    @cached_property
    def blocks(self) -> Columns:
        """Columns of the usable blocks."""
        sound = self.reasons == ""
        return {name: column[sound] for name, column in self.columns.items()}

    @cached_property
    def rejected(self) -> Columns:
        """Columns of the rejected rows, with their ``reason``."""
        wrong = self.reasons != ""
        columns = {**self.columns, "reason": self.reasons}
        return {name: column[wrong] for name, column in columns.items()}

    @property
    def row_labels(self) -> list[str]:
        """Positions of the rejected rows: "line 3 (block A7)"."""
        lines, names = self.rejected["line"].tolist(), self.rejected["block_id"].tolist()
        return [
            f"{self.word} {line}" + (f" (block {name})" if self.named and name else "")
            for line, name in zip(lines, names, strict=True)
        ]

    @property
    def rejected_count(self) -> int:
        """Number of rejected rows."""
        return int(self.rejected["row"].size)

    def without(self, wrong: NDArray[np.bool_], reason: Callable[[int], str]) -> BlockRows:
        """Return the table with additional rejected rows.

        Args:
            wrong: which of the blocks, shape (m,).
            reason: why, by the index among the blocks.

        Raises:
            InputError: no block is left.
        """
        if not wrong.any():
            return self
        reasons = self.reasons.copy()
        rows = np.flatnonzero(wrong)
        reasons[self.blocks["row"][rows]] = [reason(i) for i in rows.tolist()]
        return replace(self, reasons=reasons).checked()

    def checked(self) -> BlockRows:
        """Return the table itself; reject one without usable blocks, or with zero total weight."""
        if not self.reasons.size:
            raise InputError(NO_BLOCK.format(self.source))
        if self.rejected_count == self.reasons.size:
            self._reject("")
        weight = self.blocks.get("weight")
        if weight is not None and not weight.sum() > 0.0:
            raise InputError(f"{self.source}: the weights of the blocks sum to zero")
        return self

    def require_all(self, why: str = "all of them are needed") -> Columns:
        """Return the blocks of a table, or reject it if any row is rejected.

        Args:
            why: the reason for which the others do not do.
        """
        if self.rejected_count:
            self._reject(why)
        return self.blocks

    def describe_invalid(self, effect: str = "") -> tuple[str, ...]:
        """Return the warnings about the columns and the rejected rows.

        Args:
            effect: what becomes of these rows in numbers of several blocks.
        """
        reasons = self.rejected["reason"].tolist()
        total = self.reasons.size
        unusable = describe_invalid(self.rejected_count, total, self.row_labels, reasons, effect)
        return (*self.remarks, *unusable)

    def with_rejected(
        self, answers: Columns, row: NDArray[np.int_] | None = None
    ) -> dict[str, NDArray[Any]]:
        """Return a table of answers with the rejected rows inserted, in the order of the table.

        Args:
            answers: columns, a row for each block; NaN of those that cannot be used.
            row: index in the table of the block of each answer; None for all blocks.
        """
        if not self.rejected_count:
            return dict(answers)
        row = self.blocks["row"] if row is None else row
        order = np.argsort(np.concatenate([row, self.rejected["row"]]), kind="stable")
        empty = {"f": np.nan, "b": False, "O": ""}
        columns = {}
        for name, column in answers.items():
            nothing = np.full(self.rejected_count, empty[column.dtype.kind], dtype=column.dtype)
            columns[name] = np.concatenate([column, self.rejected.get(name, nothing)])[order]
        return columns

    def rejected_by_row(self) -> dict[int, dict[str, str]]:
        """Return ``block_id``, ``site_id`` and ``reason`` of the rejected rows, by row."""
        names = [name for name in ("block_id", "site_id", "reason") if name in self.rejected]
        rows = enumerate(self.rejected["row"].tolist())
        return {row: {name: self.rejected[name][i] for name in names} for i, row in rows}

    def _reject(self, why: str) -> NoReturn:
        reasons = self.rejected["reason"].tolist()
        reject(self.source, self.row_labels, reasons, self.reasons.size, why)


NO_BLOCK = "{}: there is no block in the file"

Blocks = str | os.PathLike[str] | Mapping[str, Any] | BlockRows
"""A table of blocks: its file, its columns by name, such as a pandas table, or as it was read."""


def read_blocks(
    source: Blocks,
    kind: str | None = None,
    *,
    reads: Collection[str] = (*PLACE, *PORTFOLIO),
    one_kind: bool = False,
    need_kind: str = "",
    for_all: Mapping[str, Any] | None = None,
    sheet: str | None = None,
    ignore_columns: Sequence[str] = (),
    crs: str | None = None,
    dry: bool = False,
) -> BlockRows:
    """Return the blocks of a table, and its rejected rows with their reasons.

    Args:
        source: file (.csv, .xlsx, .parquet), GeoJSON, or columns by name: fields of blocks under
            any of their names, by numbers or by shape, dip and friction; and, if it has them,
            ``block_id``, ``site_id``, ``kind``, ``mode`` and the columns that are read.
        kind: kind of the rows that state none; None for what they are given by.
        reads: which of ``lon`` and ``lat`` [deg], ``weight``, ``count``, ``loss``,
            ``loss_sigma`` and other columns the answer needs, and which fields of shapes are kept;
            what is wrong with others is no concern.
        one_kind: all are answered as of one kind, that which is named, or else that of most rows:
            others cannot be used.
        need_kind: why a row without a kind cannot be used; empty where it can.
        for_all: fields that are given for all blocks; a cell goes before.
        sheet: of a workbook, the name of the sheet; None for the first.
        ignore_columns: columns to ignore, whatever they are called.
        crs: coordinate reference system of x and y of rows that name none, such as EPSG:2056.
        dry: without the water behind the blocks.

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
        facts_of(kind)  # rejects a kind that there is not
    if not hasattr(source, "items"):
        source = as_path(source, "blocks", "a table of blocks")
    for_all = for_all or {}
    fields = (*BLOCK, *BY_ROW)
    of_place = ("x", "y") if {*PLACE} <= {*reads} else ()
    with opened_table(
        source, (*fields, *reads, *of_place), TEXTS, sheet=sheet, ignore_columns=ignore_columns
    ) as table:
        table.check(for_all, kind)
        columns, faults, lines = table.read_all()
    name, size = table.name, len(lines)
    values: dict[str, Any] = {field: columns.pop(field) for field in fields if field in columns}
    for field in PLANE_TEXTS:
        if field in columns or field in for_all:
            cells = columns.pop(field, np.full(size, "", dtype=object))
            values[field] = np.where(cells == "", for_all.get(field, ""), cells)
    for field, value in for_all.items():
        if field not in PLANE_TEXTS:
            cells = values.get(field, np.full(size, np.nan))
            values[field] = np.where(np.isnan(cells), value, cells)
    if dry:
        values = without_water(values)
    if of_place and "x" in table.header.columns:
        _place_on_map(columns, crs, name)
    if ("lon" in columns) != ("lat" in columns):
        raise InputError(f"{name}: lon and lat are required together: give both columns or neither")
    named = "block_id" in columns
    if not named:
        columns["block_id"] = np.array([str(i + 1) for i in range(size)], dtype=object)
    kinds = [cell or kind or "" for cell in columns.get("kind", [""] * size)]
    modes = columns["mode"].tolist() if "mode" in columns else None
    with table.named():
        blocks = classify_blocks(values, size, kinds=kinds, modes=modes, rows=True)
    table.check_read(for_all, blocks.read)
    reasons = block_reasons_of(blocks, size)
    if need_kind:
        reasons[np.array([not text for text in kinds], dtype=np.bool_)] = need_kind
    columns |= {
        column_of(field): numbers.copy()
        for field, numbers in values.items()
        if (field in reads and field not in columns)
        or (field in (*NUMBERS, *blocks.read) and field not in OF_A_SHAPE)
    }
    for group in blocks.groups:
        for field, numbers in group.numbers.items():
            column = columns.setdefault(column_of(field), np.full(size, np.nan))
            column[group.indices] = numbers
    assert blocks.kinds is not None
    columns["kind"] = np.array([*KINDS, ""], dtype=object)[blocks.kinds]
    answered_kinds = columns["kind"][reasons == ""]
    if one_kind and answered_kinds.size:
        answer_kind = kind or Counter(answered_kinds.tolist()).most_common(1)[0][0]
        for i in np.flatnonzero((reasons == "") & (columns["kind"] != answer_kind)).tolist():
            row_kind = columns["kind"][i]
            reasons[i] = f"the block's kind is {row_kind}, and the answer is for kind {answer_kind}"

    def reject_rows(wrong: NDArray[np.bool_], text: str, *names: str) -> None:
        for i in np.flatnonzero(wrong & (reasons == "")).tolist():
            reasons[i] = text.format(*(columns[name][i] for name in names))

    if "lon" in columns:
        on_map = (np.abs(columns["lon"]) <= 180.0) & (np.abs(columns["lat"]) <= 90.0)
        reject_rows(~on_map, "lon = {:g}, lat = {:g} is no place on the map", *PLACE)
    for field in PORTFOLIO:
        if field in columns:
            wrong = (columns[field] < 0.0) | (columns[field] == np.inf)
            reject_rows(wrong, field + " = {:g}: give a number not below zero", field)
    if (count := columns.get("count")) is not None:
        hint = "give the number of like blocks, a whole number from 1 on, or a weight"
        reject_rows((count < 1.0) | (count != np.rint(count)), f"count = {{:g}}: {hint}", "count")
    for i, fault in faults.items():
        reasons[i] = fault
    used = {*blocks.read, *TEXTS, *PLACE, *PORTFOLIO, *reads, *of_place}
    remarks = diagnostics(blocks.remarks, table.warnings(used))
    columns |= {"row": np.arange(size), "line": np.array(lines, dtype=np.int64)}
    wet = values["water_m"] > 0.0 if is_wet(values) else None
    return BlockRows(columns, reasons, name, table.file.word, named, remarks, wet).checked()


def _place_on_map(columns: dict[str, NDArray[Any]], crs: str | None, source: str) -> None:
    """Enter ``lon`` and ``lat`` [deg] of rows that have x and y in a coordinate reference system.

    Raises:
        InputError: no system, or one that is not known.
        MissingExtraError: pyproj is not installed.
    """
    if "y" not in columns:
        raise InputError(f"{source}: x and y are required together: give both columns or neither")
    x, y = columns["x"], columns["y"]
    systems = np.array(columns.get("crs", np.full(x.size, "", dtype=object)), dtype=object)
    systems[systems == ""] = crs or ""
    placed = ~np.isnan(x) & ~np.isnan(y)
    if (placed & (systems == "")).any():
        raise InputError(
            f"{source}: x and y require a coordinate reference system: add a column crs, or use "
            "crs, such as crs EPSG:2056",
            fields=("crs",),
        )
    try:
        from pyproj import Transformer
        from pyproj.exceptions import CRSError, ProjError
    except ImportError:
        raise MissingExtraError("Projected coordinates require pyproj", "gis") from None
    lon, lat = (columns.setdefault(name, np.full(x.size, np.nan)) for name in PLACE)
    for system in dict.fromkeys(systems[placed].tolist()):
        rows = np.flatnonzero(placed & (systems == system) & np.isnan(lon))
        try:
            to_map = Transformer.from_crs(system, "EPSG:4326", always_xy=True)
            lon[rows], lat[rows] = to_map.transform(x[rows], y[rows], errcheck=True)
        except (CRSError, ProjError):
            raise InputError(
                f"{source}: crs {system[:40]!r} is unknown or does not cover these coordinates: "
                "give a code such as EPSG:2056",
                fields=("crs",),
            ) from None


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
    numbers = numbers_in(rows.blocks)
    sigmas = [name for name in numbers if name.endswith("_sigma")]
    fields = {n: v for n, v in numbers.items() if n not in sigmas and not np.isnan(v).all()}
    block = block_of(fields, kind)
    used_fields = {n: fields[n] for n in fields if n in (*block.names, *block.options)}
    ignored = tuple(name for name in sigmas if np.nan_to_num(numbers[name]).any())
    if not ignored:
        return kind, used_fields, ()
    text = (
        f"{' and '.join(ignored)} of the blocks are not integrated here: each block is assumed to "
        "be its median (predict, survival and losses integrate)"
    )
    return kind, used_fields, (Diagnostic(text, "medians_assumed", fields=ignored),)


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
