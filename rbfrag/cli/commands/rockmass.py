"""`rbfrag rockmass`: blocks between two random joint sets."""

from __future__ import annotations

from dataclasses import replace

from rbfrag.cli import options
from rbfrag.cli.command import argument, option
from rbfrag.cli.inputs import find_shaking
from rbfrag.cli.output import (
    ProgressBar,
    check_files,
    print_result,
    say_when_compiling,
    write_table,
)

EXAMPLE = "Example:  rbfrag rockmass rockmass.toml --pgv 0.6 --out blocks.csv --plot counts.png"


def rockmass(
    *,
    file: str = argument(
        "Rock mass file (.toml or .csv): dips [deg], spacings [m], friction angles [deg]",
        metavar="FILE",
    ),
    n: int | None = option("Number of realisations [default: from the file, else 20000]"),
    seed: int | None = option("Seed of the random numbers [default: from the file, else 1]"),
    vertical: options.Vertical = None,
    direction: options.Direction,
    motion: str | None = option(
        "Accelerogram for the response of every block in its mode: a file, FILE#INDEX for "
        "one trace of several, or a database id",
        metavar="MOTION",
    ),
    scales: str | None = option(
        "Scale factors of the motion, such as 0.5,1,1.5,2 [default: 1]", metavar="LIST"
    ),
    jobs: options.Jobs = None,
    displacement: float | None = option(
        "Displacement limit of sliding [m] [default with --motion: 0.05]; with --pgv "
        "required for modes other than toppling"
    ),
    rotation: float | None = option(
        "Rotation limit of slumping and confined toppling [deg] [default: failure past recovery]"
    ),
    measures: options.Measures,
    answering: options.Answering,
    reading: options.Reading,
    out: str | None = option(
        "Output table with one row per block, with a motion one per block and scale (.csv, "
        ".xlsx, .parquet)"
    ),
    excel_text: options.ExcelText = False,
    plot: str | None = option(
        "Figure of cumulative counts of blocks against PGA by mode, with a motion of the "
        "fractions that fail (.png, .pdf, .svg)"
    ),
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Sample blocks from two joint sets; print their modes and yields.

    With --motion the response of every block that exceeds its yield is computed, and the fractions
    that fail are listed by mode. With an intensity measure (--pgv etc.) the probability of failure
    is averaged over the blocks of each mode with a fragility model.
    """
    from rbfrag.campaign.rock_mass_answer import rockmass as answered

    check_files(table=out, plot=plot, excel_text=excel_text)
    ground = upward = None
    about: list[str] = []
    if motion is not None:
        ground, upward, about = find_shaking(
            motion, vertical, db=answering.get("db"), reading=reading
        )
        say_when_compiling()
    with ProgressBar("rockmass", "blocks") as bar:
        answer = answered(
            file, n=n, seed=seed, **measures, motion=ground,
            vertical=upward, polarity=direction,
            scales=options.number_list("1" if scales is None else scales, "--scales"),
            displacement_m=displacement, rotation_deg=rotation, jobs=jobs,
            **answering,
            on_progress=lambda progress: bar.show(progress.completed, progress.total),
        )  # fmt: skip
    answer = replace(answer, warnings=(*answer.warnings, *about))
    if out is not None:
        table, notes = answer.table_columns(), answer.warnings
        write_table(table, out, excel_text=excel_text, notes=notes)
    if plot is not None:
        from rbfrag.plots.plot import rockmass as draw

        draw(answer, plot)
    print_result(answer, json=json, verbose=verbose)
