"""Tables of the OpenQuake engine: exported CSV files, and HDF5 (calc_N.hdf5, gmf-data.hdf5)."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import subprocess
import sys
import warnings
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.files import reading

_KEY_VALUE = re.compile(r"(\w+)\s*=\s*(?:'([^']*)'|([^,\s\"']+))")
ROWS = 1 << 18
"""Rows that are read at a time."""


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
                cell = row[place[name]]
                try:
                    value = kind(cell)
                except ValueError:
                    value = math.nan
                is_valid = cell.strip() != ""
                if kind is not str:
                    is_valid = -(2**63) <= value < 2**63 if kind is int else math.isfinite(value)
                if not is_valid:
                    return InputError(f"{where}: {name} is {cell!r}, not {_IN_WORDS[kind]}")
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


SUFFIXES = (".hdf5", ".h5")
"""How names of HDF5 files end."""

_DATASTORE = "the datastore of an OpenQuake job"
_TIMES = ("investigation_time", "ses_per_logic_tree_path")
_JOBS = {"checksum": "checksum32", "start_date": "date"}
"""What tells jobs apart: names in the comments of exports, and those of the file's attributes."""
_MOST_ROWS = 300
"""Rows a byte of the file: packed ones of four bytes cannot take less; a damaged file states any
number."""

_PROBE = f"""
import os, sys, h5py
with h5py.File(sys.argv[1], "r") as file:
    dict(file.attrs)
    for name in ("gmf_data", "events", "sitecol", "complete", "weights", "oqparam"):
        node = file.get(name)
        for each in (*node.values(),) if hasattr(node, "values") else (node,) if node else ():
            if each.ndim == 0:
                each[()]
            elif each.size <= {_MOST_ROWS} * os.path.getsize(sys.argv[1]):
                for start in range(0, len(each), {ROWS}):
                    each[start : start + {ROWS}]
"""
"""Reads all that is read of a file."""

_LEAST_S, _BYTES_A_SECOND = 20.0, 1e7
"""How long that may take."""


@lru_cache
def _reject_endless(path: Path, size: int, _changed_ns: int) -> None:
    """Reject a damaged file that makes the HDF5 library hang or crash.

    Only another process can be stopped in the library; an exception there comes here again.
    """
    limit = _LEAST_S + size / _BYTES_A_SECOND
    surroundings = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", _PROBE, str(path.absolute())]
    try:
        ended = subprocess.run(
            command, env=surroundings, timeout=limit, stdin=subprocess.DEVNULL,
            capture_output=True, check=False,
        ).returncode  # fmt: skip
        fault = "crashes" if ended < 0 else ""
    except subprocess.TimeoutExpired:
        fault = f"does not end in {limit:.0f} s"
    if fault:
        raise InputError(
            f"{path}: damaged: the HDF5 library {fault} in reading it: copy it again, or name the "
            "CSV files (oq export … -e csv)"
        )


@dataclass(frozen=True)
class StoredTable(Table):
    """A table of an HDF5 file.

    Args:
        node_name: name of the group or dataset that it lies in.
        size: number of rows.
        members: where each column lies inside; an empty text is the dataset itself, None a number
            from 0 on.
    """

    node_name: str = ""
    size: int = 0
    members: Mapping[str, str | None] = None  # type: ignore[assignment]

    @property
    def head(self) -> str:
        """Position of the column names, for messages."""
        return f"{self.path}, {self.node_name}"

    top = head

    def line(self, row: int | np.integer[Any]) -> str:
        """Return the position of a row of data for messages, from 1 on."""
        return f"{self.head}, row {1 + int(row)}"

    def read(self, columns: Mapping[str, type]) -> Generator[dict[str, NDArray[Any]]]:
        """Yield columns, some hundred thousand rows at a time.

        Raises:
            InputError: the file cannot be read, or a number is none; the message names the row.
        """
        with _opened(self.path) as file:
            for start in range(0, self.size, ROWS):
                rows = slice(start, min(start + ROWS, self.size))
                yield {name: self._cells(file, name, rows, kind) for name, kind in columns.items()}

    def _cells(self, file: Any, name: str, rows: slice, kind: type) -> NDArray[Any]:
        member, node = self.members[name], file[self.node_name]
        if member is None:
            return np.arange(rows.start, rows.stop)
        values = np.asarray(_member(node, member)[rows])
        if kind is str:
            texts = np.char.decode(values, "utf-8") if values.dtype.kind == "S" else values
            return texts.astype(str).astype(object)
        if kind is float and not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(f"{self.line(rows.start + row)}: {name} is {values[row]}, no number")
        return values.astype(np.int64 if kind is int else np.float64)


