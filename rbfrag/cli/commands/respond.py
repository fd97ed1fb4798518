"""`rbfrag respond`: response of one block to one ground motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

from rbfrag.cli.output import print_result, say_when_compiling
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import numbers_of
from rbfrag.cli.parameters.motion import find_shaking
from rbfrag.cli.parameters.option_groups import ParsedInputs, fields_of, option, stacked
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import COMMON, FAILURE, JOINT, PLANES, SCATTER, SHAPE

if TYPE_CHECKING:
    from rbfrag.solver.block.geometry import Block
    from rbfrag.solver.results import Response

EXAMPLE = "Example:  rbfrag respond record.AT2 --height 2.4 --width 0.5 --plot response.png"


@dataclass(frozen=True, kw_only=True)
class Model:
    """Kind of failure and model options of the response."""

    two_way: bool = option("Two-way sliding: upslope displacement is possible", False)
    horizontal: bool = option(
        "Sliding on a horizontal plane (Newmark), without the factor cos(phi - beta)/cos(phi)",
        False,
    )
    kind: str | None = option(
        "Kind of response: toppling, rocking, sliding, slumping or confined_toppling "
        "[default: from the failure mode; rocking for a toppling block with --no-back]"
    )


@dataclass(frozen=True, kw_only=True)
class Directions(options.Direction):
    """Direction in which each of several ground motions acts on the block."""

    vertical: list[str] | None = option(  # type: ignore[assignment]
        "Vertical accelerogram of the same recording, positive upward; for several motions "
        "one for each, in their order",
        metavar="MOTION",
    )
    gap: float | None = option("Time between two motions [s] [default: until the block is at rest]")

    def for_motions(self, count: int) -> list[options.Direction]:
        """Return the direction of each of several ground motions."""
        texts: list[str | None] = [None] * count if self.vertical is None else [*self.vertical]
        if len(texts) != count:
            raise InputError(
                f"{count} motions and {len(texts)} times --vertical: give one for each motion, or "
                "none"
            )
        return [options.Direction(vertical=text, reverse=self.reverse) for text in texts]


@dataclass(frozen=True, kw_only=True)
class BlockDrawOptions:
    """Block uncertainty: draws and their number."""

    draws: int | None = option(
        "Number of draws of an uncertain block, from its standard deviations or "
        "--block-draws, for the fraction that fails"
    )
    seed: int = option("Seed of --draws", 1)
    polarity: str = option(
        "Polarity for --draws: forward, reverse, or both (alternating draws)",
        "forward",
    )
    block_draws: options.BlockDraws = None


@dataclass(frozen=True, kw_only=True)
class ResponseFiles:
    """Output files of the response."""

    csv: str | None = option("Response history (.csv)")
    plot: str | None = option(
        "Figure of the acceleration with the available strength, and of the response history "
        "(.png, .pdf, .svg)"
    )
    film: str | None = option(
        "Animation of the block on its planes (.gif, .mp4 with ffmpeg, .html); requires the "
        "block geometry"
    )
    exaggerate: float = option("Scale factor of displacement and rotation in --film", 1.0)


@stacked
def respond(
    *,
    motions: options.Motions,
    inputs: Annotated[
        ParsedInputs,
        fields_of(
            "p2",
            "kr",
            "ky",
            *FAILURE,
            *SHAPE,
            *PLANES,
            *JOINT,
            *SCATTER,
            *COMMON,
            without=("kind", "ks_sigma", "ps2_sigma", "kct_sigma", "pct2_sigma"),
        ),
    ],
    model: Model,
    drawn: BlockDrawOptions,
    direction: Directions,
    files: ResponseFiles,
    reading: options.ReadingOptions,
    db: options.Db = None,
    printing: options.Printing,
) -> None:
    """Compute the response of a block to an accelerogram.

    Several accelerograms act in sequence: a sliding or slumping block starts each motion from its
    displaced position, a toppling or rocking block from rest at its initial position.

    The block is given by --p2 and --kr (toppling, or with --kind rocking free-standing on level
    ground), --ky (sliding), or its geometry, which determines the failure mode; a rectangular block
    without --phi is assumed to topple.

    With --draws the block is uncertain: the result is the fraction of draws that fails, with its
    sampling uncertainty.
    """
    from rbfrag.solver.history_file import write_history
    from rbfrag.solver.kinds import KINDS
    from rbfrag.solver.respond import respond as run

    if drawn.draws is not None:
        from rbfrag.solver.respond_draws import respond_draws

        possible, remarks = _possible(drawn, inputs, model.kind)
        if len(motions) > 1:
            raise InputError("--draws supports a single motion: omit the others")
        motion_direction = direction.for_motions(1)[0]
        ground, upward, about = find_shaking(motions[0], motion_direction, db=db, reading=reading)
        say_when_compiling()
        result = respond_draws(
            ground,
            vertical=upward,
            polarity=direction.polarity if direction.reverse else drawn.polarity,  # type: ignore[arg-type]
            two_way=model.two_way,
            horizontal=model.horizontal,
            draws=drawn.draws,
            seed=drawn.seed,
            displacement_m=inputs.get("displacement_m"),
            **{"restitution": inputs.get("restitution"), **possible},
        )
        result = replace(result, warnings=(*about, *remarks, *result.warnings))
        print_result(result, json=printing.json, verbose=printing.verbose)
        return
    body, kwargs, remarks = _body(inputs, model.kind)
    if files.film is not None:
        if body is None:
            raise InputError(
                "--film requires the block geometry and --phi, except for free-standing blocks"
            )
        from rbfrag.plots.film import film_path

        film_path(files.film)
    read = [
        find_shaking(record, motion_direction, db=db, reading=reading)
        for record, motion_direction in zip(
            motions, direction.for_motions(len(motions)), strict=True
        )
    ]
    about = [text for *_, texts in read for text in texts]
    grounds, upwards = [ground for ground, *_ in read], [upward for _, upward, _ in read]
    title = ",\nthen ".join(ground.label for ground in grounds)
    several = len(grounds) > 1
    say_when_compiling()
    settings = {name for facts in KINDS.values() for name in facts.settings}
    with inputs.named():
        response = run(
            grounds if several else grounds[0],
            vertical=upwards if several else upwards[0],
            polarity=direction.polarity,
            gap_s=direction.gap,
            two_way=model.two_way,
            horizontal=model.horizontal,
            **{name: inputs[name] for name in settings if name in inputs},
            history=any((files.csv, files.plot, files.film)),
            **kwargs,
        )
    response = replace(response, warnings=(*about, *remarks, *response.warnings))
    if files.csv is not None:
        write_history(response, files.csv)
    if files.plot is not None:
        p2 = kwargs.get("p2") if body is None else body.p2
        _draw(response, files.plot, p2, kwargs.get("kr"), title, direction.reverse)
    if files.film is not None and body is not None:
        from rbfrag.plots.film import film
        from rbfrag.solver.kinds import facts_of

        backed = not facts_of(response.kind).free_standing
        film(
            response, body, files.film, beta_deg=kwargs["beta_deg"],
            exaggerate=files.exaggerate, back_fracture=backed and kwargs.get("back_fracture", True),
            title=title,
        )  # fmt: skip
    print_result(response, json=printing.json, verbose=printing.verbose)


def _possible(
    drawn: BlockDrawOptions, inputs: ParsedInputs, kind: str | None
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the keywords of the block uncertainty, and warnings."""
    if drawn.block_draws is not None:
        from rbfrag.exchange.block_draws import read_draws

        values, weights = read_draws(drawn.block_draws)
        return {"kind": kind, **values, "weights": weights}, ()
    body, kwargs, remarks = _body(inputs, kind)
    if body is not None:
        kwargs = {"kind": kwargs["kind"], **_numbers_of(body, kwargs)}
    sigmas = {name: value for name, value in inputs.items() if name.endswith("_sigma")}
    return {**kwargs, **sigmas}, remarks


