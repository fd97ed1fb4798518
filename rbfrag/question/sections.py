"""Planes in space as angles and spacings of the section across the face."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError
from rbfrag.question.shapes import SHAPES, WAYS
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.solver.block.planes import plane_of, section_of
from rbfrag.vocabulary.quantities import SPACE

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ANGLES = {"base": "beta_deg", "back": "gamma_deg"}
"""The angle of a section that a plane in space states."""

_SPACINGS = ("s1_m", "s2_m")


def in_section(given: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """Return the fields of one block with dip, gamma and spacings of the section.

    Args:
        given: fields, of which base, back and face are texts.

    Returns:
        The fields without base, back and face, and warnings about the section.

    Raises:
        InputError: a plane is missing, stated twice or cannot be read, or no section does.
    """
    own = {name: value for name, value in given.items() if name not in SPACE}
    if "block" not in own and not any(name in own for names in SHAPES for name in names):
        raise InputError(
            f"base, back and face require the geometry of a block: give {WAYS}", fields=SPACE
        )
    for name in ("base", "face"):
        if name not in given:
            raise InputError(f"{name} is missing: give base and face together", fields=SPACE)
    for plane, angle in ANGLES.items():
        if plane in given and angle in own:
            raise InputError(
                f"{angle} cannot be combined with {plane}: both give the dip of the plane",
                fields=(angle, plane),
            )
    spaced = any(name in own for name in _SPACINGS)
    if spaced != ("back" in given):
        raise InputError(
            "back requires base, face, s1_m and s2_m: give all of them, or another geometry "
            "without back",
            fields=("back", *_SPACINGS),
        )
    face, base = plane_of(given["face"], "face"), plane_of(given["base"], "base")
    section = section_of(face, base, plane_of(given["back"], "back") if spaced else None)
    own["beta_deg"] = section.beta_deg
    if spaced:
        own["gamma_deg"] = section.gamma_deg
        factors = (section.base_factor, section.back_factor)
        own |= {n: own[n] * f for n, f in zip(_SPACINGS, factors, strict=True) if n in own}
    return own, section.remarks


def in_sections(
    given: Mapping[str, Any], size: int
) -> tuple[dict[str, NDArray[np.float64]], dict[int, str], tuple[Diagnostic, ...]]:
    """Return the fields of many blocks likewise, and why blocks have no section, by their place.

    Args:
        given: flat arrays of the number of blocks, or of one element; empty texts are not stated.
        size: number of blocks.
    """
    import numpy as np

    texts = {name: np.broadcast_to(given[name], size) for name in SPACE if name in given}
    own: dict[str, Any] = {name: value for name, value in given.items() if name not in SPACE}
    touched = ("beta_deg", *(("gamma_deg", *_SPACINGS) if "back" in texts else ()))
    columns = {
        name: np.array(np.broadcast_to(own.get(name, np.nan), size), dtype=np.float64)
        for name in touched
    }
    wrong: dict[int, str] = {}
    notes: list[Diagnostic] = []
    shapes = [name for names in SHAPES for name in names if name in own]
    for i in range(size):
        planes = {name: text[i] for name, text in texts.items() if text[i]}
        if not planes:
            continue
        numbers = {
            name: np.broadcast_to(own[name], size)[i] for name in {*shapes, *touched} & {*own}
        }
        stated = {name: float(value) for name, value in numbers.items() if value == value}
        try:
            section, remarks = in_section({**stated, **planes})
        except InputError as error:
            wrong[i] = str(error)
            continue
        for name in touched:
            columns[name][i] = section.get(name, np.nan)
        notes += [warning.replaced(rows=(i,)) for warning in remarks]
    return {**own, **columns}, wrong, diagnostics(notes)
