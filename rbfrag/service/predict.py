"""`/v1/predict`: the probability of failure of blocks."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request

from rbfrag.errors import InputError
from rbfrag.exchange.tables.csv_file import NOTE, dialect_of
from rbfrag.fragility.model_selection import models_in_memory
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.question.document import answer_block
from rbfrag.question.drained_bound import with_drained_bound
from rbfrag.question.keywords import reject_inverse
from rbfrag.question.question import ask
from rbfrag.results.diagnostic import diagnostics
from rbfrag.service.documents import PredictAnswer, PredictArrays, TableAnswers
from rbfrag.service.parameters import COLUMNS, PredictQuery, PredictRows, TableQuery
from rbfrag.service.problem import READ, SENT
from rbfrag.service.reading import check_json, json_of, json_text, read_as, sent_as, sent_file
from rbfrag.service.settings import ServiceSettings
from rbfrag.service.work import WorkerPool, in_thread
from rbfrag.vocabulary.quantities import MEASURED, SHAKING

MOST_ELEMENTS_IN_PROCESS = 20_000
"""Maximum number of elements answered in the process of the service; more go to another one."""

TABLE = "block_id,height_m,width_m,dip_deg,phi_deg,pgv_m_s\nA,2,0.4,3,35,0.6\n"
"""A table of one block."""

MOST_BYTES_IN_PROCESS = 1 << 20
"""Longer bodies are parsed by another process, whatever they hold."""


def answer_one(query: PredictQuery | PredictRows, db: str | None) -> dict[str, Any]:
    """Return the same JSON as `rbfrag predict`."""
    inputs, how = query.question()
    return answer_block(inputs, **how, db=db).document(text=query.text)


def answer_many(body: bytes, row_limit: int, db: str | None) -> bytes:
    """Return the failure probabilities of many blocks.

    Args:
        body: JSON of what :class:`PredictRows` describes.
        row_limit: most elements of a list.
        db: database of the models.

    Raises:
        InputError: lists of several lengths, or longer than the limit.
    """
    import numpy as np

    rows = read_as(PredictRows, json_of(body))
    values = {name: value for name, value in rows if not isinstance(value, dict)}
    for name, by_period in rows:
        if isinstance(by_period, dict):
            values |= {f"{name} {period}": value for period, value in by_period.items()}
    lengths = {name: len(value) for name, value in values.items() if isinstance(value, list)}
    if not lengths:
        return json_text(answer_one(rows, db))
    for name, length in lengths.items():
        if length > row_limit:
            raise InputError(
                f"{name} has {length} elements; the maximum per request is {row_limit}: split it"
            )
    if len({*lengths.values()} - {1}) > 1:
        sizes = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"the lists differ in length: {sizes}; give one length, or one number")
    fields, how = rows.question()
    # in which null is NaN
    arrays = {
        name: np.array(value, dtype=np.float64, ndmin=1)
        if name in COLUMNS and not isinstance(value, str)
        else value
        for name, value in fields.items()
    }
    reject_inverse(how)
    answers = with_drained_bound(
        lambda inputs: ask(inputs, **how, db=db, sensitivity=rows.sensitivity), arrays
    )
    assert isinstance(answers, PredictionArray)
    return json_text(answers.with_rejected_elements().as_dict())


def answer_table(body: bytes, query: TableQuery, row_limit: int, db: str | None) -> bytes:
    """Return the answers for a table of blocks, read as by the command line.

    Args:
        body: the table, CSV or a workbook.
        query: what holds for all rows.
        row_limit: most rows.
        db: database of the models.

    Raises:
        InputError: a table that cannot be used, or of more rows than the limit.
    """
    from rbfrag.exchange.block_table import opened_table
    from rbfrag.exchange.table_answers import predict_table

    if not body.strip():
        raise InputError("the table is empty: give a header and one row per block")
    inputs, how = query.question()
    kind = how.pop("kind", None)
    ignored = query.ignore_columns.split(",") if query.ignore_columns else ()
    with TemporaryDirectory() as folder:
        source, target = Path(folder, f"table.{query.form}"), Path(folder, "answers.csv")
        source.write_bytes(body)
        try:
            with opened_table(source, SHAKING, sheet=query.sheet, ignore_columns=ignored) as table:
                if any(name in SHAKING for name in table.header.columns):
                    inputs = {name: v for name, v in inputs.items() if name in MEASURED}
            answer = predict_table(
                source, target, inputs=inputs, kind=kind, sheet=query.sheet, ignore_columns=ignored,
                excel_text=True, sensitivity=query.sensitivity, db=db, **how,
            )  # fmt: skip
        except InputError as error:
            raise InputError(str(error).replace(f"{source}", "the table")) from None
        if answer.rows > row_limit:
            raise InputError(
                f"the table has {answer.rows:,} rows; the maximum per request is {row_limit:,}: "
                "split it"
            )
        answers = target.read_text(encoding="utf-8-sig")
        answers += notes_below(answer.warnings, dialect_of(target).delimiter)
    return json_text({**answer.document(text=query.text), "table": answers})


def notes_below(warnings: Sequence[str], delimiter: str) -> str:
    """Return the warnings as lines to append to a CSV table, which is downloaded as one file."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n", delimiter=delimiter)
    if warnings:
        writer.writerow([])
    writer.writerows([NOTE, warning.code, str(warning)] for warning in diagnostics(warnings))
    return text.getvalue()


