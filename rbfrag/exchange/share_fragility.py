"""Fragility of a rock mass with several limit states: fractions of its blocks that fail."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Unpack

import numpy as np
from scipy.special import ndtri

from rbfrag.errors import InputError
from rbfrag.exchange.block_fragility import (
    TOP,
    BlockCurve,
    BlockFunctions,
    about_model,
    curves_of,
)
from rbfrag.exchange.fragility_function import FragilityFunction, chords
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.question.components import component_named
from rbfrag.question.fields import AnsweringFields
from rbfrag.question.keywords import model_for
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import exact_percent
from rbfrag.solver.results import FloatArray

DRAWS = 20_000
"""Draws of what the blocks share: probabilities have a standard error of at most 0.0035."""

_VALUES_AT_ONCE = 2**22
_FINE = 1001
_FLOOR = 0.01
"""The least P to which errors of chords are relative: below it draws tell little."""


def share_functions(
    name: str,
    p2: FloatArray,
    kr: FloatArray,
    measure: str,
    shares: Sequence[float],
    *,
    levels: int = 80,
    component: str = "single",
    **answering: Unpack[AnsweringFields],
) -> BlockFunctions:
    """Return the probabilities that at least given fractions of the blocks of a rock mass fail.

    The blocks of a rock mass stand at one site and face one way. In each draw of what they have in
    common (the copula of :mod:`rbfrag.fragility.dependence`) block i fails from the level on at
    which its P reaches Φ(Z_i), and a share of the blocks from the level on at which so many have
    failed; the distribution of that level over the draws is the fragility. It never falls, and that
    of a greater share never exceeds that of a smaller one.

    Args:
        p2: frequency parameters of its blocks [1/s²], shape (m,).
        kr: their toppling yield acceleration coefficients, shape (m,).
        shares: shares of the blocks in percent, rising, above 0 to 100.
        answering: model, which must know what its blocks share, and db, as in
            :func:`rbfrag.predict`.

    Raises:
        InputError: shares that make no sense, or a model without an estimate of the dependence.
    """
    rising = all(a < b for a, b in pairwise(shares))
    if not shares or not rising or not all(0.0 < share <= 100.0 for share in shares):
        raise InputError(
            f"shares {', '.join(f'{share:g}' for share in shares)}: give increasing percentages "
            "above 0, up to 100, such as 1,10,50"
        )
    chosen = model_for(answering, ("p2", "kr", measure))
    if chosen.dependence is None:
        raise InputError(
            f"model {chosen.name!r} has no dependence model for the blocks of one earthquake: fit "
            "it to more earthquakes, or choose another model"
        )
    numbers = {"p2": p2, "kr": kr}
    meaning = component_named(component)
    kind, curves = curves_of(numbers, measure, chosen, [name], meaning.sigma)
    curve_of_each = [(ndtri(curve.p), curve.u) for curve in curves]
    blocks = Placement.of_numbers(chosen.method.block, numbers)
    assert blocks is not None
    sampler, generator = JointSampler(chosen.dependence, blocks), np.random.default_rng(0)
    counts = [max(1, math.ceil(share / 100.0 * p2.size - 1e-9)) for share in shares]
    reached = np.empty((len(counts), DRAWS))
    at_once = max(1, _VALUES_AT_ONCE // p2.size)
    for start in range(0, DRAWS, at_once):
        z = sampler.normals(min(at_once, DRAWS - start), generator)
        thresholds = np.stack(
            [np.interp(z[:, i], *curve, right=np.inf) for i, curve in enumerate(curve_of_each)],
            axis=1,
        )
        thresholds.partition([count - 1 for count in counts], axis=1)
        reached[:, start : start + at_once] = thresholds[:, [count - 1 for count in counts]].T
    ends = reached[np.isfinite(reached)]
    top = math.log(TOP[measure])
    if ends.size == 0 or ends.min() >= top:
        raise InputError(f"{name}: none of its blocks fails up to {measure} = {math.exp(top):g}")
    u = np.linspace(ends.min() - 1e-9, ends.max() + 1e-9, _FINE)
    ordered = np.sort(reached, axis=1)
    of_shares = [
        BlockCurve(u, np.searchsorted(row, u, side="right") / DRAWS).smoothed(meaning, measure)
        for row in ordered
    ]
    covered = of_shares[0].u
    covered = covered[(covered <= top) & (of_shares[0].p >= 0.5 / DRAWS)]
    p = np.array([np.interp(covered, *curve[:2]) for curve in of_shares])
    ((x, rows, error),) = chords(np.exp(covered)[None], p[None], levels, _FLOOR)
    functions = [
        FragilityFunction(
            name, f"failed_{share:g}_percent", kind, levels=x, probability=row, grid_error=error
        )
        for share, row in zip(shares, rows, strict=True)
    ]
    warnings = [
        Diagnostic(
            f"all {p2.size} blocks are assumed to stand at one site and to face one way; "
            f"probabilities are frequencies of {DRAWS} draws, with a standard error of at most "
            "0.0035",
            "single_site",
        )
    ]
    few = [share for share in shares if share / 100.0 * p2.size < 1.0]
    if few:
        text = (
            f"{exact_percent(few[0] / 100.0)} of {p2.size} blocks is less than one: that limit "
            "state is one block; give the rock mass more realisations"
        )
        warnings.append(Diagnostic(text, "fraction_of_block"))
    return BlockFunctions(functions, about_model(chosen), tuple(warnings))
