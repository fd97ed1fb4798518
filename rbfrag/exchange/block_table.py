"""Tables of blocks: meaning of the columns, invalid cells by row, and a template to fill in."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, checked_name
from rbfrag.exchange.tables.csv_file import as_written
from rbfrag.exchange.tables.files import open_table, write_block_table
from rbfrag.exchange.tables.parts import Parts, TableFile, TablePart, cells_of
from rbfrag.exchange.tables.workbook import openpyxl
from rbfrag.files import output_path, written_whole
from rbfrag.fragility.model_selection import block_of
from rbfrag.question.classify import kinds_by_numbers
from rbfrag.question.sections import ANGLES
from rbfrag.question.shape_validation import OF_A_SHAPE, PLANE_TEXTS, RECTANGLE, SHAPES
from rbfrag.question.table import (
    Column,
    Header,
    columns_in,
    drainage_named,
    header_of,
    kinds_in,
    sounds_like,
    yes_or_no,
)
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kinds import FREE_STANDING
from rbfrag.vocabulary import quantities
from rbfrag.vocabulary.quantities import (
    BLOCK,
    BY_ROW,
    FAILURE,
    INPUTS,
    MEASURED,
    PLANES,
    QUANTITIES,
    SHAKING,
    column_of,
    word_of,
)
from rbfrag.vocabulary.spectral import BY_PERIOD

TEXTS = ("block_id", "site_id", "kind", "mode", "crs", *PLANE_TEXTS)
"""Columns of texts."""

SHAKING_TEXTS = ("component", "mechanism")
"""Columns of texts about the shaking."""

IF_EMPTY = {"count": 1.0, "weight": 1.0, "amplification": 1.0}
"""What an empty cell stands for; of a standard deviation it is 0."""

ASSUMED = {"water_m": "assumed dry", "cohesion_pa": "assumed without cohesion"}
"""What an empty cell of a field means next to filled ones."""

EXAMPLE_NAME = "example"
"""Name of the row of the template that shows how to fill it in."""


@dataclass(frozen=True, eq=False)
class BlockTable:
    """An open table of blocks.

    Args:
        name: what messages call it.
        file: what is open.
        header: which columns are which fields.
        texts: fields that are texts.
        filled: fields of numbers that a cell has been read of.
        unused: columns that turned out to hold no kind of failure, with their words.
        gaps: rows without water or cohesion where the table has a column of it, by field.
        read: numbers of rows that have been read.
        common: rows with an empty cell of each field that is given for all rows as well.
    """

    name: str
    file: TableFile
    header: Header
    texts: Collection[str]
    filled: set[str] = field(default_factory=set)
    unused: dict[str, list[str]] = field(default_factory=dict)
    gaps: dict[str, list[int]] = field(default_factory=dict)
    read: list[int] = field(default_factory=list)
    common: dict[str, list[int]] = field(default_factory=dict)

    @property
    def numeric(self) -> frozenset[str]:
        """Names of the numeric columns, as in the table."""
        return frozenset(
            column.header
            for name, column in self.header.columns.items()
            if name not in (*self.texts, "free_standing", "back_fracture")
        )

    @property
    def parts(self) -> Parts:
        """The rows, a few thousand at a time, without the template's example."""
        column = self.header.columns.get("block_id")
        for part in self.file.parts(self.numeric):
            if column is not None:
                names = cells_of(part.cells[column.header])
                examples = [i for i, name in enumerate(names) if str(name) == EXAMPLE_NAME]
                if examples and len(examples) == len(names):
                    text = f"the only row is {EXAMPLE_NAME!r} of the template"
                    self.file.remarks.append(Diagnostic(text, "example_only"))
                elif examples:
                    part = part.without(examples)
                    text = f"the row {EXAMPLE_NAME!r} of the template is skipped"
                    self.file.remarks.append(Diagnostic(text, "example_skipped"))
            yield part

    def numbers(self, part: TablePart) -> tuple[dict[str, NDArray[np.float64]], dict[int, str]]:
        """Return the numbers of rows by field, and the invalid rows by index."""
        numbers, faults = {}, dict(part.faults)
        for name, column in self.header.columns.items():
            if name in (*self.texts, "free_standing"):
                continue
            if name == "back_fracture":
                values, cell_faults = self._yes_or_no(part, column)
            else:
                unit = QUANTITIES[name].unit if name in INPUTS else ""
                read = _errors_of if name in MEASURED else TablePart.numbers
                values, cell_faults = read(part, column.header, unit, column.factor)
            faults = cell_faults | faults
            empty = np.isnan(values)
            if cell_faults or not empty.all():
                self.filled.add(name)
            rows = (np.flatnonzero(empty) + sum(self.read)).tolist()
            is_sigma = "_sigma" in name and name != "gmm_sigma"
            stands_for = 0.0 if is_sigma else IF_EMPTY.get(name)
            if name in self.common:  # empty cells have the value for all rows
                self.common[name] += rows
                stands_for = None
            elif name in ASSUMED:
                self.gaps.setdefault(name, []).extend(rows)
            numbers[name] = values if stands_for is None else np.where(empty, stands_for, values)
        self.read.append(len(part.lines))
        return numbers, faults

    def _cells(self, part: TablePart, column: Column) -> list[str]:
        return [str(cell).strip() for cell in cells_of(part.cells[column.header])]

    def _yes_or_no(
        self, part: TablePart, column: Column
    ) -> tuple[NDArray[np.float64], dict[int, str]]:
        """Return 1 for yes, 0 for no and NaN for an empty cell."""
        values, faults = np.full(len(part.lines), np.nan), {}
        for i, cell in enumerate(self._cells(part, column)):
            if not cell:
                continue
            answer = yes_or_no(cell)
            if answer is None:
                faults[i] = f"{column.header} = {cell[:40]!r} is neither yes nor no"
            else:
                values[i] = answer != column.inverse
        return values, faults

    def text(self, part: TablePart, name: str) -> list[str] | None:
        """Return the texts of rows; None where the table has no column of that field."""
        cells = self._texts(part, name)
        if cells is not None and name in self.common:
            start = sum(self.read) - len(cells)  # the numbers of these rows have been read
            self.common[name] += [start + i for i, cell in enumerate(cells) if not cell]
            if any(cells):
                self.filled.add(name)
        return cells

    def _texts(self, part: TablePart, name: str) -> list[str] | None:
        if name == "kind":
            return self._kinds(part)
        column = self.header.columns.get(name)
        if column is None:
            return None
        if name == "drainage":
            return [drainage_named(cell) for cell in self._cells(part, column)]
        label = f"{self.name}: a cell of {name}"
        return [checked_name(as_written(cell), label) for cell in self._cells(part, column)]

    def _kinds(self, part: TablePart) -> list[str] | None:
        """Return the kinds given in rows, by a word or by the column of free-standing blocks."""
        column, free_column = (self.header.columns.get(name) for name in ("kind", "free_standing"))
        kinds = None
        if column is not None:
            cells = self._cells(part, column)
            kinds = kinds_in(cells, column.header, self.name)
            words = dict.fromkeys(filter(None, cells))
            if kinds is None and words:
                self.unused.setdefault(column.header, []).extend(words)
                if "kind" in self.filled:
                    wrong = f"column {column.header!r}: {next(iter(words))!r:.42}"
                    raise InputError(f"{self.name}: {wrong} is not a kind of failure")
            elif kinds is not None and words:
                self.filled.add("kind")
                if column.header in self.unused:
                    wrong = f"column {column.header!r}: {self.unused[column.header][0]!r:.42}"
                    raise InputError(f"{self.name}: {wrong} is not a kind of failure")
        if free_column is None:
            return kinds
        values, faults = self._yes_or_no(part, free_column)
        if faults:
            raise InputError(f"{self.name}: {next(iter(faults.values()))}")
        self.filled.add("free_standing")
        kinds = kinds or [""] * len(part.lines)
        return [
            FREE_STANDING if v == 1.0 else k for k, v in zip(kinds, values.tolist(), strict=True)
        ]

    def warnings(self, used: Collection[str]) -> tuple[Diagnostic, ...]:
        """Return the warnings about the columns.

        Args:
            used: the fields that the answer depends on, or hands on.
        """
        empty = {
            column.header
            for name, column in self.header.columns.items()
            if name not in self.filled and name not in self.texts
        }
        used = {*used, "free_standing"} if "kind" in used else used
        if self.unused:
            used = {name for name in used if name != "kind"}
        named = [name for name in self.file.header if name not in (*empty, *self.unused)]
        kinds = (
            f"column ignored: {header} ({', '.join(dict.fromkeys(words))}): no word names a kind "
            "of failure"
            for header, words in self.unused.items()
        )
        total = sum(self.read)
        assumed = (
            Diagnostic(
                f"{name.partition('_')[0]} not given in {len(rows):,} of {total:,} rows: "
                f"{ASSUMED[name]}",
                f"{name.partition('_')[0]}_not_given",
                rows=rows,
            )
            for name, rows in self.gaps.items()
            if rows and name in self.filled and name in used
        )
        return (
            *self.file.remarks,
            *self._cells_before_options(),
            *assumed,
            *self.header.warnings,
            *self.header.ignored(named, used),
            *(Diagnostic(text, "ignored_columns") for text in kinds),
        )

    def _cells_before_options(self) -> Iterator[Diagnostic]:
        """Yield which rows use a value that is given for all rows: those with an empty cell."""
        total = sum(self.read)
        for name, rows in self.common.items():
            if name not in self.filled:
                continue
            common = f"{word_of(name)} given for all rows"
            column = f"column {self.header.columns[name].header!r}"
            text = f"{common} is ignored: {column} has a value in every row"
            if rows:
                text = (
                    f"{common} is used for {len(rows):,} of {total:,} rows: {column} is empty there"
                )
            yield Diagnostic(text, "option_and_column", fields=(name,), rows=rows)

    def check(self, common_fields: Collection[str] = (), kind: str | None = None) -> None:
        """Reject a table that describes no blocks, or has a relevant column that is not used.

        Args:
            common_fields: fields that are given for all blocks.
            kind: how the blocks fail; None for what they are given by.
        """
        of_all = {*common_fields} | ({"kind"} if kind is not None else set())
        self.common.update({name: [] for name in sorted(of_all & {*self.header.columns})})
        present = {*self.header.columns, *common_fields}
        present |= {angle for plane, angle in ANGLES.items() if plane in present}
        self.header.check_unused(self.name, present if kind is None else {*present, "kind"})
        if kinds_by_numbers(present) or any(present.issuperset(shape) for shape in SHAPES):
            return
        sides = [name for name in RECTANGLE if name in present]
        if len(sides) == 1:
            missing = next(name for name in RECTANGLE if name not in present)
            word = missing.partition("_")[0]
            near = next((h for h in self.header.unknown if sounds_like(h) == missing), None)
            hint = f" (did you mean the column {near!r}?)" if near else ""
            raise InputError(f"{self.name}: {word} is missing{hint}; the columns are {self._have}")
        block = block_of(present, kind)
        missing = next(name for name in block.names if name not in present)
        sides_too = ", nor height_m and width_m" if "kr" in block.names else ""
        self._reject(f"{column_of(missing)}{sides_too}")

    def check_read(self, common_fields: Collection[str], read: Collection[str]) -> None:
        """Reject fields that are given for all blocks and used by no answer."""
        for name in common_fields:
            if name in BLOCK and name not in read:
                text = f"{name} cannot be combined with the blocks of {self.name}: omit it"
                raise InputError(text, fields=(name,))

    @contextmanager
    def named(self) -> Iterator[None]:
        """Add the name of the table to errors that concern all of its blocks."""
        try:
            yield
        except InputError as error:
            raise InputError(f"{self.name}: {error}", fields=error.fields) from None

    def need(self, names: Collection[str]) -> None:
        """Reject a table without some columns."""
        for name in names:
            if name not in self.header.columns:
                self._reject(name)

    @property
    def _have(self) -> str:
        have = ", ".join(self.file.header) or "none"
        if len(self.file.sheets) > 1:
            have += f" (of the first sheet; the sheets are {', '.join(self.file.sheets)})"
        return have

    def _reject(self, missing: str) -> None:
        raise InputError(f"{self.name}: there is no column {missing}; the columns are {self._have}")

    def read_all(self) -> tuple[dict[str, NDArray[Any]], dict[int, str], list[int]]:
        """Return the columns by field, the invalid rows, and the line numbers of all rows."""
        collected: dict[str, list[NDArray[Any]]] = {
            name: [np.empty(0, dtype=object if name in self.texts else np.float64)]
            for name in self.header.columns
            if name != "free_standing"
        }
        faults: dict[int, str] = {}
        lines: list[int] = []
        present = {*self.header.columns}
        present |= {"kind"} if "free_standing" in present else set()
        texts = [name for name in self.texts if name in present]
        for part in self.parts:
            numbers, wrong = self.numbers(part)
            columns: dict[str, NDArray[Any]] = {**numbers}
            for name in texts:
                if (cells := self.text(part, name)) is not None:
                    columns[name] = np.array(cells, dtype=object)
            for name, column in columns.items():
                collected.setdefault(name, []).append(column)
            faults |= {len(lines) + i: fault for i, fault in wrong.items()}
            lines.extend(part.lines)
        table = {n: np.concatenate(arrays) for n, arrays in collected.items()}
        return {n: c for n, c in table.items() if c.size == len(lines)}, faults, lines


