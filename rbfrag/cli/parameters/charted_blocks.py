"""The blocks that a command shows on the chart of modes: those of a table or of a rock mass."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rbfrag.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rbfrag.rockmasses.joint_sets import RockMass


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

    Raises:
        InputError: both files are given, or one that cannot be used.
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
        from rbfrag.rockmasses.table import block_columns

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
