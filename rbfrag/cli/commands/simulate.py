"""`rbfrag simulate`: critical values and outcomes of every motion and polarity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from rbfrag.cli.output import ProgressLine, print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.values import number_list

if TYPE_CHECKING:
    from rbfrag.campaign.simulate import CampaignProgress
    from rbfrag.db.queries import Vertical

EXAMPLE = "Example:  rbfrag simulate --p2 30,10,3,1,0.3,0.1 --vertical both --grid 23"

RECOVERY = "recovery"
"""What stands for failure past recovery in a list of rotations."""


def simulate(
    suite: options.Suite = None,
    kind: Annotated[
        str, typer.Option("--kind", help="What the blocks do: toppling, slumping or sliding.")
    ] = "toppling",
    p2: Annotated[
        str | None,
        typer.Option(
            "--p2",
            help="Toppling: frequency parameters p² [1/s²], separated by commas. Default: "
            "30,10,3,1,0.3,0.1.",
        ),
    ] = None,
    rotation: Annotated[
        str | None,
        typer.Option(
            "--rotation",
            metavar="LIST",
            help="Slumping: rotations that count as failure [deg], and the word recovery for "
            "failure past recovery. Default: 2,recovery.",
        ),
    ] = None,
    displacement: Annotated[
        str | None,
        typer.Option(
            "--displacement",
            metavar="LIST",
            help="Sliding: displacements on a level plane [m]. Default: 0.01,0.05,0.15,0.3.",
        ),
    ] = None,
    vertical: Annotated[
        str,
        typer.Option(
            "--vertical",
            metavar="without|with|both",
            help="Horizontal motions alone, with the vertical one of their recording, or both.",
        ),
    ] = "without",
    full_map: Annotated[
        bool,
        typer.Option(
            "--map",
            help="Toppling and slumping: store the intervals of strength that fail and that do "
            "not, too.",
        ),
    ] = False,
    grid: Annotated[
        str | None,
        typer.Option(
            "--grid",
            metavar="N|LIST",
            help="Toppling: run more blocks than the outcome grid holds: N of them, from 0.99 PGA "
            "down to 0.01 PGA in equal ratios, or at the k_r/PGA of a list.",
        ),
    ] = None,
    store_responses: Annotated[
        str | None,
        typer.Option(
            "--store-responses",
            metavar="LIST",
            help="Toppling: keep the motion in time of these blocks, some 300 kB each: k_r/PGA "
            "values, or the word critical for the critical block of each combination.",
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option("--jobs", help="Worker processes. Default: one per processor.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="URL",
            help="Dask scheduler whose workers take the place of local ones, tcp://host:8786.",
        ),
    ] = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Store critical values and outcomes of every motion x vertical x polarity x block.

    Of toppling the critical block of each p2 and the outcomes of a grid of blocks; with --kind
    slumping, the factor on each record that brings each block of a documented family down; with
    --kind sliding, the strengths that slide stated displacements.

    After Ctrl-C, a crash or a kill, the same command goes on where it stopped; what is stored is
    not computed again, and what a stored combination lacks is added.
    """
    from rbfrag.campaign.simulate import simulate as run

    with ProgressLine("simulate", "combinations") as line:
        summary = run(
            db,
            kind=kind,
            suite=suite,
            p2=None if p2 is None else number_list(p2, "--p2"),
            rotations_deg=None if rotation is None else _rotations(rotation),
            displacements_m=None
            if displacement is None
            else number_list(displacement, "--displacement"),
            vertical=cast("Vertical", vertical),  # any other word is refused
            grid=None if grid is None else _grid(grid),
            store_responses=None if store_responses is None else _blocks(store_responses),
            full_map=full_map,
            jobs=jobs,
            scheduler=scheduler,
            on_progress=lambda progress: _show(line, progress),
        )
    report = summary.as_dict()
    if json:
        print_json(report)
        return
    print_warnings(summary.warnings)
    del report["warnings"]
    print_pairs(report)


def _show(line: ProgressLine, progress: CampaignProgress) -> None:
    line.show(progress, f"{progress.resumed} stored before" if progress.resumed else "")


def _rotations(text: str) -> list[float | None]:
    return [
        None if part.strip() == RECOVERY else number_list(part, "--rotation")[0]
        for part in text.split(",")
    ]


def _grid(text: str) -> int | list[float]:
    return int(text) if text.strip().isdecimal() else number_list(text, "--grid")


def _blocks(text: str) -> list[float | Literal["critical"]]:
    blocks: list[float | Literal["critical"]] = []
    for part in text.split(","):
        if part.strip() == "critical":
            blocks.append("critical")
        else:
            blocks += number_list(part, "--store-responses")
    return blocks