def _errors_of(
    part: TablePart, header: str, unit: str, factor: float
) -> tuple[NDArray[np.float64], dict[int, str]]:
    """Return standard deviations of a measured field; a fraction of the field ("5%") is negative.

    Arguments as for :meth:`TablePart.numbers`.
    """
    cells = cells_of(part.cells[header])
    texts = [str(cell).strip() if isinstance(cell, str) else "" for cell in cells]
    relative = [i for i, text in enumerate(texts) if text.endswith("%")]
    if relative and unit != "deg":
        bare = [text[:-1] if text.endswith("%") else cell
                for text, cell in zip(texts, cells, strict=True)]  # fmt: skip
        part = replace(part, cells={**part.cells, header: bare})
    values, faults = part.numbers(header, unit, factor)
    for i in np.flatnonzero(values < 0.0).tolist():
        faults[i] = f"{header} = {cells[i]}: give a standard deviation of 0 or more"
    if relative and unit != "deg":
        values[relative] *= -0.01 / factor
    return values, faults


@contextmanager
def opened_table(
    source: str | os.PathLike[str] | Mapping[str, Any],
    read: Collection[str],
    texts: Collection[str] = TEXTS,
    *,
    sheet: str | None = None,
    ignore_columns: Sequence[str] = (),
) -> Iterator[BlockTable]:
    """Open a table of blocks.

    Args:
        source: a table's file, a file of GeoJSON points, or columns by name, such as a pandas
            table.
        read: fields of numbers, and other columns by their own names, that may be used.
        texts: the same of texts.
        sheet: of a workbook, the name of the sheet; None for the first.
        ignore_columns: columns to ignore, whatever they are called.

    Raises:
        InputError: the file cannot be read, or a column cannot be meant as it is called.
        MissingExtraError: a Parquet file without pyarrow, a workbook without openpyxl.
    """
    with ExitStack() as stack:
        file = open_table(source, stack, sheet=sheet)
        name = str(source) if isinstance(source, str | os.PathLike) else "blocks"
        header = columns_in(file.header, name, (*read, *texts), ignore_columns)
        yield BlockTable(name, file, header, texts)


