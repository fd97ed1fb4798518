"""Predictions for a table of blocks: the table with appended answers, or the list of answers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import NO_BLOCK, PLACE
from rbfrag.exchange.block_table import SHAKING_TEXTS, TEXTS, BlockTable, opened_table
from rbfrag.exchange.tables.csv_file import as_text, as_written, changed_texts, formula_warnings
from rbfrag.exchange.tables.files import table_path, table_writer, write_csv_notes
from rbfrag.exchange.tables.parts import TablePart, Write
from rbfrag.files import as_path, written_whole
from rbfrag.fragility.dependence import EXACT
from rbfrag.fragility.joint import UNKNOWN, Placement, count_moments, count_quantiles
from rbfrag.fragility.measures import MEASURES
from rbfrag.fragility.method import SINGLE
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.validation import FIRST, describe_invalid, reject
from rbfrag.question.components import SINGLE_COMPONENT, component_named
from rbfrag.question.drained_bound import OF_BOUND, with_drained_bound
from rbfrag.question.keywords import LEVEL, reject_inverse
from rbfrag.question.measurement import (
    TOGETHER,
    USUAL,
)
from rbfrag.question.measurement_draws import (
    encoded,
    source_of,
)
from rbfrag.question.question import ask
from rbfrag.question.shape_validation import PLANE_TEXTS
from rbfrag.results.diagnostic import Diagnostic, codes_by_row, diagnostics
from rbfrag.results.numbers import count_of, interval, percent, rounded
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import (
    BLOCK,
    BY_ROW,
    MEASURED,
    ROW,
    SCATTER,
    SHAKING,
    column_of,
    measured_by,
)

_NUMBERS = ("probability", "ci_low", "ci_high", "event_low", "event_high")

ANSWERS = ("kind", "mode", *_NUMBERS, "in_domain", "how", "warnings", "reason")
"""The columns that are appended; a table that has them gets new ones."""

_SHAKING, _SCATTER = SHAKING, frozenset(SCATTER)

OF_UNCERTAIN = "block_sd"
"""The column that is appended too where blocks are uncertain."""

OF_STATED = tuple(f"as_stated_{name}" for name in OF_BOUND)
"""The columns that are appended too where errors of measurement are given."""

OF_DRAINED = tuple(f"drained_{name}" for name in OF_BOUND)
"""The columns that are appended too where water stands behind blocks."""

MOST_PAIRED = 700
"""Rows that tell what pairs of blocks share; of a longer table so many drawn at random."""

MOST_LISTED = 10_000
"""Maximum number of rows listed; the output file has all."""

SHOWN = 40
"""Rows that a terminal shows."""


@dataclass(frozen=True, eq=False, repr=False)
class TableAnswer(Result):
    """Answers for the blocks of a table.

    Args:
        rows: number of rows.
        answered: number of rows with a probability.
        without_answer: number of rows without one.
        in_domain: number of rows within the fitted range.
        expected_failures: expected number of blocks that fail.
        failures_low: lower end of the prediction interval of the number that fails if one
            earthquake shakes all blocks; None where it is unknown.
        failures_high: upper end of it.
        kind: response kinds of the blocks.
        model: names of the models that answer.
        term: their intensity terms.
        method: how they are fitted.
        blocks: the answers of the first :data:`MOST_LISTED` rows, one mapping a row; None where a
            file has them.
        warnings: warnings about the table and its answers.
    """

    rows: int
    answered: int
    without_answer: int
    in_domain: int
    expected_failures: float
    failures_low: float | None
    failures_high: float | None
    kind: str
    model: str
    term: str
    method: str
    blocks: list[dict[str, Any]] | None
    warnings: tuple[Diagnostic, ...]

    def sentences(self) -> Iterator[str]:
        """Yield the number of rows that are answered."""
        if self.without_answer:
            yield (
                f"{self.answered:,} of {self.rows:,} blocks are answered; "
                f"{self.without_answer:,} without answer."
            )
        else:
            yield (
                "The block is answered."
                if self.rows == 1
                else (f"All {self.rows:,} blocks are answered.")
            )

    def lines(self) -> Iterator[TextLine]:
        """Yield the number of failures, and the models with the rows in their fitted ranges."""
        failures = f"expected {rounded(self.expected_failures)}"
        if self.failures_low is not None and self.failures_high is not None:
            ends = "–".join(
                dict.fromkeys(f"{n:,g}" for n in (self.failures_low, self.failures_high))
            )
            failures += f"; {ends} if one earthquake shakes all blocks (prediction interval)"
        yield TextLine("Failures", failures)
        inside = f"{self.in_domain:,} of {count_of(self.rows, 'row')} within the fitted range"
        yield TextLine("Model", f"{self.model}; {inside}")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the answers of the first rows; if verbose all that are listed, and the totals."""
        if self.blocks is not None:
            words = {"probability": "probability", "drained_probability": "drained"}
            rows = []
            for row in self.blocks if verbose else self.blocks[:SHOWN]:
                ends = row["ci_low"], row["ci_high"]
                shown = {
                    word: None if row[name] is None else percent(row[name])
                    for name, word in words.items()
                    if name in row
                }
                rows.append({
                    "block": row["block_id"], "kind": row["kind"], "mode": row["mode"],
                    "probability": shown.pop("probability"),
                    "interval": None if None in ends else interval(*ends),
                    **shown, "reason": row["reason"],
                })  # fmt: skip
            yield TextTable.of_rows(rows)
        if verbose:
            totals = self.as_dict()
            yield TextTable(
                (), [(name, totals[name]) for name in totals if name not in ("blocks", "warnings")]
            )

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        values = {**vars(self), "warnings": [*self.warnings]}
        if self.blocks is None:
            del values["blocks"]
        return values


