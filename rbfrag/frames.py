"""Answers as tables: what a notebook shows, and what pandas goes on with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from enum import Enum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd


class Tabular:
    """An answer that turns into a table: one row, or one for each element of its arrays.

    Base of dataclasses.
    """

    def table_columns(self) -> Mapping[str, Any]:
        """Return the columns by name; arrays are flat."""
        return columns_of(self)

    def to_frame(self) -> pd.DataFrame:
        """Return the answer as a pandas table, with the names and units of its fields."""
        return frame_of(self.table_columns())

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield the rows, so that ``pandas.DataFrame(answer)`` is the same table."""
        yield from self.to_frame().to_dict("records")

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return html_of(self.to_frame())

    def __repr__(self) -> str:
        """Return name and columns on one line; of arrays their number."""
        parts = (
            f"{name}=[{value.size} values]" if hasattr(value, "ravel") else f"{name}={value!r}"
            for name, value in self.table_columns().items()
            if value is not None
        )
        return f"{type(self).__name__}({', '.join(parts)})"


def columns_of(answer: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that make a table, by name.

    These are the fields that hold one number or text, and arrays of the shape of the first field
    that is one, flat; fields of another shape are left out.
    """
    # that of dataclasses.asdict would copy histories
    values = {each.name: getattr(answer, each.name) for each in fields(answer)}
    shape = next((value.shape for value in values.values() if hasattr(value, "ravel")), None)
    columns = {}
    for name, value in values.items():
        if hasattr(value, "ravel"):
            if value.shape == shape:
                columns[name] = value.ravel()
        elif isinstance(value, Enum):
            columns[name] = value.value
        elif value is None or isinstance(value, (str, int, float)):
            columns[name] = value
    return columns


def frame_of(columns: Mapping[str, Any]) -> pd.DataFrame:
    """Return columns as a pandas table, of one row where none is an array."""
    import pandas as pd

    several = any(hasattr(value, "ravel") for value in columns.values())
    return pd.DataFrame(columns, index=None if several else [0])


def html_of(frame: pd.DataFrame) -> str:
    """Return a table for a notebook, on end where it has one row."""
    html: str = frame.to_html() if len(frame) > 1 else frame.T.to_html(header=False)
    return html
