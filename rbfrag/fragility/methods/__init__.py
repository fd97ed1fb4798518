"""Methods of fitting, one file each; :mod:`rbfrag.fragility.method` defines their form."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module

from rbfrag.errors import InputError
from rbfrag.fragility.method import Method


def method_names() -> tuple[str, ...]:
    """Return the names of all methods."""
    from pkgutil import iter_modules

    return tuple(module.name for module in iter_modules(__path__))


@lru_cache(maxsize=64)
def method_named(name: str) -> Method:
    """Return the method with this name."""
    if not name.isidentifier() or name.startswith("_"):
        raise _unknown(name)
    try:
        method: Method = import_module(f"{__name__}.{name}").METHOD
    except ModuleNotFoundError as error:
        if error.name != f"{__name__}.{name}":
            raise
        raise _unknown(name) from None
    return method


def methods() -> tuple[Method, ...]:
    """Return all methods."""
    return tuple(method_named(name) for name in method_names())


def _unknown(name: str) -> InputError:
    return InputError(f"unknown method {name!r}: use one of {', '.join(method_names())}")
