"""Threads of linear algebra: one, as the commands have it, also for callers from Python."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import import_module
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def with_one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Limit linear algebra (BLAS) to one thread while a function runs.

    The matrices here are too narrow to be shared, and threads that wait for one another take
    processor time (docs/evidence/performance.md).
    """

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        from threadpoolctl import threadpool_limits

        import_module("scipy.linalg")  # a library that is loaded later is not limited
        with threadpool_limits(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