def stored_table(path: Path, content: str) -> StoredTable | None:
    """Return a table of an HDF5 file by its content; None for the ruptures of a scenario.

    The layout is that of the engine's version 3: ``gmf_data`` (one dataset a measure), ``events``
    (compound), ``sitecol`` or ``complete`` (one dataset a column), ``weights`` of the realizations,
    ``oqparam`` (JSON) with the times. A file of ground motion alone has the first and the sites.

    Args:
        path: calc_N.hdf5 or gmf-data.hdf5.
        content: gmf_data, events, sitemesh, realizations or ruptures.

    Raises:
        InputError: no such file, or it does not hold that table.
        MissingExtraError: h5py is not installed.
    """
    with _opened(path) as file:
        metadata = {
            name: str(file.attrs[attribute])
            for name, attribute in _JOBS.items()
            if attribute in file.attrs
        }
        if content == "ruptures":
            return _times(path, file, metadata)
        if content == "sitemesh":
            return _sites(path, file, metadata)
        node = _node(path, file, "weights" if content == "realizations" else content)
        if content == "realizations":
            if node.ndim != 1:
                raise InputError(
                    f"{path}, weights: of shape {node.shape}, one per realization is required"
                )
            members: dict[str, str | None] = {"rlz_id": None, "weight": ""}
            return _table(path, "weights", node.size, members, metadata)
        if content == "events":
            members = {{"id": "event_id"}.get(name, name): name for name in node.dtype.names}
            return _table(path, content, node.size, members, metadata)
        members = {name if name in ("eid", "sid") else f"gmv_{name}": name for name in node}
        return _table(path, content, _member(node, "eid").size, members, metadata)


def _table(
    path: Path,
    node_name: str,
    size: int,
    members: Mapping[str, str | None],
    metadata: Mapping[str, str],
) -> StoredTable:
    if size > _MOST_ROWS * path.stat().st_size:
        raise InputError(
            f"{path}, {node_name}: declares {size:,} rows, more than the file size allows"
        )
    return StoredTable(path, metadata, tuple(members), 0, node_name, size, members)


def _sites(path: Path, file: Any, metadata: Mapping[str, str]) -> StoredTable:
    node_name = "complete" if "complete" in file else "sitecol"
    node = _node(path, file, node_name)
    name = "custom_site_id" if "custom_site_id" in node else "sids"
    members = {"site_id" if name == "sids" else name: name, "lon": "lon", "lat": "lat"}
    sids = _member(node, "sids")
    table = _table(path, node_name, sids.size, members, metadata)
    if (sids[()] != np.arange(sids.size)).any():
        raise InputError(f"{path}, {node_name}: the sites are not numbered from 0 on")
    return table


def _times(path: Path, file: Any, metadata: Mapping[str, str]) -> StoredTable | None:
    """Return the table of ruptures without rows, with the duration of the event set as metadata."""
    if "oqparam" not in file:
        return None
    settings = json.loads(file["oqparam"][()])
    times = {name: str(settings[name]) for name in _TIMES if settings.get(name) is not None}
    if not times:
        return None
    return _table(path, "oqparam", 0, {}, {**metadata, **times})


def _node(path: Path, file: Any, name: str) -> Any:
    if name not in file:
        data = "ground motion alone" if "gmf_data" in file else "another calculation"
        raise InputError(
            f"{path} has no {name!r}: it is a file of {data}; name calc_N.hdf5 of the event-based "
            "or scenario job itself, or name the CSV files of what is missing (oq export … -e csv)"
        )
    return file[name]


def _member(node: Any, name: str) -> Any:
    """Return a sliceable column of a group, or of a table in one dataset."""
    if not name:
        return node
    return node.fields(name) if hasattr(node, "dtype") else node[name]


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        import h5py
    except ImportError:
        raise MissingExtraError("HDF5 files of OpenQuake require h5py", "hdf5") from None
    with reading(path, _DATASTORE):
        if not h5py.is_hdf5(path):
            raise InputError(f"{path}: not an HDF5 file: name {_DATASTORE}, calc_N.hdf5")
        about = path.stat()
        _reject_endless(path, about.st_size, about.st_mtime_ns)
        try:
            with h5py.File(path, "r") as file:
                yield file
        except InputError:
            raise
        # what h5py raises of a file that is damaged or of another layout
        except (KeyError, ValueError, TypeError, AttributeError, RuntimeError) as error:
            raise InputError(f"{path}: cannot be read as {_DATASTORE}: {error}") from None
