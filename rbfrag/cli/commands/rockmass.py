"""`rbfrag rockmass`: the blocks between two fracture sets that scatter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli.output import (
    ProgressLine,
    cell,
    check_files,
    print_json,
    print_pairs,
    print_table,
    print_warnings,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.motion import find_motion, find_vertical
from rbfrag.cli.parameters.values import number_list
from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.rockmasses.joint_sets import Realisations
    from rbfrag.rockmasses.shaking import ShakenMass

ALWAYS = ("at_rest", "stays", "unstable")
"""Outcomes that have a column of their own even if there are none."""


def run_shaken(
    made: Realisations,
    motion: str,
    *,
    vertical: str | None,
    reverse: bool,
    scales: str | None,
    displacement: float | None,
    rotation: float | None,
    jobs: int | None,
    db: str | None,
    units: str | None,
    dt: float | None,
) -> tuple[ShakenMass, list[str]]:
    """Run the blocks under the motion that the options name.

    Returns:
        Their outcomes, and sentences about the motion and about blocks.
    """
    from rbfrag.campaign.shake_rockmass import shake
    from rbfrag.rockmasses.failures import failure_warnings
    from rbfrag.rockmasses.shaking import DISPLACEMENT_M, FailureLimits

    limits = FailureLimits(DISPLACEMENT_M if displacement is None else displacement, rotation)
    factors = [1.0] if scales is None else number_list(scales, "--scales")
    ground = find_motion(motion, db=db, units=units, dt_s=dt)
    upward, remarks = find_vertical(vertical, ground, db=db, units=units, dt_s=dt)
    with ProgressLine("rockmass", "blocks") as line:
        found = shake(
            made,
            ground,
            scales=factors,
            vertical=upward,
            polarity="reverse" if reverse else "forward",
            limits=limits,
            jobs=jobs,
            on_progress=line.show,
        )
    return found, [*remarks, *failure_warnings(found)]


def print_failures(document: dict[str, Any]) -> None:
    """Print the failures that a motion causes, mode by mode and scale by scale."""
    from rbfrag.rockmasses.shaking import OUTCOMES

    print()
    turned = document["rotation_limit_deg"]
    print(
        f"{document['motion']}, {document['polarity']}: {document['runs']} runs; a slide fails "
        f"beyond {document['displacement_limit_m']:g} m, a block that turns "
        + ("past recovery" if turned is None else f"beyond {turned:g} degrees or past recovery")
    )
    counts = [found for each in document["scales"] for found in each["modes"].values()]
    outcomes = [
        name
        for name in OUTCOMES
        if name != "fails" and (name in ALWAYS or any(found[name] for found in counts))
    ]
    rows = []
    for each in document["scales"]:
        for mode, found in [*each["modes"].items(), ("all", each["all"])]:
            of_all, of_mode = found["fails_of_all"], found["fails_of_mode"]
            rows.append(
                [
                    each["scale"],
                    round(each["pga_g"], 4),
                    mode,
                    found["count"],
                    found["fails"],
                    _percent(of_mode["share"]),
                    _percent(of_all["share"]),
                    _percent(of_all["ci_low"]),
                    _percent(of_all["ci_high"]),
                    *(found[name] for name in outcomes),
                ]
            )
    headers = ["scale", "pga_g", "mode", "count", "fails", "%_of_mode", "%_of_all"]
    print_table([*headers, "ci_low_%", "ci_high_%", *outcomes], rows)


def _percent(share: float) -> float:
    return round(100.0 * share, 2)


EXAMPLE = "Example:  rbfrag rockmass rockmass.toml --pgv 0.6 --out blocks.csv --plot counts.png"


def rockmass(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="Rock mass file (.toml or .csv): dips [deg], spacings [m], friction [deg].",
        ),
    ],
    n: Annotated[
        int | None,
        typer.Option("--n", help="Number of realisations. Default: the file's, else 20000."),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option("--seed", help="Seed of the random numbers. Default: the file's, else 1."),
    ] = None,
    motion: Annotated[
        str | None,
        typer.Option(
            "--motion",
            metavar="MOTION",
            help="Run every block under this accelerogram, each in its own mode: a file, "
            "FILE#INDEX for one trace of several, or a database id.",
        ),
    ] = None,
    vertical: options.Vertical = None,
    reverse: options.Reverse = False,
    scales: Annotated[
        str | None,
        typer.Option(
            "--scales",
            metavar="LIST",
            help="Factors on the motion, such as 0.5,1,1.5,2. Default: 1.",
        ),
    ] = None,
    displacement: Annotated[
        float | None,
        typer.Option(
            "--displacement",
            help="A slide fails beyond this displacement [m]. Default with --motion: 0.05. With "
            "--pgv, blocks that slide or slump are answered for where it is given.",
        ),
    ] = None,
    rotation: Annotated[
        float | None,
        typer.Option(
            "--rotation",
            help="A slump, or a topple against the back plane, fails beyond this rotation [deg]. "
            "Default: failure past recovery only.",
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            help="Worker processes. Default: one per processor, where there is work for them.",
        ),
    ] = None,
    pgv: options.Pgv = None,
    pga: options.Pga = None,
    tm: options.Tm = None,
    pgd: options.Pgd = None,
    model: options.Model = None,
    level: options.Level = 0.95,
    out: Annotated[
        str | None,
        typer.Option(
            "--out",
            help="Write one row a block, with a motion one a block and scale (.csv, .parquet).",
        ),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot",
            help="Draw the cumulative counts of blocks against PGA by mode, with a motion the "
            "shares that fail (.png, .pdf, .svg).",
        ),
    ] = None,
    units: options.Units = None,
    dt: options.Dt = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Draw blocks from two fracture sets; print their modes and yield accelerations.

    With --motion every block that the motion moves is run, and the shares that fail are counted by
    mode. With a measure of the motion (--pgv ...), the probability of failure is averaged over
    the blocks of each mode for which there is a fragility model.
    """
    from rbfrag.exchange.block_table import write_block_table
    from rbfrag.rockmasses.counts import crossings, mode_counts
    from rbfrag.rockmasses.failures import (
        checked_level,
        failures,
        failures_as_dict,
        outcome_columns,
    )
    from rbfrag.rockmasses.file import read_rock_mass
    from rbfrag.rockmasses.report import as_dict, block_columns
    from rbfrag.rockmasses.scenario import scenario

    check_files(table=out, plot=plot)
    measures = {"pgv_m_s": pgv, "pga_g": pga, "tm_s": tm, "pgd_m": pgd}
    shaken = any(value is not None for value in measures.values())
    _refuse_options_without_their_cause(
        motion,
        shaken,
        with_motion={
            "--vertical": vertical is not None,
            "--reverse": reverse,
            "--scales": scales is not None,
            "--displacement": displacement is not None and not shaken,
            "--rotation": rotation is not None and (not shaken or displacement is None),
            "--jobs": jobs is not None,
            "--units": units is not None,
            "--dt": dt is not None,
        },
        model=model,
        db=db,
    )
    made = read_rock_mass(file).realise(n, seed)
    answer = outcomes = found = None
    about: list[str] = []
    if shaken:
        answer = scenario(
            made, **measures, model=model, level=level, db=db, displacement_m=displacement,
            rotation_deg=rotation,
        )  # fmt: skip
    if motion is not None:
        checked_level(level)
        outcomes, about = run_shaken(
            made, motion, vertical=vertical, reverse=reverse, scales=scales,
            displacement=displacement, rotation=rotation, jobs=jobs, db=db, units=units, dt=dt,
        )  # fmt: skip
        found = failures_as_dict(outcomes, failures(outcomes, level), level)
    document = as_dict(made, mode_counts(made), crossings(made), answer, found)
    document["warnings"] += about
    if out is not None:
        columns = block_columns(made, answer) if outcomes is None else outcome_columns(outcomes)
        write_block_table(columns, out)
    if plot is not None:
        if outcomes is None:
            from rbfrag.plots.rockmass import plot_rockmass

            plot_rockmass(made, plot)
        else:
            from rbfrag.plots.rockmass import plot_failures

            plot_failures(outcomes, plot, level=level)
    if json:
        print_json(document)
        return
    _print(document)
    print_warnings(document["warnings"])


