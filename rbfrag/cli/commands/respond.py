"""`rbfrag respond`: response of one block to one ground motion."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import zip_longest
from typing import TYPE_CHECKING, Annotated, Any

from rbfrag.cli import options
from rbfrag.cli.command import Fields, Inputs, option
from rbfrag.cli.inputs import find_shaking, numbers_of
from rbfrag.cli.output import print_result, say_when_compiling
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import COMMON, FAILURE, JOINT, MEASURED, PLANES, SCATTER, SHAPE

if TYPE_CHECKING:
    from rbfrag.solver.block.geometry import Block

EXAMPLE = "Example:  rbfrag respond record.AT2 --height 2.4 --width 0.5 --plot response.png"


def respond(
    *,
    motions: options.Motions,
    inputs: Annotated[
        Inputs,
        Fields(
            "p2",
            "kr",
            "ky",
            *FAILURE,
            *SHAPE,
            *PLANES,
            *JOINT,
            *SCATTER,
            *MEASURED[:-1],
            *COMMON,
            without=("kind", "ks_sigma", "ps2_sigma", "kct_sigma", "pct2_sigma"),
        ),
    ],
    two_way: bool = option("Two-way sliding: upslope displacement is possible", False),
    horizontal: bool = option(
        "Sliding on a horizontal plane (Newmark), without the factor cos(phi - beta)/cos(phi)",
        False,
    ),
    kind: str | None = option(
        "Kind of response: toppling, rocking, sliding, slumping or confined_toppling "
        "[default: from the failure mode; rocking for a toppling block with --no-back]"
    ),
    draws: int | None = option(
        "Number of draws of an uncertain block, rounded up to a power of two from 256 on if two or "
        "more numbers are uncertain [default: 512; from six uncertain numbers on 1,024; all rows "
        "of --block-draws]"
    ),
    polarity: str = option(
        "Polarity for draws: forward, reverse, or both (alternating draws)",
        "forward",
    ),
    block_draws: options.BlockDraws = None,
    vertical: list[str] | None = option(
        "Vertical accelerogram of the same recording, positive upward; for several motions "
        "one for each, in their order",
        metavar="MOTION",
    ),
    direction: options.Direction,
    slope_azimuth: options.SlopeAzimuth = None,
    gap: float | None = option(
        "Time between two motions [s] [default: until the block is at rest]"
    ),
    csv: str | None = option("Response history (.csv)"),
    plot: str | None = option(
        "Figure of the acceleration with the available strength, and of the response history "
        "(.png, .pdf, .svg)"
    ),
    film: str | None = option(
        "Animation of the block on its planes (.gif, .mp4 with ffmpeg, .html); requires the "
        "block geometry"
    ),
    exaggerate: float = option("Scale factor of displacement and rotation in --film", 1.0),
    reading: options.Reading,
    db: options.Db = None,
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Compute the response of a block to an accelerogram.

    Several accelerograms act in sequence: a sliding or slumping block starts each motion from its
    displaced position, a toppling or rocking block from rest at its initial position.

    The block is given by --p2 and --kr (toppling, or with --kind rocking free-standing on level
    ground), --ky (sliding), or its geometry, which determines the failure mode; a rectangular block
    without --phi is assumed to topple.

    With standard deviations (--height-sigma, --dip-sigma etc. of measured fields, --kr-sigma etc.
    of parameters) or --block-draws the block is uncertain: the result is the fraction of draws that
    fails, with its sampling uncertainty. Draws that are unstable at rest are excluded, because the
    block stands.
    """
    from rbfrag.solver.history import write_history
    from rbfrag.solver.kinds import KINDS
    from rbfrag.solver.respond import respond as run

    uncertain = next((name for name in inputs if "_sigma" in name), None)
    is_drawn = draws is not None or block_draws is not None or uncertain is not None
    if is_drawn and len(motions) > 1:
        raise InputError("an uncertain block supports a single motion: omit the others")
    if vertical and len(vertical) != len(motions):
        raise InputError(
            f"{len(motions)} motions and {len(vertical)} times --vertical: give one for each "
            "motion, or none"
        )
    body: Block | None = None
    kwargs: dict[str, Any] = {}
    remarks: tuple[str, ...] = ()
    if not is_drawn:
        body, kwargs, remarks = _body(inputs, kind)
    if film is not None:
        if body is None:
            raise InputError(
                "--film requires the block geometry and --phi, except for free-standing blocks"
            )
        from rbfrag.plots.response import film_path

        film_path(film)
    read = [
        find_shaking(record, upward, db=db, reading=reading, slope_azimuth_deg=slope_azimuth)
        for record, upward in zip_longest(motions, vertical or ())
    ]
    about = [text for *_, texts in read for text in texts]
    grounds, upwards = [ground for ground, *_ in read], [upward for _, upward, _ in read]
    say_when_compiling()
    if is_drawn:
        from rbfrag.question.respond_draws import respond_draws

        weights = None
        values: dict[str, Any] = {**inputs}
        if block_draws is not None:
            from rbfrag.exchange.block_rows import read_draws

            columns, weights = read_draws(block_draws)
            values |= columns
        with inputs.named():
            drawn = respond_draws(
                grounds[0], vertical=upwards[0], weights=weights, draws=draws, kind=kind,
                polarity=direction if direction == "reverse" else polarity,  # type: ignore[arg-type]
                two_way=two_way, horizontal=horizontal, **values,
            )  # fmt: skip
        drawn = replace(drawn, warnings=(*about, *drawn.warnings))
        print_result(drawn, json=json, verbose=verbose)
        return
    title = ",\nthen ".join(ground.label for ground in grounds)
    several = len(grounds) > 1
    settings = {name for facts in KINDS.values() for name in facts.settings}
    with inputs.named():
        response = run(
            grounds if several else grounds[0],
            vertical=upwards if several else upwards[0],
            polarity=direction,
            gap_s=gap,
            two_way=two_way,
            horizontal=horizontal,
            **{name: inputs[name] for name in settings if name in inputs},
            history=any((csv, plot, film)),
            **kwargs,
        )
    response = replace(response, warnings=(*about, *remarks, *response.warnings))
    if csv is not None:
        write_history(response, csv)
    if plot is not None:
        from rbfrag.plots.response import plot_motion, plot_response, plot_rocking

        history, is_reverse = response.history, direction == "reverse"
        if history is not None and history.impact_s is not None:
            plot_rocking(response, plot, title=title, reverse=is_reverse)
        elif history is not None and history.displacement_m is not None:
            plot_motion(response, plot, title=title, reverse=is_reverse)
        else:
            assert response.critical_angle_deg is not None
            p2 = kwargs["p2"] if body is None else body.p2
            kr = kwargs.get("kr") or math.tan(math.radians(response.critical_angle_deg))
            plot_response(response, plot, p2=p2, kr=kr, title=title, reverse=is_reverse)
    if film is not None and body is not None:
        from rbfrag.plots.response import film as draw_film
        from rbfrag.solver.kinds import facts_of

        backed = not facts_of(response.kind).free_standing
        draw_film(
            response, body, film, beta_deg=kwargs["beta_deg"],
            exaggerate=exaggerate, back_fracture=backed and kwargs.get("back_fracture", True),
            title=title,
        )  # fmt: skip
    print_result(response, json=json, verbose=verbose)