def predict_table(
    source: str | PathLike[str],
    target: str | PathLike[str] | None = None,
    *,
    inputs: Mapping[str, float],
    kind: str | None = None,
    sheet: str | None = None,
    ignore_columns: Sequence[str] = (),
    excel_text: bool = False,
    sensitivity: bool = False,
    remarks: Sequence[str] = (),
    **question: Any,
) -> TableAnswer:
    """Answer every block of a table, and write the table with the answers or list them.

    A row without an answer, such as one with an invalid number, has an empty probability and a
    reason; a row whose `mode` is another than that of the model's kind is not answered.

    Args:
        source: table, ``.csv``, ``.xlsx``, ``.parquet`` or ``.geojson``, with columns that describe
            blocks, and measures; CSV also with semicolons and decimal commas.
        target: table to write, ``.csv``, ``.xlsx`` or ``.parquet``, whole or not at all; CSV is
            written as the CSV that was read. None lists the answers.
        inputs: what is the same for all rows, by the names of :func:`rbfrag.predict`.
        kind: how the blocks fail; None for what they are given by.
        sheet: of a workbook, the name of the sheet; None for the first.
        ignore_columns: columns to ignore, whatever they are called.
        excel_text: write texts that spreadsheets take for formulas with an apostrophe (CSV).
        sensitivity: append columns with P at usual errors of each measured field, and with the
            sources of the uncertainty where standard deviations are given.
        remarks: warnings about the options, which go before those of the answer.
        question: ``rotation_deg``, ``component``, ``mechanism``, ``model``, ``level`` and ``db`` of
            :func:`rbfrag.predict`.

    Raises:
        InputError: a file that cannot be read or written, a missing column, no row that can be
            answered.
    """
    if question.get("sites") is not None:
        raise InputError(
            "sites is for a single block: use the column site_id in a table",
            fields=("sites",),
        )
    reject_inverse(question)
    origin = as_path(source, "source", "a table of blocks")
    goal = None if target is None else table_path(target)
    if goal is not None and origin.exists() and goal.exists() and origin.samefile(goal):
        raise InputError(f"out {goal} is the input table: choose another file", fields=("out",))
    read = (*BLOCK, *MEASURED, *SHAKING, *BY_ROW, "count")
    inputs = {name: encoded(name, value) for name, value in inputs.items()}
    counts = np.zeros(3, dtype=np.int64)
    together: list[tuple[FloatArray, FloatArray, NDArray[np.object_], FloatArray]] = []
    rejected: dict[str, str] = {}
    rows: list[dict[str, Any]] = []
    formulas: list[str] = []
    empty: set[str] = set()
    chosen: dict[str, dict[str, None]]
    chosen = {name: {} for name in ("kind", "model", "term", "method", "read")}
    notes: list[str] = []
    by_row: list[Diagnostic] = []
    texts = (*TEXTS, *SHAKING_TEXTS)
    with (
        opened_table(origin, read, texts, sheet=sheet, ignore_columns=ignore_columns) as table,
        ExitStack() as stack,
    ):
        common = {*inputs, *(name for name in SHAKING_TEXTS if question.get(name) is not None)}
        table.check(common, kind)
        uncertain = not _SCATTER.isdisjoint((*table.header.columns, *inputs))
        columns: tuple[str, ...] = (*ANSWERS, OF_UNCERTAIN) if uncertain else ANSWERS
        fields = {*table.header.columns, *inputs}
        is_scenario = "rjb_km" in fields or question.get("gmm") is not None
        columns += OF_STATED if is_scenario or not fields.isdisjoint(MEASURED) else ()
        if is_scenario:
            fields.add("gmm_sigma")
        columns += (*_of_sensitivity(fields), *_of_uncertainty(fields)) if sensitivity else ()
        columns += OF_DRAINED if "water_m" in (*table.header.columns, *inputs) else ()
        if goal is None:
            write = _listed(table, columns, rows)
        else:
            partial = stack.enter_context(written_whole(goal))
            write = _written(table, columns, partial, stack, formulas, notes, excel_text=excel_text)
        for part in table.parts:
            predicted, answer, count = _answer(
                table, part, inputs, kind, question, empty, sensitivity=sensitivity
            )
            by_row += [  # by the rows of the table
                warning.replaced(rows=np.asarray(warning.rows, dtype=np.intp) + int(counts[0]))
                for warning in diagnostics(predicted.warnings)
            ]
            write(part, answer)
            for name, words in chosen.items():
                names = getattr(predicted, name)
                names = names.split(", ") if isinstance(names, str) else names
                words.update(dict.fromkeys(filter(None, names)))
            finite = np.isfinite(answer["probability"])
            site = np.array(table.text(part, "site_id") or [""] * finite.size, dtype=object)
            together.append(
                (answer["probability"][finite], predicted.y_m_s[finite], site[finite],
                 count[finite])
            )  # fmt: skip
            for i in np.flatnonzero(~finite)[: FIRST - len(rejected)].tolist():
                rejected[f"{table.file.word} {part.lines[i]}"] = answer["reason"][i]
            counts += [finite.size, int(finite.sum()), int(answer["in_domain"].sum())]
        total, answered, inside = counts.tolist()
        if not total:
            raise InputError(NO_BLOCK.format(origin))
        if not answered:
            reject(str(origin), [*rejected], [*rejected.values()], total)
        table.check_read(inputs, chosen["read"])
        used = {*chosen.pop("read"), *MEASURED, *_SHAKING, *texts, *PLACE, *ROW}
        missing = describe_invalid(total - answered, total, [*rejected], [*rejected.values()])
        notes += diagnostics(
            remarks,
            by_row,
            table.warnings(used - {"weight", "loss", "loss_sigma"}),
            missing,
            formulas,
        )
    if goal is not None:
        write_csv_notes(goal, notes)
    model_names: dict[str, Any] = {name: ", ".join(words) for name, words in chosen.items()}
    return TableAnswer(
        rows=total,
        answered=answered,
        without_answer=total - answered,
        in_domain=inside,
        **_total_failures(together, [*chosen["model"]], question, fields),
        **model_names,
        blocks=rows if goal is None else None,
        warnings=diagnostics(notes),
    )


