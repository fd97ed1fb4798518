"""How kernels are compiled: numba, cached on disk where a disk can be written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

from numba import njit
from numba.core.types import unliteral

P = ParamSpec("P")
R = TypeVar("R")

_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function over arrays to machine code.

    The machine code is kept beside the package, or in the user's cache folder when the
    package is installed read-only. numba writes cache files under a temporary name and
    renames them, so several workers may start at once. Where neither folder can be
    written the kernel is compiled anew in each process.

    Floating-point operations keep their written order (no fastmath): the same input gives
    the same bits.
    """
    return _compile(function, {})


def fused_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile like :func:`kernel`, but let a product and a sum be rounded once (FMA).

    Faster, and more accurate if anything; the last bits then depend on the processor.
    """
    return _compile(function, {"fastmath": {"contract"}})


def within(function: Callable[P, R]) -> Callable[P, R]:
    """Put the operations of a function into every kernel that calls it.

    They are then compiled with that kernel, by its rules and vectorised in its loops.
    """
    return cast("Callable[P, R]", njit(inline="always", error_model="numpy")(function))


def _compile(function: Callable[P, R], extra: dict[str, Any]) -> Callable[P, R]:
    options: dict[str, Any] = {**_OPTIONS, **extra}
    try:
        compiled = njit(cache=True, **options)(function)
    except RuntimeError:  # numba's "cannot cache function": no folder is writable
        compiled = njit(**options)(function)
    _once_for_literals(compiled)
    return cast("Callable[P, R]", compiled)


def _once_for_literals(compiled: Any) -> None:
    """Let kernels that call this one with literals share one compilation of it.

    numba compiles a callee anew for each literal that stands in a call (0, 1, True), which
    doubled the time of the first search on a machine.
    """
    template = getattr(compiled, "get_call_template", None)
    if template is None:  # NUMBA_DISABLE_JIT leaves the function as it is
        return

    without_literal: Callable[[Any], Any] = unliteral

    def by_types_alone(args: Any, kws: Any) -> Any:
        return template(
            tuple(without_literal(each) for each in args),
            {name: without_literal(each) for name, each in kws.items()},
        )

    compiled.get_call_template = by_types_alone
