"""The blocks and motions of a command: a block, its table or rock mass, and MOTION arguments."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from rbfrag.cli import options
from rbfrag.cli.command import Inputs, option
from rbfrag.errors import InputError
from rbfrag.results.numbers import percent
from rbfrag.vocabulary.quantities import column_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rbfrag.db.rows import MotionRow
    from rbfrag.db.vertical_pairs import VerticalPair
    from rbfrag.exchange.block_rows import BlockRows
    from rbfrag.motions.ground_motion import GroundMotion
    from rbfrag.motions.response_spectrum import DirectionalPeaks
    from rbfrag.rockmasses.joint_sets import RockMass


class BlockSource:
    """Table of blocks, or rock mass, instead of a single block."""

    def __init__(
        self,
        blocks: str | None = option(
            "Table of blocks (.csv, .xlsx, .parquet, .geojson) with p2_1_s2 [1/s²] and kr, or "
            "height_m and width_m [m] (and dip_deg, phi_deg), or the parameters of another kind; "
            "one answer per row",
            metavar="FILE",
        ),
        sheet: options.Sheet = None,
        ignore_columns: options.IgnoreColumns = None,
        crs: options.Crs = None,
    ) -> None:
        self.blocks, self.sheet, self.crs = blocks, sheet, crs
        self.ignore_columns = options.column_names(ignore_columns)
        self.rockmass: str | None = None

    def collect(
        self,
        inputs: Inputs,
        *,
        reads: Collection[str] = (),
        one_kind: bool = False,
        need_kind: str = "",
        n: int | None = None,
        dry: bool = False,
    ) -> GivenBlocks:
        """Return the blocks that the options describe.

        Args:
            inputs: what they say of one block, or of all rows of a table.
            reads: which further columns of a table the command reads, as for `read_blocks`.
            one_kind: whether all must be of one kind, as for `read_blocks`.
            need_kind: why rows of a table need a kind, as for `read_blocks`.
            n: number of realisations of a rock mass; None for what its file says.
            dry: without the water that a table has behind blocks.
        """
        from rbfrag.exchange.block_rows import read_blocks

        if self.rockmass is not None:
            return self._of_rock_mass(self.rockmass, inputs, n)
        kind = inputs.get("kind")
        if self.blocks is not None:
            rows = read_blocks(
                self.blocks, kind, reads=reads, one_kind=one_kind,
                for_all={field: value for field, value in inputs.items() if field != "kind"},
                sheet=self.sheet, ignore_columns=self.ignore_columns, crs=self.crs,
                need_kind=need_kind, dry=dry,
            )  # fmt: skip
            return GivenBlocks(rows.blocks, False, inputs.notes, rows)
        kind, numbers, remarks = numbers_of(inputs)
        columns = {column_of(field): [value] for field, value in numbers.items()}
        read = read_blocks(columns, kind, one_kind=True).require_all()
        block_columns = {
            column: values for column, values in read.items() if column not in ("row", "line")
        }
        return GivenBlocks({**block_columns, "block_id": [None]}, False, remarks)

    def _of_rock_mass(self, path: str, inputs: Inputs, n: int | None) -> GivenBlocks:
        """Return the stable toppling blocks of a rock mass, as one class."""
        from rbfrag.fragility.method import TOPPLING_BLOCK
        from rbfrag.rockmasses.file import read_rock_mass
        from rbfrag.rockmasses.report import notes_on_water
        from rbfrag.rockmasses.report import toppling_blocks as stable_topples

        if inputs.get("kind") not in (None, TOPPLING_BLOCK.kind):
            raise InputError(
                f"--rockmass cannot be combined with --kind {inputs['kind']}: only toppling blocks "
                "of a rock mass are supported"
            )
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
        notes = (remark, *notes_on_water(blocks), *blocks.rock_mass.remarks)
        return GivenBlocks(columns, True, notes)


def _with_rock_mass(
    source: Annotated[BlockSource, BlockSource],
    rockmass: str | None = option(
        "Rock mass file (.toml, .csv), for the mean over its stable toppling blocks", metavar="FILE"
    ),
) -> BlockSource:
    source.rockmass = rockmass
    return source


BlockTable = Annotated[BlockSource, BlockSource]
BlocksOrRockMass = Annotated[BlockSource, _with_rock_mass]


def numbers_of(
    inputs: Inputs, kind: str | None = None, pga_g: float | None = None
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


def find_motion(
    text: str,
    *,
    db: str | None,
    reading: Mapping[str, Any] | None = None,
    allow_partial: bool = False,
) -> GroundMotion:
    """Return the ground motion of a MOTION argument.

    Args:
        text: a path, ``path#index``, or the id of a stored motion. A number that is also the
            name of an existing file means the file.
        db: where ids are looked up.
        reading: what a text file leaves open.
        allow_partial: read a file whose header states another number of samples than follow.
    """
    if _is_id(text):
        from rbfrag.db.engine import opened_database
        from rbfrag.db.motions import load_motion

        with opened_database(db, read_only=True) as engine, engine.connect() as connection:
            return load_motion(connection, int(text))
    from rbfrag.motions.readers import read_motion

    return read_motion(text, allow_partial=allow_partial, **reading or {})


def stored_row(text: str, *, db: str | None) -> tuple[MotionRow, VerticalPair | None] | None:
    """Return the database row of a MOTION argument that is an id.

    Args:
        text: as for :func:`find_motion`.
        db: where ids are looked up.

    Returns:
        The stored row and, for a horizontal motion, its vertical companion or why there is
        none; None where the argument means a file.
    """
    if not _is_id(text):
        return None
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motions import motion_row
    from rbfrag.db.vertical_pairs import vertical_pair

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        row = motion_row(connection, int(text))
        return row, None if row.is_vertical else vertical_pair(connection, row.id)


def stored_peaks(motion_id: int, *, db: str | None) -> list[DirectionalPeaks]:
    """Return the stored RotD50 and RotD100 of the recording of a motion; empty without them."""
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motion_spectra import recording_peaks

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        return recording_peaks(connection, motion_id)


def _is_id(text: str) -> bool:
    return text.isascii() and text.isdigit() and not Path(text).exists()


def find_horizontals(
    text: str, *, db: str | None, reading: Mapping[str, Any]
) -> tuple[GroundMotion, GroundMotion]:
    """Return both horizontal components of the recording of a MOTION argument.

    Args:
        text: as for :func:`find_motion`.
        db: likewise.
        reading: likewise.
    """
    if not _is_id(text):
        from rbfrag.motions.readers import read_horizontals

        return read_horizontals(text, **reading)
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motion_spectra import other_horizontal
    from rbfrag.db.motions import load_motion

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        first = load_motion(connection, int(text))
        return first, load_motion(connection, other_horizontal(connection, int(text)))


def find_shaking(
    text: str,
    upward_text: str | None = None,
    *,
    db: str | None,
    reading: Mapping[str, Any],
    slope_azimuth_deg: float | None = None,
) -> tuple[GroundMotion, GroundMotion | None, list[str]]:
    """Return the ground motion of a MOTION argument, its vertical component, and warnings.

    Args:
        text: as for :func:`find_motion`.
        upward_text: likewise of the vertical motion, upward positive; None for none.
        db: as for :func:`find_motion`.
        reading: likewise.
        slope_azimuth_deg: dip direction of the slope that the horizontal components are rotated
            into; None for the component as it is.
    """
    if slope_azimuth_deg is None:
        horizontal = find_motion(text, db=db, reading=reading)
    else:
        from rbfrag.motions.rotation import rotate_into_slope

        pair = find_horizontals(text, db=db, reading=reading)
        horizontal = rotate_into_slope(*pair, slope_azimuth_deg)
    if upward_text is None:
        return horizontal, None, []
    from rbfrag.motions.direction import companion

    upward = find_motion(upward_text, db=db, reading=reading)
    warnings = []
    if upward.is_vertical is False:
        warnings.append(
            f"{upward_text} is the horizontal component {upward.component} by its own header"
        )
    vertical = companion(horizontal, upward)
    if vertical is not upward:
        warnings.append(vertical.remarks[-1])
    return horizontal, vertical, warnings
