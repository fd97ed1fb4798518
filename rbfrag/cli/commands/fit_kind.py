"""`rbfrag fit --kind`: a model of blocks that slide or slump."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbfrag.cli.output import cell, print_json, print_pairs, print_table, print_warnings

if TYPE_CHECKING:
    from rbfrag.db.model_file import ModelRow


def fit_kind(
    kind: str,
    *,
    term: str,
    rotation_deg: float | None,
    suite: str | None,
    vertical: str,
    name: str | None,
    replace: bool,
    db: str | None,
    json: bool,
) -> None:
    """Fit a model, store it and print its report."""
    from rbfrag.db.engine import opened_database
    from rbfrag.db.models import save_model
    from rbfrag.fragility.fit.kind_fitting import fit_kind as run

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        fitted = run(
            connection,
            kind=kind,
            term=term,
            rotation_deg=rotation_deg,
            suite=suite,
            vertical=vertical,  # type: ignore[arg-type]
            name=name,
        )
    with opened_database(db) as engine, engine.begin() as connection:
        row = save_model(connection, fitted.row, replace=replace)
    print_kind_report(row, json=json)


def print_kind_report(row: ModelRow, *, json: bool) -> None:
    """Print the report of a fitted model."""
    from rbfrag.fragility.fit.kind_report import kind_report

    report = kind_report(row)
    if json:
        print_json(report)
        return
    default = f", the default of {row.kind}" if row.is_default else ""
    print(f"model {row.name}: {row.method} on {row.term}{default}")
    print(f"says: {report['meaning']}")
    errors = report.get("standard_errors", {})
    print_table(
        ("parameter", "value", "standard error"),
        [(name, value, errors.get(name)) for name, value in row.coefficients.items()],
    )
    print("standard error: clustered by earthquake, each left out in turn")
    names = {"n": "found", "n_censored": "censored", "events": "earthquakes",
             "rotation_deg": "rotation [deg]"}  # fmt: skip
    print_pairs({text: report.get(name) for name, text in names.items()})
    print("scores, judged on simulated outcomes:")
    for name, value in report.get("scores", {}).items():
        print(f"  {name}: {cell(value)}")
    print_warnings(report.get("warnings", ()))