def _total_failures(
    together: Sequence[tuple[FloatArray, FloatArray, NDArray[np.object_], FloatArray]],
    models: Sequence[str],
    question: Mapping[str, Any],
    fields: Collection[str],
) -> dict[str, Any]:
    """Return the expected number of failures, and its range if one earthquake shakes all rows.

    The blocks face unknown azimuths and stand at one site where no other is named. They are taken
    as of one size, by which more fall together than of unlike ones.

    Args:
        together: P, velocity y [m/s], site and number of blocks of rows.
        models: names of the models that answer; the range of several is not known.
        question: as :func:`predict_table` has it.
        fields: names of what is given.
    """
    p, y, names, count = (np.concatenate(column) for column in zip(*together, strict=True))
    ends: dict[str, float | None] = dict.fromkeys(("failures_low", "failures_high"))
    law, loadings = None, EXACT
    if len(models) == 1:
        name, rotation = question.get("model") or models[0], question.get("rotation_deg")
        measures = _measures_of(fields)
        model = find_model(name, measures, question.get("db"), rotation_deg=rotation)
        law, block = model.dependence, model.method.block
        if block.size is not None:
            typical = {block.size: _TYPICAL_P2, block.strength: _TYPICAL_STRENGTH}
            loadings = model.loadings(typical, SINGLE)
    expected = float(count @ p)
    if law is not None:
        ln_y = np.log(np.where(np.isfinite(y) & (y > 0.0), y, 1.0))
        blocks = Placement.of(
            0.0, ln_y, site=np.unique(names.astype(str), return_inverse=True)[1], polarity=UNKNOWN,
            loadings=loadings,
        )  # fmt: skip
        total = int(count.sum())
        alone = float(count @ (p * (1.0 - p)))
        # some blocks drawn without replacement, of which a row with a count holds several
        drawn = np.random.default_rng(0).choice(total, min(total, MOST_PAIRED), replace=False)
        indices = np.searchsorted(np.cumsum(count), drawn, side="right")
        shared = count_moments(p[indices], blocks.only(indices), law)[1]
        shared -= float((p[indices] * (1.0 - p[indices])).sum())
        shared *= total * (total - 1.0) / max(indices.size * (indices.size - 1.0), 1.0)
        tail = 0.5 - 0.5 * question.get("level", LEVEL)
        levels = tail, 1.0 - tail
        counts = count_quantiles(total, expected, alone + shared, levels)
        ends = dict(zip(ends, map(float, counts), strict=True))
    return {"expected_failures": expected, **ends}


