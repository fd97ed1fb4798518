"""`rbfrag db`: the database itself."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import asdict, fields
from typing import TYPE_CHECKING

import typer

from rbfrag.cli.output import (
    print_json,
    print_pairs,
    print_table,
    print_warnings,
    say_when_compiling,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import argument, command_group, option, stacked
from rbfrag.errors import InputError
from rbfrag.results.numbers import count_of

if TYPE_CHECKING:
    from rbfrag.db.merge.databases import MergeReport
    from rbfrag.db.queries import DatabaseInfo, SuiteCount

app = command_group(
    "Upgrade, describe, check, export and merge databases, and import tables.",
    "Example:  rbfrag db info",
)


@app.command("upgrade", epilog="Example:  rbfrag db upgrade --db old.db")
def upgrade(db: options.Db = None, json: options.Json = False) -> None:
    """Upgrade a database to the current schema."""
    from rbfrag.db.upgrade import upgrade_database

    before, after = upgrade_database(db)
    if json:
        print_json({"from": before, "to": after})
    elif before == after:
        print(f"schema {after}: nothing to do")
    else:
        print(f"schema {before} upgraded to {after}")


@app.command("info", epilog="Example:  rbfrag db info --by suite")
@stacked
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
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        if by is None:
            _print_info(database_info(connection), json=json)
        else:
            _print_suites(suite_counts(connection), json=json)


def _print_info(content: DatabaseInfo, *, json: bool) -> None:
    if json:
        print_json(asdict(content))
        return
    rows = content.rows
    print(
        f"{count_of(rows.get('motion', 0), 'motion')} of "
        f"{count_of(rows.get('earthquake', 0), 'earthquake')}, "
        f"{count_of(rows.get('combination', 0), 'combination')} and "
        f"{count_of(rows.get('fragility_model', 0), 'fitted model')}."
    )
    print()
    print_pairs(
        {
            "schema": content.revision,
            "dialect": content.dialect,
            "numerics": content.numerics_versions,
            "default model": content.default_model,
            "last found sound": content.last_sound or "never checked",
        }
    )
    print()
    print_table(("table", "rows"), content.rows.items())
    if content.combinations_by_status:
        print()
        print_table(("combinations", "number"), content.combinations_by_status.items())


def _print_suites(counts: Iterable[SuiteCount], *, json: bool) -> None:
    from rbfrag.db.queries import SuiteCount

    rows = [asdict(count) for count in counts]
    if json:
        print_json({"suites": rows})
    else:
        columns = [field.name for field in fields(SuiteCount)]
        print_table(columns, [tuple(row.values()) for row in rows])


@app.command("check", epilog="Example:  rbfrag db check --sample 100 --seed 7")
@stacked
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
    from rbfrag.db.check.damage import Damage
    from rbfrag.db.check.database import check_database, coverage
    from rbfrag.db.check.ledger import accept_rows, mark_sound
    from rbfrag.db.engine import opened_database
    from rbfrag.db.insert import utc_now

    begun, again = utc_now(), None
    accepted = accept_rows(db) if accept else []
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        findings = check_database(connection)
        covered = coverage(connection)
        if sample:
            from rbfrag.campaign.resimulate import resimulate

            say_when_compiling()
            try:
                again = resimulate(connection, sample=sample, seed=seed)
                findings += again.findings
            except Exception as error:
                if not findings:
                    raise
                # what a damaged row can raise there, nobody can list; the row is found already
                why = f"{type(error).__name__}: {error}"
                findings.append(Damage("database", "-", f"computing again broke off ({why})"))
    if not findings:
        mark_sound(db, begun)
    if json:
        computed = None if again is None else asdict(again)
        if computed is not None:
            del computed["findings"]
        print_json(
            {
                "sound": not findings,
                "findings": [asdict(finding) for finding in findings],
                "accepted": [asdict(each) for each in accepted],
                "resimulated": computed,
                "covered": covered,
            }
        )
    else:
        if again is not None:
            print(
                f"computed again: {again.sampled} of {again.eligible} combinations, "
                f"{again.exact} exact, {again.within_error} within the solver's error"
            )
        for each in accepted:
            print(f"accepted: {each.table} {each.row}: {each.problem}")
        if findings:
            print_table(
                ("table", "row", "problem"), [(f.table, f.row, f.problem) for f in findings]
            )
            for advice in dict.fromkeys(finding.advice for finding in findings):
                print(f"to do: {advice}")
        else:
            print("sound: nothing is wrong with this database")
        print(covered)
    if findings:
        raise typer.Exit(1)


@app.command("export", epilog="Example:  rbfrag db export --out tables --tables motion,combination")
@stacked
def export(
    *,
    out: str = option(
        "New folder with a file for each table and the data dictionary", ..., metavar="DIR"
    ),
    db: options.Db = None,
    format: str = option("File format: parquet or csv", "parquet"),
    tables: str | None = option("Tables to export, separated by commas [default: all]"),
    arrays: bool = option("Include samples [g] and response histories (Parquet only)", False),
    excel_text: bool = option(options.EXCEL_TEXT, False),
    json: options.Json = False,
) -> None:
    """Export the tables as Parquet or CSV, with a data dictionary."""
    from rbfrag.exchange.database_tables import export_database

    names = None if tables is None else [name.strip() for name in tables.split(",") if name.strip()]
    report = export_database(
        out, db=db, format=format, tables=names, arrays=arrays, excel_text=excel_text
    )
    if json:
        print_json(report.as_dict())
    else:
        print_table(("table", "rows"), report.rows.items())
        print(f"written to {report.folder}")
        print_warnings(report.warnings)


@app.command("merge", epilog="Example:  rbfrag db merge theirs.db --db ours.db")
@stacked
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
    from rbfrag.db.merge.databases import merge_databases

    _print_merge(merge_databases(other, db=db), json=json)


@app.command("import", epilog="Example:  rbfrag db import critical.csv --map map.toml")
@stacked
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

    _print_merge(import_critical_values(table, map, db=db), json=json)


def _print_merge(report: MergeReport, *, json: bool) -> None:
    """Print what was added to a database, and what was there."""
    if json:
        print_json(report.as_dict())
        return
    for note in report.notes:
        print(f"note: {note}", file=sys.stderr)
    tables = sorted(report.added.keys() | report.same.keys())
    rows = [(name, report.added.get(name, 0), report.same.get(name, 0)) for name in tables]
    print_table(("table", "added", "already here"), rows)
    if report.restated:
        print(f"earthquakes stated instead of guessed: {report.restated} motions")
    if report.within_error:
        print(f"equal within the error of the solver, ours kept: {report.within_error}")
