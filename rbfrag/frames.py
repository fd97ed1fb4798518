"""Answers as tables, for notebooks and pandas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from enum import Enum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd


def columns_of(answer: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are columns of a table, by name.

    These are the fields that hold one number or text, and arrays of the shape of the first field
    that is one, flat; fields of another shape are left out.
    """
    # that of dataclasses.asdict would copy histories
    values = {item.name: getattr(answer, item.name) for item in fields(answer)}
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
    """Return columns as a pandas DataFrame, with one row if none is an array."""
    import pandas as pd

    several = any(hasattr(value, "ravel") for value in columns.values())
    return pd.DataFrame(columns, index=None if several else [0])


def frame_of_rows(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return rows of values by name as a pandas table."""
    import pandas as pd

    return pd.DataFrame(rows)


def html_of(frame: pd.DataFrame) -> str:
    """Return an HTML table for a notebook, transposed if it has one row."""
    html: str = frame.to_html() if len(frame) > 1 else frame.T.to_html(header=False)
    return html
