"""The geometry options of a command: a block in one of three ways, and what it stands on."""

from __future__ import annotations

from typing import Annotated, Any

import typer


def _number(name: str, text: str) -> Any:
    return typer.Option(name, help=text)


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
