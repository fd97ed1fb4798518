"""Data dictionary: meaning of every column, from the schema, for readers of the tables."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from sqlalchemy import Boolean, Column, Double, Integer, LargeBinary, Table

from rbfrag.db.location import SCHEMA_REVISION
from rbfrag.db.schema import metadata


@dataclass(frozen=True)
class ColumnMeaning:
    """One column.

    Args:
        type: ``integer``, ``number`` (float64), ``true/false``, ``text`` or ``array`` (float64).
        unit: its unit; empty for none, ``k_r/PGA`` for a k_r over the motion's PGA in g.
        meaning: one sentence.
        may_be_missing: whether a row may have no value.
        refers_to: the table and column it points to; empty for none.
    """

    name: str
    type: str
    unit: str
    meaning: str
    may_be_missing: bool
    refers_to: str


@dataclass(frozen=True)
class TableMeaning:
    """One table.

    Args:
        meaning: one sentence.
        columns: its columns, in order.
    """

    name: str
    meaning: str
    columns: tuple[ColumnMeaning, ...]


def data_dictionary() -> tuple[TableMeaning, ...]:
    """Return every table with every column."""
    return tuple(map(table_meaning, metadata.tables.values()))


def table_meaning(table: Table) -> TableMeaning:
    """Return the meaning of one table of the schema."""
    return TableMeaning(table.name, table.info["meaning"], tuple(map(_column, table.columns)))


def dictionary_as_json() -> dict[str, Any]:
    """Return the dictionary as a JSON document: schema revision and tables."""
    return {"schema": SCHEMA_REVISION, "tables": [asdict(table) for table in data_dictionary()]}


def dictionary_as_markdown() -> str:
    """Return the dictionary as Markdown, one section per table."""
    return "\n".join(
        f"## {table.name}\n\n{table.meaning}\n\n{columns_as_markdown(table.columns)}"
        for table in data_dictionary()
    )


def columns_as_markdown(columns: Iterable[ColumnMeaning]) -> str:
    """Return the Markdown table of some columns."""
    lines = ["| column | type | unit | meaning |", "| --- | --- | --- | --- |"]
    for column in columns:
        notes = [column.meaning]
        if column.refers_to:
            notes.append(f"refers to {column.refers_to}")
        if column.may_be_missing and "missing" not in column.meaning:
            notes.append("may be missing")
        text = "; ".join(notes).replace("|", "\\|")
        lines.append(f"| {column.name} | {column.type} | {column.unit or '-'} | {text} |")
    return "\n".join(lines) + "\n"


def _column(column: Column[Any]) -> ColumnMeaning:
    return ColumnMeaning(
        name=column.name,
        type=_type(column),
        unit=column.info["unit"],
        meaning=column.info["meaning"],
        may_be_missing=bool(column.nullable),
        refers_to=next((key.target_fullname for key in column.foreign_keys), ""),
    )


def _type(column: Column[Any]) -> str:
    if isinstance(column.type, Boolean):
        return "true/false"
    if isinstance(column.type, Integer) or column.foreign_keys:
        return "integer"
    if isinstance(column.type, Double):
        return "number"
    if isinstance(column.type, LargeBinary):
        return "array"
    return "text"
