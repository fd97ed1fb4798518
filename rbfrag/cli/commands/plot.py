"""`rbfrag plot`: figures of models, data, responses and failure modes."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from rbfrag.cli import options
from rbfrag.cli.command import Commands, Fields, Inputs, option
from rbfrag.cli.inputs import charted_blocks, find_motion, find_shaking, numbers_of
from rbfrag.cli.output import (
    ProgressBar,
    print_json,
    print_table,
    print_warnings,
    say_when_compiling,
)
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import (
    BLOCK,
    COMMON,
    INTENSITY,
    JOINT,
    MEASURED,
    PLANES,
    REQUEST,
    SHAPE,
    SPACE,
)

app = Commands(
    "Draw models, data, spectra, responses and failure modes.",
    "Example:  rbfrag plot fit --out fit.png",
)

Out = Annotated[str, typer.Option("--out", help="Output file (.png, .pdf, .svg)")]


@app.command("fit", epilog="Example:  rbfrag plot fit --model toppling-pgv --out fit.png")
def plot_fit(
    *,
    out: Out,
    model: str | None = option("Name of the model [default: default model of the database]"),
    log: bool = option("Logarithmic axes", False),
    db: options.Db = None,
) -> None:
    """Draw the data of a fit with failure lines.

    The failure lines are those of P = 2.5 %, 50 % and 97.5 %, with histograms.
    """
    from rbfrag.plots import plot

    picture = plot.fit(out, model=model, log=log, db=db)
    print(out)
    print_warnings(picture.warnings)


@app.command("chart", epilog="Example:  rbfrag plot chart --p2 3 --out chart.pdf")
def plot_chart(
    *,
    out: Out,
    p2: float | None = option(
        "Frequency parameter p² of the blocks [1/s²] [default: middle of the fitted range]"
    ),
    pga: float | None = option(
        "PGA of the motions [g], over PGV [default: proportional to PGV, from the middle of the "
        "fitted range]"
    ),
    tm: float | None = option("Mean period of the motions [s], of models that use it"),
    model: str | None = option(
        "Name of a model, drawn over PGV, PGA or SA [default: model used for PGV and the given "
        "measures]"
    ),
    displacement: float | None = option(
        "Displacement limit of sliding [m] [default: middle of the fitted range]"
    ),
    db: options.Db = None,
) -> None:
    """Draw a design chart: lines of equal probability.

    The axes are intensity and block. Further predictors are held constant: --p2, --pga of a model
    of PGV with PGA, and --tm. The equation of the model stands below.
    """
    from rbfrag.plots import plot

    plot.chart(
        out,
        model=model,
        p2=p2,
        pga_g=pga,
        tm_s=tm,
        displacement_m=displacement,
        db=db,
    )
    print(out)


@app.command(
    "curve", epilog="Example:  rbfrag plot curve --height 2.4 --width 0.5 --pga 0.4 --out curve.png"
)
def plot_curve(
    *,
    out: Out,
    inputs: options.Block,
    held: options.Measures,
    over: str | None = option(
        "Intensity measure on the horizontal axis: pgv, pga, pgd or 'sa(1)' [default: pgv, or "
        "the first predictor of --model that is not given]"
    ),
    answering: options.Ranging,
    compare: str | None = option(
        "Fragility functions of the same intensity measure for comparison: NRML 0.4 or 0.5 "
        "(.xml), or a pelicun table (.csv)",
        metavar="FILE",
    ),
) -> None:
    """Draw the fragility curve of a block.

    The band is the confidence interval of P. With --sites a second band is the prediction interval
    of the fraction of identical blocks that fails at these sites in one earthquake. Other intensity
    measures are held at the given values.
    """
    from rbfrag.plots import plot

    def published(measure: str) -> Any:
        if compare is None:
            return {}
        from rbfrag.exchange.export import of_measure

        return of_measure(compare, measure)

    question: dict[str, Any] = {**inputs, **held, **answering}
    with inputs.named():
        picture = plot.curve(out=out, over=over, compared=published, **question)
    print_warnings(picture.warnings, (*inputs, *INTENSITY))
    print(out)


@app.command(
    "sensitivity",
    epilog="Example:  rbfrag plot sensitivity --height 2 --width .4 --phi 40 --pgv .9 --out s.png",
)
def plot_sensitivity(
    *,
    out: Out,
    inputs: Annotated[Inputs, Fields(*BLOCK, *MEASURED, *COMMON)],
    measures: options.Shaking,
    request: Annotated[Inputs, Fields(*REQUEST, without=("sites",))],
) -> None:
    """Draw P of a block at usual errors of measurement, the longest bar at the top.

    With --dip-sigma, --width-sigma etc. the distribution of P over the draws is drawn, too, with
    its mean and its interval.
    """
    from rbfrag.plots import plot

    with inputs.named():
        picture = plot.sensitivity(out, **inputs, **measures, **request)
    print_warnings(picture.warnings)
    print(out)


@app.command("critical", epilog="Example:  rbfrag plot critical --out critical.png")
def plot_critical(out: Out, suite: options.Suite = None, db: options.Db = None) -> None:
    """Draw critical k_r/PGA over the frequency ratio.

    The frequency ratio is omega_m/p. The lines are those of single pulses.
    """
    from rbfrag.plots import plot

    plot.critical(out, suite=suite, db=db)
    print(out)


@app.command("calibration", epilog="Example:  rbfrag plot calibration --out calibration.png")
def plot_calibration(
    *,
    out: Out,
    model: list[str] | None = option(
        "Name of a stored model, up to four times [default: default model]"
    ),
    seed: int = option("Seed of the earthquake bootstrap", 0),
    db: options.Db = None,
) -> None:
    """Draw predicted probabilities and observed fractions.

    The predictions are from leave-one-earthquake-out cross-validation: each model is refitted
    without each earthquake in turn.
    """
    from rbfrag.plots import plot

    plot.calibration(out, models=model or (), seed=seed, db=db)
    print(out)


@app.command("vertical", epilog="Example:  rbfrag plot vertical --out vertical.png")
def plot_vertical(out: Out, suite: options.Suite = None, db: options.Db = None) -> None:
    """Draw critical strengths with and without vertical motion."""
    from rbfrag.plots import plot

    plot.vertical(out, suite=suite, db=db)
    print(out)


@app.command("spectrum", epilog="Example:  rbfrag plot spectrum 1 5 --polarity both --out x.png")
def plot_spectrum(
    *,
    motions: options.Motions,
    out: Out,
    reading: options.Reading,
    p2: str = option("Minimum range of p² on the axis [1/s²]", "0.1,30"),
    polarity: options.Polarity = "both",
    db: options.Db = None,
) -> None:
    """Draw the toppling spectra of motions over p², with PGV."""
    from rbfrag.plots import plot
    from rbfrag.plots.canvas import plot_path

    sizes, chosen = options.number_list(p2, "--p2"), options.polarities(polarity)
    plot_path(out)
    records = [find_motion(text, db=db, reading=reading) for text in motions]
    plot.spectrum(records, out, polarities=chosen, p2=sizes)
    print(out)


@app.command(
    "response", epilog="Example:  rbfrag plot response 1 --height 2 --width 0.4 --out a.png"
)
def plot_response(
    motion: options.Motion,
    out: Out,
    inputs: Annotated[Inputs, Fields("p2", "kr", *SHAPE, *PLANES, *JOINT, *COMMON)],
    vertical: options.Vertical = None,
    *,
    direction: options.Direction,
    reading: options.Reading,
    db: options.Db = None,
) -> None:
    """Draw the response history of a block.

    The upper part is the acceleration with k_r(theta), the lower part theta over the critical
    angle.
    """
    from rbfrag.fragility.method import TOPPLING_BLOCK
    from rbfrag.plots import plot

    _, numbers, about = numbers_of(inputs, TOPPLING_BLOCK.kind)
    ground, upward, remarks = find_shaking(motion, vertical, db=db, reading=reading)
    say_when_compiling()
    plot.response(
        ground, out, p2=numbers["p2"], kr=numbers["kr"], vertical=upward,
        polarity=direction,
    )  # fmt: skip
    print_warnings([*about, *remarks])
    print(out)


@app.command(
    "planes",
    epilog="Example:  rbfrag plot planes --base 25/102 --back 65/075 --face 70/090 --out a.png",
)
def plot_planes(
    *,
    planes: Annotated[Inputs, Fields(*SPACE)],
    out: Out,
) -> None:
    """Draw base, back and face of a block on a stereonet.

    The projection is lower hemisphere, equal area. Shaded are the poles of planes whose strike
    deviates too much from the face for a section.
    """
    from rbfrag.plots import plot

    picture = plot.planes(out, **planes)
    print(out)
    print_warnings(picture.warnings)


@app.command(
    "modes",
    epilog="Example:  rbfrag plot modes --phi 40 --beta 20 --rockmass mass.toml --out a.png",
)
def plot_modes(
    *,
    planes: Annotated[
        Inputs,
        Fields(*PLANES, "back_fracture", "s1_m", *JOINT, "cohesion_pa", "density_kg_m3"),
    ],
    out: Out,
    ultimate: bool = option(
        "Simulate the block of each 3° cell, with the spacing --s1 (default 1 m), to its end",
        False,
    ),
    motion: str | None = option("Accelerogram of --ultimate", metavar="MOTION"),
    jobs: options.Jobs = None,
    vertical: options.Vertical = None,
    direction: options.Direction,
    reading: options.Reading,
    db: options.Db = None,
    blocks: str | None = option(
        "Table of blocks to show (.csv, .xlsx, .parquet) with alpha1_deg and alpha3_deg, "
        "such as that of rbfrag rockmass --out",
        metavar="FILE",
    ),
    sheet: options.Sheet = None,
    rockmass: str | None = option("Rock mass file of blocks to show (.toml, .csv)", metavar="FILE"),
) -> None:
    """Draw failure modes and yield accelerations.

    The axes are the block angles alpha1 and alpha3. With water, cohesion or roughness the chart is
    for blocks of one spacing --s1. With --ultimate the colours are the final modes under --motion.
    """
    from rbfrag.plots import plot
    from rbfrag.plots.canvas import plot_path

    if "phi_deg" not in planes:
        raise InputError(
            "phi_deg is missing: the chart is for one friction angle", fields=("phi_deg",)
        )
    plot_path(out)
    shown = charted_blocks(blocks, rockmass, planes, sheet=sheet)
    ran, warnings = None, [*shown.warnings]
    if ultimate != (motion is not None):
        raise InputError("--ultimate requires --motion, and --motion requires --ultimate")
    if motion is not None:
        from rbfrag.campaign.rock_mass_answer import shake
        from rbfrag.plots.modes import chart_cells

        ground, upward, remarks = find_shaking(motion, vertical, db=db, reading=reading)
        say_when_compiling()
        with ProgressBar("plot modes", "cells") as bar:
            ran = shake(
                chart_cells(**planes), ground, vertical=upward, polarity=direction,
                jobs=jobs, on_progress=lambda state: bar.show(state.completed, state.total),
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
def plot_rotation(
    *,
    out: Out,
    inputs: Annotated[Inputs, Fields(*SHAPE, *PLANES, *COMMON, without=("kind",))],
    back_follows: str = option(
        "Rotations of the back plane as fractions of the block rotation, 0–1",
        "0,0.5,1",
    ),
    json: options.Json = False,
) -> None:
    """Draw the yield acceleration over the rotation.

    The block slumps or topples with confinement. The minimum is printed. The rock behind the block
    may yield: the back plane then rotates by a fraction of the block rotation.
    """
    from rbfrag.plots.modes import plot_rotation as draw
    from rbfrag.plots.modes import yield_lines
    from rbfrag.question.classify import on_planes, without_kv

    with inputs.named():
        block, planes, *_ = on_planes(without_kv(inputs))
    if not planes.pop("back_fracture", True):
        raise InputError(
            "--no-back is not supported: slumping and confined toppling require a back plane"
        )
    for name in planes.keys() - {*PLANES}:
        text = (
            f"{name} cannot be combined with the yield over a rotation, which follows the first "
            "slip"
        )
        raise InputError(f"{text}: omit it", fields=(name,))
    shares = options.number_list(back_follows, "--back-follows")
    draw(block, out, back_follows=shares, **planes)
    lines = yield_lines(block, back_follows=shares, **planes)
    if json:
        print_json({"plot": out, "lines": [line._asdict() for line in lines]})
        return
    print_table(lines[0]._fields, lines)
    print(out)
