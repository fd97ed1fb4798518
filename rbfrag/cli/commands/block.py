"""`rbfrag block`: how one block fails, and at which acceleration."""

from __future__ import annotations

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import WAYS, ShapeOptions
from rbfrag.cli.parameters.stack import option, stacked
from rbfrag.errors import InputError

EXAMPLE = "Example:  rbfrag block --s1 1 --s2 0.6 --gamma 25 --beta 20 --phi 40"


@stacked
def block(
    *,
    shape: ShapeOptions,
    cohesion: float | None = option("Cohesion of the base [Pa], with --density."),
    density: float | None = option("Density of the rock [kg/m3]."),
    kv: float | None = option("Vertical acceleration of the ground, up positive [g]."),
    plot: str | None = option(
        "Draw the block on its planes with its contacts and the resultant at yield "
        "(.png, .pdf, .svg)."
    ),
    json: options.Json = False,
) -> None:
    """Print a block's failure mode, yield accelerations and size.

    Angles in degrees, lengths in m, accelerations in g, the size parameter p2 in 1/s2. A block
    that topples is backed by a slope; a free-standing one rocks, and fails at weaker shaking.
    """
    from rbfrag.solver.stability.single import stability, stability_as_dict

    described = shape.described(cohesion_pa=cohesion, density_kg_m3=density, kv=kv)
    if described is None:
        raise InputError(f"no block: describe it by {WAYS}")
    body, conditions = described.on_planes()
    result = stability(body, **conditions)
    if plot is not None:
        from rbfrag.plots.block import plot_block

        plot_block(body, result, plot)
    answer = stability_as_dict(body, result)
    if json:
        print_json(answer)
        return
    answer.pop("warnings")
    margins = answer.pop("margins")
    bond = answer.pop("cohesion")
    print_pairs(answer | {f"cohesion_{name}": value for name, value in (bond or {}).items()})
    for margin in margins:
        print(
            f"{margin['mode']} if {margin['variable']} changes by {margin['change_deg']:+.6g} deg"
        )
    print_warnings(result.warnings)
