"""`rbfrag simulate`: the critical values of every motion and polarity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

import typer

from rbfrag.cli.output import ProgressLine, print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.values import number_list
from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.campaign.progress import CampaignProgress
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
            show_default=False,
        ),
    ] = None,
    rotation: Annotated[
        str | None,
        typer.Option(
            "--rotation",
            metavar="LIST",
            help="Slumping: rotations that count as failure [deg], and the word recovery for "
            "failure past recovery. Default: 2,recovery.",
            show_default=False,
        ),
    ] = None,
    displacement: Annotated[
        str | None,
        typer.Option(
            "--displacement",
            metavar="LIST",
            help="Sliding: displacements on a level plane [m]. Default: 0.01,0.05,0.15,0.3.",
            show_default=False,
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

    With --kind slumping, the factor on each record that brings each block of a documented family
    down; with --kind sliding, the strengths that slide stated displacements.

    Each combination is stored as soon as it is found, that of toppling with the map of all blocks
    that topple. After Ctrl-C, a crash or a kill, the same command goes on where it stopped; what
    is stored is not computed again.
    """
    _refuse_options_of_other_kinds(
        kind,
        {
            "--p2": p2 is not None,
            "--grid": grid is not None,
            "--store-responses": store_responses is not None,
            "--rotation": rotation is not None,
            "--displacement": displacement is not None,
        },
    )
    if kind != "toppling":
        _simulate_kind(
            kind, suite=suite, rotation=rotation, displacement=displacement, vertical=vertical,
            jobs=jobs, scheduler=scheduler, db=db, json=json,
        )  # fmt: skip
        return
    from rbfrag.campaign.simulate import simulate as run
    from rbfrag.solver.results import DEFAULT_P2

    with ProgressLine("simulate", "combinations") as line:
        summary = run(
            db,
            suite=suite,
            p2=DEFAULT_P2 if p2 is None else number_list(p2, "--p2"),
            vertical=cast("Vertical", vertical),  # any other word is refused
            grid=_grid(grid),
            store_responses=_blocks(store_responses),
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


OPTIONS_OF = {
    "toppling": {"--p2", "--grid", "--store-responses"},
    "slumping": {"--rotation"},
    "sliding": {"--displacement"},
}
"""Which options go with which kind."""


def _refuse_options_of_other_kinds(kind: str, given: dict[str, bool]) -> None:
    if kind not in OPTIONS_OF:
        raise InputError(f"--kind {kind}: campaigns are of {', '.join(OPTIONS_OF)}")
    for option, is_given in given.items():
        if is_given and option not in OPTIONS_OF[kind]:
            (owner,) = [name for name, its in OPTIONS_OF.items() if option in its]
            raise InputError(f"{option} goes with --kind {owner}, not with {kind}")


def _simulate_kind(
    kind: str,
    *,
    suite: str | None,
    rotation: str | None,
    displacement: str | None,
    vertical: str,
    jobs: int | None,
    scheduler: str | None,
    db: str | None,
    json: bool,
) -> None:
    from rbfrag.campaign.simulate_kind import simulate_kind

    asked: dict[str, Any] = {}
    if rotation is not None:
        asked["rotations_deg"] = [
            None if part.strip() == RECOVERY else number_list(part, "--rotation")[0]
            for part in rotation.split(",")
        ]
    if displacement is not None:
        asked["displacements_m"] = number_list(displacement, "--displacement")
    with ProgressLine("simulate", "combinations") as line:
        summary = simulate_kind(
            db,
            kind=cast("Literal['slumping', 'sliding']", kind),
            suite=suite,
            vertical=cast("Vertical", vertical),  # any other word is refused
            jobs=jobs,
            scheduler=scheduler,
            on_progress=lambda progress: _show(line, progress),
            **asked,
        )
    report = summary.as_dict()
    if json:
        print_json(report)
        return
    print_warnings(report.pop("warnings"))
    print_pairs(report)


def _show(line: ProgressLine, progress: CampaignProgress) -> None:
    line.show(progress, f"{progress.resumed} stored before" if progress.resumed else "")


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
