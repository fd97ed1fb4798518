"""`rbfrag losses`: how many blocks fail a year by an event set of OpenQuake, and at what loss."""

from __future__ import annotations

from dataclasses import dataclass

from rbfrag.cli.commands.simulate import WorkerOptions
from rbfrag.cli.output import ProgressBar, check_files, print_result, write_table
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import argument, option, stacked

EXAMPLE = "Example:  rbfrag losses FOLDER --blocks blocks.csv --component rotd50 --out events.csv"


@dataclass(frozen=True, kw_only=True)
class JobFileOptions:
    """The exports of one job."""

    gmf_data: str | None = option(
        "File of ground motion fields, CSV or HDF5 (gmf-data, which names the sites too).",
        metavar="FILE",
    )
    events: str | None = option("File of all events.", metavar="FILE")
    sitemesh: str | None = option("File of all sites.", metavar="FILE")
    realizations: str | None = option("File of the logic tree's weights.", metavar="FILE")
    ruptures: str | None = option(
        "File of ruptures, whose first line states how long the events took.", metavar="FILE"
    )

    def named(self) -> dict[str, str]:
        """Return the files that are named, by what they hold."""
        return {name: path for name, path in vars(self).items() if path is not None}


@dataclass(frozen=True, kw_only=True)
class Time:
    """How long the events took, where no file of ruptures states it."""

    investigation_time: float | None = option(
        "Years of one stochastic event set, as in job.ini; where no file of ruptures states it."
    )
    ses: int | None = option(
        "Number of event sets of each realization (ses_per_logic_tree_path), likewise."
    )


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """How the blocks of one event are taken together."""

    samples: int = option("Samples of each event.", 100)
    expected: bool = option("Expected values alone, without samples and curves.", False)
    seed: int = option("Seed of the samples.", 0)


@dataclass(frozen=True, kw_only=True)
class Meaning:
    """What shakes the blocks, and how they fail."""

    imt: str | None = option(
        "Measure that the models read: PGV, 'SA(1.0)', or PGA, turned into PGV by the magnitudes "
        "of the ruptures; several as PGV,PGA, with their --model, which the engine draws "
        "independently. Default: the first of PGV and SA(1.0) that the job has."
    )
    component: str | None = option(
        "Horizontal component of the measures: single, geometric_mean, rotd50, rotd100 or larger "
        "[default: rotd50]."
    )
    kind: str | None = option(
        "Kind of failure of rows that state none. Default: toppling, backed by a slope."
    )


@dataclass(frozen=True, kw_only=True)
class LossTable:
    """The table of blocks."""

    blocks: str = option(
        "Table of blocks (.csv, .xlsx, .parquet) with p2_1_s2 [1/s²] and kr, or height_m and "
        "width_m [m], site_id or lon and lat, and if wanted count, weight, loss, loss_sigma, kind.",
        ...,
        metavar="FILE",
    )
    sheet: str | None = option(options.SHEET, metavar="NAME")
    ignore_columns: str | None = option(options.IGNORE_COLUMNS, metavar="NAME,NAME")
    crs: str | None = option(options.CRS)
    within_km: float = option(options.WITHIN_HELP, options.WITHIN_KM)


@stacked
def losses(
    *,
    folder: str | None = argument(
        "Folder with one job's exports: gmf-data, events, sitemesh, realizations, ruptures CSV; "
        "or its datastore calc_N.hdf5 (extra hdf5).",
        None,
        metavar="[FOLDER]",
    ),
    table: LossTable,
    files: JobFileOptions,
    time: Time,
    sampling: Sampling,
    meaning: Meaning,
    workers: WorkerOptions,
    answering: options.Answering,
    out: str | None = option("Write the table of events (.csv, .xlsx, .parquet)."),
    excel_text: bool = option(options.EXCEL_TEXT, False),
    plot: str | None = option("Draw how often numbers of failures are reached (.png, .pdf, .svg)."),
    printing: options.Printing,
) -> None:
    """Count failures and losses in the earthquakes of an event set.

    The event set is that of an OpenQuake job, event-based or scenario. Blocks join it by site_id,
    or by lon and lat.
    Each event counts weight(realization)/(investigation time x event sets) a year; a scenario has
    no rate, and its answer is given the event. What the blocks of one event do together is drawn
    by the model's dependence: what the earthquake shares, what a site shares, what each block has.
    The answer is the same for any number of workers.
    """
    from rbfrag.exchange.block_rows import PLACE, PORTFOLIO, read_blocks
    from rbfrag.exchange.event_losses import losses as answered
    from rbfrag.hazards.event_counts import count_years

    check_files(table=out, plot=plot, excel_text=excel_text)
    rows = read_blocks(
        table.blocks, meaning.kind, reads=(*PLACE, *PORTFOLIO), sheet=table.sheet,
        ignore_columns=options.column_names(table.ignore_columns), crs=table.crs,
    )  # fmt: skip
    with ProgressBar("losses", "events") as bar:
        answer = answered(
            folder, rows, files=files.named(), samples=sampling.samples,
            expected=sampling.expected, seed=sampling.seed,
            investigation_time=time.investigation_time, ses=time.ses,
            imt=None if meaning.imt is None else meaning.imt.split(","),
            component=meaning.component, kind=meaning.kind, within_km=table.within_km,
            **answering, run=workers.runner(count_years), on_progress=bar.show,
        )  # fmt: skip
    if out is not None:
        write_table(answer.table_columns(), out, excel_text=excel_text, notes=answer.warnings)
    if plot is not None:
        from rbfrag.plots.losses import plot_losses

        plot_losses(answer, plot)
    print_result(answer, json=printing.json, verbose=printing.verbose, fields=())
