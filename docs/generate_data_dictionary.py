"""Write the data dictionary page from the vocabulary and the schema; --check compares."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

from rbfrag.db.data_dictionary import (
    columns_as_markdown,
    data_dictionary,
    table_meaning,
    view_dictionary,
)
from rbfrag.db.schema import ledger
from rbfrag.vocabulary.quantities import (
    COLUMNS,
    INPUTS,
    QUANTITIES,
    ROW,
    column_of,
    option_of,
    parameter_of,
)
from rbfrag.vocabulary.results import RESULT_GROUPS

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "reference" / "data-dictionary.md"

FIELDS = """\
# Data dictionary

## Fields of a question

What may be said of blocks and their shaking, once for all doors: the keyword of Python, the option
of the shell, the name in requests, and what a column of a table may be called besides, its unit in
brackets (`H (m)`). Written tables use the name in bold.

| keyword | shell | request | columns | unit | range | what it is |
| --- | --- | --- | --- | --- | --- | --- |
"""

KEYS = """\
## Keys of answers

The keys of JSON documents (`--json`, HTTP) in addition to the fields of a question. A value that
does not apply is null.

"""

HEAD = """\
## Tables of the database

Every table and column of the database. `rbfrag db export` writes the same beside the tables, as
JSON and as Markdown. Units are in the column names; `k_r/PGA` is a $k_r$ over the motion's PGA in
g. A missing value is NULL in the database, null in Parquet, an empty cell in CSV and NaN in arrays
and data frames. Row numbers hold in one database only: between databases, compare `natural_key`,
or `samples_sha256` with `dt_s`.

### Columns of several tables

"""

FIT = """\
import sqlite3

import numpy as np
import pandas as pd
import statsmodels.api as sm

from rbfrag.db.location import REFERENCE

connection = sqlite3.connect(f"{REFERENCE.as_uri()}?mode=ro&immutable=1", uri=True)
rows = pd.read_sql(
    "SELECT grid, kr, p2, pgv_m_s, failed FROM outcome WHERE kind = 'toppling' AND "
    "grid IS NOT NULL AND vertical_motion_id IS NULL AND NOT linear AND NOT on_structure",
    connection,
)
strongest = rows[rows["grid"] == rows["grid"].max()]
stable = [strongest.assign(kr=strongest["kr"] * 40 ** (n / 24), failed=0) for n in range(1, 11)]
rows = pd.concat([rows, *stable], ignore_index=True).dropna(subset=["failed"])
rows = rows.query("0.02 <= kr <= 1 and pgv_m_s > 0")
p = np.sqrt(rows["p2"])
h = np.exp(0.18 * np.log(p) - 0.06 * np.log(p) ** 2)
x = np.column_stack([h, h * np.log(rows["pgv_m_s"] * p / (9.80665 * rows["kr"]))])
fit = sm.GLM(rows["failed"], x, sm.families.Binomial()).fit(tol=1e-12, tol_criterion="params")
fit.params"""
"""The fit of outcomes by statsmodels, whose steps a notebook explains."""

VIEWS = f"""\
## Views

Views join the tables for people who write SQL, in SQLite and in PostgreSQL. `rbfrag.read_table`
returns them as well, and `db export --tables outcome` writes them. Conditions of `--where` are over
columns of `outcome`. Response spectra join by `motion_id`. The same coefficients as by
`rbfrag fit --method logistic --term pgv`; the notebook `sql-and-statsmodels` explains the steps:

```python
{FIT}
```

"""


def fields() -> str:
    """Return the table of the fields that blocks, their shaking and rows of tables have."""
    rows = []
    for name in (*COLUMNS, "cohesion_pa"):
        about = QUANTITIES[name]
        aliases = [
            f"**{column_of(name)}**",
            *(alias for alias in INPUTS[name].aliases if alias != column_of(name)),
        ]
        doors = ["", ""]
        if name not in ROW or name == "kind":
            doors = [f"`{option_of(name)}`", f"`{parameter_of(name)}`"]
        cells = [f"`{name}`", *doors, ", ".join(aliases), about.unit, about.range.words]
        rows.append(f"| {' | '.join(cells)} | {about.description('`{}`'.format)} |")
    return FIELDS + "\n".join(rows) + "\n\n"


def keys() -> str:
    """Return the tables of the keys of answers, a table for each subject."""
    parts = [KEYS]
    for title, quantities in RESULT_GROUPS.items():
        rows = [
            f"| `{about.name}` | {about.symbol} | {about.unit} | {about.label} |"
            for about in quantities
        ]
        head = "| key | symbol | unit | meaning |\n| --- | --- | --- | --- |"
        parts.append(f"### {title}\n\n" + "\n".join([head, *rows]) + "\n\n")
    return "".join(parts)


def page() -> str:
    """Return the page: what tables have alike, and then each with its own columns."""
    tables = data_dictionary()
    times = Counter(column for table in tables for column in table.columns)
    usual = {column.name: column for column, count in reversed(times.most_common()) if count > 1}
    common = [column for column in times if column in usual.values()]
    parts = [fields() + keys() + HEAD + columns_as_markdown(common)]
    for table in tables:
        specific = [column for column in table.columns if column not in common]
        also = ", ".join(f"`{column.name}`" for column in table.columns if column in common)
        parts.append(f"### {table.name}\n\n{table.meaning}\n")
        parts += [columns_as_markdown(specific)] if specific else []
        parts += [f"Also: {also}.\n"] if also else []
    ledger_meaning = table_meaning(ledger)
    parts.append(f"### {ledger_meaning.name}\n\n{ledger_meaning.meaning} It is not exported.\n")
    parts.append(columns_as_markdown(ledger_meaning.columns))
    parts.append(VIEWS)
    for view in view_dictionary():
        parts += [f"### {view.name}\n\n{view.meaning}\n", columns_as_markdown(view.columns)]
    return "\n".join(parts)


def main(arguments: list[str]) -> int:
    """Write the page, or say whether it is up to date."""
    if "--check" in arguments:
        if PAGE.exists() and PAGE.read_text(encoding="utf-8") == page():
            return 0
        print(f"{PAGE} is out of date: run python docs/generate_data_dictionary.py")
        return 1
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
