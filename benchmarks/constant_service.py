"""What FastAPI and uvicorn themselves need: `/constant` answers without looking."""

from __future__ import annotations

from fastapi import FastAPI

ANSWER = {
    "probability": 0.11795834662937416,
    "ci_low": 0.058696602740786134,
    "ci_high": 0.43004655864721875,
    "level": 0.95,
    "model": "weibull-pgv",
}

app = FastAPI(openapi_url=None)


@app.get("/constant")
async def constant(p2: float, kr: float, pgv: float) -> dict[str, float | str]:  # noqa: ARG001
    """Take what `/v1/predict` takes, and answer the same whatever it is."""
    return ANSWER


@app.get("/bare")
async def bare() -> dict[str, float | str]:
    """Answer without even reading the question."""
    return ANSWER
