"""`rbfrag rockmass`: the blocks between two fracture sets that scatter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rbfrag.cli.output import (
    ProgressBar,
    cell,
    check_files,
    print_json,
    print_pairs,
    print_sentences,
    print_table,
    print_warnings,
    say_when_compiling,
    write_table,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.motion import find_shaking
from rbfrag.cli.parameters.stack import argument, option, stacked
from rbfrag.cli.sentences import rock_mass_in_words

ALWAYS = ("at_rest", "stays", "unstable")
"""Outcomes that have a column of their own even if there are none."""


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
    counts = [tally for each in document["scales"] for tally in each["modes"].values()]
    outcomes = [
        name
        for name in OUTCOMES
        if name != "fails" and (name in ALWAYS or any(tally[name] for tally in counts))
    ]
    rows = []
    for each in document["scales"]:
        for mode, tally in [*each["modes"].items(), ("all", each["all"])]:
            of_all, of_mode = tally["fails_of_all"], tally["fails_of_mode"]
            rows.append(
                [
                    each["scale"],
                    round(each["pga_g"], 4),
                    mode,
                    tally["count"],
                    tally["fails"],
                    _percent(of_mode["share"]),
                    _percent(of_all["share"]),
                    _percent(of_all["ci_low"]),
                    _percent(of_all["ci_high"]),
                    *(tally[name] for name in outcomes),
                ]
            )
    headers = ["scale", "pga_g", "mode", "count", "fails", "%_of_mode", "%_of_all"]
    print_table([*headers, "ci_low_%", "ci_high_%", *outcomes], rows)
    ends = [
        [mode, each["scale"], *tally.values()]
        for each in document["scales"]
        for mode, tally in each["final_modes"].items()
    ]
    print("\nmode by which blocks end; none: the motion does not move them, or they are not run")
    print_table(["mode", "scale", *next(iter(document["scales"][0]["final_modes"].values()))], ends)


def _percent(share: float) -> float:
    return round(100.0 * share, 2)


EXAMPLE = "Example:  rbfrag rockmass rockmass.toml --pgv 0.6 --out blocks.csv --plot counts.png"


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """How many blocks are drawn."""

    n: int | None = option("Number of realisations. Default: the file's, else 20000.")
    seed: int | None = option("Seed of the random numbers. Default: the file's, else 1.")


@dataclass(frozen=True, kw_only=True)
class ShakenBy(options.Direction):
    """The motion that every block is run under."""

    motion: str | None = option(
        "Run every block under this accelerogram, each in its own mode: a file, "
        "FILE#INDEX for one trace of several, or a database id.",
        metavar="MOTION",
    )
    scales: str | None = option(
        "Factors on the motion, such as 0.5,1,1.5,2. Default: 1.", metavar="LIST"
    )
    jobs: options.Jobs = None


@dataclass(frozen=True, kw_only=True)
class LimitOptions:
    """What counts as failure."""

    displacement: float | None = option(
        "A slide fails beyond this displacement [m]. Default with --motion: 0.05. With "
        "--pgv, blocks that do not topple freely are answered for where it is given."
    )
    rotation: float | None = option(
        "A slump, or a topple against the back plane, fails beyond this rotation [deg]. "
        "Default: failure past recovery only."
    )


@dataclass(frozen=True, kw_only=True)
class RockMassFiles:
    """What is written."""

    out: str | None = option(
        "Write one row a block, with a motion one a block and scale (.csv, .xlsx, .parquet)."
    )
    excel_text: bool = option(options.EXCEL_TEXT, False)
    plot: str | None = option(
        "Draw the cumulative counts of blocks against PGA by mode, with a motion the "
        "shares that fail (.png, .pdf, .svg)."
    )


@stacked
def rockmass(
    *,
    file: str = argument(
        "Rock mass file (.toml or .csv): dips [deg], spacings [m], friction [deg].", metavar="FILE"
    ),
    drawn: Drawn,
    shaken: ShakenBy,
    limits: LimitOptions,
    measures: options.Measures,
    answering: options.Answering,
    reading: options.ReadingOptions,
    files: RockMassFiles,
    printing: options.Printing,
) -> None:
    """Draw blocks from two fracture sets; print their modes and yields.

    With --motion every block that the motion moves is run, and the shares that fail are counted by
    mode. With a measure of the motion (--pgv ...), the probability of failure is averaged over
    the blocks of each mode for which there is a fragility model.
    """
    from rbfrag.campaign.rock_mass_answer import rockmass as answered
    from rbfrag.vocabulary.quantities import SPECTRAL

    check_files(table=files.out, plot=files.plot, excel_text=files.excel_text)
    ground = upward = None
    about: list[str] = []
    if shaken.motion is not None:
        ground, upward, about = find_shaking(
            shaken.motion, shaken, db=answering.get("db"), reading=reading
        )
        say_when_compiling()
    stated: dict[str, Any] = {**measures}
    spectrum = {period: stated.pop(name) for period, name in SPECTRAL.items() if name in stated}
    with ProgressBar("rockmass", "blocks") as bar:
        answer = answered(
            file, n=drawn.n, seed=drawn.seed, **stated, sa_g=spectrum or None, motion=ground,
            vertical=upward, polarity=shaken.polarity,
            scales=options.number_list("1" if shaken.scales is None else shaken.scales, "--scales"),
            displacement_m=limits.displacement, rotation_deg=limits.rotation, jobs=shaken.jobs,
            **answering,
            on_progress=lambda progress: bar.show(progress.done, progress.total),
        )  # fmt: skip
    document = answer.as_dict()
    document["warnings"] += about
    if files.out is not None:
        table, notes = answer.table_columns(), document["warnings"]
        write_table(table, files.out, excel_text=files.excel_text, notes=notes)
    if files.plot is not None:
        from rbfrag.plots.plot import rockmass as draw

        draw(answer, files.plot)
    if printing.json:
        print_json(document)
        return
    print_sentences(rock_mass_in_words(document))
    _print(document, verbose=printing.verbose)
    print_warnings(document["warnings"], ("displacement_m",))


def _print(document: dict[str, Any], *, verbose: bool) -> None:
    if verbose:
        print_pairs(
            {
                "realisations": document["realisations"],
                "blocks": document["blocks"],
                "seed": document["seed"],
                **document["variables"],
                "block.back_fracture": document["back_fracture"],
            }
        )
        print()
    for text, count in document["impossible"].items():
        print(f"no block {count} times: {text}")
    quantiles = ("q05", "q50", "q95")
    headers = ["mode", "count", "share_%", "+-", "unstable", "locked"]
    headers += [f"k_{q}_g" for q in quantiles]
    if document["drainage"] is not None:
        headers += [f"drained_k_{q}_g" for q in quantiles]
    print_table(
        headers,
        [
            [
                mode,
                tally["count"],
                round(100.0 * tally["share"], 2),
                round(100.0 * tally["share_error"], 2),
                tally["unstable"],
                tally["locked"],
                *(
                    (states["yield_g"] or {}).get(q)
                    for states in (tally, tally["drained"])
                    if states is not None
                    for q in quantiles
                ),
            ]
            for mode, tally in document["modes"].items()
        ],
    )
    for crossing in document["crossings"]:
        error = crossing["standard_error_g"]
        within = "-" if error is None else f"{error:.2g}"
        print(
            f"counts cross at {crossing['pga_g']:.4g} +- {within} g "
            f"({cell(crossing['count'])} blocks each): more {_words(crossing['below'])} below, "
            f"more {_words(crossing['above'])} above"
        )
    if document["scenario"] is not None:
        _print_scenario(document["scenario"])
    if document["shaking"] is not None:
        print_failures(document["shaking"])


def _print_scenario(scenario: dict[str, Any]) -> None:
    from rbfrag.vocabulary.quantities import INTENSITY

    print()
    names = (*INTENSITY, "model", "level")
    others = {f"model of {_words(mode)}": name for mode, name in scenario["other_models"].items()}
    print_pairs({**{name: scenario[name] for name in names if name in scenario}, **others})
    rows = [
        [mode, 100.0 * answer["share"], answer["covered"], *_probability(answer)]
        for mode, answer in scenario["modes"].items()
    ]
    total = scenario["covered_only"]
    rows.append(["covered blocks only", 100.0 * scenario["covered_share"], total["covered"]])
    rows[-1] += _probability(total)
    headers = ["mode", "share_%", "covered", "probability", "+-", "ci_low", "ci_high"]
    if total["drained"] is not None:
        headers += ["drained", "drained_low", "drained_high"]
    print_table(headers, rows)


def _probability(answer: dict[str, Any]) -> list[Any]:
    drained = answer["drained"] or {}
    return [
        *(answer[key] for key in ("probability", "standard_error", "ci_low", "ci_high")),
        *(drained[key] for key in ("probability", "ci_low", "ci_high") if drained),
    ]


def _words(mode: str) -> str:
    return {"confined_topple": "confined topples"}.get(mode, f"{mode}s")
