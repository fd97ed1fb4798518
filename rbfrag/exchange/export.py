"""Fragility functions for and from other tools: `rbfrag.export.nrml`, `rbfrag.export.pelicun`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_fragility import BlockFunctions, block_functions, share_functions
from rbfrag.exchange.block_rows import Blocks, collect_blocks, read_by_models
from rbfrag.exchange.fragility_function import renamed
from rbfrag.exchange.nrml import nrml_text, read_nrml
from rbfrag.exchange.pelicun_table import metadata_text, pelicun_text, read_pelicun
from rbfrag.files import output_path, write_text
from rbfrag.fragility import describe
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.hazards.curve import requested_measure
from rbfrag.question.components import SINGLE_COMPONENT, Component, component_named
from rbfrag.question.fields import AnsweringFields, BlockKeywords, V
from rbfrag.question.keywords import parts_of
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import count_of, percent
from rbfrag.results.result import Result, TextLine
from rbfrag.solver.kinds import KindSpec, facts_of
from rbfrag.vocabulary.quantities import ANSWERING, BLOCKS

EACH_NEEDED = "an exposure model needs a function of each"
"""Why a table with a row that cannot be used is rejected."""


@dataclass(frozen=True, repr=False)
class ExportAnswer(Result):
    """Fragility functions written to a file.

    Args:
        file: the file.
        description: the file next to it that describes them; None where there is none.
        functions: number of functions.
        lognormal: how many of them are lognormal.
        largest_relative_error: largest error of linear interpolation between their levels, as
            a fraction of P.
        component: horizontal component of the measure.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        warnings: what to know about them.
    """

    file: str
    description: str | None
    functions: int
    lognormal: int
    largest_relative_error: float
    component: str
    model: str
    term: str
    method: str
    warnings: tuple[str, ...]

    def sentences(self) -> Iterator[str]:
        """Yield the number of functions and their form."""
        count = count_of(self.functions, "fragility function")
        yield f"{count}, {self.lognormal:,} lognormal: {self.file}"

    def lines(self) -> Iterator[TextLine]:
        """Yield the measure's component, the model, and the accuracy of the levels."""
        if self.description is not None:
            yield TextLine("Metadata", self.description)
        yield TextLine("Shaking", f"component {self.component}")
        yield TextLine("Model", describe.model(vars(self)))
        if self.largest_relative_error > 0.0:
            error = percent(self.largest_relative_error)
            yield TextLine("Accuracy", f"linear interpolation between levels within {error} of P")

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        values = {name: value for name, value in vars(self).items() if value is not None}
        return {**values, "warnings": list(self.warnings)}


class _Functions(TypedDict, total=False):
    """Keywords of fragility functions: blocks, measure and form."""

    blocks: Blocks | None
    imt: str
    one_class: bool
    name: str
    levels: int
    component: str
    shares: Sequence[float] | None


class FunctionKeywords(BlockKeywords[V], AnsweringFields, _Functions, total=False):
    """Keywords of blocks, models and the form of fragility functions."""


