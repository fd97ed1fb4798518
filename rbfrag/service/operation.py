"""What every operation of the service has in common in the OpenAPI document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbfrag.service.documents import Problem
from rbfrag.service.parameters import Parameter
from rbfrag.service.problem import MEDIA_TYPE

PROBLEMS = {
    400: "The request cannot be read.",
    401: "The bearer token is missing or wrong.",
    408: "The body came too slowly.",
    413: "The body is longer than this service takes.",
    415: "The body is of another type.",
    422: "A value cannot be used; the detail says which and what to do.",
    503: "The database cannot be read, or the service is busy.",
}


def operation(
    summary: str,
    answer: Any,
    *,
    parameters: Mapping[str, Parameter] | None = None,
    body: Mapping[str, Any] | None = None,
    description: str = "",
    problems: tuple[int, ...] = (400, 401, 408, 413, 415, 422, 503),
) -> dict[str, Any]:
    """Return the keywords of a FastAPI operation that reads its request itself.

    Args:
        summary: what it answers, in a few words.
        answer: the model of the answer, for the document only.
        parameters: parameters of its query.
        body: content of its body by media type, as OpenAPI writes it.
        description: more words.
        problems: statuses of the troubles it may have.
    """
    extra: dict[str, Any] = {}
    if parameters:
        extra["parameters"] = [each.openapi() for each in parameters.values()]
    if body is not None:
        extra["requestBody"] = {"required": True, "content": dict(body)}
    else:
        problems = tuple(status for status in problems if status not in (408, 413, 415))
    described: dict[int | str, dict[str, Any]] = {200: {"model": answer}}
    reference = {"$ref": f"#/components/schemas/{Problem.__name__}"}
    for status in problems:
        described[status] = {
            "description": PROBLEMS[status],
            "content": {MEDIA_TYPE: {"schema": reference}},
        }
    return {
        "summary": summary,
        "description": description or summary,
        "responses": described,
        "openapi_extra": extra,
    }