_TYPICAL_P2, _TYPICAL_STRENGTH = 3.0, 0.1
"""The block whose spectral velocity stands for those of all rows in what they share."""


def _measures_of(fields: Collection[str]) -> list[str]:
    """Return the intensity measures among the fields; those of a scenario where it is one."""
    if "gmm_sigma" in fields:
        from rbfrag.question.bssa14 import MEASURES as OF_SCENARIO

        return list(OF_SCENARIO)
    return [name for name in fields if name in MEASURES]


def _answer(
    table: BlockTable,
    part: TablePart,
    common_fields: Mapping[str, float],
    kind: str | None,
    question: Mapping[str, Any],
    empty: set[str],
    *,
    sensitivity: bool,
) -> tuple[PredictionArray, dict[str, NDArray[Any]], FloatArray]:
    """Return the answers for rows, their columns, and the number of blocks of each row."""
    values, faults = table.numbers(part)
    count = values.pop("count", np.ones(len(part.lines)))
    is_integer = (count >= 1.0) & (count == np.rint(count))
    for i in np.flatnonzero(~is_integer).tolist():
        faults.setdefault(i, f"count = {count[i]:g}: give a whole number of blocks, 1 or more")
    inputs: dict[str, Any] = dict(common_fields)
    for name, column in values.items():
        if name not in table.filled and (name in common_fields or name in _SHAKING):
            empty.add(name)  # an empty column gives nothing
        elif name in empty:
            raise InputError(
                f"{table.name}: column {column_of(name)} is empty in the first rows and filled "
                "below: fill it, or split the table"
            )
        else:
            # an option holds for the rows whose cell is empty
            inputs[name] = np.where(np.isnan(column), common_fields.get(name, np.nan), column)
    for name in inputs.keys() & {*MEASURED}:
        # a negative number is a fraction of its field
        error, value = inputs[name], inputs.get(measured_by(name), np.nan)
        inputs[name] = np.where(error < 0.0, -error * np.asarray(value), error)
    for name in PLANE_TEXTS:
        if (cells := table.text(part, name)) is not None:
            inputs[name] = np.array(
                [cell or common_fields.get(name, "") for cell in cells], dtype=object
            )
    for name in SHAKING_TEXTS:
        if (cells := table.text(part, name)) is not None and any(cells):
            for i, cell in enumerate(cells if name == "component" else ()):
                try:
                    component_named(cell or SINGLE_COMPONENT)
                except InputError as error:
                    faults.setdefault(i, str(error))
            of_all = question.get(name)
            filled = ["" if i in faults else cell or of_all for i, cell in enumerate(cells)]
            question = {**question, name: filled}
    kinds, modes = table.text(part, "kind"), table.text(part, "mode")
    requested = kind if kinds is None else [row_kind or kind for row_kind in kinds]
    with table.named():
        predicted = with_drained_bound(
            lambda rows: ask(
                rows, kind=requested, mode=modes, rows=True, sensitivity=sensitivity, **question
            ),
            inputs,
        )
    assert isinstance(predicted, PredictionArray)
    answer: dict[str, NDArray[Any]] = {
        name: getattr(predicted, name) for name in (*_NUMBERS, "in_domain", "how", "reason")
    }
    for name, input_texts, predicted_texts in (
        ("kind", kinds, predicted.kinds),
        ("mode", modes, predicted.modes),
    ):
        texts = np.array(input_texts or [""], dtype=object)
        answer[name] = np.where(texts == "", predicted_texts, texts)
    sd = predicted.block_sd
    answer[OF_UNCERTAIN] = np.zeros(predicted.probability.shape) if sd is None else sd
    bound = predicted.drained or {}
    nominal = predicted.as_stated or {n: getattr(predicted, n) for n in OF_BOUND}
    answer |= {f"drained_{n}": bound.get(n, np.full(count.size, np.nan)) for n in OF_BOUND}
    answer |= {f"as_stated_{n}": nominal[n].copy() for n in OF_BOUND}
    bad = [*faults]
    more = {
        f"{key}_{n}": column
        for key in ("sensitivity", "uncertainty")
        for n, column in (getattr(predicted, key) or {}).items()
    }
    empty_column = np.full(count.size, np.nan)
    answer |= {n: more.get(n, empty_column).copy() for n in _ON_REQUEST}
    for name in (*_NUMBERS, OF_UNCERTAIN, *OF_STATED, *OF_DRAINED, *_ON_REQUEST):
        answer[name][bad] = np.nan
    answer["in_domain"][bad] = False
    answer["how"][bad] = ""
    answer["reason"][bad] = [*faults.values()]
    answer["warnings"] = codes_by_row(predicted.warnings, count.size)
    return predicted, answer, np.where(is_integer, count, 1.0)


