"""A table of the database as a pandas DataFrame."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rbfrag.db.engine import opened_database
from rbfrag.db.table_columns import chosen_columns, read_columns

if TYPE_CHECKING:
    import pandas as pd


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