def nrml(
    out: str | PathLike[str],
    *numbers: ArrayLike | None,
    **question: Unpack[FunctionKeywords[ArrayLike | None]],
) -> ExportAnswer:
    """Write an OpenQuake fragility model, NRML 0.5; PGV is in cm/s there.

    The keywords:

    - the fields of blocks, each a number or of shape (m,), with ``kind``, as
      :func:`rbfrag.predict` has them; all blocks are of one kind.
    - ``blocks``: instead of these a table of blocks: a file, or columns by name.
    - ``imt``: measure of the functions: PGV (the default), PGA, or SA(T) such as ``SA(0.5)``.
    - ``one_class``: one function, the mean over the blocks.
    - ``name``: identifier of a single block, or of the class; ``block`` if not given.
    - ``levels``: greatest number of levels of a function that is not lognormal; 80 if not given.
    - ``component``: horizontal component of the measure: ``single`` (the default),
      ``geometric_mean``, ``rotd50``, ``rotd100`` or ``larger``; P is integrated over its
      dispersion.
    - ``shares``: shares of the blocks [%]: a limit state each, that at least so many fail; one
      function of each block if not given.
    - ``model``, ``db``: as in :func:`rbfrag.predict`.

    Args:
        out: file to write (.xml).
        numbers: p2 [1/s²] and kr of the blocks, if they are not given by name.
        question: the keywords above.

    Raises:
        InputError: a measure, block or file that cannot be used.
        UnknownFieldError: a keyword that is none.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    target = output_path(out, (".xml",), "NRML file")
    request = _Request.of(numbers, question)
    result, renames = request.functions(_NOT_IN_NRML)
    model, term, method = result.about
    text = (
        f"{request.failing} rock blocks, model {model} ({method} on {term}), shaking of "
        f"{request.component.title}"
    )
    write_text(nrml_text(result.functions, description=text), target)
    return request.answer(str(target), None, result, renames)


def pelicun(
    out: str | PathLike[str],
    *numbers: ArrayLike | None,
    **question: Unpack[FunctionKeywords[ArrayLike | None]],
) -> ExportAnswer:
    """Write a fragility table of pelicun and SimCenter, and its JSON description.

    PGV is in m/s there. The description has the table's name and ends in .json.

    Args:
        out: file to write (.csv).
        numbers: as for :func:`nrml`.
        question: the keywords of :func:`nrml`.

    Raises:
        InputError: a measure, block or file that cannot be used.
        UnknownFieldError: a keyword that is none.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    target = output_path(out, (".csv",), "fragility table")
    description_path = output_path(str(target.with_suffix(".json")), (".json",), "description")
    request = _Request.of(numbers, question)
    result, renames = request.functions(_NOT_IN_TABLES)
    content = pelicun_text(result.functions)
    description = metadata_text(
        result.functions, request.descriptions(), result.about, request.component.title
    )
    write_text(description, description_path)
    write_text(content, target)
    return request.answer(str(target), str(description_path), result, renames)


_NOT_IN_NRML = "#'\"", "_", "the OpenQuake engine rejects in an ID"
_NOT_IN_TABLES = "-", ".", "the loader splits an ID at"
"""Characters that an ID cannot have, what stands for them, and why."""

_FAILING = {
    "topple": "Toppling of", "slide": "Sliding of", "slump": "Slumping of",
    "confined_topple": "Toppling under their back plane of",
}  # fmt: skip


