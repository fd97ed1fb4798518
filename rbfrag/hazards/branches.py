"""Hazard curves of one site that are branches of a logic tree, statistics of it, or both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from rbfrag.errors import InputError
from rbfrag.hazards.curve import HazardCurve
from rbfrag.solver.results import FloatArray

_ADDS_UP = 2e-3
"""How far weights may add up to something else than 1."""


def curve_name(curve: HazardCurve) -> str:
    """Return what of a logic tree a curve is, or where it comes from."""
    return curve.statistic or curve.source


def quantile_warning(curve: HazardCurve, answer: str) -> Iterator[str]:
    """Yield what is to be said of a curve of quantiles."""
    if curve.statistic.startswith("quantile"):
        yield (
            f"{curve.statistic} is the hazard of no single model, and {answer} under it no "
            f"quantile of {answer}: branches with their weights say more"
        )


def refuse_unlike(curves: Sequence[HazardCurve]) -> None:
    """Refuse no curve at all, and curves of several measures or sites."""
    if not curves:
        raise InputError("there is no hazard curve: give one or more")
    measures = list(dict.fromkeys(curve.imt for curve in curves))
    if len(measures) > 1:
        raise InputError(
            f"the curves are of {', '.join(measures)}: give curves of one measure, or choose it "
            "with imt",
            fields=("imt",),
        )
    places = list(dict.fromkeys(curve.place for curve in curves if curve.place))
    if len(places) > 1:
        raise InputError(
            f"the curves are of {len(places)} sites ({places[0]}; {places[1]}; …): the blocks "
            "stand at one: choose it by its number or name"
        )


def checked_weights(weights: Sequence[float | None] | None, n: int) -> FloatArray | None:
    """Return weights that sum to 1, NaN for curves without; None where none is given.

    Args:
        weights: weights of the curves, None for one that is no branch.

    Raises:
        InputError: another number of weights, one that is none, or a sum other than 1.
    """
    if weights is None or all(one is None for one in weights):
        return None
    if len(weights) != n:
        raise InputError(f"{len(weights)} weights for {n} curves: give one for each")
    values = np.array([math.nan if one is None else one for one in weights], dtype=np.float64)
    given = values[~np.isnan(values)]
    if not ((given >= 0.0) & (given <= 1.0)).all():
        raise InputError(f"weights {', '.join(f'{one:g}' for one in given)}: each is from 0 to 1")
    if abs(given.sum() - 1.0) > _ADDS_UP:
        raise InputError(
            f"the weights of {given.size} branches add up to {given.sum():.6g}, not 1: give the "
            "curves and weights of all branches"
        )
    return np.asarray(values / given.sum())


def weighted_quantiles(values: FloatArray, weights: FloatArray, q: Sequence[float]) -> FloatArray:
    """Return the smallest values that the weights up to them reach q, shape (len(q), ...).

    Args:
        values: one a branch along the first axis.
        weights: weights that sum to 1, shape (branches,).
    """
    order = np.argsort(values, axis=0, kind="stable")
    below = np.cumsum(weights[order], axis=0)
    ordered = np.take_along_axis(values, order, axis=0)
    first = [(below >= level - 1e-9).argmax(axis=0) for level in q]
    return np.stack([np.take_along_axis(ordered, at[None], axis=0)[0] for at in first])
