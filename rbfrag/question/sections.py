"""Conversion of planes in space to angles and spacings of the section across the face."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError
from rbfrag.question.shape_validation import SHAPES, WAYS
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.solver.block.planes import plane_of, section_of
from rbfrag.vocabulary.quantities import SPACE

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ANGLES = {"base": "beta_deg", "back": "gamma_deg"}
"""The angle of a section that a plane in space states."""

_SPACINGS = ("s1_m", "s2_m")


def in_section(inputs: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """Return the fields of one block with the dip, gamma and spacings of the section.

    Args:
        inputs: fields, of which base, back and face are texts.

    Returns:
        The fields without base, back and face, and warnings about the section.

    Raises:
        InputError: a plane is missing, stated twice or cannot be read, or no section does.
    """
    section_inputs = {name: value for name, value in inputs.items() if name not in SPACE}
    if "block" not in section_inputs and not any(
        name in section_inputs for names in SHAPES for name in names
    ):
        raise InputError(
            f"base, back and face require the geometry of a block: give {WAYS}", fields=SPACE
        )
    for name in ("base", "face"):
        if name not in inputs:
            raise InputError(f"{name} is missing: give base and face together", fields=SPACE)
    for plane, angle in ANGLES.items():
        if plane in inputs and angle in section_inputs:
            raise InputError(
                f"{angle} cannot be combined with {plane}: both give the dip of the plane",
                fields=(angle, plane),
            )
    spaced = any(name in section_inputs for name in _SPACINGS)
    if spaced != ("back" in inputs):
        raise InputError(
            "back requires base, face, s1_m and s2_m: give all of them, or another geometry "
            "without back",
            fields=("back", *_SPACINGS),
        )
    face, base = plane_of(inputs["face"], "face"), plane_of(inputs["base"], "base")
    section = section_of(face, base, plane_of(inputs["back"], "back") if spaced else None)
    section_inputs["beta_deg"] = section.beta_deg
    if spaced:
        section_inputs["gamma_deg"] = section.gamma_deg
        factors = (section.base_factor, section.back_factor)
        section_inputs |= {
            n: section_inputs[n] * f
            for n, f in zip(_SPACINGS, factors, strict=True)
            if n in section_inputs
        }
    return section_inputs, section.remarks


def in_sections(
    inputs: Mapping[str, Any], size: int
) -> tuple[dict[str, NDArray[np.float64]], dict[int, str], tuple[Diagnostic, ...]]:
    """Return the fields of blocks with the angles of their sections, and errors by block index.

    Args:
        inputs: flat arrays of the number of blocks, or of one element; empty texts are not stated.
        size: number of blocks.
    """
    import numpy as np

    texts = {name: np.broadcast_to(inputs[name], size) for name in SPACE if name in inputs}
    section_inputs: dict[str, Any] = {
        name: value for name, value in inputs.items() if name not in SPACE
    }
    touched = ("beta_deg", *(("gamma_deg", *_SPACINGS) if "back" in texts else ()))
    columns = {
        name: np.array(np.broadcast_to(section_inputs.get(name, np.nan), size), dtype=np.float64)
        for name in touched
    }
    wrong: dict[int, str] = {}
    notes: list[Diagnostic] = []
    shapes = [name for names in SHAPES for name in names if name in section_inputs]
    for i in range(size):
        planes = {name: text[i] for name, text in texts.items() if text[i]}
        if not planes:
            continue
        numbers = {
            name: np.broadcast_to(section_inputs[name], size)[i]
            for name in {*shapes, *touched} & {*section_inputs}
        }
        values = {name: float(value) for name, value in numbers.items() if value == value}
        try:
            section, remarks = in_section({**values, **planes})
        except InputError as error:
            wrong[i] = str(error)
            continue
        for name in touched:
            columns[name][i] = section.get(name, np.nan)
        notes += [warning.replaced(rows=(i,)) for warning in remarks]
    return {**section_inputs, **columns}, wrong, diagnostics(notes)
