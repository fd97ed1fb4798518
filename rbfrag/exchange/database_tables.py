"""Tables of a database as files for other programs, and as pandas frames."""

from __future__ import annotations

import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sqlalchemy import Connection

from rbfrag.db.data_dictionary import (
    TABLES,
    VIEWS,
    ColumnMeaning,
    chosen_columns,
    dictionary_as_json,
    dictionary_as_markdown,
    frames,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.location import data_place
from rbfrag.errors import InputError, WorkFailedError
from rbfrag.exchange.tables.csv_file import as_text, changed_texts, formula_warnings
from rbfrag.exchange.tables.parts import pyarrow
from rbfrag.results.numbers import count_of
from rbfrag.results.result import Result, TextTable

if TYPE_CHECKING:
    import pandas as pd

FORMATS = ("parquet", "csv")
"""What the tables can be written as."""

DICTIONARY = "data_dictionary"
"""Name of the two files that say what the columns mean."""

DICTIONARY_HEAD = (
    "# Data dictionary\n\nSI units; accelerations in g; units are in the column names. An "
    "empty cell (CSV) or null (Parquet) is a missing value.\n\n"
)


@dataclass(frozen=True, repr=False)
class ExportReport(Result):
    """Files written by :func:`export_database`.

    Args:
        folder: the folder.
        format: ``parquet`` or ``csv``.
        rows: number of rows by table.
        warnings: cells that spreadsheets compute.
    """

    folder: str
    format: str
    rows: dict[str, int]
    warnings: tuple[str, ...] = ()

    def sentences(self) -> Iterator[str]:
        """Yield the number of tables and the folder."""
        yield f"{count_of(len(self.rows), 'table')} written to {self.folder}"

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:  # noqa: ARG002
        """Yield the number of rows by table."""
        yield TextTable(("table", "rows"), [*self.rows.items()])

    def as_dict(self) -> dict[str, Any]:
        """Return the report under the keys of the JSON contract."""
        return {**asdict(self), "warnings": list(self.warnings)}


def export_database(
    out: str | os.PathLike[str],
    *,
    db: str | os.PathLike[str] | None = None,
    format: str = "parquet",
    tables: Sequence[str] | None = None,
    arrays: bool = False,
    excel_text: bool = False,
) -> ExportReport:
    """Write the tables of a database into a folder, one file each, with a data dictionary.

    The folder appears complete or not at all. All tables are read in one transaction: they
    belong together even while a campaign writes. Memory does not grow with the database.

    Args:
        out: folder to make; it must not exist, or be empty.
        db: the database (path, URL, or None for the default).
        format: ``parquet`` or ``csv``.
        tables: only these tables or views; None for all tables.
        arrays: include samples and histories (Parquet only): lists of float64.
        excel_text: write texts that spreadsheets take for formulas with an apostrophe (CSV).

    Raises:
        InputError: an unknown format or table; a folder that holds files or cannot be made;
            arrays in CSV, apostrophes in Parquet.
        MissingExtraError: Parquet without pyarrow.
        DatabaseError: the database cannot be used.
        WorkFailedError: the disk is full.
    """
    if format not in FORMATS:
        raise InputError(f"format {format}: choose one of {', '.join(FORMATS)}", fields=("format",))
    if arrays and format == "csv":
        raise InputError(
            "arrays are not supported in CSV: use format parquet", fields=("arrays", "format")
        )
    if excel_text and format != "csv":
        raise InputError(
            "excel_text applies to CSV only: use format csv",
            fields=("excel_text", "format"),
        )
    if format == "parquet":
        pyarrow()
    names = list(dict.fromkeys(TABLES if tables is None else tables))
    if not names:
        raise InputError("tables: give at least one table", fields=("tables",))
    chosen = {name: chosen_columns(name, arrays=arrays) for name in names}
    formulas: list[str] = []
    write: Callable[[Connection, str, Sequence[ColumnMeaning], Path], int] = (
        _write_parquet
        if format == "parquet"
        else partial(_write_csv, excel_text=excel_text, formulas=formulas)
    )
    folder = Path(out)
    with opened_database(db, read_only=True) as engine, ExitStack() as stack:
        try:
            if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
                raise InputError(
                    f"out {folder}: the folder is not empty; give a new folder", fields=("out",)
                )
            if not folder.absolute().parent.is_dir():
                raise InputError(
                    f"out {folder}: create the folder {folder.absolute().parent} first",
                    fields=("out",),
                )
            draft = folder.absolute().with_name(f".{folder.name}.{secrets.token_hex(4)}.part")
            draft.mkdir()
        except OSError as error:
            raise InputError(
                f"out {folder}: cannot be made: {error.strerror or error}", fields=("out",)
            ) from None
        stack.callback(shutil.rmtree, draft, ignore_errors=True)
        try:
            with engine.connect() as connection:
                rows = {
                    name: write(connection, name, columns, draft / f"{name}.{format}")
                    for name, columns in chosen.items()
                }
            document = json.dumps(dictionary_as_json(), indent=2, ensure_ascii=False) + "\n"
            (draft / f"{DICTIONARY}.json").write_text(document, encoding="utf-8")
            text = DICTIONARY_HEAD + dictionary_as_markdown()
            (draft / f"{DICTIONARY}.md").write_text(text, encoding="utf-8")
            if folder.exists():
                folder.rmdir()
            draft.rename(folder)
        except OSError as error:
            raise WorkFailedError(
                f"the export to {folder} was given up: {error.strerror or error}; nothing of it "
                "was kept"
            ) from error
    return ExportReport(str(folder), format, rows, tuple(formulas[:1]))


def _write_csv(
    connection: Connection,
    table: str,
    columns: Sequence[ColumnMeaning],
    file: Path,
    *,
    excel_text: bool,
    formulas: list[str],
) -> int:
    rows = 0
    words = {True: "true", False: "false"}
    for frame in frames(connection, table, columns):
        for column in columns:
            if column.type == "true/false":
                frame[column.name] = frame[column.name].map(words)
        texts = {
            column.name: list(frame[column.name]) for column in columns if column.type == "text"
        }
        if excel_text:
            for name, cells in changed_texts(texts, as_text).items():
                frame[name] = cells
        else:
            formulas += formula_warnings(texts)
        frame.to_csv(
            file, mode="a", header=not rows, index=False, lineterminator="\n", encoding="utf-8"
        )
        rows += len(frame)
    return rows


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
        metadata={"meaning": {**TABLES, **VIEWS}[table].meaning},
    )
    rows = 0
    with parquet.ParquetWriter(file, schema) as writer:
        for frame in frames(connection, table, columns):
            writer.write_table(arrow.Table.from_pandas(frame, schema, preserve_index=False))
            rows += len(frame)
    return rows


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
            ``motion_spectrum``, ``recording_spectrum``, ``toppling_spectrum``, ``campaign``,
            ``combination``, ``outcome_interval``, ``simulation``, ``response``, ``shock_pair`` or
            ``fragility_model``; or one of the views ``outcome`` and ``critical_value``.
        db: the database (path, URL, or None for the default, else the built-in data).
        columns: only these columns.
        arrays: include samples [g] and histories, as one float64 array a row.

    Raises:
        InputError: there is no such table or column.
        DatabaseError: the database cannot be used.
    """
    import pandas as pd

    chosen = chosen_columns(table, columns, arrays=arrays)
    place, _ = data_place(db)
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        return pd.concat(frames(connection, table, chosen), ignore_index=True)