class _Request(NamedTuple):
    """Blocks of one kind, and the requested fragility functions.

    Args:
        facts: their kind.
        numbers: what a model reads of them, by field, shape (m,) each.
        names: identifiers of the functions.
        measure: what they run over, as `predict` calls it.
        one_class: whether one function stands for all.
        shares: shares of them [%] that are limit states of all, or None.
        component: horizontal component of the measure.
        how: number of levels, model and database.
        remarks: warnings about the blocks.
    """

    facts: KindSpec
    numbers: dict[str, NDArray[np.float64]]
    names: list[str]
    measure: str
    one_class: bool
    shares: Sequence[float] | None
    component: Component
    how: dict[str, Any]
    remarks: tuple[str, ...]

    @classmethod
    def of(cls, numbers: Sequence[Any], question: Mapping[str, Any]) -> _Request:
        inputs, answering, request = parts_of(
            numbers, question, BLOCKS, ANSWERING, _Functions.__optional_keys__
        )
        blocks, one_class = request.get("blocks"), request.get("one_class", False)
        rows = collect_blocks(inputs, blocks)
        table = rows.require_all(EACH_NEEDED)
        measure, _ = requested_measure(request.get("imt", "PGV"))
        kind, read, medians = read_by_models(rows)
        names = [str(block_id) for block_id in table["block_id"]]
        if one_class or (blocks is None and len(names) == 1):
            names = [request.get("name", "block")]
        meaning = component_named(request.get("component", SINGLE_COMPONENT))
        how = {"levels": request.get("levels", 80), "component": meaning.name, **answering}
        remarks = (*rows.remarks, *medians)
        shares = request.get("shares")
        return cls(facts_of(kind), read, names, measure, one_class, shares, meaning, how, remarks)

    def functions(self, rejected: tuple[str, str, str]) -> tuple[BlockFunctions, list[Diagnostic]]:
        """Return the functions of the blocks, and the renamed identifiers."""
        if self.shares is None:
            of = self.names, self.numbers, self.measure, self.facts.kind
            result = block_functions(*of, one_class=self.one_class, **self.how)
        elif self.facts.free_standing or {*TOPPLING_BLOCK.names} - {*self.numbers}:
            raise InputError(
                "shares require a rock mass, whose blocks are backed by rock: omit shares or the "
                "kind"
            )
        else:
            p2, kr = (self.numbers[name] for name in TOPPLING_BLOCK.names)
            of_all = self.names[0], p2, kr, self.measure, list(self.shares)
            result = share_functions(*of_all, **self.how)
        functions, renames = renamed(result.functions, *rejected)
        return result._replace(functions=functions), renames

    @property
    def failing(self) -> str:
        """Failure of the blocks, as the beginning of a description."""
        if self.facts.free_standing:
            return "Overturning of free-standing"
        return _FAILING.get(self.facts.mode or "", "Failure of")

    def descriptions(self) -> list[str]:
        """Return a sentence on each block, or on all of a class."""
        is_free_standing, topples = self.facts.free_standing, self.facts.mode == "topple"
        if self.one_class or self.shares is not None:
            size = next(iter(self.numbers.values())).size
            backed = "toppling blocks of a rock mass, backed by a slope"
            mean = (
                "free-standing blocks"
                if is_free_standing
                else backed
                if topples
                else "blocks of a slope"
            )
            of = "Mean over" if self.shares is None else "Shares of"
            return [f"{of} {size} stable {mean}."]
        stands = (
            "that is free-standing"
            if is_free_standing
            else "backed by a slope"
            if topples
            else "on a slope"
        )
        rows = zip(*(values.tolist() for values in self.numbers.values()), strict=True)
        return [
            f"Rock block {stands}, {describe.labelled_values(parameters, 6)}."
            for row in rows
            for parameters in [{n: v for n, v in zip(self.numbers, row, strict=True) if v == v}]
        ]

    def answer(
        self, file: str, description: str | None, result: BlockFunctions, renames: list[Diagnostic]
    ) -> ExportAnswer:
        """Return the answer on the functions written."""
        functions = result.functions
        errors = [function.grid_error for function in functions if function.grid_error is not None]
        lognormal = sum(function.is_lognormal for function in functions)
        meant = [] if self.component.sigma == 0.0 else [self.component.in_words("shaking is")]
        return ExportAnswer(
            file, description, len(functions), lognormal, max(errors, default=0.0),
            self.component.name, *result.about,
            warnings=(*self.remarks, *renames, *meant, *result.warnings),
        )  # fmt: skip


FloatArray = NDArray[np.float64]

MOST_CURVES = 12
"""More curves than these cannot be told apart."""


def of_measure(
    path: str | os.PathLike[str], measure: str
) -> dict[str, Callable[[FloatArray], FloatArray]]:
    """Return the fragility functions of one measure by asset and limit state.

    Args:
        path: NRML (.xml) or a pelicun table (.csv).
        measure: ``pgv_m_s`` or ``pga_g``.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".xml", ".csv"):
        raise InputError(
            f"{path}: unsupported file of fragility functions: use .xml (NRML) or .csv (pelicun)"
        )
    functions = read_nrml(path) if suffix == ".xml" else read_pelicun(path)
    curves: dict[str, Callable[[FloatArray], FloatArray]] = {
        f"{function.name}, {function.limit_state}": function.at
        for function in functions
        if function.kind.measure == measure
    }
    if not curves:
        have = ", ".join(sorted({function.kind.imt for function in functions})) or "none of ground"
        raise InputError(f"{path}: there is no fragility over {measure}; there are {have}")
    if len(curves) > MOST_CURVES:
        raise InputError(
            f"{path}: {len(curves)} fragilities exceed the maximum of {MOST_CURVES} for a figure: "
            "reduce the file"
        )
    return curves
