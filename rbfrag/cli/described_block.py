"""The geometry options of a command: a block in one of three ways, and what it stands on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.solver.block import Block


def _number(name: str, text: str) -> Any:
    return typer.Option(name, help=text, show_default=False)


Alpha1 = Annotated[
    float | None, _number("--alpha1", "Angle of the heel [deg], with --alpha3 and --r3.")
]
Alpha3 = Annotated[float | None, _number("--alpha3", "Angle of the toe [deg].")]
R3 = Annotated[float | None, _number("--r3", "Distance from centroid to toe [m].")]
S1 = Annotated[
    float | None, _number("--s1", "Spacing of the base fractures [m], with --s2 and --gamma.")
]
S2 = Annotated[float | None, _number("--s2", "Spacing of the back fractures [m].")]
Gamma = Annotated[
    float | None, _number("--gamma", "Dip of the back plane less dip of the base [deg].")
]
Beta = Annotated[
    float | None, _number("--beta", "Dip of the base, out of the slope positive [deg].")
]
Phi = Annotated[float | None, _number("--phi", "Friction angle of the base [deg].")]
PhiBack = Annotated[
    float | None,
    _number("--phi-back", "Friction angle of the back plane [deg]. Default: that of the base."),
]
NoBack = Annotated[bool, typer.Option("--no-back", help="There is no fracture behind the block.")]


def described(
    angles: dict[str, float | None],
    fractures: dict[str, float | None],
    file_option: str,
    path: str | None,
    given: dict[str, float | None],
    no_back: bool,
) -> tuple[Block, dict[str, Any]]:
    """Return the block that options or a file describe, and the keywords of `stability`.

    Args:
        angles: --alpha1, --alpha3 and --r3 by name.
        fractures: --s1, --s2 and --gamma by name.
        file_option: name of the option that names a file.
        path: the file, or None.
        given: keywords of `stability` that were given as options; they go before the file.
        no_back: the option --no-back.

    Raises:
        InputError: a block that is described in no way, or in two; dip or friction are missing.
    """
    block, conditions = _shape(angles, fractures, file_option, path)
    conditions |= {name: value for name, value in given.items() if value is not None}
    if no_back:
        conditions["back_fracture"] = False
    for name, option in (("beta_deg", "--beta"), ("phi_deg", "--phi")):
        if name not in conditions:
            reason = "is missing: the mode of a block depends on dip and friction"
            where = f"{path}: {name} or " if path else ""
            raise InputError(f"{where}{option} {reason}")
    return block, conditions


def _shape(
    angles: dict[str, float | None],
    fractures: dict[str, float | None],
    file_option: str,
    path: str | None,
) -> tuple[Block, dict[str, Any]]:
    from rbfrag.solver.block import Block
    from rbfrag.solver.block_file import read_block

    by_angles = [name for name, value in angles.items() if value is not None]
    by_fractures = [name for name, value in fractures.items() if value is not None]
    if path is not None:
        extra = by_angles + [name for name in by_fractures if name != "gamma"]
        if extra:
            raise InputError(
                f"--{extra[0]} does not go with {file_option}: the file has the outline"
            )
        file = read_block(path, gamma_deg=fractures["gamma"])
        return file.block, dict(file.conditions)
    if len(by_angles) == 3 and not by_fractures:
        alpha1, alpha3, r3 = angles.values()
        return Block.from_angles(alpha1, alpha3, r3), {}  # type: ignore[arg-type]
    if len(by_fractures) == 3 and not by_angles:
        s1, s2, gamma = fractures.values()
        return Block.from_fractures(s1, s2, gamma), {}  # type: ignore[arg-type]
    named = ", ".join(f"--{name}" for name in (*by_angles, *by_fractures)) or "none of them"
    raise InputError(
        f"a block is described by --alpha1 --alpha3 --r3, or by --s1 --s2 --gamma, or by "
        f"{file_option} FILE; given: {named}"
    )
