"""A block as people describe it by options: its shape in one of three ways, and its base."""

from __future__ import annotations

from typing import Any

from rbfrag.errors import InputError
from rbfrag.solver.block.file import read_block
from rbfrag.solver.block.geometry import Block


def described(
    angles: dict[str, float | None],
    fractures: dict[str, float | None],
    given: dict[str, float | None],
    no_back: bool,
    *,
    file_option: str | None = None,
    path: str | None = None,
) -> tuple[Block, dict[str, Any]]:
    """Return the block that options or a file describe, and the keywords of `stability`.

    Args:
        angles: --alpha1, --alpha3 and --r3 by name.
        fractures: --s1, --s2 and --gamma by name.
        given: keywords of `stability` that were given as options; they go before the file.
        no_back: the option --no-back.
        file_option: name of the option that names a file, where there is one.
        path: the file, or None.

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
    file_option: str | None,
    path: str | None,
) -> tuple[Block, dict[str, Any]]:
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
    in_a_file = f", or by {file_option} FILE" if file_option else ""
    raise InputError(
        f"a block is described by --alpha1 --alpha3 --r3, or by --s1 --s2 --gamma{in_a_file}; "
        f"given: {named}"
    )
