"""Physics of each kind, one file per kind; `model_of_kind` loads the file of its name."""

from __future__ import annotations

from functools import cache
from importlib import import_module

from rbfrag.solver.kind import Kind
from rbfrag.solver.kinds import facts_of, kind_of_mode
from rbfrag.solver.stability.modes import ModeName


@cache
def model_of_kind(kind: str) -> Kind:
    """Return the model of a kind, loaded with all that it needs.

    Raises:
        InputError: there is no such kind.
    """
    model: Kind = import_module(f"{__name__}.{facts_of(kind).kind}").MODEL
    return model


def model_of_mode(mode: ModeName, *, back_fracture: bool = True) -> Kind:
    """Return the model of blocks that fail in this mode; arguments as of `kind_of_mode`."""
    return model_of_kind(kind_of_mode(mode, back_fracture=back_fracture).kind)
