"""`rbfrag block`: how one block fails, and at which acceleration."""

from __future__ import annotations

from typing import Annotated

import typer

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options

EXAMPLE = "Example:  rbfrag block --s1 1 --s2 0.6 --gamma 25 --beta 20 --phi 40"


def block(
    alpha1: options.Alpha1 = None,
    alpha3: options.Alpha3 = None,
    r3: options.R3 = None,
    s1: options.S1 = None,
    s2: options.S2 = None,
    gamma: options.Gamma = None,
    polygon: Annotated[
        str | None,
        typer.Option(
            "--polygon",
            help="Block file (.toml or .csv); what it states may be given anew by options.",
        ),
    ] = None,
    beta: options.Beta = None,
    phi: options.Phi = None,
    phi_back: options.PhiBack = None,
    cohesion: Annotated[
        float | None, typer.Option("--cohesion", help="Cohesion of the base [Pa], with --density.")
    ] = None,
    density: Annotated[
        float | None, typer.Option("--density", help="Density of the rock [kg/m3].")
    ] = None,
    kv: Annotated[
        float | None,
        typer.Option("--kv", help="Vertical acceleration of the ground, up positive [g]."),
    ] = None,
    no_back: options.NoBack = False,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot",
            help="Draw the block on its planes with its contacts and the resultant at yield "
            "(.png, .pdf, .svg).",
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Print a block's failure mode, yield accelerations and size parameter.

    Angles in degrees, lengths in m, accelerations in g, p2 in 1/s2.
    """
    from rbfrag.solver.block.file import described
    from rbfrag.solver.stability.single import stability, stability_as_dict

    shape, conditions = described(
        {"alpha1": alpha1, "alpha3": alpha3, "r3": r3},
        {"s1": s1, "s2": s2, "gamma": gamma},
        {
            "beta_deg": beta,
            "phi_deg": phi,
            "phi_back_deg": phi_back,
            "cohesion_pa": cohesion,
            "density_kg_m3": density,
            "kv": kv,
        },
        no_back,
        file_option="--polygon",
        path=polygon,
    )
    found = stability(shape, **conditions)
    if plot is not None:
        from rbfrag.plots.block import plot_block

        plot_block(shape, found, plot)
    answer = stability_as_dict(shape, found)
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
    print_warnings(found.warnings)
