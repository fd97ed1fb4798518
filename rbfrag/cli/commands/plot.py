"""`rbfrag plot`: pictures of models, data, responses and failure modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import typer

from rbfrag.cli.output import (
    ProgressBar,
    print_json,
    print_table,
    print_warnings,
    say_when_compiling,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import numbers_of
from rbfrag.cli.parameters.motion import find_motion, find_shaking
from rbfrag.cli.parameters.stack import Given, command_group, fields_of, option, stacked
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import JOINT, PLANES, SHAPE, SPACE, WHOLE

app = command_group(
    "Draw models, data, spectra, responses and failure modes.",
    "Example:  rbfrag plot fit --out fit.png",
)

Out = Annotated[str, typer.Option("--out", help="File to write: .png, .pdf or .svg.")]


@dataclass(frozen=True, kw_only=True)
class Held:
    """What lines of equal probability are drawn for."""

    p2: float | None = option(
        "Frequency parameter p² [1/s²] of the blocks drawn. Default: the middle of the "
        "fitted range."
    )
    pga: float | None = option(
        "PGA [g] of the motions drawn. Default: in proportion to PGV, by the middle of "
        "the fitted range."
    )
    tm: float | None = option(
        "Mean period [s] of the motions drawn. Default: the middle of the fitted range."
    )


@app.command("fit", epilog="Example:  rbfrag plot fit --model logistic-pgv --out fit.png")
@stacked
def plot_fit(
    *,
    out: Out,
    model: str | None = option("Name of the model. Default: the database's default."),
    log: bool = option("Logarithmic axes.", False),
    db: options.Db = None,
) -> None:
    """Draw the data of a fit with its 2.5 %, 50 % and 97.5 % failure lines and histograms."""
    from rbfrag.plots import plot

    picture = plot.fit(out, model=model, log=log, db=db)
    print(out)
    print_warnings(picture.warnings)


@app.command("chart", epilog="Example:  rbfrag plot chart --p2 3 --out chart.pdf")
@stacked
def plot_chart(
    *,
    out: Out,
    held: Held,
    model: str | None = option(
        "Model of one measure (PGV, SA(1), PGA, ...), or of PGV with PGA (and Tm); of another kind "
        "than toppling any. Default: the one that answers for PGV."
    ),
    displacement: float | None = option(
        "Sliding: displacement [m] that is too far. Default: the middle of the fitted range."
    ),
    db: options.Db = None,
) -> None:
    """Draw lines of equal probability of toppling over intensity and block, to read by hand.

    What the model reads beside them is held: --p2, and of a model of PGV with PGA --pga and --tm.
    """
    from rbfrag.plots import plot

    plot.chart(
        out,
        model=model,
        p2=held.p2,
        pga_g=held.pga,
        tm_s=held.tm,
        displacement_m=displacement,
        db=db,
    )
    print(out)


@app.command(
    "curve", epilog="Example:  rbfrag plot curve --height 2.4 --width 0.5 --pga 0.4 --out curve.png"
)
@stacked
def plot_curve(
    *,
    out: Out,
    given: options.Block,
    held: options.Measures,
    over: str | None = option(
        "What the curve runs over: pgv, pga, pgd or sa10. Default: pgv, or what "
        "--model reads first."
    ),
    answering: options.Ranging,
    beside: str | None = option(
        "Fragilities of the same measure to compare with: NRML 0.4 or 0.5 (.xml), or a "
        "pelicun table (.csv).",
        metavar="FILE",
    ),
) -> None:
    """Draw the fragility curve of one block over a measure of the shaking.

    The band is the confidence interval of P; with --sites a second one is the share
    of such blocks that fails at so many sites of one earthquake. The other measures are held at the
    values given.
    """
    from rbfrag.plots import plot

    def others(measure: str) -> Any:
        if beside is None:
            return {}
        from rbfrag.exchange.other_fragilities import of_measure

        return of_measure(beside, measure)

    question: dict[str, Any] = {**given, **held, **answering}
    with given.named():
        picture = plot.curve(out=out, over=over, beside=others, **question)
    print_warnings(picture.warnings)
    print(out)


@app.command("sensitivity", epilog="Example:  rbfrag plot sensitivity --out sensitivity.png")
def plot_sensitivity(out: Out, suite: options.Suite = None, db: options.Db = None) -> None:
    """Draw critical k_r/PGA over the frequency ratio omega_m/p, with the lines of single lobes."""
    from rbfrag.plots import plot

    plot.sensitivity(out, suite=suite, db=db)
    print(out)


@app.command("calibration", epilog="Example:  rbfrag plot calibration --out calibration.png")
@stacked
def plot_calibration(
    *,
    out: Out,
    model: list[str] | None = option(
        "Stored model; may be given up to four times. Default: the default."
    ),
    seed: int = option("Seed of the draws of earthquakes.", 0),
    db: options.Db = None,
) -> None:
    """Draw predicted probabilities beside the shares that toppled, earthquakes left out in turn.

    Each model is fitted again, once without each earthquake.
    """
    from rbfrag.plots import plot

    plot.calibration(out, models=model or (), seed=seed, db=db)
    print(out)


@app.command("vertical", epilog="Example:  rbfrag plot vertical --out vertical.png")
def plot_vertical(out: Out, suite: options.Suite = None, db: options.Db = None) -> None:
    """Draw critical strengths with vertical motion beside those without it."""
    from rbfrag.plots import plot

    plot.vertical(out, suite=suite, db=db)
    print(out)


@app.command("spectrum", epilog="Example:  rbfrag plot spectrum 1 5 --polarity both --out x.png")
@stacked
def plot_spectrum(
    *,
    motions: options.Motions,
    out: Out,
    reading: options.ReadingOptions,
    p2: str = option("The figure spans at least these p² [1/s²].", "0.1,30"),
    polarity: options.Polarity = "both",
    db: options.Db = None,
) -> None:
    """Draw the toppling spectra of motions over the size of the block, with PGV beside them."""
    from rbfrag.plots import plot
    from rbfrag.plots.canvas import plot_path

    sizes, wanted = options.number_list(p2, "--p2"), options.polarities(polarity)
    plot_path(out)
    records = [find_motion(text, db=db, reading=reading) for text in motions]
    plot.spectrum(records, out, polarities=wanted, p2=sizes)
    print(out)


@app.command(
    "response", epilog="Example:  rbfrag plot response 1 --height 2 --width 0.4 --out a.png"
)
@stacked
def plot_response(
    motion: options.Motion,
    out: Out,
    given: Annotated[Given, fields_of("p2", "kr", *SHAPE, *PLANES, *JOINT, *WHOLE)],
    direction: options.Direction,
    reading: options.ReadingOptions,
    db: options.Db = None,
) -> None:
    """Draw acceleration against k_r(theta), and theta over the critical angle, in time."""
    from rbfrag.fragility.method import TOPPLING_BLOCK
    from rbfrag.plots import plot

    _, numbers, about = numbers_of(given, TOPPLING_BLOCK.kind)
    ground, upward, remarks = find_shaking(motion, direction, db=db, reading=reading)
    say_when_compiling()
    plot.response(
        ground, out, p2=numbers["p2"], kr=numbers["kr"], vertical=upward,
        polarity=direction.polarity,
    )  # fmt: skip
    print_warnings([*about, *remarks])
    print(out)


@app.command(
    "planes",
    epilog="Example:  rbfrag plot planes --base 25/102 --back 65/075 --face 70/090 --out a.png",
)
@stacked
def plot_planes(
    *,
    planes: Annotated[Given, fields_of(*SPACE)],
    out: Out,
) -> None:
    """Draw base, back and face of a block on a stereonet: lower hemisphere, equal area.

    Shaded are the poles of planes that strike too far off the face for a section.
    """
    from rbfrag.plots import plot

    picture = plot.planes(out, **planes)
    print(out)
    print_warnings(picture.warnings)


@dataclass(frozen=True, kw_only=True)
class Ultimate:
    """The motion under which the cells of a chart are followed."""

    ultimate: bool = option(
        "Follow the block of each cell of 3 degrees, of the spacing --s1 (default 1 m), in time.",
        False,
    )
    motion: str | None = option("The accelerogram of --ultimate.", metavar="MOTION")
    jobs: options.Jobs = None


@app.command(
    "modes",
    epilog="Example:  rbfrag plot modes --phi 40 --beta 20 --rockmass mass.toml --out a.png",
)
@stacked
def plot_modes(
    *,
    planes: Annotated[
        Given,
        fields_of(*PLANES, "back_fracture", "s1_m", *JOINT, "cohesion_pa", "density_kg_m3"),
    ],
    out: Out,
    ended: Ultimate,
    direction: options.Direction,
    reading: options.ReadingOptions,
    db: options.Db = None,
    blocks: str | None = option(
        "Show the blocks of a table (.csv, .xlsx, .parquet) with alpha1_deg and alpha3_deg, "
        "as  rbfrag rockmass --out  writes it.",
        metavar="FILE",
    ),
    sheet: str | None = option(options.SHEET, metavar="NAME"),
    rockmass: str | None = option(
        "Show the blocks of a rock mass file (.toml, .csv).", metavar="FILE"
    ),
) -> None:
    """Draw failure modes and yield accelerations over the block angles alpha1 and alpha3.

    With water, cohesion or roughness the chart is of blocks of one spacing --s1; with --ultimate
    its colours are the modes in which they end under --motion.
    """
    from rbfrag.cli.parameters.block import charted_blocks
    from rbfrag.plots import plot
    from rbfrag.plots.canvas import plot_path

    if "phi_deg" not in planes:
        raise InputError(
            "phi_deg is missing: the chart is drawn for one friction angle", fields=("phi_deg",)
        )
    plot_path(out)
    shown = charted_blocks(blocks, rockmass, planes, sheet=sheet)
    ran, warnings = None, [*shown.warnings]
    if ended.ultimate != (ended.motion is not None):
        raise InputError("--ultimate and --motion go together: cells are followed under a motion")
    if ended.motion is not None:
        from rbfrag.campaign.shake_rockmass import shake
        from rbfrag.plots.modes import chart_cells

        ground, upward, remarks = find_shaking(ended.motion, direction, db=db, reading=reading)
        say_when_compiling()
        with ProgressBar("plot modes", "cells") as bar:
            ran = shake(
                chart_cells(**planes), ground, vertical=upward, polarity=direction.polarity,
                jobs=ended.jobs, on_progress=lambda each: bar.show(each.done, each.total),
            )  # fmt: skip
        warnings += [*remarks, *ran.warnings]
    plot.modes(out, alpha1_deg=shown.alpha1_deg, alpha3_deg=shown.alpha3_deg, ended=ran, **planes)
    print(out)
    print_warnings(warnings)


@app.command(
    "rotation",
    epilog="Example:  rbfrag plot rotation --alpha1 45 --alpha3 65 --r3 1 --beta 0 --phi 35 "
    "--out rotation.png",
)
@stacked
def plot_rotation(
    *,
    out: Out,
    given: Annotated[Given, fields_of(*SHAPE, *PLANES, *WHOLE, without=("kind",))],
    back_follows: str = option(
        "Shares of the block's rotation by which the back plane turns with it, from 0 to 1.",
        "0,0.5,1",
    ),
    json: options.Json = False,
) -> None:
    """Draw the yield of a slump or a confined topple over its rotation, and print its least.

    The rock behind a block may give way with it: its back plane then turns by a share of the
    block's rotation.
    """
    from rbfrag.plots.rotation import plot_rotation as draw
    from rbfrag.plots.rotation import yield_lines
    from rbfrag.question.blocks import on_planes, without_kv

    with given.named():
        block, planes, *_ = on_planes(without_kv(given))
    if not planes.pop("back_fracture", True):
        raise InputError("--no-back: without a plane behind it no block turns against it")
    for name in planes.keys() - {*PLANES}:
        text = f"{name} does not go with yields over a rotation, which follows a first slip"
        raise InputError(f"{text}: leave it out", fields=(name,))
    shares = options.number_list(back_follows, "--back-follows")
    draw(block, out, back_follows=shares, **planes)
    lines = yield_lines(block, back_follows=shares, **planes)
    if json:
        print_json({"plot": out, "lines": [line._asdict() for line in lines]})
        return
    print_table(lines[0]._fields, lines)
    print(out)
