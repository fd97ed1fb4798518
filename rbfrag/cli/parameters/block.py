"""Block options of a command: parameters, geometry, geometry file, table or rock mass."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from rbfrag.cli.parameters.option_groups import ParsedInputs, option
from rbfrag.cli.parameters.options import CRS, EXCEL_TEXT, IGNORE_COLUMNS, SHEET, column_names
from rbfrag.errors import InputError
from rbfrag.results.numbers import percent
from rbfrag.vocabulary.quantities import column_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rbfrag.exchange.block_rows import BlockRows
    from rbfrag.rockmasses.joint_sets import RockMass


@dataclass(frozen=True, kw_only=True)
class MeshOptions:
    """Free-standing block given by its surface mesh."""

    mesh: str | None = option(
        "Closed mesh of a free-standing block [m] in its measured resting pose on level "
        "ground (.obj, .ply, .stl)",
        metavar="FILE",
    )
    up: str = option("Vertical axis of the mesh, positive upward: x, y or z", "z")
    contact_mm: float = option(
        "Maximum height of contact vertices above the lowest vertex [mm]", 10.0
    )
    out: str | None = option(
        "Output table of the blocks of a mesh, one row per azimuth (.csv, .xlsx, .parquet)",
        metavar="FILE",
    )
    excel_text: bool = option(EXCEL_TEXT, False)


@dataclass(frozen=True, kw_only=True)
class TableOptions:
    """Table of blocks instead of a single block."""

    blocks: str | None = option(
        "Table of blocks (.csv, .xlsx, .parquet, .geojson) with p2_1_s2 [1/s²] and kr, or "
        "height_m and width_m [m] (and dip_deg, phi_deg), or the parameters of another kind; "
        "one answer per row",
        metavar="FILE",
    )
    sheet: str | None = option(SHEET, metavar="NAME")
    ignore_columns: str | None = option(IGNORE_COLUMNS, metavar="NAME,NAME")
    crs: str | None = option(CRS)

    def collect_blocks(
        self,
        inputs: ParsedInputs,
        *,
        name: str | None = None,
        reads: Collection[str] = (),
        one_kind: bool = False,
        need_kind: str = "",
        dry: bool = False,
    ) -> GivenBlocks:
        """Return the blocks that the options describe.

        Args:
            inputs: what they say of one block, or of all rows of a table.
            name: identifier of a single block.
            reads: which further columns of a table the command reads, as for `read_blocks`.
            one_kind: whether all must be of one kind, as for `read_blocks`.
            need_kind: why rows of a table need a kind, as for `read_blocks`.
            dry: without the water that a table has behind blocks.
        """
        from rbfrag.exchange.block_rows import read_blocks

        kind = inputs.get("kind")
        block_inputs = {field: value for field, value in inputs.items() if field != "kind"}
        if self.blocks is not None:
            table: Any = self.blocks
            rows = read_blocks(
                table, kind, reads=reads, one_kind=one_kind, for_all=block_inputs, sheet=self.sheet,
                ignore_columns=column_names(self.ignore_columns), crs=self.crs, need_kind=need_kind,
                dry=dry,
            )  # fmt: skip
            return GivenBlocks(rows.blocks, False, inputs.notes, rows)
        kind, numbers, remarks = numbers_of(inputs)
        columns = {column_of(field): [value] for field, value in numbers.items()}
        names = {} if name is None else {"block_id": [name]}
        read = read_blocks({**columns, **names}, kind, one_kind=True).require_all()
        block_columns = {
            column: values for column, values in read.items() if column not in ("row", "line")
        }
        return GivenBlocks({**block_columns, "block_id": [name]}, False, remarks)


@dataclass(frozen=True, kw_only=True)
class BlocksOptions(TableOptions):
    """Table of blocks or rock mass instead of a single block."""

    rockmass: str | None = option(
        "Rock mass file (.toml, .csv), for the mean over its stable toppling blocks", metavar="FILE"
    )

    def collect_blocks(
        self,
        inputs: ParsedInputs,
        *,
        name: str | None = None,
        reads: Collection[str] = (),
        one_kind: bool = False,
        need_kind: str = "",
        n: int | None = None,
        dry: bool = False,
    ) -> GivenBlocks:
        """Return the blocks that the options describe.

        Args:
            inputs: what they say of one block, or of all rows of a table.
            name: identifier of a single block.
            reads: which further columns of a table the command reads, as for `read_blocks`.
            one_kind: whether all must be of one kind, as for `read_blocks`.
            need_kind: why rows of a table need a kind, as for `read_blocks`.
            n: number of realisations of the rock mass; None for what its file says.
            dry: without the water that a table has behind blocks.
        """
        if self.rockmass is None:
            return super().collect_blocks(
                inputs, name=name, reads=reads, one_kind=one_kind, need_kind=need_kind, dry=dry
            )
        from rbfrag.fragility.method import TOPPLING_BLOCK

        if inputs.get("kind") not in (None, TOPPLING_BLOCK.kind):
            raise InputError(
                f"--rockmass cannot be combined with --kind {inputs['kind']}: only toppling blocks "
                "of a rock mass are supported"
            )
        return _of_rock_mass(self.rockmass, n)


def numbers_of(
    inputs: ParsedInputs, kind: str | None = None, pga_g: float | None = None
) -> tuple[str | None, dict[str, Any], tuple[str, ...]]:
    """Return the kind and the model inputs of the single block in the options, and warnings.

    Args:
        inputs: what they say, by field.
        kind: how it fails where they do not say so; None for what they say of it.
        pga_g: PGA at which it is said whether the toe of a block that topples holds [g].

    Raises:
        InputError: it is described twice or in part, or is of another kind.
    """
    from rbfrag.question.classify import classify_block

    block_inputs = {field: value for field, value in inputs.items() if field != "kind"}
    with inputs.named():
        blocks = classify_block(block_inputs, inputs.get("kind", kind), pga_g)
    (group,) = blocks.groups
    return group.kind, {**group.numbers}, (*inputs.notes, *blocks.remarks)


class GivenBlocks(NamedTuple):
    """Blocks of a command.

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
        """Model inputs of the blocks, by field, and their kinds."""
        from rbfrag.question.classify import numbers_in

        kinds = [str(kind) for kind in self.columns["kind"]]
        return {**numbers_in(self.columns), "kind": kinds}

    @property
    def question(self) -> BlockRows | dict[str, Any]:
        """Block table for an answer, with everything it uses."""
        if self.rows is not None:
            return self.rows
        # a class has more blocks than names
        return {name: values for name, values in self.columns.items() if name != "block_id"}


