"""The block of a command: numbers, or a file that describes it."""

from __future__ import annotations

import math

from rbfrag.errors import InputError
from rbfrag.fragility.methods import TOPPLING_BLOCK


def toppling_block(
    p2: float | None, kr: float | None, block: str | None
) -> tuple[float, float, tuple[str, ...]]:
    """Return p2 [1/s²], k_r and warnings.

    Args:
        p2: the option --p2.
        kr: the option --kr.
        block: the option --block, a block file that states beta_deg and phi_deg.

    Raises:
        InputError: an option is missing or given twice, or the block does not topple; the
            message names the mode that governs instead.
    """
    if block is None:
        if p2 is None or kr is None:
            missing = "--p2" if p2 is None else "--kr"
            raise InputError(
                f"{missing} is missing: a block is given by --p2 and --kr, or by --block FILE"
            )
        return p2, kr, ()
    if p2 is not None or kr is not None:
        extra = "--kr" if p2 is None else "--p2"
        raise InputError(f"{extra} does not go with --block: the file describes the block")
    values, remarks = block_of_file(block, TOPPLING_BLOCK.kind)
    return values["p2"], values["kr"], remarks


def block_of_file(path: str, kind: str) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return what predictions read of the block of a file, by name, and warnings.

    Args:
        path: a block file that states beta_deg and phi_deg.
        kind: how the block is asked to fail.

    Raises:
        InputError: the block is of another mode, or no earthquake decides about it.
    """
    from rbfrag.solver.block.file import read_block
    from rbfrag.solver.kinds import model_of_kind
    from rbfrag.solver.mechanism import shaken_mechanism
    from rbfrag.solver.stability.modes import words_of_mode
    from rbfrag.solver.stability.single import stability

    model = model_of_kind(kind)
    if not model.parameters:
        raise InputError(f"there is no fragility model of kind {kind}")
    file = read_block(path)
    conditions = dict(file.conditions)
    for name in ("beta_deg", "phi_deg"):
        if name not in conditions:
            raise InputError(
                f"{path}: {name} is missing: how the block fails depends on dip and friction"
            )
    if conditions.pop("kv", 0.0) != 0.0:
        raise InputError(
            f"{path}: kv does not belong in a block that is to be shaken: the vertical "
            "acceleration comes with the motion; leave the line out"
        )
    found = stability(file.block, **conditions)
    if found.mode != model.mode:
        raise InputError(
            f"{path}: its mode is {words_of_mode(found.mode)} (yield "
            f"{found.yield_acceleration:.4g} g, {found.state}), and the {kind} model says nothing "
            "about it; see  rbfrag block --polygon FILE"
        )
    if found.state != "stable" or found.yield_acceleration <= 0.0:
        raise InputError(
            f"{path}: the block is {found.state} in {words_of_mode(found.mode)} (yield "
            f"{found.yield_acceleration:.4g} g): no earthquake decides about it"
        )
    if "ps2" in model.parameters:
        for name, nothing in (("cohesion_pa", 0.0), ("back_fracture", True)):
            if conditions.pop(name, nothing) != nothing:
                raise InputError(f"{path}: {name} does not go with {kind}: leave it out")
        conditions.pop("density_kg_m3", None)
        try:
            shaken = shaken_mechanism(file.block, kind=kind, **conditions)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        values = {"ks": shaken.yield_g, "ps2": shaken.p2}
        if math.isfinite(shaken.leaves_g):
            values["leaves_g"] = shaken.leaves_g
        return values, shaken.remarks
    values = {
        "p2": file.block.p2,
        "kr": found.yield_acceleration,
        "ky": found.yield_acceleration,
    }
    values = {name: value for name, value in values.items() if name in model.parameters}
    if "ky" in values:
        if conditions.get("cohesion_pa"):
            raise InputError(
                f"{path}: cohesion_pa does not go with {kind}: the first slip breaks it"
            )
        values["beta_deg"] = found.beta_deg
    return values, found.warnings