def read_rows(
    source: str | os.PathLike[str],
    defaults: Mapping[str, Any],
    *,
    sheet: str | None = None,
    ignore_columns: Sequence[str] = (),
) -> tuple[list[dict[str, Any]], tuple[Diagnostic, ...]]:
    """Return the inputs of each row of a table, for answers row by row, and its warnings.

    Args:
        source: the table.
        defaults: fields that hold for rows whose cell is empty.
        sheet: of a workbook, the name of the sheet; None for the first.
        ignore_columns: columns to ignore.

    Returns:
        Fields by name, with ``block_id``, ``count`` and, of a row that cannot be used, ``reason``.
    """
    read = (*BLOCK, *SHAKING, *BY_ROW, "count")
    texts = (*TEXTS, *SHAKING_TEXTS)
    with opened_table(source, read, texts, sheet=sheet, ignore_columns=ignore_columns) as table:
        table.check(defaults, defaults.get("kind"))
        columns, faults, _ = table.read_all()
    rows = []
    for i, cells in enumerate(zip(*(column.tolist() for column in columns.values()), strict=True)):
        row = {n: v for n, v in zip(columns, cells, strict=True) if v == v and v != ""}
        if kinds_by_numbers(row):  # which go before a shape
            row = {name: row[name] for name in row if name not in OF_A_SHAPE}
        elif "beta_deg" in columns and {"beta_deg", "base"}.isdisjoint({*row, *defaults}):
            faults.setdefault(i, f"{column_of('beta_deg')} is empty: enter 0 for a level base")
        if "back_fracture" in row:
            row["back_fracture"] = bool(row["back_fracture"])
        rows.append({**defaults, **row, **({"reason": faults[i]} if i in faults else {})})
    return rows, table.warnings((*read, *texts))


