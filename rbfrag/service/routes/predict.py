"""`/v1/predict`: the probability that blocks fail."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from rbfrag.db.location import locate
from rbfrag.errors import InputError
from rbfrag.fragility.predict import prediction_document
from rbfrag.service.body import Bodies
from rbfrag.service.documents import PredictAnswer, PredictArrays
from rbfrag.service.json_body import answer, json_answer, json_text, read_json
from rbfrag.service.operation import (
    KEYWORD,
    KR,
    LEVEL,
    MEASURES,
    MODEL,
    OTHER_BLOCKS,
    P2,
    by_name,
    operation,
    own_router,
    read_query,
)
from rbfrag.service.settings import Settings
from rbfrag.service.work import WorkerPool

PARAMETERS = by_name(
    (
        replace(P2, required=False),
        replace(KR, required=False),
        *OTHER_BLOCKS,
        *MEASURES,
        MODEL,
        LEVEL,
    )
)

ROWS_AT_ONCE = 64
"""So many rows are answered while others wait."""

ROWS_BESIDE = 5000
"""So many rows are answered beside others; more than these, by another process."""

KEYWORDS = {
    "p2": "p2",
    "kr": "kr",
    "ky": "ky",
    "displacement": "displacement_m",
    "beta": "beta_deg",
    "ks": "ks",
    "ps2": "ps2",
    **KEYWORD,
}
"""Keywords of :func:`rbfrag.predict` by the names of the body that may be a list."""


def answer_one(query: bytes, db: str | None) -> dict[str, Any]:
    """Return the answer to the query of a URL."""
    values = read_query(query, PARAMETERS)
    return prediction_document(
        _given(values),
        kind=values.get("kind"),
        rotation_deg=values.get("rotation"),
        model=values.get("model"),
        level=values.get("level", 0.95),
        db=db,
    )


def answer_many(given: dict[str, Any], db: str | None) -> bytes:
    """Return the answer to numbers and lists of numbers by name, as :func:`checked` gives them."""
    from rbfrag.fragility.predict import predict

    values = _given(given)
    if values and not any(isinstance(value, list) for value in values.values()):
        # an array of one element, so that single numbers are answered by lists too
        first = next(iter(values))
        values[first] = [values[first]]
    found: Any = predict(
        **values,
        kind=given.get("kind"),
        rotation_deg=given.get("rotation"),
        model=given.get("model"),
        level=given.get("level", 0.95),
        db=db,
    )
    return json_text(
        {
            "probability": _plain(found.probability),
            "ci_low": _plain(found.ci_low),
            "ci_high": _plain(found.ci_high),
            "in_domain": found.in_domain.tolist(),
            "reason": found.reason.tolist(),
            "kind": found.kind,
            "level": found.level,
            "model": found.model,
            "term": found.term,
            "method": found.method,
            "warnings": list(found.notes),
        }
    )


def _given(values: dict[str, Any]) -> dict[str, Any]:
    return {keyword: values[name] for name, keyword in KEYWORDS.items() if name in values}


def _plain(values: Any) -> list[float | None]:
    return [None if math.isnan(value) else value for value in values.tolist()]


def checked(stated: Any, row_limit: int) -> dict[str, Any]:
    """Return the numbers and lists of numbers of a body by name.

    Raises:
        InputError: a name that is not known, or a value that is no number and no such list.
    """
    if not isinstance(stated, dict):
        raise InputError('the body is a JSON object such as {"p2": 3, "kr": [0.1, 0.2], "pgv": 1}')
    for name in stated:
        if name not in PARAMETERS:
            raise InputError(f"there is no {name[:60]!r}; known are {', '.join(PARAMETERS)}")
        if stated[name] is None:
            raise InputError(f"{name} is null: leave it out, or give {PARAMETERS[name].words}")
    values = dict(stated)
    lengths = {}
    for name in KEYWORDS:
        value = values.get(name)
        if isinstance(value, list):
            lengths[name] = len(value)
            if not value:
                raise InputError(f"{name} is an empty list: give a number or a list of numbers")
            if len(value) > row_limit:
                raise InputError(
                    f"{name} has {len(value)} elements; one request may hold {row_limit}: split it"
                )
            values[name] = [_number(name, each, i) for i, each in enumerate(value)]
        elif value is not None:
            values[name] = _number(name, value, None)
    if len({length for length in lengths.values() if length > 1}) > 1:
        sizes = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"the lists differ in length: {sizes}; give one length, or one number")
    for name in ("model", "kind"):
        text = values.get(name)
        if text is not None and not (isinstance(text, str) and text):
            raise InputError(f"{name} is not a text: {PARAMETERS[name].words}")
    if "rotation" in values:
        values["rotation"] = _number("rotation", values["rotation"], None)
    level = values.get("level", 0.95)
    if isinstance(level, bool) or not isinstance(level, int | float):
        raise InputError("level is not a number: a confidence level lies between 0 and 1")
    values["level"] = float(level)
    return values


def _number(name: str, value: Any, place: int | None) -> float:
    if value is None:
        return math.nan
    where = name if place is None else f"{name}[{place}]"
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where} = {str(value)[:60]!r} is not a number")
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{where} is too large for a number") from None


def router(settings: Settings, bodies: Bodies, pool: WorkerPool) -> APIRouter:
    """Return the operations on `/v1/predict`.

    Args:
        settings: database and limits.
        bodies: reads what is sent.
        pool: where long work is done.
    """
    routes = own_router()
    # a server's answer is waited for; a file's models are in memory
    on_server = isinstance(locate(settings.db), str)

    @routes.get(
        "/v1/predict",
        **operation(
            "Probability that one block fails",
            PredictAnswer,
            parameters=PARAMETERS,
            description="What `rbfrag predict --json` prints for the same values.",
        ),
    )
    async def predict_one(request: Request) -> Response:
        query = request.scope["query_string"]
        if on_server:
            return json_answer(await run_in_threadpool(answer_one, query, settings.db))
        return json_answer(answer_one(query, settings.db))

    number = {"type": "number"}
    lists = {
        name: {
            "anyOf": [
                number,
                {
                    "type": "array",
                    "items": {"type": ["number", "null"]},
                    "minItems": 1,
                    "maxItems": settings.row_limit,
                },
            ],
            "description": PARAMETERS[name].words,
        }
        for name in KEYWORDS
    }
    others = {
        name: {**PARAMETERS[name].schema(), "description": PARAMETERS[name].words}
        for name in ("kind", "rotation", "model", "level")
    }
    body = {
        "type": "object",
        "properties": {**lists, **others},
        "additionalProperties": False,
    }

    @routes.post(
        "/v1/predict",
        **operation(
            "Probability that each of many blocks fails",
            PredictArrays,
            body={
                "application/json": {
                    "schema": body,
                    "example": {"p2": 3.0, "kr": [0.1, 0.2, 0.3], "pgv": [0.6, 0.6, 1.2]},
                }
            },
            description="Each name is a number or a list; numbers stand for every element. Where "
            "an element cannot be used, its answer is null and `reason` says why.",
        ),
    )
    async def predict_many(request: Request) -> Response:
        async with bodies.read(request) as body:
            given = checked(read_json(body), settings.row_limit)
            rows = max((len(each) for each in given.values() if isinstance(each, list)), default=1)
            if rows > ROWS_BESIDE:
                return answer(await pool.run(request, answer_many, given, settings.db))
            if rows > ROWS_AT_ONCE or on_server:
                return answer(await run_in_threadpool(answer_many, given, settings.db))
            return answer(answer_many(given, settings.db))

    return routes
