"""Predictions for a table of blocks: the table again, with the answers appended."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import PLACE, PORTFOLIO, foreign_reasons
from rbfrag.exchange.block_table import (
    BLOCK_COLUMNS,
    FRICTION,
    NUMBERS,
    RECTANGLE,
    is_of_rectangles,
    rectangle_columns,
    rectangle_reasons,
    sliding_reasons,
)
from rbfrag.exchange.excel_text import as_text, as_written, changed_texts, formula_warnings
from rbfrag.exchange.tables.files import (
    place_word,
    table_parts,
    table_path,
    table_source,
    table_writer,
)
from rbfrag.exchange.tables.parts import Part, cells_of
from rbfrag.files import reading, written_whole
from rbfrag.fragility.lookup import block_of, find_model
from rbfrag.fragility.measures import STATED
from rbfrag.fragility.methods import TOPPLING_BLOCK, methods
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.unusable import FIRST, refuse, unusable_in_words
from rbfrag.question.table import Header, Numeric, columns_in
from rbfrag.solver.kinds import facts_of

FloatArray = NDArray[np.float64]

NUMBERS_OF_ANSWERS = ("probability", "ci_low", "ci_high", "event_low", "event_high")

ANSWERS = (*NUMBERS_OF_ANSWERS, "in_domain", "reason")
"""The columns that are appended; a table that has them gets new ones."""

NAMES = ("block_id", "site_id")
KEPT = (*NAMES, *PLACE, *PORTFOLIO)
"""Columns that say which block a row is, and what other answers read of it."""

OF_UNCERTAIN = "block_sd"
"""The column that is appended too where blocks are uncertain."""

DEVIATIONS = tuple(sorted({sigma for method in methods() for sigma in method.block.sigmas}))
"""Columns of standard deviations of blocks of any kind, of which an empty cell is 0."""

_OR_SIDES = dict.fromkeys(("p2_1_s2", "kr"), ", nor height_m and width_m")
"""What a table of toppling blocks may have instead of a column."""

READ = (*BLOCK_COLUMNS, *DEVIATIONS, *RECTANGLE, FRICTION, *STATED)
"""Columns of numbers that may be read, by what written tables call them."""

NUMERIC = Numeric(READ)
"""The same, whatever a table calls them."""

TEXTS = ("kind", "mode")
"""Columns of texts that are read."""


def predict_table(
    source: str | PathLike[str],
    target: str | PathLike[str],
    *,
    given: Mapping[str, float],
    model: str | None,
    level: float,
    db: str | PathLike[str] | None,
    kind: str | None = None,
    rotation_deg: float | None = None,
    excel_text: bool = False,
) -> dict[str, object]:
    """Answer every block of a table and write the table with the answers.

    A row that cannot be answered, as one with a cell that is no number, keeps an empty probability
    and says why; a row whose `mode` is another than that of the model's kind is not answered.

    Args:
        source: table, ``.csv``, ``.xlsx`` or ``.parquet``, with columns that describe blocks, and
            measures; CSV also with semicolons and decimal commas.
        target: table to write, of any of these; written whole or not at all. CSV is written as
            the CSV that was read.
        given: what is the same for all rows, by the names of :func:`rbfrag.predict`.
        model: name of the model; None for the best for what is given.
        level: confidence level of the interval.
        db: database of the model.
        kind: how the blocks fail; None for what they are given by.
        rotation_deg: rotation that counts as failure [deg], where models of several are fitted.
        excel_text: write texts that spreadsheets take for formulas with an apostrophe (CSV).

    Returns:
        Counts: rows, answered, without an answer, in_domain; kind, model, term, method; warnings.

    Raises:
        InputError: a file that cannot be read or written, a missing column, no row that can be
            answered.
    """
    origin, goal = table_source(source), table_path(target)
    if origin.exists() and goal.exists() and origin.samefile(goal):
        raise InputError(f"--out {goal} is the table itself: name another file")
    try:
        with reading(origin, "a block table"), ExitStack() as stack:
            header, parts, dialect = table_parts(origin, NUMERIC, stack, fast=True)
            stated = columns_in(header, origin, (*READ, *TEXTS, *NAMES))
            names = _columns(origin, header, stated, given, kind)
            known = [*_known_names(names), *given]
            remarks = (
                *stated.remarks,
                *stated.unread(header, (*names, *TEXTS, *KEPT, *ANSWERS, OF_UNCERTAIN)),
            )
            chosen = find_model(model, known, db, kind=kind, rotation_deg=rotation_deg)
            partial = stack.enter_context(written_whole(goal))
            uncertain = not set(known).isdisjoint(DEVIATIONS)
            answers = (*ANSWERS, OF_UNCERTAIN) if uncertain else ANSWERS
            kept = [name for name in header if name not in (*ANSWERS, OF_UNCERTAIN)]
            write = table_writer(
                partial, kept, answers, numeric=NUMERIC, stack=stack, dialect=dialect, fast=True
            )
            counts = np.zeros(3, dtype=np.int64)
            formulas: list[str] = []
            refused: dict[str, str] = {}
            for part in parts:
                answer = _answer(part, stated, names, given, chosen, level)
                cells = {
                    name: cells
                    for name, cells in part.cells.items()
                    if name not in (*ANSWERS, OF_UNCERTAIN)
                }
                cells = changed_texts(cells, as_written)
                if goal.suffix.lower() == ".csv" and excel_text:
                    cells = changed_texts(cells, as_text)
                elif goal.suffix.lower() == ".csv":
                    formulas = formulas or formula_warnings(cells)
                write(replace(part, cells=cells), answer)
                finite = np.isfinite(answer["probability"])
                for i in np.flatnonzero(~finite)[: FIRST - len(refused)].tolist():
                    refused[f"{place_word(origin)} {part.lines[i]}"] = answer["reason"][i]
                counts += [finite.size, int(finite.sum()), int(answer["in_domain"].sum())]
            rows, answered, inside = counts.tolist()
            if not rows:
                raise InputError(f"{origin}: there is no block in the file")
            if not answered:
                refuse(str(origin), [*refused], [*refused.values()], rows)
    except csv.Error as error:
        raise InputError(f"{origin}: not a CSV file: {error}") from None
    unusable = unusable_in_words(rows - answered, rows, [*refused], [*refused.values()])
    return {
        "rows": rows,
        "answered": answered,
        "without_answer": rows - answered,
        "in_domain": inside,
        "kind": chosen.kind,
        "model": chosen.name,
        "term": chosen.term.name,
        "method": chosen.row.method,
        "warnings": [*remarks, *chosen.notes, *unusable, *formulas],
    }


def _columns(
    origin: PathLike[str],
    header: list[str],
    stated: Header,
    given: Mapping[str, float],
    kind: str | None,
) -> dict[str, str]:
    """Return what each column of numbers is called in `predict`."""
    have = stated.columns
    # a dip says what else is said, not how the block fails
    numbers = [BLOCK_COLUMNS.get(name, "") for name in have if name not in RECTANGLE]
    block = block_of([*numbers, *given], kind)
    rectangles = (
        block.names == TOPPLING_BLOCK.names
        and is_of_rectangles(have)
        and not {*block.names}.intersection(given)
    )
    columns = (
        {name: name for name in (*RECTANGLE, FRICTION, *block.options)}
        if rectangles
        else {
            column: name
            for column, name in BLOCK_COLUMNS.items()
            if name in (*block.names, *block.options)
        }
    )
    for column, name in columns.items():
        if name in block.names and name not in given and column not in have:
            raise InputError(
                f"{origin}: there is no column {column}{_OR_SIDES.get(column, '')}; the columns "
                f"are {', '.join(header) or 'none'}"
            )
    doubled = [name for name in header if name and header.count(name) > 1]
    if doubled:
        raise InputError(f"{origin}: the column {doubled[0]} is there twice")
    columns |= {name: name for name in (*block.sigmas, *STATED)}
    present = {column: name for column, name in columns.items() if column in have}
    for column, name in present.items():
        if name in given:
            raise InputError(f"{column} is an option and a column of {origin}: give it once")
    return present


def _known_names(names: Mapping[str, str]) -> list[str]:
    """Return what is known of blocks and motions, rectangles by their numbers."""
    if "height_m" not in names:
        return list(names.values())
    measures = (name for name in names.values() if name not in (*RECTANGLE, FRICTION))
    return [*(BLOCK_COLUMNS[name] for name in NUMBERS), *measures]


def _answer(
    part: Part,
    stated: Header,
    names: Mapping[str, str],
    given: Mapping[str, float],
    model: FragilityModel,
    level: float,
) -> dict[str, NDArray[Any]]:
    values: dict[str, NDArray[Any]] = {}
    faults = dict(part.faults)
    for column, name in names.items():
        header, factor = stated.columns[column]
        cells, others = part.numbers(header)
        values[name] = cells * factor
        faults = others | faults
    if "height_m" in values:
        free_standing = facts_of(model.kind).free_standing
        faults = rectangle_reasons(values) | sliding_reasons(values, model.kind) | faults
        numbers_of = rectangle_columns(values, free_standing=free_standing)
        others_of = (*RECTANGLE, FRICTION)
        values = {name: value for name, value in values.items() if name not in others_of}
        for column, value in numbers_of.items():
            name = BLOCK_COLUMNS[column]
            own = values.get(name, np.nan)
            values[name] = np.where(np.isnan(own), value, own)
    values = model.method.block.filled(values)
    for name in set(DEVIATIONS).intersection(values):
        values[name] = np.nan_to_num(values[name], nan=0.0, posinf=np.inf)
    predicted = answer_given(model, {**values, **given}, level)
    assert isinstance(predicted, PredictionArray)
    answer: dict[str, NDArray[Any]] = {name: getattr(predicted, name) for name in ANSWERS}
    answer[OF_UNCERTAIN] = np.zeros(predicted.probability.shape)
    if predicted.block_sd is not None:
        answer[OF_UNCERTAIN] = predicted.block_sd
    texts = {
        name: cells_of(part.cells[stated.columns[name].header])
        for name in TEXTS
        if name in stated.columns
    }
    faults |= foreign_reasons(texts, model.kind)
    bad = [*faults]
    for name in (*NUMBERS_OF_ANSWERS, OF_UNCERTAIN):
        answer[name][bad] = np.nan
    answer["in_domain"][bad] = False
    for i, reason in faults.items():
        answer["reason"][i] = reason
    return answer
