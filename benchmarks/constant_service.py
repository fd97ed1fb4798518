"""What FastAPI and uvicorn themselves need: `/constant` answers without looking.

python -m benchmarks.constant_service PORT PROCESSES

It listens as `rbfrag serve` does: uvicorn's own socket of several processes lets the client's
delayed acknowledgement hold every answer back.
"""

from __future__ import annotations

import sys
from typing import Annotated

import uvicorn
from fastapi import FastAPI, Query

from rbfrag.service.parameters import PredictQuery
from rbfrag.service.run import Workers, listener

ANSWER = {
    "probability": 0.11795834662937416,
    "ci_low": 0.058696602740786134,
    "ci_high": 0.43004655864721875,
    "level": 0.95,
    "model": "toppling-pgv",
}

app = FastAPI(openapi_url=None)


@app.get("/constant")
async def constant(p2: float, kr: float, pgv: float) -> dict[str, float | str]:  # noqa: ARG001
    """Take what `/v1/predict` takes, and answer the same whatever it is."""
    return ANSWER


@app.get("/model")
async def model(query: Annotated[PredictQuery, Query()]) -> dict[str, float | str]:  # noqa: ARG001
    """Take the parameters of `/v1/predict` as FastAPI reads such a model."""
    return ANSWER


@app.get("/bare")
async def bare() -> dict[str, float | str]:
    """Answer without even reading the question."""
    return ANSWER


def main() -> None:
    """Answer until told to end."""
    port, workers = map(int, sys.argv[1:])
    config = uvicorn.Config(
        "benchmarks.constant_service:app", workers=workers, access_log=False, log_level="warning"
    )
    with listener("127.0.0.1", port) as socket:
        if workers == 1:
            uvicorn.Server(config).run(sockets=[socket])
        else:
            Workers(config, sockets=[socket]).run()


if __name__ == "__main__":
    main()