def _of_sensitivity(fields: Collection[str]) -> tuple[str, ...]:
    """Return the columns of P at usual errors of those of the fields that are measured."""
    rectangle = {"beta_deg"} if "height_m" in fields else set()
    names = (name for name in USUAL if name in {*fields} | rectangle)
    return tuple(f"sensitivity_{name}_{end}" for name in names for end in ("low", "high"))


def _of_uncertainty(fields: Collection[str]) -> tuple[str, ...]:
    """Return the columns of the sources of uncertainty of those of the fields that are errors."""
    sources = [source_of(name) for name in MEASURED if name in fields]
    return tuple(f"uncertainty_{n}" for n in (*sources, "fragility", TOGETHER) if sources)


_ON_REQUEST = (*_of_sensitivity(USUAL), *_of_uncertainty(MEASURED))


def _written(
    table: BlockTable,
    answers: Sequence[str],
    partial: Path,
    stack: ExitStack,
    formulas: list[str],
    notes: Sequence[str],
    *,
    excel_text: bool,
) -> Write:
    """Return a function that writes parts and answers to a file; collects the warnings."""
    doubled = next((name for name in table.file.header if table.file.header.count(name) > 1), None)
    if doubled is not None:
        raise InputError(f"{table.name}: the column {doubled} occurs twice")
    written = (*ANSWERS, OF_UNCERTAIN, *OF_STATED, *OF_DRAINED, *_ON_REQUEST)
    header = [name for name in table.file.header if name not in written]
    write = table_writer(
        partial, header, answers, numeric=table.numeric, stack=stack, dialect=table.file.dialect,
        fast=True, notes=notes,
    )  # fmt: skip
    is_csv = partial.suffix.lower() == ".csv"

    def write_part(part: TablePart, answer: Mapping[str, NDArray[Any]]) -> None:
        cells = changed_texts({name: part.cells[name] for name in header}, as_written)
        if is_csv and excel_text:
            cells = changed_texts(cells, as_text)
        elif is_csv and not formulas:
            formulas.extend(formula_warnings(cells))
        write(replace(part, cells=cells), answer)

    return write_part


def _listed(table: BlockTable, answers: Sequence[str], rows: list[dict[str, Any]]) -> Write:
    """Return a function that appends the answers for parts to a list, up to :data:`MOST_LISTED`."""

    def list_part(part: TablePart, answer: Mapping[str, NDArray[Any]]) -> None:
        first, most = len(rows), MOST_LISTED - len(rows)
        if not most:
            return
        names = table.text(part, "block_id") or map(str, range(first + 1, MOST_LISTED + 1))
        columns = [answer[name].tolist() for name in answers]
        for name, *row in islice(zip(names, *columns, strict=False), most):
            cells = (None if value != value else value for value in row)
            rows.append({"block_id": name, **dict(zip(answers, cells, strict=True))})

    return list_part
