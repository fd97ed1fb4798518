"""The blocks of a command: numbers, a shape, a file that describes one, a table, a rock mass."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rbfrag.cli.parameters.options import EXCEL_TEXT, SHEET
from rbfrag.cli.parameters.stack import Given, option
from rbfrag.errors import InputError
from rbfrag.question.fields import column_of, name_of, option_of
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
        "toppling (backed by a slope) or rocking (free-standing, which fails at weaker shaking). "
        "Default: what the blocks are given by."
    )
    restitution: _Number = option(
        "Rocking: speed after an impact over that before it, above 0 and up to 1; a column "
        "restitution goes before. Default: what angular momentum leaves."
    )

    @property
    def stated(self) -> dict[str, float]:
        """What is stated of all blocks, by field."""
        numbers = {name_of(name): value for name, value in vars(self).items() if name != "kind"}
        return {name: value for name, value in numbers.items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class TableOptions:
    """A table of blocks in the place of one."""

    blocks: str | None = option(
        "Table of blocks (.csv, .xlsx, .parquet, .geojson) with p2_1_s2 [1/s²] and kr, or "
        "height_m and width_m [m] (and dip_deg, phi_deg), or the numbers of another kind; one "
        "answer a row.",
        metavar="FILE",
    )
    sheet: str | None = option(SHEET, metavar="NAME")

    def given_blocks(
        self,
        given: Given,
        *,
        name: str | None = None,
        reads: Collection[str] = (),
        one_kind: bool = False,
    ) -> GivenBlocks:
        """Return the blocks that the options describe.

        Args:
            given: what they say of one block, or of all rows of a table.
            name: identifier of a single block.
            reads: which further columns of a table the command reads, as for `read_blocks`.
            one_kind: whether all must be of one kind, as for `read_blocks`.
        """
        from rbfrag.exchange.block_rows import read_blocks

        kind = given.get("kind")
        stated = {field: value for field, value in given.items() if field != "kind"}
        if self.blocks is not None:
            table: Any = self.blocks
            rows = read_blocks(
                table, kind, reads=reads, one_kind=one_kind, for_all=stated, sheet=self.sheet
            )
            return GivenBlocks(rows.blocks, False, (), rows)
        kind, numbers, remarks = numbers_of(given)
        columns = {column_of(field): [value] for field, value in numbers.items()}
        names = {} if name is None else {"block_id": [name]}
        read = read_blocks({**columns, **names}, kind, one_kind=True).whole()
        own = {column: values for column, values in read.items() if column not in ("row", "line")}
        return GivenBlocks({**own, "block_id": [name]}, False, remarks)


@dataclass(frozen=True, kw_only=True)
class BlocksOptions(TableOptions):
    """A table of blocks or a rock mass in the place of one block."""

    rockmass: str | None = option(
        "Rock mass file (.toml, .csv): the mean over its stable toppling blocks.", metavar="FILE"
    )

    def given_blocks(
        self,
        given: Given,
        *,
        name: str | None = None,
        reads: Collection[str] = (),
        one_kind: bool = False,
        n: int | None = None,
    ) -> GivenBlocks:
        """Return the blocks that the options describe.

        Args:
            given: what they say of one block, or of all rows of a table.
            name: identifier of a single block.
            reads: which further columns of a table the command reads, as for `read_blocks`.
            one_kind: whether all must be of one kind, as for `read_blocks`.
            n: number of realisations of the rock mass; None for what its file says.
        """
        if self.rockmass is None:
            return super().given_blocks(given, name=name, reads=reads, one_kind=one_kind)
        from rbfrag.fragility.methods import TOPPLING_BLOCK

        if given.get("kind") not in (None, TOPPLING_BLOCK.kind):
            raise InputError(
                f"--rockmass does not go with --kind {given['kind']}: its blocks are backed by the "
                "rock behind them, and those that topple are answered for"
            )
        return _of_rock_mass(self.rockmass, n)


def numbers_of(
    given: Given, *, topples: bool = False
) -> tuple[str | None, dict[str, Any], tuple[str, ...]]:
    """Return the kind of the one block that options describe, its numbers, and warnings.

    Args:
        given: what they say, by field.
        topples: whether a shape of no stated kind is to topple, or to rock where nothing backs it.

    Raises:
        InputError: it is described twice or in part, or is of another kind.
    """
    from rbfrag.question.blocks import has_shape, missing_number, one_block, refuse_foreign
    from rbfrag.solver.kinds import kind_of_mode

    stated = {field: value for field, value in given.items() if field != "kind"}
    kind = given.get("kind")
    if topples and kind is None and has_shape(stated):
        kind = kind_of_mode("topple", back_fracture=stated.get("back_fracture", True)).kind
    with given.named():
        blocks = one_block(stated, kind)
    (group,) = blocks.groups
    if lacking := missing_number(group.numbers, group.kind):
        missing, names = lacking
        of_kind = f" of kind {group.kind}" if group.kind else ""
        raise InputError(
            f"{missing} is missing: a block{of_kind} is given by {' and '.join(names)}, or by its "
            "shape, such as height_m and width_m",
            fields=(*names, "height_m", "width_m"),
        )
    refuse_foreign(group.numbers, group.kind)
    if topples and "p2" not in group.numbers:
        raise InputError(
            f"p2 is no number of a block that is given by {' and '.join(group.numbers)}: this "
            "command answers for blocks that topple or rock; predict answers for others",
            fields=("p2", *group.numbers),
        )
    return group.kind, {**group.numbers}, blocks.remarks


class GivenBlocks(NamedTuple):
    """Blocks that a command answers for.

    Args:
        columns: ``block_id``, ``kind`` and the numbers that the kinds read, and of a table that has
            them the columns that are read.
        is_class: they stand for one class, the stable toppling blocks of a rock mass.
        remarks: warnings.
        rows: the table that they are of, with what cannot be used of it; None without one.
    """

    columns: Mapping[str, Any]
    is_class: bool
    remarks: tuple[str, ...]
    rows: BlockRows | None = None

    @property
    def numbers(self) -> dict[str, Any]:
        """What answers read of the blocks, by field, and their kinds."""
        from rbfrag.question.blocks import numbers_in

        kinds = [str(kind) for kind in self.columns["kind"]]
        return {**numbers_in(self.columns), "kind": kinds}

    @property
    def question(self) -> BlockRows | dict[str, Any]:
        """What says of the blocks all that an answer reads of them."""
        if self.rows is not None:
            return self.rows
        # a class has more blocks than names
        return {name: values for name, values in self.columns.items() if name != "block_id"}


def _of_rock_mass(path: str, n: int | None) -> GivenBlocks:
    from rbfrag.fragility.methods import TOPPLING_BLOCK
    from rbfrag.rockmasses.file import read_rock_mass
    from rbfrag.rockmasses.report import toppling_blocks as stable_topples

    p2s, krs, share = stable_topples(read_rock_mass(path).realise(n, None))
    if krs.size == 0:
        raise InputError(f"{path}: no block of it topples: there is no model for them")
    remark = (
        f"the answer is the mean over {krs.size} stable toppling blocks, "
        f"{100.0 * share:.3g} % of the rock mass; the others have no part in it"
    )
    kinds = [TOPPLING_BLOCK.kind] * krs.size
    columns = {"block_id": ["rock mass"], "p2_1_s2": p2s, "kr": krs, "kind": kinds}
    return GivenBlocks(columns, True, (remark,))


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
    blocks: str | None,
    rockmass: str | None,
    *,
    phi: float,
    phi_back: float | None,
    no_back: bool,
    sheet: str | None = None,
) -> ChartedBlocks:
    """Return the blocks of one of two files.

    Args:
        blocks: the option --blocks, a table with alpha1_deg and alpha3_deg.
        rockmass: the option --rockmass, a rock mass file.
        phi: friction angle that the chart is drawn for [deg].
        phi_back: that of the back plane [deg]; None for the same.
        no_back: whether the chart has no back fracture.
        sheet: the option --sheet.
    """
    warnings: list[str] = []
    names = ("alpha1_deg", "alpha3_deg")
    if blocks is not None:
        from rbfrag.exchange.block_table import opened_table

        with opened_table(blocks, names, (), sheet=sheet) as table:
            table.need(names)
            columns, _, _ = table.whole()
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
