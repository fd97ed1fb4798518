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
from rbfrag.cli.parameters.stack import option, stacked

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
    """Who does the work."""

    jobs: options.Jobs = None
    scheduler: str | None = option(
        "Dask scheduler whose workers take the place of local ones, tcp://host:8786.", metavar="URL"
    )

    def runner(self, work: Callable[..., Any]) -> Callable[..., Iterator[Any]]:
        """Return what does the parts of some work, by local processes or by a cluster.

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
    """Which blocks are run, and what counts as their failure; each kind has its own."""

    p2: str | None = option(
        "Toppling and rocking: frequency parameters p² [1/s²], separated by commas. Default: "
        "30,10,3,1,0.3,0.1."
    )
    restitution_factor: str | None = option(
        "Rocking: factors on the restitution 1 - 1.5 sin² α of the rectangle. Default: "
        "1,0.95,0.9,0.8.",
        metavar="LIST",
    )
    rotation: str | None = option(
        "Slumping: rotations that count as failure [deg], and the word recovery for "
        "failure past recovery. Default: 2,recovery.",
        metavar="LIST",
    )
    displacement: str | None = option(
        "Sliding: displacements on a level plane [m]. Default: 0.01,0.05,0.15,0.3.", metavar="LIST"
    )


@dataclass(frozen=True, kw_only=True)
class Sequence:
    """Two motions, one after the other."""

    sequence: bool = option(
        "Sliding, slumping, confined_toppling: run blocks under two motions, one after the other, "
        "and print the conditional fragility.",
        False,
    )
    seed: int = option("With --sequence: seed of the pairs that are drawn.", 1)
    draws: int = option(
        "With --sequence: how many first motions are drawn for each that is no later shock of a "
        "station.",
        1,
    )
    out: str | None = option(
        "With --sequence: write the conditional fragility (.csv, .parquet).", metavar="FILE"
    )


@dataclass(frozen=True, kw_only=True)
class StorageOptions:
    """What is stored of each motion."""

    vertical: str = option(
        "Horizontal motions alone, with the vertical one of their recording, or both.",
        "without",
        metavar="without|with|both",
    )
    full_map: bool = option(
        "Toppling: store the intervals of strength that fail and that do not, too.",
        False,
        word="--map",
    )
    grid: str | None = option(
        "Toppling: run more blocks than the outcome grid holds: N of them, from 0.99 PGA "
        "down to 0.01 PGA in equal ratios, or at the k_r/PGA of a list.",
        metavar="N|LIST",
    )
    store_responses: str | None = option(
        "Toppling: keep the motion in time of these blocks, some 300 kB each: k_r/PGA "
        "values, or the word critical for the critical block of each combination.",
        metavar="LIST",
    )


@stacked
def simulate(
    *,
    workers: WorkerOptions,
    suite: options.Suite = None,
    include_structures: bool = option(options.INCLUDE_STRUCTURES, False),
    kind: str = option(
        "What the blocks do: toppling, rocking, slumping, confined_toppling or sliding.", "toppling"
    ),
    blocks: BlockOptions,
    stored: StorageOptions,
    sequence: Sequence,
    db: options.Db = None,
    printing: options.Printing,
) -> None:
    """Store critical values and outcomes of every motion and block.

    A combination is a motion, without or with its vertical one, in one polarity, and a block. Of
    toppling the critical block of each p2 and the outcomes of a grid of blocks; with --kind
    slumping or confined_toppling, the outcomes of a documented family of blocks under scaled
    records, each followed to its end; with --kind sliding, the strengths that slide stated
    displacements; with --kind rocking, the outcomes of a grid of free-standing blocks, which have
    no critical one, in one polarity.

    With --sequence, sliding and slumping blocks under two motions, the second of which finds them
    where the first has left them: two shocks of one station where the metadata state them, and each
    other motion after one of another earthquake that a seed draws. Printed is the share that fails
    in the second of those that survived the first, by the state it left and by the PGA of the
    second over the block's yield acceleration, beside the share of the same blocks in their first
    place.

    After Ctrl-C, a crash or a kill, the same command goes on where it stopped; what is stored is
    not computed again, and what a stored combination lacks is added.
    """
    from rbfrag.campaign.interrupt import stopped_by_interrupts
    from rbfrag.campaign.simulate import simulate as run

    histories = stored.store_responses
    check_files(table=sequence.out)
    say_when_compiling()
    with stopped_by_interrupts() as stopped, ProgressBar("simulate", "combinations") as bar:

        def show(progress: CampaignProgress) -> None:
            before = f"{progress.resumed} stored before" if progress.resumed else ""
            bar.show(progress.done, progress.total, before)

        summary = run(
            db,
            kind=kind,
            suite=suite,
            include_structures=include_structures,
            p2=_numbers(blocks.p2, "--p2"),
            rotations_deg=None if blocks.rotation is None else _rotations(blocks.rotation),
            displacements_m=_numbers(blocks.displacement, "--displacement"),
            restitution_factors=_numbers(blocks.restitution_factor, "--restitution-factor"),
            vertical=cast("Vertical", stored.vertical),  # any other word is refused
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
