"""`rbfrag losses`: annual failures and losses of blocks from an OpenQuake event set."""

from __future__ import annotations

from rbfrag.cli import options
from rbfrag.cli.command import argument, option
from rbfrag.cli.output import ProgressBar, check_files, print_result, write_table

EXAMPLE = "Example:  rbfrag losses FOLDER --blocks blocks.csv --component rotd50 --out events.csv"


def losses(
    *,
    folder: str | None = argument(
        "Folder with the exports of one job: gmf-data, events, sitemesh, realizations, "
        "ruptures CSV; or its datastore calc_N.hdf5 (extra hdf5)",
        None,
        metavar="[FOLDER]",
    ),
    blocks: str = option(
        "Table of blocks (.csv, .xlsx, .parquet) with p2_1_s2 [1/s²] and kr, or height_m and "
        "width_m [m]; site_id or lon and lat; optional count, weight, loss, loss_sigma, kind",
        ...,
        metavar="FILE",
    ),
    sheet: options.Sheet = None,
    ignore_columns: options.IgnoreColumns = None,
    crs: options.Crs = None,
    within_km: options.WithinKm = options.WITHIN_KM,
    gmf_data: str | None = option(
        "Ground-motion fields, CSV or HDF5 (gmf-data, which also names the sites)",
        metavar="FILE",
    ),
    events: str | None = option("Events file", metavar="FILE"),
    sitemesh: str | None = option("Site mesh file", metavar="FILE"),
    realizations: str | None = option(
        "Realizations file with the logic-tree weights", metavar="FILE"
    ),
    ruptures: str | None = option(
        "Ruptures file, with the investigation time in its first line", metavar="FILE"
    ),
    investigation_time: float | None = option(
        "Investigation time of one stochastic event set [years], as in job.ini, if no "
        "ruptures file gives it"
    ),
    ses: int | None = option(
        "Number of stochastic event sets per realization (ses_per_logic_tree_path), as in "
        "job.ini, if no ruptures file gives it"
    ),
    samples: int = option("Number of samples per event", 100),
    expected: bool = option("Expected values only, without samples and curves", False),
    seed: int = option("Seed of the samples", 0),
    imt: str | None = option(
        "Intensity measure: PGV, 'SA(0.5)', or PGA, converted to PGV with the magnitudes of "
        "the ruptures; several (PGV,PGA) with their --model, sampled independently by "
        "OpenQuake [default: PGV, else SA(1.0), else other SA, as available]"
    ),
    component: str | None = option(
        "Horizontal component of the intensity measures: single, geometric_mean, rotd50, "
        "rotd100 or larger [default: rotd50]"
    ),
    kind: str | None = option(
        "Kind of failure of rows without one [default: toppling, backed by a rock face]"
    ),
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    answering: options.Answering,
    out: str | None = option("Output table of events (.csv, .xlsx, .parquet)"),
    excel_text: options.ExcelText = False,
    plot: str | None = option(
        "Figure of exceedance rates of the number of failures (.png, .pdf, .svg)"
    ),
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Compute failures and losses of blocks in an event set.

    The event set is that of an OpenQuake job, event-based or scenario. Blocks are assigned to its
    sites by site_id, or by lon and lat. Each event has the annual rate
    weight(realization)/(investigation time x event sets); results of a scenario are conditional on
    the earthquake. Failures of blocks in one event are sampled with the dependence model of the
    fragility model: residuals of the earthquake, of the site and of the block. The result does not
    depend on the number of workers.
    """
    from rbfrag.exchange.block_rows import PLACE, PORTFOLIO, read_blocks
    from rbfrag.exchange.event_losses import losses as answered
    from rbfrag.hazards.event_counts import count_years

    check_files(table=out, plot=plot, excel_text=excel_text)
    rows = read_blocks(
        blocks, kind, reads=(*PLACE, *PORTFOLIO), sheet=sheet,
        ignore_columns=options.column_names(ignore_columns), crs=crs,
    )  # fmt: skip
    files = {
        "gmf_data": gmf_data, "events": events, "sitemesh": sitemesh,
        "realizations": realizations, "ruptures": ruptures,
    }  # fmt: skip
    with ProgressBar("losses", "events") as bar:
        answer = answered(
            folder, rows, files={name: path for name, path in files.items() if path is not None},
            samples=samples, expected=expected, seed=seed, investigation_time=investigation_time,
            ses=ses, imt=None if imt is None else imt.split(","), component=component, kind=kind,
            within_km=within_km, **answering, on_progress=bar.show,
            run=options.runner(count_years, jobs, scheduler),
        )  # fmt: skip
    if out is not None:
        write_table(answer.table_columns(), out, excel_text=excel_text, notes=answer.warnings)
    if plot is not None:
        from rbfrag.plots.hazard import plot_losses

        plot_losses(answer, plot)
    print_result(answer, json=json, verbose=verbose, fields=())
