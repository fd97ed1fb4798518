"""Fragility functions for other tools: `rbfrag.export.nrml` and `rbfrag.export.pelicun`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.exchange.block_fragility import block_functions
from rbfrag.exchange.block_rows import Blocks
from rbfrag.exchange.fragility_function import FragilityFunction
from rbfrag.exchange.map_answer import given_blocks
from rbfrag.exchange.nrml import nrml_text
from rbfrag.exchange.pelicun_table import metadata_text, pelicun_text, without_dashes
from rbfrag.exchange.share_fragility import share_functions
from rbfrag.files import output_path, write_text
from rbfrag.fragility.measures import SPECTRAL
from rbfrag.fragility.methods import TOPPLING_BLOCK
from rbfrag.fragility.model import Model
from rbfrag.frames import Tabular
from rbfrag.hazards.curve import ANSWERED
from rbfrag.hazards.measure_type import openquake_type
from rbfrag.solver.kinds import facts_of

EACH_NEEDED = "an exposure model needs a function of each"
"""Why a table with a row that cannot be used is refused."""


@dataclass(frozen=True, repr=False)
class ExportAnswer(Tabular):
    """Fragility functions that were written.

    Args:
        file: the file.
        description: the file beside it that describes them; None where there is none.
        functions: number of functions.
        lognormal: how many of them are lognormal.
        largest_grid_error: largest error of linear interpolation between their levels.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        warnings: what to know about them.
    """

    file: str
    description: str | None
    functions: int
    lognormal: int
    largest_grid_error: float
    model: str
    term: str
    method: str
    warnings: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        known = {name: value for name, value in vars(self).items() if value is not None}
        return {**known, "warnings": list(self.warnings)}


def nrml(
    out: str | PathLike[str],
    p2: ArrayLike | None = None,
    kr: ArrayLike | None = None,
    *,
    blocks: Blocks | None = None,
    kind: str | None = None,
    restitution: ArrayLike | None = None,
    imt: str = "PGV",
    shares: Sequence[float] | None = None,
    one_class: bool = False,
    name: str = "block",
    levels: int = 80,
    model: Model | None = None,
    db: str | PathLike[str] | None = None,
) -> ExportAnswer:
    """Write an OpenQuake fragility model, NRML 0.5; PGV is in cm/s there.

    Args:
        out: file to write (.xml).
        p2: frequency parameters p² [1/s²], scalar or shape (m,), with `kr`.
        kr: toppling yield acceleration coefficients.
        blocks: instead of these a table of blocks: a file, or columns by name.
        kind: how they stand: ``toppling`` (backed by a slope, the default) or ``rocking``.
        restitution: of blocks that rock: speed after an impact over that before it; None for what
            angular momentum leaves.
        imt: measure of the functions: PGV, PGA, or SA(T) at 0.3, 1, 2 or 3 s.
        shares: shares of the blocks [%]: a limit state each, that at least so many fail; None for
            a function of each block.
        one_class: one function, the mean over the blocks.
        name: identifier of a single block, or of the class.
        levels: number of levels of a function that is not lognormal.
        model: as in :func:`rbfrag.predict`.
        db: as in :func:`rbfrag.predict`.

    Raises:
        InputError: a measure, block or file that cannot be used.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    target = output_path(out, (".xml",), "NRML file")
    rows = given_blocks(
        {"p2": p2, "kr": kr, "restitution": restitution}, blocks, kind, only=TOPPLING_BLOCK.names
    )
    kind = str(rows.blocks["kind"][0])
    table, measure = rows.whole(EACH_NEEDED), _measure(imt)
    single = one_class or (blocks is None and len(table["kr"]) == 1)
    notes: Sequence[str] = ()
    if shares is not None:
        if _stands_free(kind):
            raise InputError(
                "shares are of a rock mass, whose blocks are backed by the rock behind them: leave "
                "shares or the kind out"
            )
        functions, about, notes = share_functions(
            name, table["p2_1_s2"], table["kr"], measure, list(shares), levels=levels, model=model,
            db=db,
        )  # fmt: skip
    else:
        functions, about = block_functions(
            _names(table, name, single), table["p2_1_s2"], table["kr"], measure, kind=kind,
            restitution=table.get("restitution"), one_class=one_class, levels=levels, model=model,
            db=db,
        )  # fmt: skip
    what = f"{'Overturning of free-standing' if _stands_free(kind) else 'Toppling of'} rock blocks"
    what += f", model {about[0]} ({about[2]} on {about[1]})"
    write_text(nrml_text(functions, description=what), target)
    return _answer(str(target), None, functions, about, notes)


