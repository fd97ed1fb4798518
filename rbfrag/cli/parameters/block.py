"""The blocks of a command: numbers, a shape, a file that describes one, a table, a rock mass."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rbfrag.cli.parameters.options import EXCEL_TEXT
from rbfrag.cli.parameters.stack import option
from rbfrag.errors import InputError
from rbfrag.question.fields import option_of
from rbfrag.solver.described import DescribedBlock, describe

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rbfrag.exchange.block_rows import BlockRows
    from rbfrag.rockmasses.joint_sets import RockMass

WAYS = (
    "--height and --width, or by --alpha1, --alpha3 and --r3, or by --s1, --s2 and --gamma, or by "
    "--block or --polygon FILE"
)
"""How a shape is given."""

_Number = float | None

NoBack = Annotated[bool, typer.Option("--no-back", help="There is no fracture behind the block.")]


@dataclass(frozen=True, kw_only=True)
class ShapeOptions:
    """A block by its shape, and its planes."""

    height: _Number = option(
        "Height of a rectangular block, perpendicular to its base [m], with --width."
    )
    width: _Number = option("Width of a rectangular block along its base [m].")
    dip: _Number = option("Dip of the base of a rectangular block [deg], its --beta. Default: 0.")
    alpha1: _Number = option(
        "Angle from the normal of the base to the line centroid-heel [deg], with --alpha3 and --r3."
    )
    alpha3: _Number = option("The same of the toe [deg].")
    r3: _Number = option("Distance from centroid to toe [m].")
    s1: _Number = option("Spacing of the base fractures [m], with --s2 and --gamma.")
    s2: _Number = option("Spacing of the back fractures [m].")
    gamma: _Number = option("Dip of the back plane less dip of the base [deg].")
    block: str | None = option(
        "Block file (.toml or .csv); what it states about the planes may be given anew by options.",
        metavar="FILE",
    )
    polygon: str | None = option(
        "File with the outline of a block (.csv or .toml), read as --block is.", metavar="FILE"
    )
    beta: _Number = option("Dip of the base, out of the slope positive [deg].")
    phi: _Number = option(
        "Friction angle of the base [deg]; only a rectangle is taken to topple without."
    )
    phi_back: _Number = option("Friction angle of the back plane [deg]. Default: that of the base.")
    no_back: NoBack = False

    def described(self, **conditions: float | None) -> DescribedBlock | None:
        """Return the block, or None where no option says anything of its shape.

        Args:
            conditions: further keywords of `rbfrag.stability` that were given, or None.
        """
        lengths = ("height", "width", "dip", "alpha1", "alpha3", "r3", "s1", "s2", "gamma")
        return describe(
            {name: getattr(self, name) for name in lengths},
            {
                "beta_deg": self.beta,
                "phi_deg": self.phi,
                "phi_back_deg": self.phi_back,
                "back_fracture": False if self.no_back else None,
                **conditions,
            },
            file=self.block or self.polygon,
            spell=option_of,
        )


@dataclass(frozen=True, kw_only=True)
class MeshOptions:
    """A free-standing block by its surface."""

    mesh: str | None = option(
        "Closed mesh [m] of a free-standing block in its measured resting pose on level ground "
        "(.obj, .ply, .stl).",
        metavar="FILE",
    )
    up: str = option("Axis of the mesh that points up: x, y or z.", "z")
    contact_mm: float = option(
        "Height above the lowest vertex up to which vertices touch the ground [mm].", 10.0
    )
    out: str | None = option(
        "Write the table of a mesh's blocks, one row for each azimuth (.csv, .xlsx, .parquet).",
        metavar="FILE",
    )
    excel_text: bool = option(EXCEL_TEXT, False)


@dataclass(frozen=True, kw_only=True)
class NumberOptions:
    """A toppling block by two numbers."""

    p2: _Number = option("Frequency parameter p² of the block [1/s²], with --kr.")
    kr: _Number = option(
        "Rocking acceleration coefficient k_r = tan(critical angle) [g], with --p2."
    )


@dataclass(frozen=True, kw_only=True)
class UncertaintyOptions:
    """How well a block is known; the option that states a value states its median."""

    p2_sigma: _Number = option("Standard deviation of ln p²; 0.1 is some 10 %.")
    kr_sigma: _Number = option("Standard deviation of ln k_r; 0.1 is some 10 %.")
    ky_sigma: _Number = option("Standard deviation of ln k_y.")
    restitution_sigma: _Number = option("Standard deviation of the restitution.")
    block_draws: str | None = option(
        "Table of what the one block may be (.csv, .xlsx, .parquet), a row each, with the columns "
        "of a block table and weight if they weigh differently.",
        metavar="FILE",
    )

    def sigmas(self) -> dict[str, float]:
        """Return the standard deviations that were given, by name."""
        values = {name: value for name, value in vars(self).items() if name.endswith("sigma")}
        return {name: value for name, value in values.items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class BlockOptions(ShapeOptions, NumberOptions):
    """A block by numbers or by its shape."""

    def toppling(
        self, kind: str | None = None
    ) -> tuple[str | None, dict[str, float], tuple[str, ...]]:
        """Return the kind, what predictions read of the block, and warnings.

        Args:
            kind: how the block fails; None for toppling, or rocking where nothing backs its shape.

        Raises:
            InputError: an option is missing, or the block is of another mode.
        """
        described = self.described()
        if described is None:
            if self.p2 is None or self.kr is None:
                missing = "--p2" if self.p2 is None else "--kr"
                raise InputError(
                    f"{missing} is missing: a block is given by --p2 and --kr, or by {WAYS}"
                )
            return kind, {"p2": self.p2, "kr": self.kr}, ()
        from rbfrag.question.blocks import toppling_block

        blocks = toppling_block(described, {}, kind)
        (group,) = blocks.groups
        return group.kind, {**group.numbers}, blocks.remarks


@dataclass(frozen=True, kw_only=True)
class StandingOptions:
    """Whether blocks are backed by a slope."""

    kind: str | None = option(
        "toppling (backed by a slope, the default) or rocking (free-standing, which fails at "
        "weaker shaking)."
    )
    restitution: _Number = option(
        "Rocking: speed after an impact over that before it, above 0 and up to 1; a column "
        "restitution goes before. Default: what angular momentum leaves."
    )

    def is_free(self, kind: str | None) -> bool:
        """Return whether blocks of a kind stand free; None for what is stated here."""
        kind = kind or self.kind
        if kind is None:
            return False
        from rbfrag.solver.kinds import facts_of

        return facts_of(kind).free_standing

    def completed(self, columns: dict[str, Any], kind: str | None = None) -> dict[str, Any]:
        """Return a table of blocks with what is stated for all; backed ones have no restitution.

        Args:
            columns: the table.
            kind: how they fail; None for what is stated here.

        Raises:
            InputError: a restitution of blocks that do not stand free.
        """
        import numpy as np

        if not self.is_free(kind):
            if self.restitution is not None:
                raise InputError("--restitution goes with blocks that stand free: --kind rocking")
            return {name: column for name, column in columns.items() if name != "restitution"}
        if self.restitution is None:
            return columns
        own = columns.get("restitution", np.full(columns["kr"].size, np.nan))
        return {**columns, "restitution": np.where(np.isnan(own), self.restitution, own)}


@dataclass(frozen=True, kw_only=True)
class TableOptions(BlockOptions):
    """One block, or a table of them."""

    blocks: str | None = option(
        "Table of blocks (.csv, .xlsx, .parquet, .geojson) with p2_1_s2 [1/s²] and kr, or "
        "height_m and width_m [m] (and dip_deg, phi_deg); one answer a row.",
        metavar="FILE",
    )

    def toppling_blocks(
        self,
        standing: StandingOptions | None = None,
        *,
        name: str | None = None,
        reads: Collection[str] = (),
    ) -> TopplingBlocks:
        """Return the blocks that the options describe.

        Args:
            standing: how they stand; None for backed by a slope.
            name: identifier of a single block.
            reads: which further columns of a table the command reads, as for `read_blocks`.
        """
        import numpy as np

        standing = standing or StandingOptions()
        if self.blocks is not None:
            from rbfrag.exchange.block_rows import read_blocks

            rows = read_blocks(self.blocks, standing.kind, reads=reads, one_kind=True)
            rows = replace(rows, blocks=standing.completed({**rows.blocks}))
            return TopplingBlocks(rows.blocks, False, (), rows, standing.kind)
        from rbfrag.solver.quantity import positive

        kind, values, remarks = self.toppling(standing.kind)
        if missing := [each for each in ("p2", "kr") if each not in values]:
            raise InputError(
                f"a block of kind {kind} has no {missing[0]}: this command answers for "
                "blocks that topple or rock; predict answers for others"
            )
        columns: dict[str, Any] = {
            "block_id": [name],
            "p2_1_s2": np.array([positive(values["p2"], "p2", "1/s²")]),
            "kr": np.array([positive(values["kr"], "kr", "g")]),
        }
        if standing.restitution is None and "restitution" in values:
            columns["restitution"] = np.array([values["restitution"]])
        return TopplingBlocks(standing.completed(columns, kind), False, remarks, None, kind)


@dataclass(frozen=True, kw_only=True)
class BlocksOptions(TableOptions):
    """One block, or many."""

    rockmass: str | None = option(
        "Rock mass file (.toml, .csv): the mean over its stable toppling blocks.", metavar="FILE"
    )

    def toppling_blocks(
        self,
        standing: StandingOptions | None = None,
        *,
        name: str | None = None,
        reads: Collection[str] = (),
        n: int | None = None,
    ) -> TopplingBlocks:
        """Return the blocks that the options describe.

        Args:
            standing: how they stand; None for backed by a slope.
            name: identifier of a single block.
            reads: which further columns of a table the command reads, as for `read_blocks`.
            n: number of realisations of the rock mass; None for what its file says.
        """
        if self.rockmass is None:
            return super().toppling_blocks(standing, name=name, reads=reads)
        if standing is not None and standing.is_free(None):
            raise InputError(
                f"--rockmass does not go with --kind {standing.kind}: its blocks are backed by the "
                "rock behind them"
            )
        return _of_rock_mass(self.rockmass, n)


class TopplingBlocks(NamedTuple):
    """Toppling blocks that a command answers for.

    Args:
        columns: ``block_id``, ``p2_1_s2`` [1/s²] and ``kr``, and of a table that has them the
            columns that are read.
        is_class: they stand for one class, the stable toppling blocks of a rock mass.
        remarks: warnings.
        rows: the table that they are of, with what cannot be used of it; None without one.
        kind: how they fail; None for toppling.
    """

    columns: Mapping[str, Any]
    is_class: bool
    remarks: tuple[str, ...]
    rows: BlockRows | None = None
    kind: str | None = None

    @property
    def question(self) -> BlockRows | dict[str, Any]:
        """What says of the blocks all that an answer reads of them."""
        if self.rows is not None:
            return self.rows
        # a class has more blocks than names
        return {name: values for name, values in self.columns.items() if name != "block_id"}


def taken_as_medians(columns: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what a command says that leaves standard deviations of blocks aside."""
    sigmas = ("p2_sigma", "kr_sigma")
    stated = [name for name in sigmas if name in columns and columns[name].any()]
    if not stated:
        return ()
    return (
        f"{' and '.join(stated)} of the blocks are not integrated here: each block is taken as its "
        "median (predict, survival and losses integrate)",
    )


