"""`/v1/predict`: the probability that blocks fail."""

from __future__ import annotations

import math
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from pydantic import ValidationError

from rbfrag.errors import InputError
from rbfrag.fragility.lookup import models_in_memory
from rbfrag.question.document import prediction_document
from rbfrag.question.question import ask, described
from rbfrag.service.documents import PredictAnswer, PredictArrays
from rbfrag.service.parameters import (
    MEASURES,
    NUMBERS,
    OF_ROWS,
    SLIDING,
    UNCERTAIN,
    PredictQuery,
    PredictRows,
)
from rbfrag.service.problem import READ, SENT, refusal
from rbfrag.service.reading import QueryRoute, check_json, json_of, sent_as
from rbfrag.service.settings import Settings
from rbfrag.service.work import WorkerPool, in_thread, json_answer, json_text

ELEMENTS_BESIDE = 20_000
"""So many elements are answered beside other requests; more than these, by another process."""

BYTES_BESIDE = 1 << 20
"""Longer bodies are parsed by another process, whatever they hold."""


def answer_one(query: PredictQuery, db: str | None) -> PredictAnswer:
    """Return what `rbfrag predict --json` prints."""
    stated = (
        query.block_fields()
        | query.given({"displacement": "displacement_m"})
        | query.given(UNCERTAIN)
    )
    blocks = described(stated, query.kind)
    (group,) = blocks.groups
    document = prediction_document(
        {**group.numbers, **query.given(MEASURES)},
        kind=group.kind,
        remarks=blocks.remarks,
        rotation_deg=query.rotation,
        model=query.model,
        level=query.level,
        db=db,
    )
    return PredictAnswer.model_validate(document)


def columns_of(body: PredictRows, row_limit: int) -> dict[str, Any]:
    """Return numbers and lists of one length, by the keywords of :func:`rbfrag.predict`.

    Raises:
        InputError: lists of several lengths, or longer than the limit.
    """
    lengths = {}
    for name, value in body:
        if isinstance(value, list):
            lengths[name] = len(value)
            if len(value) > row_limit:
                raise InputError(
                    f"{name} has {len(value)} elements; one request may hold {row_limit}: split it"
                )
    if len({length for length in lengths.values() if length > 1}) > 1:
        sizes = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"the lists differ in length: {sizes}; give one length, or one number")
    values = body.given({**OF_ROWS, **NUMBERS, **SLIDING, **UNCERTAIN, **MEASURES})
    if body.dip is not None:
        if body.beta is not None:
            raise InputError("dip does not go with beta: both are the dip of the base")
        if not (body.height and body.width):
            raise InputError("dip goes with height and width: of other blocks it is beta")
        values["beta_deg"] = body.dip
    return values | ({"back_fracture": False} if body.no_back else {})


def answer_many(body: bytes, row_limit: int, db: str | None) -> bytes:
    """Return probabilities of many blocks.

    Args:
        body: JSON of what :class:`PredictRows` describes.
        row_limit: most elements of a list.
        db: database of the models.
    """
    try:
        rows = PredictRows.model_validate(json_of(body))
    except ValidationError as error:
        raise refusal(PredictRows.model_fields, error.errors(), sent=True) from None
    values = columns_of(rows, row_limit)
    if values and not any(isinstance(value, list) for value in values.values()):
        # an array of one element, so that single numbers are answered by lists too
        first = next(name for name in values if name != "back_fracture")
        values[first] = [values[first]]
    answers: Any = ask(
        {name: _array(value) for name, value in values.items()},
        kind=rows.kind, rotation_deg=rows.rotation, model=rows.model, level=rows.level, db=db,
    )  # fmt: skip
    return json_text(
        {
            "probability": _with_null(answers.probability),
            "ci_low": _with_null(answers.ci_low),
            "ci_high": _with_null(answers.ci_high),
            "event_low": _with_null(answers.event_low),
            "event_high": _with_null(answers.event_high),
            "block_sd": None if answers.block_sd is None else _with_null(answers.block_sd),
            "in_domain": answers.in_domain.tolist(),
            "reason": answers.reason.tolist(),
            "kind": answers.kind,
            "kinds": answers.kinds.tolist(),
            "modes": answers.modes.tolist(),
            "level": answers.level,
            "model": answers.model,
            "term": answers.term,
            "method": answers.method,
            "data": answers.data,
            "warnings": list(answers.warnings),
        }
    )


def _array(value: Any) -> Any:
    """Return a list as an array, in which null is NaN."""
    import numpy as np

    return np.array(value, dtype=np.float64) if isinstance(value, list) else value


def _with_null(values: Any) -> list[float | None]:
    return [None if math.isnan(value) else value for value in values.tolist()]


def add_routes(routes: APIRouter, settings: Settings, pool: WorkerPool) -> None:
    """Add the operations on `/v1/predict`, whose long work is done by a pool."""

    async def predict_one(query: Annotated[PredictQuery, Query()]) -> PredictAnswer:
        """Return what `rbfrag predict --json` prints for the same values."""
        if models_in_memory(settings.db):
            return answer_one(query, settings.db)
        # a server, or a file that has changed and may be locked: nobody else waits for it
        answer: PredictAnswer = await in_thread(settings.time_limit, answer_one, query, settings.db)
        return answer

    routes.add_api_route(
        "/v1/predict",
        predict_one,
        summary="Probability that one block fails",
        responses=READ,
        route_class_override=QueryRoute,
    )

    @routes.post(
        "/v1/predict",
        summary="Probability that each of many blocks fails",
        response_model=PredictArrays,
        responses=SENT,
        openapi_extra=sent_as({"application/json": {"schema": PredictRows.model_json_schema()}}),
    )
    async def predict_many(request: Request) -> Response:
        """Return probabilities of many blocks.

        Each name is a number or a list; numbers stand for every element. Where an element cannot
        be used, its answer is null and `reason` says why.
        """
        body = await request.body()
        check_json(body, settings.row_limit)
        given = body, settings.row_limit, settings.db
        if len(body) > BYTES_BESIDE or body.count(b",") > ELEMENTS_BESIDE:
            return json_answer(await pool.run(request, answer_many, *given))
        return json_answer(await in_thread(settings.time_limit, answer_many, *given))