COLUMNS = ("block_id", *RECTANGLE, *PLANES, *FAILURE, "pgv_m_s", "pga_g")
"""Fields that have a column; the others are listed on a sheet of their own."""

EXAMPLE = {"block_id": "example", "height_m": 2.4, "width_m": 0.5, "beta_deg": 3.0, "phi_deg": 35.0}


def write_template(path: str | os.PathLike[str]) -> Path:
    """Write a table with one example row, completely or not at all, and return its path.

    A workbook has a second sheet that lists all columns.

    Args:
        path: file to write, ``.xlsx`` or ``.csv``.
    """
    target = output_path(path, (".xlsx", ".csv"), "table")
    names, row = map(header_of, COLUMNS), [EXAMPLE.get(name, "") for name in COLUMNS]
    if target.suffix.lower() == ".csv":
        columns = {name: np.array([cell]) for name, cell in zip(names, row, strict=True)}
        return write_block_table(columns, target)
    book = openpyxl().Workbook()
    sheet, column_sheet = book.active, book.create_sheet("columns")
    sheet.title, sheet.freeze_panes, column_sheet.freeze_panes = "blocks", "A2", "A2"
    sheet.append([*names])
    sheet.append(row)
    column_sheet.append(["column", "description", "other names"])
    spectral = ("sa(1)", "sa(1)_sigma")  # or at any other period
    for name in (*(name for name in quantities.COLUMNS if name not in BY_PERIOD), *spectral):
        help = quantities.QUANTITIES[name].help(word_of)
        column_sheet.append([header_of(name), help, ", ".join(quantities.INPUTS[name].aliases)])
    with written_whole(target, "table") as partial:
        book.save(partial)
    return target
