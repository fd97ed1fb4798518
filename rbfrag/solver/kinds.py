"""The kinds that there are: every file of `rbfrag/solver/models` with a ``MODEL``."""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module

import rbfrag.solver.models
from rbfrag.errors import InputError
from rbfrag.solver.kind import Kind
from rbfrag.solver.stability.modes import ModeName


@cache
def models() -> dict[str, Kind]:
    """Return all models by kind."""
    by_name: dict[str, Kind] = {}
    for module in pkgutil.iter_modules(rbfrag.solver.models.__path__):
        model = getattr(import_module(f"rbfrag.solver.models.{module.name}"), "MODEL", None)
        if model is not None:
            by_name[model.kind] = model
    return by_name


def model_of_kind(kind: str) -> Kind:
    """Return the model of that name."""
    known = models()
    if kind not in known:
        raise InputError(
            f"unknown kind {kind!r}: use one of {', '.join(sorted(known))} "
            "(rocking is free-standing, toppling backed by a slope)"
        )
    return known[kind]


def model_of_mode(mode: ModeName, *, back_fracture: bool = True) -> Kind:
    """Return the model of blocks that fail in this mode.

    Args:
        mode: the failure mode.
        back_fracture: whether there is a plane behind the block, which decides where the mode has
            a model of each kind.
    """
    of_mode = [model for model in models().values() if model.mode == mode]
    # False comes first: the model that fits, or the only one there is
    return min(of_mode, key=lambda model: model.free_standing == back_fracture)


def stands_free_of(model: Kind, back_fracture: bool) -> bool:
    """Return whether a block is asked of a model of backed blocks though nothing backs it.

    Args:
        model: the model that is asked.
        back_fracture: whether there is a plane behind the block.
    """
    if back_fracture or model.free_standing or model.mode is None:
        return False
    return model_of_mode(model.mode, back_fracture=False).free_standing
