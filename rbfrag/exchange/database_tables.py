"""The tables of a database as files that other programs read, and as pandas frames."""

from __future__ import annotations

import csv
import json
import os
import secrets
import shutil
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import Connection

from rbfrag.db.data_dictionary import (
    ColumnMeaning,
    dictionary_as_json,
    dictionary_as_markdown,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.table_columns import TABLES, Batch, chosen_columns, column_batches, read_columns
from rbfrag.errors import InputError, WorkFailedError
from rbfrag.exchange.batch_table import pyarrow

if TYPE_CHECKING:
    import pandas as pd

FORMATS = ("parquet", "csv")
"""What the tables can be written as."""

DICTIONARY = "data_dictionary"
"""Name of the two files that say what the columns mean."""


@dataclass(frozen=True)
class ExportReport:
    """What :func:`export_database` wrote.

    Args:
        folder: the folder.
        format: ``parquet`` or ``csv``.
        rows: number of rows by table.
    """

    folder: str
    format: str
    rows: dict[str, int]

    def as_dict(self) -> dict[str, object]:
        """Return the report under the keys of the JSON contract."""
        return asdict(self)


def export_database(
    out: str | os.PathLike[str],
    *,
    db: str | os.PathLike[str] | None = None,
    format: str = "parquet",
    tables: Sequence[str] | None = None,
    arrays: bool = False,
) -> ExportReport:
    """Write the tables of a database into a folder, one file each, with a data dictionary.

    The folder appears complete or not at all. All tables are read in one transaction: they
    belong together even while a campaign writes. Memory does not grow with the database.

    Args:
        out: folder to make; it must not exist, or be empty.
        db: the database (path, URL, or None for the default).
        format: ``parquet`` or ``csv``.
        tables: only these tables; None for all.
        arrays: include samples and histories (Parquet only): lists of float64.

    Raises:
        InputError: an unknown format or table; a folder that holds files or cannot be made;
            arrays in CSV.
        MissingExtraError: Parquet without pyarrow.
        DatabaseError: the database cannot be used.
        WorkFailedError: the disk is full.
    """
    if format not in FORMATS:
        raise InputError(f"--format {format}: choose one of {', '.join(FORMATS)}")
    if arrays and format == "csv":
        raise InputError("--arrays: a CSV cell holds no array; use --format parquet")
    if format == "parquet":
        pyarrow()
    names = list(dict.fromkeys(TABLES if tables is None else tables))
    if not names:
        raise InputError("--tables: name at least one table")
    chosen = {name: chosen_columns(name, arrays=arrays) for name in names}
    write = _write_parquet if format == "parquet" else _write_csv
    folder = Path(out)
    with opened_database(db, read_only=True) as engine, ExitStack() as stack:
        draft = _draft_folder(folder)
        stack.callback(shutil.rmtree, draft, ignore_errors=True)
        try:
            with engine.connect() as connection:
                rows = {
                    name: write(connection, name, columns, draft / f"{name}.{format}")
                    for name, columns in chosen.items()
                }
            _write_dictionary(draft)
            if folder.exists():
                folder.rmdir()
            draft.rename(folder)
        except OSError as error:
            raise WorkFailedError(
                f"the export to {folder} was given up: {error.strerror or error}; nothing of it "
                "was kept"
            ) from error
    return ExportReport(folder=str(folder), format=format, rows=rows)


def _draft_folder(folder: Path) -> Path:
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"--out {folder}: it holds something already; name a new folder")
        if not folder.absolute().parent.is_dir():
            raise InputError(
                f"--out {folder}: there is no folder {folder.absolute().parent}: make it first"
            )
        draft = folder.absolute().with_name(f".{folder.name}.{secrets.token_hex(4)}.part")
        draft.mkdir()
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be made: {error.strerror or error}") from None
    return draft


