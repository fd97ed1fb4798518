"""Compilation of kernels by numba, with a disk cache where a disk is writable."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from numba import config, njit
from numba.core import event
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral

P = ParamSpec("P")
R = TypeVar("R")

# nothing calls kernels as C callbacks: the wrapper for that is left out
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}

_BARE: dict[str, Any] = {"_nrt": False}


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function over arrays to machine code.

    The machine code is kept next to the package, or in the user's cache folder when the
    package is installed read-only. numba writes cache files under a temporary name and
    renames them, so several workers may start at once. Where neither folder can be
    written, a folder of the user's own below the temporary one is taken (:func:`last_resort`).

    Floating-point operations keep their written order (no fastmath): the same input gives
    the same bits.
    """
    return _compile(function, {})


def bare_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that allocates no arrays, otherwise like :func:`kernel`.

    References to those that it is given are not counted then, which takes half of the time of a
    short excursion. Of a kernel that makes arrays numba says "Require NRT"; it must not return
    one that it was given either.
    """
    return _compile(function, _BARE)


def inner_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that only other kernels call, otherwise like :func:`bare_kernel`.

    The conversion of arguments from Python is left out, which takes a quarter of the time of
    compilation where they hold the tables of a record. A call from Python is rejected; tests take
    `py_func`.
    """
    compiled = _compile(function, {**_BARE, "no_cpython_wrapper": True})
    if isinstance(compiled, CPUDispatcher):
        compiled.__class__ = _InnerKernel
    return compiled


class _InnerKernel(CPUDispatcher):
    def __call__(self, *_args: Any, **_kwargs: Any) -> Any:
        # there is no machine code to enter: without this the interpreter would crash
        name = self.py_func.__name__
        raise TypeError(f"{name} is called by other kernels only; from Python, call {name}.py_func")


def fused_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile like :func:`bare_kernel`, with fused rounding of product and sum (FMA).

    Faster, and more accurate if anything; the last bits then depend on the processor.
    """
    return _compile(function, {**_BARE, "fastmath": {"contract"}})


def within(function: Callable[P, R]) -> Callable[P, R]:
    """Inline a function into every kernel that calls it.

    They are then compiled with that kernel, by its rules and vectorised in its loops.
    """
    return cast("Callable[P, R]", njit(inline="always", error_model="numpy")(function))


def on_compilation(callback: Callable[[], None]) -> None:
    """Register a function to be called once, when a kernel is first compiled rather than read from
    disk.

    Compilation takes seconds in which nothing else is seen: the command line says so.
    """
    callbacks.append(callback)
    event.register("numba:compile", _Once(callback))  # type: ignore[no-untyped-call]


callbacks: list[Callable[[], None]] = []
"""What this process asked to be called on compilation, for workers that do its work."""


class _Once(event.Listener):
    def __init__(self, callback: Callable[[], None]) -> None:
        self._callback: Callable[[], None] | None = callback

    def on_start(self, event: Any) -> None:  # noqa: ARG002
        callback, self._callback = self._callback, None
        if callback is not None:
            callback()

    def on_end(self, event: Any) -> None:
        """Do nothing when the compiler ends."""


def _compile(function: Callable[P, R], extra: dict[str, Any]) -> Callable[P, R]:
    options: dict[str, Any] = {**_OPTIONS, **extra}
    try:
        compiled = njit(cache=True, **options)(function)
    except RuntimeError:  # numba's "cannot cache function": neither install nor home is writable
        folder = last_resort()
        if folder is not None:
            config.CACHE_DIR = folder  # type: ignore[attr-defined]
        compiled = njit(cache=folder is not None, **options)(function)
    _stamped_with_all_sources(compiled)
    _once_for_literals(compiled)
    return cast("Callable[P, R]", compiled)


@cache
def last_resort() -> str | None:
    """Return a cache folder for an install and a home that are not writable; None if there is none.

    It lies in the temporary folder and is this user's alone: what lies in it is run.
    """
    if not hasattr(os, "getuid"):
        return None
    folder = Path(tempfile.gettempdir()) / f"rbfrag-kernels-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        state = folder.lstat()
    except OSError:
        return None
    is_private_dir = stat.S_ISDIR(state.st_mode) and state.st_uid == os.getuid()
    return str(folder) if is_private_dir and not state.st_mode & 0o077 else None


def where_kept() -> str:
    """Return a description of the cache folder if it is not the usual one."""
    if not last_resort.cache_info().currsize:
        return ""
    folder = last_resort()
    if folder is None:
        return "at each start: no folder can be written to keep them; name one in NUMBA_CACHE_DIR"
    return f"once; they are kept in {folder}"


class _CacheFile(IndexDataCacheFile):
    def _load_index(self) -> Any:
        # numba reads what an older version of this package left before it looks at the stamp, and
        # fails on a class that has another name now
        try:
            return super()._load_index()  # type: ignore[no-untyped-call]
        except Exception:  # noqa: BLE001
            return {}


@cache
def _stamp_of_sources() -> tuple[tuple[str, int, int], ...]:
    """Return name, time and size of every source file of the solver."""
    solver = Path(__file__).parents[1]
    files = ((file, file.stat()) for file in sorted(solver.rglob("*.py")))
    return tuple((str(f.relative_to(solver)), at.st_mtime_ns, at.st_size) for f, at in files)


def _stamped_with_all_sources(compiled: Any) -> None:
    """Invalidate cached machine code as soon as any source file of the solver changes.

    numba looks at the kernel's own file alone, and would go on running what it had put into it
    from another file that has changed since.
    """
    cached = getattr(compiled, "_cache", None)
    if isinstance(cached, FunctionCache):  # not where no folder is writable
        base = cached._impl.filename_base
        cached._cache_file = _CacheFile(cached.cache_path, base, _stamp_of_sources())  # type: ignore[no-untyped-call]


def is_missing_on_disk(compiled: Any) -> bool:
    """Return whether a kernel can be kept on disk and no machine code of these sources is there."""
    cached = getattr(compiled, "_cache", None)
    return isinstance(cached, FunctionCache) and not cached._cache_file._load_index()  # type: ignore[no-untyped-call]


def _once_for_literals(compiled: Any) -> None:
    """Make calls with different literals share one compilation of a kernel.

    numba compiles a callee again for each literal that stands in a call (0, 1, True), which
    doubled the time of the first search on a machine.
    """
    template = getattr(compiled, "get_call_template", None)
    if template is None:  # NUMBA_DISABLE_JIT leaves the function as it is
        return

    without_literal: Callable[[Any], Any] = unliteral

    def by_types_alone(args: Any, kws: Any) -> Any:
        return template(
            tuple(without_literal(argument) for argument in args),
            {name: without_literal(argument) for name, argument in kws.items()},
        )

    compiled.get_call_template = by_types_alone
