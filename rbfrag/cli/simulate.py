"""`rbfrag simulate`: the critical block of every motion, polarity and block size."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from rbfrag.cli import options
from rbfrag.cli.number_list import number_list
from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.progress_line import ProgressLine

if TYPE_CHECKING:
    from rbfrag.campaign.simulate import CampaignProgress
    from rbfrag.db.queries import Vertical

EXAMPLE = "Example:  rbfrag simulate --p2 30,10,3,1,0.3,0.1 --vertical both --grid 23"


def simulate(
    suite: options.Suite = None,
    p2: Annotated[
        str, typer.Option("--p2", help="Frequency parameters p² [1/s²], separated by commas.")
    ] = "30,10,3,1,0.3,0.1",
    vertical: Annotated[
        str,
        typer.Option(
            "--vertical",
            metavar="without|with|both",
            help="Horizontal motions alone, with the vertical one of their recording, or both.",
        ),
    ] = "without",
    grid: Annotated[
        str | None,
        typer.Option(
            "--grid",
            metavar="N|LIST",
            help="Also run blocks for themselves and store their peak rotation: N of them, from "
            "0.99 PGA down to 0.01 PGA in equal ratios, or at the k_r/PGA of a list.",
            show_default=False,
        ),
    ] = None,
    store_responses: Annotated[
        str | None,
        typer.Option(
            "--store-responses",
            metavar="LIST",
            help="Keep the motion in time of these blocks, some 300 kB each: k_r/PGA values, "
            "or the word critical for the critical block of each combination.",
            show_default=False,
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            help="Worker processes. Default: one per processor.",
            show_default=False,
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="URL",
            help="Dask scheduler whose workers take the place of local ones, tcp://host:8786.",
            show_default=False,
        ),
    ] = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Find and store the critical block of every motion x vertical x polarity x p2.

    Each combination is stored as soon as it is found, with the map of all blocks that topple.
    After Ctrl-C, a crash or a kill, the same command goes on where it stopped; what is stored is
    not computed again.
    """
    from rbfrag.campaign.simulate import simulate as run

    with ProgressLine("simulate", "combinations") as line:

        def show(progress: CampaignProgress) -> None:
            line.show(progress, f"{progress.resumed} stored before" if progress.resumed else "")

        summary = run(
            db,
            suite=suite,
            p2=number_list(p2, "--p2"),
            vertical=cast("Vertical", vertical),  # any other word is refused
            grid=_grid(grid),
            store_responses=_blocks(store_responses),
            jobs=jobs,
            scheduler=scheduler,
            on_progress=show,
        )
    report = summary.as_dict()
    if json:
        print_json(report)
        return
    print_warnings(summary.warnings)
    del report["warnings"]
    print_pairs(report)


def _grid(text: str | None) -> int | list[float]:
    if text is None:
        return []
    return int(text) if text.strip().isdecimal() else number_list(text, "--grid")


def _blocks(text: str | None) -> list[float | Literal["critical"]]:
    blocks: list[float | Literal["critical"]] = []
    for part in [] if text is None else text.split(","):
        if part.strip() == "critical":
            blocks.append("critical")
        else:
            blocks += number_list(part, "--store-responses")
    return blocks