def _of_rock_mass(path: str, n: int | None) -> GivenBlocks:
    from rbfrag.fragility.method import TOPPLING_BLOCK
    from rbfrag.rockmasses.file import read_rock_mass
    from rbfrag.rockmasses.report import notes_on_water
    from rbfrag.rockmasses.report import toppling_blocks as stable_topples

    blocks = read_rock_mass(path).realise(n, None)
    p2s, krs, share = stable_topples(blocks)
    if krs.size == 0:
        raise InputError(f"{path}: no stable toppling blocks: only these are supported")
    remark = (
        f"the answer is the mean over {krs.size} stable toppling blocks, "
        f"{percent(share)} of the rock mass; the others have no part in it"
    )
    kinds = [TOPPLING_BLOCK.kind] * krs.size
    columns = {"block_id": ["rock mass"], "p2_1_s2": p2s, "kr": krs, "kind": kinds}
    return GivenBlocks(columns, True, (remark, *notes_on_water(blocks), *blocks.rock_mass.remarks))


class ChartedBlocks(NamedTuple):
    """Block angles to show in a chart.

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
    planes: Mapping[str, Any],
    *,
    sheet: str | None = None,
) -> ChartedBlocks:
    """Return the block angles from a table or a rock mass file.

    Args:
        blocks: the option --blocks, a table with alpha1_deg and alpha3_deg.
        rockmass: the option --rockmass, a rock mass file.
        planes: friction angles that the chart is drawn for, and whether it has a back fracture.
        sheet: the option --sheet.
    """
    warnings: list[str] = []
    names = ("alpha1_deg", "alpha3_deg")
    if blocks is not None:
        from rbfrag.exchange.block_table import opened_table

        with opened_table(blocks, names, (), sheet=sheet) as table:
            table.need(names)
            columns, _, _ = table.read_all()
    elif rockmass is not None:
        from rbfrag.rockmasses.file import read_rock_mass
        from rbfrag.rockmasses.report import block_columns

        mass = read_rock_mass(rockmass)
        columns = block_columns(mass.realise())
        warnings += _differences(mass, planes)
    else:
        return ChartedBlocks(None, None, warnings)
    alpha1, alpha3 = (columns[name] for name in names)
    is_valid = (alpha1 > -90.0) & (alpha1 < alpha3) & (alpha3 < 90.0)
    if not is_valid.any():
        raise InputError(
            f"{blocks or rockmass}: no valid block: alpha1_deg and alpha3_deg must be between -90 "
            "and 90 degrees, and alpha1_deg below alpha3_deg"
        )
    if not is_valid.all():
        warnings.append(
            f"{(~is_valid).sum()} of {is_valid.size} rows have invalid angles and are not shown"
        )
    return ChartedBlocks(alpha1[is_valid], alpha3[is_valid], warnings)


def _differences(mass: RockMass, planes: Mapping[str, Any]) -> list[str]:
    """Return where a rock mass and its chart are inconsistent."""
    warnings = []
    phi = planes["phi_deg"]
    friction = mass.variables["friction.phi_deg"]
    if friction.law != "constant" or friction.location != phi:
        warnings.append(
            f"the chart is drawn for a friction angle of {phi:g} deg, and that of the rock mass "
            f"is: {friction}"
        )
    back = mass.variables.get("friction.phi_back_deg", friction)
    of_chart = planes.get("phi_back_deg", phi)
    if back != friction and (back.law != "constant" or back.location != of_chart):
        warnings.append(
            f"the chart is drawn for a friction angle of the back of {of_chart:g} deg, and that "
            f"of the rock mass is: {back}"
        )
    if "friction.cohesion_pa" in mass.variables:
        warnings.append(
            "the chart is drawn without cohesion, and that of the rock mass is: "
            f"{mass.variables['friction.cohesion_pa']} Pa"
        )
    if mass.back_fracture != planes.get("back_fracture", True):
        warnings.append(
            "the rock mass has "
            + (
                "a back fracture, and the chart none"
                if mass.back_fracture
                else "no back fracture: --no-back"
            )
        )
    return warnings
