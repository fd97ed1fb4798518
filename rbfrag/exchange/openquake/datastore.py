"""Tables of the OpenQuake engine in its HDF5 files: calc_N.hdf5, gmf-data.hdf5."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, MissingExtraError
from rbfrag.exchange.openquake.table import ROWS, Table
from rbfrag.files import reading

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
