"""`rbfrag db`: the database itself."""

from __future__ import annotations

from dataclasses import asdict

import typer

from rbfrag.cli import options
from rbfrag.cli.output import print_json, print_pairs, print_table

app = typer.Typer(
    help="Upgrade, describe and check a database.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog="Example:  rbfrag db info",
)


@app.command("upgrade", epilog="Example:  rbfrag db upgrade --db old.db")
def upgrade(db: options.Db = None, json: options.Json = False) -> None:
    """Bring a database to the schema of this rbfrag, in one transaction."""
    from rbfrag.db.upgrade import upgrade_database

    before, after = upgrade_database(db)
    if json:
        print_json({"from": before, "to": after})
    elif before == after:
        print(f"schema {after}: nothing to do")
    else:
        print(f"schema {before} upgraded to {after}")


@app.command("info", epilog="Example:  rbfrag db info --json")
def info(db: options.Db = None, json: options.Json = False) -> None:
    """Print the schema, the number of rows and the default model."""
    from rbfrag.db.engine import opened_database
    from rbfrag.db.queries import database_info

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        found = database_info(connection)
    if json:
        print_json(asdict(found))
        return
    print_pairs(
        {
            "schema": found.revision,
            "dialect": found.dialect,
            "numerics": found.numerics_versions,
            "default model": found.default_model,
        }
    )
    print()
    print_table(("table", "rows"), found.rows.items())
    if found.combinations_by_status:
        print()
        print_table(("combinations", "number"), found.combinations_by_status.items())


@app.command("check", epilog="Example:  rbfrag db check")
def check(db: options.Db = None, json: options.Json = False) -> None:
    """Look for damage: references, sha256 of samples, brackets, keys. Exit 1 if any is found."""
    from rbfrag.db.check import check_database
    from rbfrag.db.engine import opened_database

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        findings = check_database(connection)
    if json:
        print_json({"sound": not findings, "findings": [asdict(found) for found in findings]})
    elif findings:
        print_table(("table", "row", "problem"), [(f.table, f.row, f.problem) for f in findings])
    else:
        print("sound: nothing is wrong with this database")
    if findings:
        raise typer.Exit(1)
