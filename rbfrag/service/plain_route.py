"""Routes whose endpoints read their request themselves."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.routing import APIRoute


class _PlainRoute(APIRoute):
    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the endpoint itself: there are no dependencies that would have to be solved."""
        return self.endpoint


def plain_router() -> APIRouter:
    """Return a router for functions from a request to a response."""
    return APIRouter(route_class=_PlainRoute)