def _of_rock_mass(path: str, n: int | None) -> TopplingBlocks:
    from rbfrag.rockmasses.file import read_rock_mass
    from rbfrag.rockmasses.report import toppling_blocks as stable_topples

    p2s, krs, share = stable_topples(read_rock_mass(path).realise(n, None))
    if krs.size == 0:
        raise InputError(f"{path}: no block of it topples: there is no model for them")
    remark = (
        f"the answer is the mean over {krs.size} stable toppling blocks, "
        f"{100.0 * share:.3g} % of the rock mass; the others have no part in it"
    )
    columns = {"block_id": ["rock mass"], "p2_1_s2": p2s, "kr": krs}
    return TopplingBlocks(columns, True, (remark,))


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
    warnings: list[str] = []
    names = ("alpha1_deg", "alpha3_deg")
    if blocks is not None:
        from rbfrag.exchange.block_table import read_columns

        columns = read_columns(blocks, names, faults={})
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
    if "friction.cohesion_pa" in mass.variables:
        warnings.append(
            "the chart is drawn without cohesion, and that of the rock mass is: "
            f"{mass.variables['friction.cohesion_pa']} Pa"
        )
    if mass.back_fracture == no_back:
        warnings.append(
            "the rock mass has "
            + ("a back fracture, and the chart none" if no_back else "no back fracture: --no-back")
        )
    return warnings
