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
from rbfrag.exchange.block_rows import PLACE, PORTFOLIO
from rbfrag.exchange.block_table import BLOCK_FIELDS
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
from rbfrag.fragility.lookup import block_of
from rbfrag.fragility.measures import STATED
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.unusable import FIRST, refuse, unusable_in_words
from rbfrag.question.blocks import SHAPES, kinds_by_numbers
from rbfrag.question.fields import column_of
from rbfrag.question.question import ask
from rbfrag.question.table import Header, Numeric, columns_in

NUMBERS_OF_ANSWERS = ("probability", "ci_low", "ci_high", "event_low", "event_high")

ANSWERS = ("kind", "mode", *NUMBERS_OF_ANSWERS, "in_domain", "reason")
"""The columns that are appended; a table that has them gets new ones."""

NAMES = ("block_id", "site_id")
KEPT = (*NAMES, *PLACE, *PORTFOLIO)
"""Columns that say which block a row is, and what other answers read of it."""

OF_UNCERTAIN = "block_sd"
"""The column that is appended too where blocks are uncertain."""

FIELDS = {**BLOCK_FIELDS, **{column_of(name): name for name in STATED}}
"""The fields of numbers that may be read, by what written tables call them."""

READ = (*FIELDS,)

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
    question = {"rotation_deg": rotation_deg, "model": model, "level": level, "db": db}
    if origin.exists() and goal.exists() and origin.samefile(goal):
        raise InputError(f"--out {goal} is the table itself: name another file")
    try:
        with reading(origin, "a block table"), ExitStack() as stack:
            header, parts, dialect = table_parts(origin, NUMERIC, stack, fast=True)
            stated = columns_in(header, origin, (*READ, *TEXTS, *NAMES))
            names = _fields(origin, header, stated, given, kind)
            partial = stack.enter_context(written_whole(goal))
            uncertain = any(name.endswith("_sigma") for name in (*names.values(), *given))
            answers = (*ANSWERS, OF_UNCERTAIN) if uncertain else ANSWERS
            kept = [name for name in header if name not in (*ANSWERS, OF_UNCERTAIN)]
            write = table_writer(
                partial, kept, answers, numeric=NUMERIC, stack=stack, dialect=dialect, fast=True
            )
            counts = np.zeros(3, dtype=np.int64)
            formulas: list[str] = []
            refused: dict[str, str] = {}
            chosen = _Chosen()
            for part in parts:
                answer = _answer(part, stated, names, given, kind, question, chosen)
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
            read = {column for column, name in names.items() if name in {*chosen.read, *STATED}}
            unread = stated.unread(header, (*read, *TEXTS, *KEPT, *ANSWERS, OF_UNCERTAIN))
    except csv.Error as error:
        raise InputError(f"{origin}: not a CSV file: {error}") from None
    unusable = unusable_in_words(rows - answered, rows, [*refused], [*refused.values()])
    return {
        "rows": rows,
        "answered": answered,
        "without_answer": rows - answered,
        "in_domain": inside,
        **{name: ", ".join(each) for name, each in chosen.words.items()},
        "warnings": [*stated.remarks, *unread, *chosen.notes, *unusable, *formulas],
    }


class _Chosen:
    """What answered, over all parts of a table.

    Attributes:
        words: kinds, models, terms and methods.
        notes: what is to be said of the whole answer.
        read: fields of the blocks that it depends on.
    """

    def __init__(self) -> None:
        self.words: dict[str, dict[str, None]] = {
            name: {} for name in ("kind", "model", "term", "method")
        }
        self.notes: dict[str, None] = {}
        self.read: set[str] = set()

    def add(self, answer: PredictionArray) -> None:
        for name, known in self.words.items():
            known.update(dict.fromkeys(filter(None, getattr(answer, name).split(", "))))
        self.notes.update(dict.fromkeys(answer.notes))
        self.read |= answer.read


def _fields(
    origin: PathLike[str],
    header: list[str],
    stated: Header,
    given: Mapping[str, float],
    kind: str | None,
) -> dict[str, str]:
    """Return the fields that columns of numbers state, by what written tables call them."""
    doubled = [name for name in header if name and header.count(name) > 1]
    if doubled:
        raise InputError(f"{origin}: the column {doubled[0]} is there twice")
    names = {column: name for column, name in FIELDS.items() if column in stated.columns}
    for column, name in names.items():
        if name in given:
            raise InputError(f"{column} is an option and a column of {origin}: give it once")
    known = {*names.values(), *given}
    if not kinds_by_numbers(known) and not any(known.issuperset(shape) for shape in SHAPES):
        block = block_of(known, kind)
        missing = next(name for name in block.names if name not in known)
        sides = ", nor height_m and width_m" if "kr" in block.names else ""
        raise InputError(
            f"{origin}: there is no column {column_of(missing)}{sides}; the columns are "
            f"{', '.join(header) or 'none'}"
        )
    return names


def _answer(
    part: Part,
    stated: Header,
    names: Mapping[str, str],
    given: Mapping[str, float],
    kind: str | None,
    question: Mapping[str, Any],
    chosen: _Chosen,
) -> dict[str, NDArray[Any]]:
    values: dict[str, NDArray[Any]] = {}
    faults = dict(part.faults)
    for column, name in names.items():
        header, factor = stated.columns[column]
        cells, others = part.numbers(header)
        values[name] = cells * factor
        if name.endswith("_sigma"):
            values[name] = np.nan_to_num(values[name], nan=0.0, posinf=np.inf)
        faults = others | faults
    texts = {
        name: [str(cell).strip() for cell in cells_of(part.cells[stated.columns[name].header])]
        for name in TEXTS
        if name in stated.columns
    }
    kinds: Any = texts.get("kind", kind)
    if kind is not None and "kind" in texts:
        kinds = [each or kind for each in texts["kind"]]
    predicted = ask({**values, **given}, kind=kinds, mode=texts.get("mode"), rows=True, **question)
    assert isinstance(predicted, PredictionArray)
    chosen.add(predicted)
    answer: dict[str, NDArray[Any]] = {
        name: getattr(predicted, name) for name in ANSWERS if name not in TEXTS
    }
    for name, each in (("kind", predicted.kinds), ("mode", predicted.modes)):
        own = np.array(texts.get(name, [""] * each.size), dtype=object)
        answer[name] = np.where(each == "", own, each)
    answer[OF_UNCERTAIN] = np.zeros(predicted.probability.shape)
    if predicted.block_sd is not None:
        answer[OF_UNCERTAIN] = predicted.block_sd
    bad = [*faults]
    for name in (*NUMBERS_OF_ANSWERS, OF_UNCERTAIN):
        answer[name][bad] = np.nan
    answer["in_domain"][bad] = False
    for i, reason in faults.items():
        answer["reason"][i] = reason
    return answer
