"""Tables of the OpenQuake engine in its exported CSV files."""

from __future__ import annotations

import csv
import math
import re
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.files import reading

_KEY_VALUE = re.compile(r"(\w+)\s*=\s*(?:'([^']*)'|([^,\s\"']+))")
ROWS = 1 << 18
"""Rows that are read at a time."""


def _finite(text: str) -> float:
    if not math.isfinite(value := float(text)):
        raise ValueError(text)
    return value


def _integer(text: str) -> int:
    if not -(2**63) <= (value := int(text)) < 2**63:
        raise ValueError(text)
    return value


def _nonempty(text: str) -> str:
    if not text.strip():
        raise ValueError(text)
    return text


_KINDS: Mapping[type, Callable[[str], object]] = {int: _integer, float: _finite, str: _nonempty}
_IN_WORDS = {int: "a whole number", float: "a number", str: "a name"}


def _next(parts: Any, too_many_cells: type[Warning]) -> Any:
    """Return the next part of a file, or None; a line with more cells than the first is an error.

    pandas cuts such a line with a warning where it is the first of a part.
    """
    # numpy warns of a number beyond all integers, which pandas then rejects
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.simplefilter("error", too_many_cells)
        return next(parts, None)


@dataclass(frozen=True)
class Table:
    """A table of a job: metadata above its rows, column names and reader.

    Args:
        path: the file.
        metadata: what the comment of its first line states, by name.
        names: names of the columns.
        lines: number of lines above the data.
    """

    path: Path
    metadata: Mapping[str, str]
    names: tuple[str, ...]
    lines: int

    @classmethod
    def of(cls, path: Path) -> Table:
        """Return the table of a CSV file."""
        metadata: dict[str, str] = {}
        with reading(path, "an export of OpenQuake"), closing(_lines(path)) as lines:
            for number, row in lines:
                if row and row[0].lstrip().startswith("#"):
                    matches = _KEY_VALUE.finditer(",".join(row))
                    metadata |= {
                        match.group(1): match.group(2) or match.group(3) or "" for match in matches
                    }
                    continue
                names = tuple(cell.strip() for cell in row)
                for name in names:
                    if names.count(name) > 1:
                        raise InputError(f"{path}, line {number}: the column {name!r} occurs twice")
                return cls(path, metadata, names, number)
        raise InputError(f"{path}: it ends before the header: export it again")

    @property
    def head(self) -> str:
        """Position of the column names, for messages."""
        return f"{self.path}, line {self.lines}"

    @property
    def top(self) -> str:
        """Position of the metadata of the file, for messages."""
        return f"{self.path}, line 1"

    def column(self, choices: Sequence[str], *, needed: bool = True) -> str | None:
        """Return the first of several names that is a column."""
        name = next((name for name in choices if name in self.names), None)
        if name is None and needed:
            raise InputError(
                f"{self.head}: there is no column {' or '.join(choices)}; the "
                f"columns are {', '.join(self.names)}"
            )
        return name

    def line(self, row: int | np.integer[Any]) -> str:
        """Return the position of a row of data for messages."""
        return f"{self.path}, line {self.lines + 1 + int(row)}"

    def read(self, columns: Mapping[str, type]) -> Generator[dict[str, NDArray[Any]]]:
        """Yield columns, some hundred thousand rows at a time.

        Raises:
            InputError: a cell holds no such thing, or a line lacks cells; the message names it.
        """
        import pandas as pd

        dtypes = {int: "int64", float: "float64", str: "str"}
        kinds = {name: columns.get(name, str) for name in self.names}
        with reading(self.path, "an export of OpenQuake"):
            try:
                with pd.read_csv(
                    self.path, skiprows=self.lines, header=None, names=list(kinds),
                    dtype={name: dtypes[kind] for name, kind in kinds.items()}, chunksize=ROWS,
                    keep_default_na=False, na_values=[], index_col=False, encoding="utf-8-sig",
                ) as parts:  # fmt: skip
                    while (part := _next(parts, pd.errors.ParserWarning)) is not None:
                        cells = {name: part[name].to_numpy() for name in columns}
                        for name in cells:
                            if columns[name] is str:
                                texts = part[name].fillna("").str.strip()
                                cells[name] = texts.to_numpy(dtype=object)
                                if (cells[name] == "").any():
                                    raise ValueError(f"{name} is missing")
                        yield cells
            except pd.errors.EmptyDataError:
                return
            except (
                ValueError,
                OverflowError,
                pd.errors.ParserError,
                pd.errors.ParserWarning,
            ) as error:
                raise self._trouble(columns) or InputError(f"{self.path}: {error}") from None

    def read_all(self, columns: Mapping[str, type]) -> dict[str, NDArray[Any]]:
        """Return complete columns."""
        with closing(self.read(columns)) as read:
            parts = list(read)
        empty = {int: np.int64, float: np.float64, str: object}
        return {
            name: np.concatenate([np.empty(0, dtype=empty[kind]), *(part[name] for part in parts)])
            for name, kind in columns.items()
        }

    def _trouble(self, columns: Mapping[str, type]) -> InputError | None:
        """Return an error that describes the first unreadable line."""
        place = {name: self.names.index(name) for name in columns}
        for number, row in _lines(self.path):
            where = f"{self.path}, line {number}"
            if number <= self.lines or not row:
                continue
            if len(row) != len(self.names):
                return InputError(f"{where}: {len(row)} cells under {len(self.names)} columns")
            for name, kind in columns.items():
                try:
                    _KINDS[kind](row[place[name]])
                except ValueError:
                    return InputError(
                        f"{where}: {name} is {row[place[name]]!r}, not {_IN_WORDS[kind]}"
                    )
        return None


def _lines(path: Path) -> Generator[tuple[int, list[str]]]:
    """Yield the rows of a file that may be large, each with the number of its last line."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.reader(file)
        try:
            for row in reader:
                yield reader.line_num, row
        except csv.Error as error:
            raise InputError(f"{path}, line {reader.line_num}: not a CSV file: {error}") from None