def _refuse_options_without_their_cause(
    motion: str | None,
    measured: bool,
    *,
    with_motion: dict[str, bool],
    model: str | None,
    db: str | None,
) -> None:
    """Refuse options that would do nothing, and two descriptions of one motion."""
    if motion is not None and measured:
        raise InputError(
            "--motion does not go with --pgv, --pga, --tm and --pgd: either the blocks are run "
            "under a motion, or a fragility model answers for measures of one"
        )
    if motion is None and (extra := [name for name, given in with_motion.items() if given]):
        also = {
            "--displacement": ", or with --pgv",
            "--rotation": ", or with --pgv and --displacement",
        }.get(extra[0], "")
        raise InputError(f"{extra[0]} goes with --motion{also}: name the accelerogram, too")
    if model is not None and not measured:
        raise InputError(
            "--model goes with a measure of the motion: give --pgv, --pga and --tm, or --pgd and "
            "--tm, too"
        )
    if db is not None and not measured and motion is None:
        raise InputError(
            "--db goes with a motion or a measure of it: give --motion, or --pgv, --pga and --tm, "
            "or --pgd and --tm, too"
        )


def _print(document: dict[str, Any]) -> None:
    print_pairs(
        {
            "realisations": document["realisations"],
            "blocks": document["blocks"],
            "seed": document["seed"],
            **document["variables"],
            "block.back_fracture": document["back_fracture"],
        }
    )
    for text, count in document["impossible"].items():
        print(f"no block {count} times: {text}")
    print()
    quantiles = ("q05", "q50", "q95")
    print_table(
        ["mode", "count", "share_%", "+-", "unstable", "locked", *(f"k_{q}_g" for q in quantiles)],
        [
            [
                mode,
                found["count"],
                round(100.0 * found["share"], 2),
                round(100.0 * found["share_error"], 2),
                found["unstable"],
                found["locked"],
                *((found["yield_g"] or {}).get(q) for q in quantiles),
            ]
            for mode, found in document["modes"].items()
        ],
    )
    for crossing in document["crossings"]:
        print(
            f"counts cross at {crossing['pga_g']:.4g} +- {_short(crossing['standard_error_g'])} g "
            f"({cell(crossing['count'])} blocks each): more {_words(crossing['below'])} below, "
            f"more {_words(crossing['above'])} above"
        )
    if document["scenario"] is not None:
        _print_scenario(document["scenario"])
    if document["shaking"] is not None:
        print_failures(document["shaking"])


def _print_scenario(found: dict[str, Any]) -> None:
    print()
    names = ("pgv_m_s", "pga_g", "tm_s", "pgd_m", "model", "level")
    others = {f"model of {_words(mode)}": name for mode, name in found["other_models"].items()}
    print_pairs({**{name: found[name] for name in names if name in found}, **others})
    rows = [
        [mode, 100.0 * answer["share"], answer["covered"], *_probability(answer)]
        for mode, answer in found["modes"].items()
    ]
    total = found["covered_only"]
    rows.append(["covered blocks only", 100.0 * found["covered_share"], total["covered"]])
    rows[-1] += _probability(total)
    print_table(["mode", "share_%", "covered", "probability", "+-", "ci_low", "ci_high"], rows)


def _probability(answer: dict[str, Any]) -> list[Any]:
    return [answer[key] for key in ("probability", "standard_error", "ci_low", "ci_high")]


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}"


def _words(mode: str) -> str:
    return {"confined_topple": "confined topples"}.get(mode, f"{mode}s")
