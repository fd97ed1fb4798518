"""The toppling block of a command: two numbers, or a file that describes it."""

from __future__ import annotations

from rbfrag.errors import InputError


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

    from rbfrag.solver.block.file import read_block
    from rbfrag.solver.stability.single import stability

    file = read_block(block)
    conditions = dict(file.conditions)
    for name in ("beta_deg", "phi_deg"):
        if name not in conditions:
            raise InputError(
                f"{block}: {name} is missing: whether the block topples depends on dip and friction"
            )
    if conditions.pop("kv", 0.0) != 0.0:
        raise InputError(
            f"{block}: kv does not belong in a block that is to be shaken: the vertical "
            "acceleration comes with the motion; leave the line out"
        )
    found = stability(file.block, **conditions)
    if found.mode != "topple":
        name = found.mode.replace("_", " ")
        raise InputError(
            f"{block}: the block does not topple, its mode is {name} (yield "
            f"{found.yield_acceleration:.4g} g, {found.state}), and the toppling model says "
            "nothing about it; see  rbfrag block --polygon FILE"
        )
    if found.state != "stable" or found.yield_acceleration <= 0.0:
        raise InputError(
            f"{block}: the block is {found.state} in toppling (k_r = "
            f"{found.yield_acceleration:.4g} g): no earthquake decides about it"
        )
    return file.block.p2, found.yield_acceleration, found.warnings