def add_routes(routes: APIRouter, settings: ServiceSettings, pool: WorkerPool) -> None:
    """Add the operations on `/v1/predict`, with long work done by a pool."""

    @routes.get(
        "/v1/predict",
        summary="Probability of failure of a block",
        response_model=PredictAnswer,
        responses=READ,
    )
    async def predict_one(query: Annotated[PredictQuery, Query()]) -> Any:
        """Return what `rbfrag predict` prints as JSON for the same values."""
        if models_in_memory(settings.db):
            return answer_one(query, settings.db)
        # a server, or a file that has changed and may be locked: nobody else waits for it
        return await in_thread(settings.time_limit, answer_one, query, settings.db)

    @routes.post(
        "/v1/table",
        summary="Probabilities of failure of the blocks of a table",
        response_model=TableAnswers,
        responses=SENT,
        openapi_extra=sent_as(
            {
                "text/csv": {"schema": {"type": "string"}, "example": TABLE},
                "application/octet-stream": {"schema": {"type": "string", "format": "binary"}},
            }
        ),
    )
    async def predict_rows(request: Request, query: Annotated[TableQuery, Query()]) -> bytes:
        """Return the table with the answers of `rbfrag predict --blocks`, and its warnings.

        Columns are named as in the tables of the command line, in five languages and with units.
        """
        body = await sent_file(request)
        return await pool.run(request, answer_table, body, query, settings.row_limit, settings.db)

    @routes.post(
        "/v1/predict",
        summary="Probabilities of failure of many blocks",
        response_model=PredictArrays | PredictAnswer,
        responses=SENT,
        openapi_extra=sent_as({"application/json": {"schema": PredictRows.model_json_schema()}}),
    )
    async def predict_many(request: Request) -> Any:
        """Return probabilities of many blocks.

        Each name is a number or a list; numbers stand for every element. Where an element cannot
        be used, its answer is null and `reason` says why. Without a list the answer is that for one
        block.
        """
        body = await request.body()
        check_json(body, settings.row_limit)
        arguments = body, settings.row_limit, settings.db
        if len(body) > MOST_BYTES_IN_PROCESS or body.count(b",") > MOST_ELEMENTS_IN_PROCESS:
            return await pool.run(request, answer_many, *arguments)
        return await in_thread(settings.time_limit, answer_many, *arguments)
