"""The blocks of a command: two numbers, a file that describes one, a table, or a rock mass."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.fragility.methods import TOPPLING_BLOCK

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rbfrag.rockmasses.joint_sets import RockMass


def toppling_block(
    p2: float | None, kr: float | None, block: str | None
) -> tuple[float, float, tuple[str, ...]]:
    """Return p2 [1/s²], k_r and warnings.

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


class TopplingBlocks(NamedTuple):
    """Toppling blocks that a command answers for.

    Args:
        columns: ``block_id``, ``p2_1_s2`` [1/s²] and ``kr``, and of a table that has them
            ``weight``, ``lon`` and ``lat`` [deg].
        is_class: they stand for one class, the stable toppling blocks of a rock mass.
        remarks: warnings.
    """

    columns: dict[str, Any]
    is_class: bool
    remarks: tuple[str, ...]


def toppling_blocks(
    p2: float | None,
    kr: float | None,
    block: str | None,
    blocks: str | None,
    rockmass: str | None,
    *,
    n: int | None = None,
    name: str | None = None,
) -> TopplingBlocks:
    """Return the blocks that one of four options or pairs of options describes.

    Args:
        p2: the option --p2.
        kr: the option --kr.
        block: the option --block, a block file.
        blocks: the option --blocks, a table or GeoJSON points.
        rockmass: the option --rockmass, a rock mass file.
        n: number of realisations of the rock mass; None for what its file says.
        name: identifier of a single block.
    """
    import numpy as np

    alone = p2 is not None or kr is not None or block is not None
    if (blocks is not None) + (rockmass is not None) + alone > 1:
        raise InputError(
            "give one of --p2 with --kr, --block, --blocks and --rockmass, not several of them"
        )
    if blocks is not None:
        from rbfrag.exchange.block_table import waiting_blocks

        return TopplingBlocks(waiting_blocks(blocks), False, ())
    if rockmass is not None:
        from rbfrag.rockmasses.file import read_rock_mass
        from rbfrag.rockmasses.report import toppling_blocks as stable_topples

        p2s, krs, share = stable_topples(read_rock_mass(rockmass).realise(n, None))
        if krs.size == 0:
            raise InputError(f"{rockmass}: no block of it topples: there is no model for them")
        remark = (
            f"the answer is the mean over {krs.size} stable toppling blocks, "
            f"{100.0 * share:.3g} % of the rock mass; the others have no part in it"
        )
        columns = {"block_id": ["rock mass"], "p2_1_s2": p2s, "kr": krs}
        return TopplingBlocks(columns, True, (remark,))
    from rbfrag.solver.quantity import positive

    one_p2, one_kr, remarks = toppling_block(p2, kr, block)
    columns = {
        "block_id": [name],
        "p2_1_s2": np.array([positive(one_p2, "p2", "1/s²")]),
        "kr": np.array([positive(one_kr, "kr", "g")]),
    }
    return TopplingBlocks(columns, False, remarks)


class ChartedBlocks(NamedTuple):
    """Block angles to be shown.

    Args:
        alpha1_deg: angles of the heel [deg]; None for no blocks.
        alpha3_deg: angles of the toe [deg].
        warnings: what does not fit the chart.
    """

    alpha1_deg: NDArray[np.float64] | None
    alpha3_deg: NDArray[np.float64] | None
    warnings: list[str]


def charted_blocks(
    blocks: str | None, rockmass: str | None, *, phi: float, phi_back: float | None, no_back: bool
) -> ChartedBlocks:
    """Return the blocks of one of two files.

    Args:
        blocks: the option --blocks, a table with alpha1_deg and alpha3_deg.
        rockmass: the option --rockmass, a rock mass file.
        phi: friction angle that the chart is drawn for [deg].
        phi_back: that of the back plane [deg]; None for the same.
        no_back: whether the chart has no back fracture.
    """
    if blocks is not None and rockmass is not None:
        raise InputError("--blocks does not go with --rockmass: show one of them")
    warnings: list[str] = []
    names = ("alpha1_deg", "alpha3_deg")
    if blocks is not None:
        from rbfrag.exchange.block_table import read_columns

        columns = read_columns(blocks, names)
    elif rockmass is not None:
        from rbfrag.rockmasses.file import read_rock_mass
        from rbfrag.rockmasses.report import block_columns

        mass = read_rock_mass(rockmass)
        columns = block_columns(mass.realise())
        warnings += _differences(mass, phi, phi_back, no_back)
    else:
        return ChartedBlocks(None, None, warnings)
    alpha1, alpha3 = (columns[name] for name in names)
    known = (alpha1 > -90.0) & (alpha1 < alpha3) & (alpha3 < 90.0)
    if not known.any():
        raise InputError(
            f"{blocks or rockmass}: there is no block to show: alpha1_deg and alpha3_deg lie "
            "between -90 and 90 degrees, and the first is below the second"
        )
    if not known.all():
        warnings.append(f"{(~known).sum()} of {known.size} rows are no block and not shown")
    return ChartedBlocks(alpha1[known], alpha3[known], warnings)


def _differences(mass: RockMass, phi: float, phi_back: float | None, no_back: bool) -> list[str]:
    """Return where a rock mass and the chart it is shown on do not agree."""
    warnings = []
    stated = mass.variables["friction.phi_deg"]
    if stated.law != "constant" or stated.location != phi:
        warnings.append(
            f"the chart is drawn for a friction angle of {phi:g} deg, and that of the rock mass "
            f"is: {stated}"
        )
    back = mass.variables.get("friction.phi_back_deg", stated)
    of_chart = phi if phi_back is None else phi_back
    if back != stated and (back.law != "constant" or back.location != of_chart):
        warnings.append(
            f"the chart is drawn for a friction angle of the back of {of_chart:g} deg, and that "
            f"of the rock mass is: {back}"
        )
    if mass.back_fracture == no_back:
        warnings.append(
            "the rock mass has "
            + ("a back fracture, and the chart none" if no_back else "no back fracture: --no-back")
        )
    return warnings