def pelicun(
    out: str | PathLike[str],
    p2: ArrayLike | None = None,
    kr: ArrayLike | None = None,
    *,
    blocks: Blocks | None = None,
    kind: str | None = None,
    restitution: ArrayLike | None = None,
    imt: str = "PGV",
    one_class: bool = False,
    name: str = "block",
    levels: int = 80,
    model: Model | None = None,
    db: str | PathLike[str] | None = None,
) -> ExportAnswer:
    """Write a fragility table of pelicun and SimCenter, and its description beside it.

    PGV is in m/s there. The description has the table's name and ends in .json.

    Args:
        out: file to write (.csv).
        p2: as for :func:`nrml`, like all that follow.
        kr: see there.
        blocks: see there.
        kind: see there.
        restitution: see there.
        imt: see there.
        one_class: see there.
        name: see there.
        levels: see there.
        model: see there.
        db: see there.

    Raises:
        InputError: a measure, block or file that cannot be used.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    target = output_path(out, (".csv",), "fragility table")
    beside = output_path(str(target.with_suffix(".json")), (".json",), "description")
    rows = given_blocks(
        {"p2": p2, "kr": kr, "restitution": restitution}, blocks, kind, only=TOPPLING_BLOCK.names
    )
    kind = str(rows.blocks["kind"][0])
    table, measure = rows.whole(EACH_NEEDED), _measure(imt)
    single = one_class or (blocks is None and len(table["kr"]) == 1)
    functions, about = block_functions(
        _names(table, name, single), table["p2_1_s2"], table["kr"], measure, kind=kind,
        restitution=table.get("restitution"), one_class=one_class, levels=levels, model=model,
        db=db,
    )  # fmt: skip
    count, free = len(table["kr"]), _stands_free(kind)
    mean = "free-standing blocks" if free else "toppling blocks of a rock mass, backed by a slope"
    stands = "that stands free" if free else "backed by a slope"
    descriptions = (
        [f"Mean over {count} stable {mean}."]
        if one_class
        else [
            f"Rock block {stands}, p² = {a:.6g} 1/s², k_r = {b:.6g}."
            for a, b in zip(table["p2_1_s2"].tolist(), table["kr"].tolist(), strict=True)
        ]
    )
    functions, renamed = without_dashes(functions)
    content = pelicun_text(functions)
    write_text(metadata_text(functions, descriptions, about), beside)
    write_text(content, target)
    return _answer(str(target), str(beside), functions, about, renamed)


def _stands_free(kind: str | None) -> bool:
    return kind is not None and facts_of(kind).free_standing


def _measure(imt: str) -> str:
    """Return the measure that functions are of, as `predict` calls it."""
    kind = openquake_type(imt, "--imt")
    measure = kind.measure if kind.period_s is None else SPECTRAL.get(kind.period_s)
    if measure is None:
        raise InputError(f"--imt {imt}: use one of {ANSWERED}")
    return measure


def _names(table: Mapping[str, Any], name: str, single: bool) -> list[str]:
    return [name] if single else [str(each) for each in table["block_id"]]


def _answer(
    file: str,
    description: str | None,
    functions: Sequence[FragilityFunction],
    about: tuple[str, ...],
    warnings: Sequence[str],
) -> ExportAnswer:
    errors = [function.grid_error for function in functions if function.grid_error is not None]
    return ExportAnswer(
        file=file,
        description=description,
        functions=len(functions),
        lognormal=sum(function.is_lognormal for function in functions),
        largest_grid_error=max(errors, default=0.0),
        model=about[0],
        term=about[1],
        method=about[2],
        warnings=tuple(warnings),
    )