def _write_dictionary(folder: Path) -> None:
    document = json.dumps(dictionary_as_json(), indent=2, ensure_ascii=False) + "\n"
    (folder / f"{DICTIONARY}.json").write_text(document, encoding="utf-8")
    text = (
        "# Data dictionary\n\nSI units; accelerations in g; units are in the column names. An "
        "empty cell (CSV) or null (Parquet) is a missing value.\n\n"
    )
    (folder / f"{DICTIONARY}.md").write_text(text + dictionary_as_markdown(), encoding="utf-8")


def _write_csv(
    connection: Connection, table: str, columns: Sequence[ColumnMeaning], file: Path
) -> int:
    rows = 0
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(column.name for column in columns)
        for batch in column_batches(connection, table, columns):
            cells = [_cells(c, values) for c, values in zip(columns, batch.values, strict=True)]
            writer.writerows(zip(*cells, strict=True))
            rows += len(batch.values[0])
    return rows


def _cells(column: ColumnMeaning, values: Sequence[Any]) -> Sequence[Any]:
    if column.type == "true/false":
        return [None if value is None else str(value).lower() for value in values]
    return values  # csv writes None as an empty cell, and numbers with all their digits


def _write_parquet(
    connection: Connection, table: str, columns: Sequence[ColumnMeaning], file: Path
) -> int:
    arrow, parquet = pyarrow()
    kinds = {
        "integer": arrow.int64(),
        "number": arrow.float64(),
        "true/false": arrow.bool_(),
        "text": arrow.string(),
        "array": arrow.list_(arrow.float64()),
    }
    schema = arrow.schema(
        [
            arrow.field(
                column.name,
                kinds[column.type],
                nullable=column.may_be_missing,
                metadata={"unit": column.unit, "meaning": column.meaning},
            )
            for column in columns
        ],
        metadata={"meaning": TABLES[table].meaning},
    )
    rows = 0
    with parquet.ParquetWriter(file, schema) as writer:
        for batch in column_batches(connection, table, columns):
            writer.write_table(_arrow_table(arrow, schema, batch))
            rows += len(batch.values[0])
    return rows


def _arrow_table(arrow: Any, schema: Any, batch: Batch) -> Any:
    arrays = [
        arrow.array(_arrays(values) if column.type == "array" else values, type=field.type)
        for column, values, field in zip(batch.columns, batch.values, schema, strict=True)
    ]
    return arrow.Table.from_arrays(arrays, schema=schema)


def _arrays(blobs: Sequence[bytes | None]) -> list[Any]:
    return [None if blob is None else np.frombuffer(blob, dtype="<f8") for blob in blobs]


def read_table(
    table: str,
    *,
    db: str | os.PathLike[str] | None = None,
    columns: Sequence[str] | None = None,
    arrays: bool = False,
) -> pd.DataFrame:
    """Return a table of a database as a pandas DataFrame, in the order of its key.

    Units are in the column names; :doc:`the data dictionary </reference/data-dictionary>` says
    what each column means. Numbers are float64 with NaN where missing, true/false is bool,
    integers are int64 (``Int64`` where one may be missing).

    Args:
        table: ``earthquake``, ``recording``, ``motion``, ``suite``, ``suite_motion``,
            ``toppling_spectrum``, ``campaign``, ``combination``, ``outcome_interval``,
            ``simulation``, ``response`` or ``fragility_model``.
        db: the database (path, URL, or None for the default).
        columns: only these columns.
        arrays: include samples [g] and histories, as one float64 array a row.

    Raises:
        InputError: there is no such table or column.
        DatabaseError: the database cannot be used.
    """
    # Imported here: no other answer of rbfrag needs pandas.
    import pandas as pd

    chosen = chosen_columns(table, columns, arrays=arrays)
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        values = read_columns(connection, table, columns, arrays=arrays)
    frame = pd.DataFrame(values)
    whole = [c.name for c in chosen if c.type == "integer" and c.may_be_missing]
    return frame.astype(dict.fromkeys(whole, "Int64"))
