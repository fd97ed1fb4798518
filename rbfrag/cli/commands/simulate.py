"""`rbfrag simulate`: critical values and outcomes of every motion and polarity."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast

from rbfrag.cli.output import (
    ProgressBar,
    check_files,
    print_result,
    say_when_compiling,
    write_table,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.option_groups import option, stacked

if TYPE_CHECKING:
    from rbfrag.campaign.summary import CampaignProgress
    from rbfrag.db.rows import Vertical

EXAMPLE = "Example:  rbfrag simulate --p2 30,10,3,1,0.3,0.1 --vertical both --grid 23"

RECOVERY = "recovery"
"""What stands for failure past recovery in a list of rotations."""


AFTER_A_DEATH = "run the same command again"
"""What to do when a worker process has died of a command that stores nothing."""


@dataclass(frozen=True, kw_only=True)
class WorkerOptions:
    """Worker processes or cluster of a campaign."""

    jobs: options.Jobs = None
    scheduler: str | None = option(
        "Dask scheduler whose workers replace local ones, such as tcp://host:8786", metavar="URL"
    )

    def runner(self, work: Callable[..., Any]) -> Callable[..., Iterator[Any]]:
        """Return the function that runs work on local processes or on a cluster.

        Args:
            work: does one part, after what all have in common, if there is anything; a function of
                a module, which workers can find.
        """
        from rbfrag.campaign.executors.local import check_workers, executor

        check_workers(self.jobs, self.scheduler)

        def run(parts: Iterator[Any], number: int, shared: Any = None) -> Iterator[Any]:
            with executor(
                work, self.jobs, self.scheduler, after_a_death=AFTER_A_DEATH, shared=shared
            ) as execute:
                yield from execute(parts, number)

        return run


@dataclass(frozen=True, kw_only=True)
class BlockOptions:
    """Blocks to simulate and their failure criteria; each kind has its own."""

    p2: str | None = option(
        "Frequency parameters p² of toppling and rocking [1/s²], separated by commas "
        "[default: 30,10,3,1,0.3,0.1]"
    )
    restitution_factor: str | None = option(
        "Factors on the coefficient of restitution 1 - 1.5 sin² α of a rocking rectangular "
        "block [default: 1,0.95,0.9,0.8]",
        metavar="LIST",
    )
    rotation: str | None = option(
        "Rotation limits of slumping [deg]; recovery for failure past recovery [default: "
        "2,recovery]",
        metavar="LIST",
    )
    displacement: str | None = option(
        "Displacement limits of sliding on a level plane [m] [default: 0.01,0.05,0.15,0.3]",
        metavar="LIST",
    )


@dataclass(frozen=True, kw_only=True)
class Sequence:
    """Options of motions in sequence."""

    sequence: bool = option(
        "Conditional fragility under two consecutive motions (sliding, slumping, "
        "confined_toppling)",
        False,
    )
    seed: int = option("Seed of the pairs of --sequence", 1)
    draws: int = option(
        "Number of first motions of --sequence drawn for each motion that is not a later "
        "shock of its station",
        1,
    )
    out: str | None = option(
        "Output table of the conditional fragility of --sequence (.csv, .parquet)", metavar="FILE"
    )


@dataclass(frozen=True, kw_only=True)
class StorageOptions:
    """Additional results to store for each motion."""

    vertical: str = option(
        "Horizontal motions alone, with the vertical motion of the recording, or both",
        "without",
        metavar="without|with|both",
    )
    full_map: bool = option(
        "Store also the toppling and stable intervals of k_r/PGA",
        False,
        word="--map",
    )
    grid: str | None = option(
        "Additional toppling blocks for the outcome grid: N blocks with k_r/PGA from 0.99 to "
        "0.01 in equal ratios, or a list of k_r/PGA",
        metavar="N|LIST",
    )
    store_responses: str | None = option(
        "Toppling blocks with stored response histories (about 300 kB each): values of "
        "k_r/PGA, or critical for the critical block of each combination",
        metavar="LIST",
    )


@stacked
def simulate(
    *,
    workers: WorkerOptions,
    suite: options.Suite = None,
    include_structures: bool = option(options.INCLUDE_STRUCTURES, False),
    kind: str = option(
        "Kind of failure: toppling, rocking, slumping, confined_toppling or sliding", "toppling"
    ),
    blocks: BlockOptions,
    stored: StorageOptions,
    sequence: Sequence,
    db: options.Db = None,
    printing: options.Printing,
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
    from rbfrag.campaign.interrupt import stopped_by_interrupts
    from rbfrag.campaign.simulate import simulate as run

    histories = stored.store_responses
    check_files(table=sequence.out)
    say_when_compiling()
    with stopped_by_interrupts() as stopped, ProgressBar("simulate", "combinations") as bar:

        def show(progress: CampaignProgress) -> None:
            before = f"{progress.resumed} stored before" if progress.resumed else ""
            bar.show(progress.completed, progress.total, before)

        summary = run(
            db,
            kind=kind,
            suite=suite,
            include_structures=include_structures,
            p2=_numbers(blocks.p2, "--p2"),
            rotations_deg=None if blocks.rotation is None else _rotations(blocks.rotation),
            displacements_m=_numbers(blocks.displacement, "--displacement"),
            restitution_factors=_numbers(blocks.restitution_factor, "--restitution-factor"),
            vertical=cast("Vertical", stored.vertical),  # any other word is rejected
            grid=None if stored.grid is None else _grid(stored.grid),
            store_responses=None if histories is None else _blocks(histories),
            full_map=stored.full_map,
            sequence=sequence.sequence,
            seed=sequence.seed,
            draws=sequence.draws,
            jobs=workers.jobs,
            scheduler=workers.scheduler,
            on_progress=show,
            stopped=stopped,
        )
    if summary.sequence is not None and sequence.out is not None:
        write_table(summary.sequence.table_columns(), sequence.out, excel_text=False)
    print_result(summary, json=printing.json, verbose=printing.verbose)


def _numbers(text: str | None, option: str) -> list[float] | None:
    return None if text is None else options.number_list(text, option)


def _rotations(text: str) -> list[float | None]:
    return [
        None if part.strip() == RECOVERY else options.number_list(part, "--rotation")[0]
        for part in text.split(",")
    ]


def _grid(text: str) -> int | list[float]:
    return int(text) if text.strip().isdecimal() else options.number_list(text, "--grid")


def _blocks(text: str) -> list[float | Literal["critical"]]:
    blocks: list[float | Literal["critical"]] = []
    for part in text.split(","):
        if part.strip() == "critical":
            blocks.append("critical")
        else:
            blocks += options.number_list(part, "--store-responses")
    return blocks
