"""Hazard curves of one site: logic-tree branches, their statistics, or both."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from scipy.special import ndtr

from rbfrag.errors import InputError
from rbfrag.files import csv_rows, source_text
from rbfrag.hazards.curve import CurveKeywords, HazardCurve
from rbfrag.hazards.curve_file import CurveLike, as_curves
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray

_ADDS_UP = 2e-3
"""How far weights may add up to something else than 1."""


_REALIZATION = re.compile(r"rlz-0*(\d+)")

Weights = Sequence[float | None] | str | os.PathLike[str]
"""Weights of branches in the order of the curves, or OpenQuake's file of them."""


def curve_name(curve: HazardCurve) -> str:
    """Return the logic-tree branch or statistic of a curve, or else its source."""
    return curve.statistic or curve.source


def curve_warnings(curve: HazardCurve, answer: str) -> Iterator[str]:
    """Yield the warnings of a curve, and one if it is a quantile of the hazard.

    Args:
        curve: the hazard curve.
        answer: the quantity that is computed from it.
    """
    yield from curve.warnings
    if curve.statistic.startswith("quantile"):
        yield Diagnostic(
            f"{curve.statistic} is not a realization of the hazard, and {answer} under it is not "
            f"that quantile of {answer}: use the realizations with their weights",
            "quantile_curve",
        )


def first_curve_warnings(
    curves: Sequence[HazardCurve], weight: FloatArray | None
) -> Iterator[Diagnostic]:
    """Yield a warning where one realization of several curves stands for all of them."""
    if weight is None and len(curves) > 1 and curves[0].statistic != "mean":
        yield Diagnostic(
            f"the answer is that of the first of {len(curves)} hazard curves, "
            f"{curve_name(curves[0])}: give the weights of the branches for their mean",
            "first_curve",
            fields=("weights",),
        )


def branch_curves(
    curve_sources: CurveLike | Sequence[CurveLike], weights: Weights | None, meaning: CurveKeywords
) -> tuple[list[HazardCurve], FloatArray | None]:
    """Return the curves of one site and measure, and the weights of the logic-tree branches.

    Args:
        curve_sources: curves or their files.
        weights: as for :func:`rbfrag.hazard`.
        meaning: which curves are meant.
    """
    curves = as_curves(curve_sources, **meaning)
    reject_unlike(curves)
    return curves, branch_weights(weights, curves)


def branch_weights(weights: Weights | None, curves: Sequence[HazardCurve]) -> FloatArray | None:
    """Return the branch weights of the curves of a site, which sum to 1; None without weights.

    Args:
        weights: numbers in the order of the curves, None for a curve that is not a branch (weight
            NaN); also as text: 0.5,0.3,0.2; or the name of a file of realizations.

    Raises:
        InputError: another number of weights, one that is none, or a sum other than 1.
    """
    if isinstance(weights, str | os.PathLike):
        text = os.fspath(weights)
        try:
            weights = [float(part) for part in text.split(",")]
        except ValueError:
            weights = realization_weights(text, curves)
    if weights is None or all(weight is None for weight in weights):
        return None
    if len(weights) != len(curves):
        raise InputError(f"{len(weights)} weights for {len(curves)} curves: give one for each")
    values = np.array(
        [math.nan if weight is None else weight for weight in weights], dtype=np.float64
    )
    finite = values[~np.isnan(values)]
    if not ((finite >= 0.0) & (finite <= 1.0)).all():
        raise InputError(
            f"weights {', '.join(f'{weight:g}' for weight in finite)}: each must be from 0 to 1"
        )
    if abs(finite.sum() - 1.0) > _ADDS_UP:
        raise InputError(
            f"the weights of {finite.size} branches add up to {finite.sum():.6g}, not 1: give the "
            "curves and weights of all branches"
        )
    return np.asarray(values / finite.sum())


def reject_unlike(curves: Sequence[HazardCurve]) -> None:
    """Reject an empty list of curves, and curves of several measures or sites."""
    if not curves:
        raise InputError("no hazard curve: give one or more")
    reject_several_measures(curves)
    sites = list(dict.fromkeys(curve.place for curve in curves if curve.place))
    if len(sites) > 1:
        raise InputError(
            f"the curves are of {len(sites)} sites ({sites[0]}; {sites[1]}; …): the blocks are "
            "at one site: choose it by number or name"
        )


def reject_several_measures(curves: Iterable[HazardCurve]) -> None:
    """Reject curves of several intensity measures."""
    measures = list(dict.fromkeys(curve.imt for curve in curves))
    if len(measures) > 1:
        raise InputError(
            f"the curves are of {', '.join(measures)}: give curves of one measure, or choose it "
            "with imt",
            fields=("imt",),
        )


def weighted_quantiles(values: FloatArray, weights: FloatArray, q: Sequence[float]) -> FloatArray:
    """Return the smallest values with cumulative weight of at least q, shape (len(q), ...).

    Args:
        values: one a branch along the first axis.
        weights: weights that sum to 1, shape (branches,).
    """
    order = np.argsort(values, axis=0, kind="stable")
    below = np.cumsum(weights[order], axis=0)
    ordered = np.take_along_axis(values, order, axis=0)
    first = [(below >= level - 1e-9).argmax(axis=0) for level in q]
    return np.stack([np.take_along_axis(ordered, at[None], axis=0)[0] for at in first])


def mixture_quantiles(
    rates_of: FloatArray, weight: FloatArray, log_sd: FloatArray, q: Sequence[float]
) -> FloatArray:
    """Return quantiles of rates over branches with lognormal dispersion, shape (len(q), m).

    Args:
        rates_of: rate in each branch, branches x m.
        weight: weights of the branches, which sum to 1.
        log_sd: standard deviation of the logarithm, common to all branches, shape (m,).
    """
    with np.errstate(divide="ignore"):
        logs = np.log(rates_of)
    sd = np.maximum(log_sd, 1e-9)
    finite = np.where(np.isfinite(logs), logs, -700.0)
    result = []
    for level in q:
        low, high = (finite.min(axis=0) - 10.0 * sd, finite.max(axis=0) + 10.0 * sd)
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = weight @ ndtr((middle - logs) / sd) < level
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        result.append(np.exp(high))
    return np.stack(result)


def realization_weights(
    path: str | os.PathLike[str], curves: Sequence[HazardCurve]
) -> list[float | None]:
    """Return the weight of each curve from OpenQuake's realizations file; None for no branch.

    Args:
        path: CSV with ``rlz_id`` and ``weight``, lines that begin with # left out.

    Raises:
        InputError: the file is none of realizations, or lacks that of a curve.
    """
    text = source_text(path, "the realizations of a logic tree")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    header, *rows = [cells for _, cells in csv_rows("\n".join(lines), path)] or [[]]
    weights: dict[int, float] = {}
    for cells in rows:
        row = dict(zip(header, cells, strict=False))
        try:
            weights[int(row["rlz_id"])] = float(row["weight"])
        except (KeyError, ValueError):
            raise InputError(
                f"{path}: {','.join(cells)[:80]!r} is not a realization: rlz_id and weight must "
                "be numbers"
            ) from None
    branches = [_REALIZATION.fullmatch(curve.statistic) for curve in curves]
    if not any(branches):
        raise InputError(
            f"{path} has weights of realizations, and none of the curves is one (kind='rlz-001'): "
            "give the curves of the realizations"
        )
    numbers = [None if match is None else int(match.group(1)) for match in branches]
    for number in numbers:
        if number is not None and number not in weights:
            raise InputError(f"{path}: there is no rlz_id {number}, but a curve has it")
    return [None if number is None else weights[number] for number in numbers]