def _numbers_of(body: Block, kwargs: dict[str, Any]) -> dict[str, float]:
    """Return the parameters of a symmetric free-standing block on level ground; reject other
    geometries.
    """
    from rbfrag.solver.kinds import facts_of

    is_free_standing = kwargs["kind"] is not None and facts_of(kwargs["kind"]).free_standing
    if (
        is_free_standing
        and kwargs["beta_deg"] == 0.0
        and math.isclose(body.alpha1_deg, -body.alpha3_deg)
    ):
        return {"p2": body.p2, "kr": body.tan_alpha3}
    raise InputError(
        "--draws supports blocks given by --p2 and --kr, by --ky, as rectangles or in tables; "
        "see rbfrag block for p2 and kr of a geometry, rbfrag rockmass --motion for variable "
        "joint sets"
    )


def _body(
    inputs: ParsedInputs, kind: str | None
) -> tuple[Block | None, dict[str, Any], tuple[str, ...]]:
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


def _draw(
    response: Response, path: str, p2: float | None, kr: float | None, title: str, reverse: bool
) -> None:
    history = response.history
    if history is not None and history.impact_s is not None:
        from rbfrag.plots.response import plot_rocking

        plot_rocking(response, path, title=title, reverse=reverse)
        return
    if history is not None and history.displacement_m is not None:
        from rbfrag.plots.response import plot_motion

        plot_motion(response, path, title=title, reverse=reverse)
        return
    from rbfrag.plots.response import plot_response

    assert response.critical_angle_deg is not None
    assert p2 is not None
    kr = math.tan(math.radians(response.critical_angle_deg)) if kr is None else kr
    plot_response(response, path, p2=p2, kr=kr, title=title, reverse=reverse)
