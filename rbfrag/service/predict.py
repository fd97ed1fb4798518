"""`/v1/predict`: the probability that blocks fail."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request

from rbfrag.errors import InputError
from rbfrag.fragility.lookup import models_in_memory
from rbfrag.question.document import prediction_document
from rbfrag.question.question import OF_SHAKING, ask, described
from rbfrag.service.documents import OF_ARRAYS, PredictAnswer, PredictArrays
from rbfrag.service.parameters import COLUMNS, PredictQuery, PredictRows
from rbfrag.service.problem import READ, SENT
from rbfrag.service.reading import check_json, json_of, json_text, read_as, sent_as
from rbfrag.service.settings import ServiceSettings
from rbfrag.service.work import WorkerPool, in_thread

ELEMENTS_BESIDE = 20_000
"""So many elements are answered beside other requests; more than these, by another process."""

BYTES_BESIDE = 1 << 20
"""Longer bodies are parsed by another process, whatever they hold."""


def answer_one(query: PredictQuery, db: str | None) -> dict[str, Any]:
    """Return what `rbfrag predict` prints as JSON."""
    given, how = query.question()
    blocks = described(given, how.pop("kind", None))
    (group,) = blocks.groups
    known = {**group.numbers, **{name: given[name] for name in given if name in OF_SHAKING}}
    return prediction_document(known, kind=group.kind, remarks=blocks.remarks, **how, db=db)


def answer_many(body: bytes, row_limit: int, db: str | None) -> bytes:
    """Return probabilities of many blocks.

    Args:
        body: JSON of what :class:`PredictRows` describes.
        row_limit: most elements of a list.
        db: database of the models.

    Raises:
        InputError: lists of several lengths, or longer than the limit.
    """
    import numpy as np

    rows = read_as(PredictRows, json_of(body))
    lengths = {name: len(value) for name, value in rows if isinstance(value, list)}
    for name, length in lengths.items():
        if length > row_limit:
            raise InputError(
                f"{name} has {length} elements; one request may hold {row_limit}: split it"
            )
    if len({*lengths.values()} - {1}) > 1:
        sizes = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"the lists differ in length: {sizes}; give one length, or one number")
    given, how = rows.question()
    # in which null is NaN
    arrays = {
        name: np.array(value, dtype=np.float64, ndmin=1) if name in COLUMNS else value
        for name, value in given.items()
    }
    answers = ask(arrays, **how, db=db)
    columns = {name: getattr(answers, name) for name in OF_ARRAYS}
    return json_text({n: v.tolist() if hasattr(v, "tolist") else v for n, v in columns.items()})


def add_routes(routes: APIRouter, settings: ServiceSettings, pool: WorkerPool) -> None:
    """Add the operations on `/v1/predict`, whose long work is done by a pool."""

    @routes.get(
        "/v1/predict",
        summary="Probability that one block fails",
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
        "/v1/predict",
        summary="Probability that each of many blocks fails",
        response_model=PredictArrays,
        responses=SENT,
        openapi_extra=sent_as({"application/json": {"schema": PredictRows.model_json_schema()}}),
    )
    async def predict_many(request: Request) -> Any:
        """Return probabilities of many blocks.

        Each name is a number or a list; numbers stand for every element. Where an element cannot
        be used, its answer is null and `reason` says why.
        """
        body = await request.body()
        check_json(body, settings.row_limit)
        given = body, settings.row_limit, settings.db
        if len(body) > BYTES_BESIDE or body.count(b",") > ELEMENTS_BESIDE:
            return await pool.run(request, answer_many, *given)
        return await in_thread(settings.time_limit, answer_many, *given)
