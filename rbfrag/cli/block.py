"""`rbfrag block`: how one block fails, and at which acceleration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli import options
from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.solver.block import Block

EXAMPLE = "Example:  rbfrag block --s1 1 --s2 0.6 --gamma 25 --beta 20 --phi 40"


def _number(name: str, text: str) -> Any:
    return typer.Option(name, help=text, show_default=False)


def block(
    alpha1: Annotated[
        float | None, _number("--alpha1", "Angle of the heel [deg], with --alpha3 and --r3.")
    ] = None,
    alpha3: Annotated[float | None, _number("--alpha3", "Angle of the toe [deg].")] = None,
    r3: Annotated[float | None, _number("--r3", "Distance from centroid to toe [m].")] = None,
    s1: Annotated[
        float | None,
        _number("--s1", "Spacing of the base fractures [m], with --s2 and --gamma."),
    ] = None,
    s2: Annotated[float | None, _number("--s2", "Spacing of the back fractures [m].")] = None,
    gamma: Annotated[
        float | None, _number("--gamma", "Dip of the back plane less dip of the base [deg].")
    ] = None,
    polygon: Annotated[
        str | None,
        _number(
            "--polygon", "Block file (.toml or .csv); what it states may be given anew by options."
        ),
    ] = None,
    beta: Annotated[
        float | None, _number("--beta", "Dip of the base, out of the slope positive [deg].")
    ] = None,
    phi: Annotated[float | None, _number("--phi", "Friction angle of the base [deg].")] = None,
    phi_back: Annotated[
        float | None,
        _number("--phi-back", "Friction angle of the back plane [deg]. Default: that of the base."),
    ] = None,
    cohesion: Annotated[
        float | None, _number("--cohesion", "Cohesion of the base [Pa], with --density.")
    ] = None,
    density: Annotated[float | None, _number("--density", "Density of the rock [kg/m3].")] = None,
    kv: Annotated[
        float | None, _number("--kv", "Vertical acceleration of the ground, up positive [g].")
    ] = None,
    no_back: Annotated[
        bool, typer.Option("--no-back", help="There is no fracture behind the block.")
    ] = False,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot",
            help="Draw the block on its planes with its contacts and the resultant at yield "
            "(.png, .pdf, .svg).",
            show_default=False,
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Print a block's failure mode, yield accelerations and size parameter.

    Angles in degrees, lengths in m, accelerations in g, p2 in 1/s2.
    """
    from rbfrag.solver.stability import stability
    from rbfrag.solver.stability_report import as_dict

    shape, conditions = _described(
        {"alpha1": alpha1, "alpha3": alpha3, "r3": r3},
        {"s1": s1, "s2": s2, "gamma": gamma},
        polygon,
    )
    given = {
        "beta_deg": beta,
        "phi_deg": phi,
        "phi_back_deg": phi_back,
        "cohesion_pa": cohesion,
        "density_kg_m3": density,
        "kv": kv,
    }
    conditions |= {name: value for name, value in given.items() if value is not None}
    if no_back:
        conditions["back_fracture"] = False
    for name, option in (("beta_deg", "--beta"), ("phi_deg", "--phi")):
        if name not in conditions:
            raise InputError(f"{option} is missing: the mode depends on dip and friction")
    found = stability(shape, **conditions)
    if plot is not None:
        from rbfrag.plots.block import plot_block

        plot_block(shape, found, plot)
    answer = as_dict(shape, found)
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


def _described(
    angles: dict[str, float | None], fractures: dict[str, float | None], polygon: str | None
) -> tuple[Block, dict[str, Any]]:
    """Return the block that the options describe in one of three ways."""
    from rbfrag.solver.block import Block
    from rbfrag.solver.block_file import read_block

    by_angles = [name for name, value in angles.items() if value is not None]
    by_fractures = [name for name, value in fractures.items() if value is not None]
    if polygon is not None:
        extra = by_angles + [name for name in by_fractures if name != "gamma"]
        if extra:
            raise InputError(f"--{extra[0]} does not go with --polygon: the file has the outline")
        file = read_block(polygon, gamma_deg=fractures["gamma"])
        return file.block, dict(file.conditions)
    if len(by_angles) == 3 and not by_fractures:
        alpha1, alpha3, r3 = angles.values()
        return Block.from_angles(alpha1, alpha3, r3), {}  # type: ignore[arg-type]
    if len(by_fractures) == 3 and not by_angles:
        s1, s2, gamma = fractures.values()
        return Block.from_fractures(s1, s2, gamma), {}  # type: ignore[arg-type]
    given = ", ".join(f"--{name}" for name in (*by_angles, *by_fractures)) or "none of them"
    raise InputError(
        "a block is described by --alpha1 --alpha3 --r3, or by --s1 --s2 --gamma, or by --polygon "
        f"FILE; given: {given}"
    )
