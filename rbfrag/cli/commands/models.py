"""`rbfrag models`: the fitted fragility models of a database."""

from __future__ import annotations

from typing import Annotated

import typer

from rbfrag.cli import options
from rbfrag.cli.command import Commands, argument, model_names
from rbfrag.cli.output import print_result

app = Commands(
    "List, show and choose fitted fragility models.", "Example:  rbfrag models show toppling-pgv"
)

Name = Annotated[
    str, typer.Argument(metavar="NAME", help="Name of the model", autocompletion=model_names)
]


@app.command("list", epilog="Example:  rbfrag models list --json")
def list_models(db: options.Db = None, json: options.Json = False) -> None:
    """List the fitted models with their scores.

    The log loss is from leave-one-earthquake-out cross-validation; lower is better, among models of
    one kind. For blocks with k_r it is that of k_r >= 0.05. Among the models whose predictors are
    available, the default model is used, else the best. Models of methods for comparison are used
    by name only. Without a database the built-in models are listed.
    """
    from rbfrag.fragility.model_selection import ModelList, stored_rows

    print_result(ModelList(stored_rows(db)), json=json)


@app.command("show", epilog="Example:  rbfrag models show toppling-pgv")
def show_model(
    verbose: options.Verbose = False,
    json: options.Json = False,
    name: str | None = argument(
        "Name of the model [default: list all]",
        None,
        metavar="NAME",
        autocompletion=model_names,
    ),
    db: options.Db = None,
) -> None:
    """Print the report of a fitted model, or the list of models."""
    if name is None:
        list_models(db, json=json)
        return
    from rbfrag.fragility.fit.report import FitReport
    from rbfrag.fragility.model import FragilityModel
    from rbfrag.fragility.model_selection import stored_row

    row = stored_row(name, db)
    report = FitReport.from_model(FragilityModel.from_row(row))
    print_result(report, json=json, verbose=verbose, fields=())


@app.command("default", epilog="Example:  rbfrag models default toppling-pgv")
def set_default_model(name: Name, db: options.Db = None) -> None:
    """Set the default model of a kind, instead of the model with the best score."""
    from rbfrag.db.engine import opened_database
    from rbfrag.db.location import data_place
    from rbfrag.db.models import set_default
    from rbfrag.errors import InputError

    place, built_in = data_place(db)
    if built_in:
        raise InputError(
            f"the built-in data set is read-only: use --model {name}, or copy {place} to "
            "rbfrag.db and set the default there"
        )
    with opened_database(db) as engine, engine.begin() as connection:
        set_default(connection, name)
    print(f"{name} is the default model now")


@app.command("check", epilog="Example:  rbfrag models check")
def check(db: options.Db = None, json: options.Json = False) -> None:
    """Check whether the data of the models have changed since they were fitted.

    The exit status is 1 if data have changed, or if a model is invalid.
    """
    from rbfrag.db.engine import opened_database
    from rbfrag.db.models import model_rows
    from rbfrag.fragility.fit.stored import check_models

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        checks = check_models(connection, model_rows(connection))
    print_result(checks, json=json)
    if not checks.is_passed:
        raise typer.Exit(1)
