"""`rbfrag simulate`: critical values and outcomes of every motion and polarity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from rbfrag.cli import options
from rbfrag.cli.command import option
from rbfrag.cli.output import (
    ProgressBar,
    check_files,
    print_result,
    say_when_compiling,
    write_table,
)

if TYPE_CHECKING:
    from rbfrag.campaign.summary import CampaignProgress
    from rbfrag.db.rows import Vertical

EXAMPLE = "Example:  rbfrag simulate --p2 30,10,3,1,0.3,0.1 --vertical both --grid 23"

RECOVERY = "recovery"
"""What stands for failure past recovery in a list of rotations."""

NO_WORDS: Mapping[str, Any] = {}


def simulate(
    *,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    suite: options.Suite = None,
    where: options.Where = None,
    include_structures: options.IncludeStructures = False,
    kind: str = option(
        "Kind of failure: toppling, rocking, slumping, confined_toppling or sliding", "toppling"
    ),
    p2: str | None = option(
        "Frequency parameters p² of toppling and rocking [1/s²], separated by commas "
        "[default: 30,10,3,1,0.3,0.1]"
    ),
    restitution_factor: str | None = option(
        "Factors on the coefficient of restitution 1 - 1.5 sin² α of a rocking rectangular "
        "block [default: 1,0.95,0.9,0.8]",
        metavar="LIST",
    ),
    rotation: str | None = option(
        "Rotation limits of slumping [deg]; recovery for failure past recovery [default: "
        "2,recovery]",
        metavar="LIST",
    ),
    displacement: str | None = option(
        "Displacement limits of sliding on a level plane [m] [default: 0.01,0.05,0.15,0.3]",
        metavar="LIST",
    ),
    vertical: str = option(
        "Horizontal motions alone, with the vertical motion of the recording, or both",
        "without",
        metavar="without|with|both",
    ),
    full_map: bool = option(
        "Store also the toppling and stable intervals of k_r/PGA", False, "--map"
    ),
    grid: str | None = option(
        "Additional toppling blocks for the outcome grid: N blocks with k_r/PGA from 0.99 to "
        "0.01 in equal ratios, or a list of k_r/PGA",
        metavar="N|LIST",
    ),
    store_responses: str | None = option(
        "Toppling blocks with stored response histories (about 300 kB each): values of "
        "k_r/PGA, or critical for the critical block of each combination",
        metavar="LIST",
    ),
    sequence: bool = option(
        "Conditional fragility under two consecutive motions (sliding, slumping, "
        "confined_toppling)",
        False,
    ),
    seed: int = option("Seed of the pairs of --sequence", 1),
    draws: int = option(
        "Number of first motions of --sequence drawn for each motion that is not a later "
        "shock of its station",
        1,
    ),
    out: str | None = option(
        "Output table of the conditional fragility of --sequence (.csv, .parquet)", metavar="FILE"
    ),
    db: options.Db = None,
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Compute and store critical values and outcomes of all motions.

    A combination is a motion, without or with its vertical motion, in one polarity, and a block.
    Toppling: the critical strength at each p2 and the outcomes of a grid of blocks. Slumping and
    confined_toppling: the outcomes of a documented family of blocks under scaled records, each
    simulated to its end. Sliding: the critical strengths of the displacement limits. Rocking: the
    outcomes of a grid of free-standing blocks in one polarity, without critical strengths.

    With --sequence, sliding and slumping blocks are subjected to two consecutive motions: two
    shocks of one station if the metadata give them, and randomly chosen motions of two earthquakes.
    The result is the fraction that fails in the second motion of the blocks that survived the
    first, by their displaced state and by PGA of the second motion over the yield acceleration,
    compared with the same blocks in their initial position.

    After an interruption the same command resumes; stored results are not computed again, and
    missing parts of a stored combination are added.
    """
    from rbfrag.campaign.executors import stopped_by_interrupts
    from rbfrag.campaign.simulate import simulate as run

    check_files(table=out)
    say_when_compiling()
    with stopped_by_interrupts() as stopped, ProgressBar("simulate", "combinations") as bar:

        def show(progress: CampaignProgress) -> None:
            before = f"{progress.resumed} stored before" if progress.resumed else ""
            bar.show(progress.completed, progress.total, before)

        summary = run(
            db,
            kind=kind,
            suite=suite,
            where=where,
            include_structures=include_structures,
            p2=_numbers(p2, "--p2"),
            rotations_deg=_numbers(rotation, "--rotation", {RECOVERY: None}),
            displacements_m=_numbers(displacement, "--displacement"),
            restitution_factors=_numbers(restitution_factor, "--restitution-factor"),
            vertical=cast("Vertical", vertical),  # any other word is rejected
            grid=int(grid) if grid and grid.strip().isdecimal() else _numbers(grid, "--grid"),
            store_responses=_numbers(
                store_responses, "--store-responses", {"critical": "critical"}
            ),
            full_map=full_map,
            sequence=sequence,
            seed=seed,
            draws=draws,
            jobs=jobs,
            scheduler=scheduler,
            on_progress=show,
            stopped=stopped,
        )
    if summary.sequence is not None and out is not None:
        write_table(summary.sequence.table_columns(), out, excel_text=False)
    print_result(summary, json=json, verbose=verbose)


def _numbers(text: str | None, option: str, words: Mapping[str, Any] = NO_WORDS) -> Any:
    """Return the numbers of a list, and what stands for words in it; None without a list."""
    if text is None:
        return None
    return [
        words[part.strip()] if part.strip() in words else options.number_list(part, option)[0]
        for part in text.split(",")
    ]
