"""`rbfrag fit`: a fragility model from the stored critical values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli import options
from rbfrag.cli.output import cell, print_json, print_pairs, print_table, print_warnings

if TYPE_CHECKING:
    from rbfrag.fragility.report import FitReport

EXAMPLE = "Example:  rbfrag fit --term pgv"


def fit(
    term: Annotated[
        str,
        typer.Option(
            "--term",
            help="Intensity term [m/s]: pgv; pga_tm = PGA g Tm/(2 pi); pgd_tm = 2 pi PGD/Tm.",
            show_default=False,
        ),
    ],
    method: Annotated[
        str,
        typer.Option("--method", help="wls: weighted least squares with iterated variance."),
    ] = "wls",
    suite: options.Suite = None,
    name: Annotated[
        str | None,
        typer.Option("--name", help="Name of the model. Default: method-term.", show_default=False),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the bootstrap by earthquake.")] = 0,
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace a stored model of the same name.")
    ] = False,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Fit critical toppling velocities y = k_r g/p against an intensity term and store the model.

    The first model of a database becomes its default (rbfrag models default NAME changes it).
    """
    from rbfrag.db.engine import opened_database
    from rbfrag.db.model_store import save_model
    from rbfrag.fragility.fitting import fit as run
    from rbfrag.fragility.model import FragilityModel
    from rbfrag.fragility.report import FitReport

    # reading takes no lock, so that a campaign may go on meanwhile
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        report = run(connection, term=term, method=method, suite=suite, name=name, seed=seed)
    with opened_database(db) as engine, engine.begin() as connection:
        row = save_model(connection, report.model.row, replace=replace)
    print_report(FitReport.from_model(FragilityModel.from_row(row)), json=json)


def print_report(report: FitReport, *, json: bool) -> None:
    """Print the report of a fitted model."""
    if json:
        print_json(report.as_dict())
        return
    details: dict[str, Any] = dict(report.details)
    default = ", the default" if report.model.row.is_default else ""
    print(f"model {report.name}: {report.method} on {report.term}{default}")
    print_table(
        ("parameter", "value", "standard error"),
        [
            (name, value, report.standard_errors.get(name))
            for name, value in report.coefficients.items()
        ],
    )
    print()
    print_pairs(
        {
            "combinations": details.get("n_total"),
            "found, fitted": report.n,
            "below the search limit (left out)": report.n_censored,
            "earthquakes": report.events,
        }
    )
    law = details.get("power_law")
    if law:
        print_pairs({f"power law {name}": value for name, value in law.items()})
    correlations = details.get("log_correlations") or {}
    if correlations:
        ranked = ", ".join(f"{name} {cell(value)}" for name, value in correlations.items())
        print(f"correlation of ln y with ln x: {ranked}")
    for name, value in report.scores.items():
        print(f"{name}: {cell(value)}")
    print_warnings(report.warnings)
