"""`rbfrag plot`: pictures of fits and responses."""

from __future__ import annotations

from typing import Annotated

import typer

from rbfrag.cli import options
from rbfrag.cli.motion_argument import find_motion
from rbfrag.cli.output import print_warnings

app = typer.Typer(
    help="Draw fits and responses (.png, .pdf, .svg).",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog="Example:  rbfrag plot fit --out fit.png",
)

Out = Annotated[
    str, typer.Option("--out", help="File to write: .png, .pdf or .svg.", show_default=False)
]


@app.command("fit", epilog="Example:  rbfrag plot fit --model wls-pgv --out fit.png")
def plot_fit(
    out: Out,
    model: Annotated[
        str | None,
        typer.Option("--model", help="Name of the model. Default: the database's default."),
    ] = None,
    db: options.Db = None,
) -> None:
    """Draw the data of a fit with its mean and its 2.5 % and 97.5 % failure lines."""
    from rbfrag.db.engine import opened_database
    from rbfrag.db.model_store import load_model
    from rbfrag.db.queries import combination_table
    from rbfrag.fragility.fit_data import fit_data
    from rbfrag.fragility.model import FragilityModel
    from rbfrag.plots.fit import plot_fit as draw

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        fitted = FragilityModel.from_row(load_model(connection, model))
        suite = fitted.row.diagnostics.get("suite")
        table = combination_table(connection, suite=None if suite is None else str(suite))
    draw(table, fitted, out)
    print(out)
    if fit_data(table, fitted.term).fingerprint != fitted.row.data_fingerprint:
        print_warnings(
            [
                f"the data have changed since {fitted.name} was fitted: the points are those of "
                "today; rbfrag fit --replace  fits them anew"
            ]
        )


@app.command("response", epilog="Example:  rbfrag plot response 1 --p2 3 --kr 0.1 --out a.png")
def plot_response(
    motion: options.Motion,
    p2: options.P2,
    kr: options.Kr,
    out: Out,
    vertical: options.Vertical = None,
    reverse: options.Reverse = False,
    linear: options.Linear = False,
    units: options.Units = None,
    dt: options.Dt = None,
    db: options.Db = None,
) -> None:
    """Draw acceleration against k_r(theta), and theta over the critical angle, in time."""
    from rbfrag.plots.response import plot_response as draw
    from rbfrag.solver.respond import respond

    ground = find_motion(motion, db=db, units=units, dt_s=dt)
    upward = find_motion(vertical, db=db, units=units, dt_s=dt) if vertical else None
    response = respond(
        ground,
        p2=p2,
        kr=kr,
        vertical=upward,
        polarity="reverse" if reverse else "forward",
        linear=linear,
        history=True,
    )
    draw(response, out, p2=p2, kr=kr, linear=linear, reverse=reverse, title=ground.label)
    print(out)