def _body(inputs: Inputs, kind: str | None) -> tuple[Block | None, dict[str, Any], tuple[str, ...]]:
    """Return the block if its geometry is simulated, its keywords, and warnings."""
    from rbfrag.question.classify import shape_of, without_kv
    from rbfrag.question.shape_validation import TAKEN_NOT_TO_SLIP
    from rbfrag.solver.kinds import facts_of, kind_of_mode

    with inputs.named():
        shape = shape_of(without_kv(inputs))
        parameters = {
            name: inputs[name] for name in ("p2", "kr", "ky", "beta_deg") if name in inputs
        }
        if shape is None:
            return None, {"kind": kind, **parameters}, ()
        if len(parameters.keys() - {"beta_deg"}):
            numbers_of(inputs)  # rejects a block that is described twice
        if "phi_deg" in shape.planes:
            return shape.block, {"kind": kind, "block": shape.block, **shape.planes}, ()
        backed = shape.planes.get("back_fracture", True)
        model = kind_of_mode("topple", back_fracture=backed) if kind is None else facts_of(kind)
        if model.free_standing:
            kwargs = {"kind": model.kind, "block": shape.block, **shape.planes}
            return shape.block, kwargs, (TAKEN_NOT_TO_SLIP,)
    _, numbers, remarks = numbers_of(inputs, model.kind)
    return None, {"kind": kind, **numbers}, remarks
