"""`rbfrag db`: maintenance of the database."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from rbfrag.cli import options
from rbfrag.cli.command import Commands, argument, option
from rbfrag.cli.output import print_json, print_result, say_when_compiling
from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.results.result import Result

app = Commands(
    "Upgrade, describe, check, export and merge databases, and import tables.",
    "Example:  rbfrag db info",
)


@app.command("upgrade", epilog="Example:  rbfrag db upgrade --db old.db")
def upgrade(db: options.Db = None, json: options.Json = False) -> None:
    """Upgrade a database to the current schema."""
    from rbfrag.db.engine import upgrade_database

    before, after, deleted = upgrade_database(db)
    if json:
        print_json({"from": before, "to": after, "deleted_models": list(deleted)})
    elif before == after:
        print(f"schema {after}: nothing to do")
    else:
        print(f"schema {before} upgraded to {after}")
        if deleted:
            print(
                f"Fitted models of a form that is no longer supported were deleted: "
                f"{', '.join(deleted)}; fit them again by  rbfrag fit"
            )


@app.command("info", epilog="Example:  rbfrag db info --by suite")
def info(
    *,
    db: options.Db = None,
    by: str | None = option("Results by suite instead: suite"),
    json: options.Json = False,
) -> None:
    """Print schema, numbers of rows and default model.

    With --by suite the results are listed by suite.
    """
    from rbfrag.db.engine import opened_database
    from rbfrag.db.queries import database_info, suite_counts

    if by not in (None, "suite"):
        raise InputError(f"--by {by!r}: it must be suite")
    query = database_info if by is None else suite_counts
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        content: Result = query(connection)
    print_result(content, json=json)


@app.command("check", epilog="Example:  rbfrag db check --sample 100 --seed 7")
def check(
    *,
    db: options.Db = None,
    sample: int = option(
        "Number of randomly chosen combinations to compute again, 0 for none", 20, min=0
    ),
    seed: int = option("Seed of the random sample", 0),
    accept: bool = option("Accept the rows present as complete, after a loss", False),
    json: options.Json = False,
) -> None:
    """Check a database for damage.

    The check covers the file, references, samples, keys, brackets, maps, and a random sample
    computed again. The exit status is 1 if damage is found.
    """
    from rbfrag.campaign.database_check import check_with_sample

    if sample:
        say_when_compiling()
    result = check_with_sample(db, sample=sample, seed=seed, accept=accept)
    print_result(result, json=json)
    if not result.is_sound:
        raise typer.Exit(1)


@app.command("export", epilog="Example:  rbfrag db export --out tables --tables motion,combination")
def export(
    *,
    out: str = option(
        "New folder with a file for each table and the data dictionary", ..., metavar="DIR"
    ),
    db: options.Db = None,
    format: str = option("File format: parquet or csv", "parquet"),
    tables: str | None = option("Tables to export, separated by commas [default: all]"),
    arrays: bool = option("Include samples [g] and response histories (Parquet only)", False),
    excel_text: options.ExcelText = False,
    json: options.Json = False,
) -> None:
    """Export the tables as Parquet or CSV, with a data dictionary."""
    from rbfrag.exchange.database_tables import export_database

    names = None if tables is None else [name.strip() for name in tables.split(",") if name.strip()]
    report = export_database(
        out, db=db, format=format, tables=names, arrays=arrays, excel_text=excel_text
    )
    print_result(report, json=json)


@app.command("merge", epilog="Example:  rbfrag db merge theirs.db --db ours.db")
def merge(
    *,
    other: str = argument(
        "Source database, a path or SQLAlchemy URL; it is not modified", metavar="OTHER"
    ),
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Add the contents of another database.

    Motions, suites, results and models are added. A second merge changes nothing. If the databases
    contradict each other, nothing is written.
    """
    from rbfrag.db.merge import merge_databases

    print_result(merge_databases(other, db=db), json=json)


@app.command("import", epilog="Example:  rbfrag db import critical.csv --map map.toml")
def import_(
    *,
    table: str = argument("CSV table with one critical value per line", metavar="TABLE.csv"),
    map: str = option("TOML file with the column and unit of each field", ..., metavar="FILE"),
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Import critical values of toppling from a table.

    The table also has the intensity measures of the motions. A second import changes nothing. If
    the table contradicts stored values, nothing is written.
    """
    from rbfrag.exchange.tables.critical_values import import_critical_values

    print_result(import_critical_values(table, map, db=db), json=json)
