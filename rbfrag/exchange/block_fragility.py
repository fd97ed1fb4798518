"""Fragility of blocks, or of fractions of a rock mass, as a function of one intensity measure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from typing import NamedTuple, Unpack

import numpy as np
from scipy.special import ndtr, ndtri

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import JUMP, FragilityFunction, chords
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.hazards.curve import IntensityType
from rbfrag.question.components import Component, component_named
from rbfrag.question.fields import AnsweringFields
from rbfrag.question.keywords import model_for
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import exact_percent
from rbfrag.solver.kinds import mode_of_kind
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import MEASURES
from rbfrag.vocabulary.spectral import SpectralMapping

FAILED = {"topple": "toppled", "slide": "slid", "slump": "slumped", "confined_topple": "toppled"}
"""The limit state of a block by its mode."""

LEAST, FLOOR = 5e-6, 1e-5
"""P where a function begins, and the least P to which errors are relative."""

TOP = SpectralMapping(
    {name: measure.top for name, measure in MEASURES.items() if measure.top is not None},
    lambda name: MEASURES[name].top, "sa_g",
)  # fmt: skip
"""The strongest shaking [m/s or g] that a function covers, by the measure's name in `predict`."""

_WEAKEST, _SCANNED, _FINE, _HALVINGS = 1e-5, 1001, 1201, 40
_TOWARDS_THE_FIRST = np.linspace(0.0, 1.0, _FINE) ** 2
"""Places of levels, close where P is least and often steepest, as parts of the range."""
_NOTHING, _UNSEEN, _SURE = 1e-300, 1e-12, 1.0 - 1e-7
_REACH = 7.0
"""Standard deviations of a component's scatter that are integrated over, to both sides."""
_STRAIGHT = 1e-9
_CHUNK = 256
_NARROWEST = 0.2
"""Least range of ln of the levels: a block that never fails has one too."""
_BEGINNINGS = 500
"""So many weakest blocks of a class keep the jump at which each begins."""


class BlockFunctions(NamedTuple):
    """Fragility functions of blocks, with their model and warnings.

    Args:
        functions: one of each block, or of their class.
        about: name, term and method of the model.
        warnings: what to know about them.
    """

    functions: list[FragilityFunction]
    about: tuple[str, str, str]
    warnings: tuple[str, ...] = ()


class BlockCurve(NamedTuple):
    """P at levels close enough for linear interpolation; 0 below the first level.

    Args:
        u: ln of the levels, shape (n,).
        p: P at them, never falling, shape (n,).
        lowest: level [m/s or g] below which P rises again, which is cut off there, or None.
    """

    u: FloatArray
    p: FloatArray
    lowest: float | None = None

    def smoothed(self, meaning: Component, measure: str) -> BlockCurve:
        """Return P for another definition of the component, integrated over its dispersion.

        The steps of u must be equal. A single component is definition/ratio · exp(sigma ξ), ξ
        standard normal. What P jumps by where it begins is integrated in closed form.
        """
        if meaning.sigma == 0.0:
            return self
        step = self.u[1] - self.u[0]
        reach = math.ceil(_REACH * meaning.sigma / step)
        xi = step / meaning.sigma * np.arange(-reach, reach + 1)
        weight = np.exp(-0.5 * xi**2)
        beyond = np.pad(self.p - self.p[0], (0, 2 * reach), mode="edge")
        rest = np.convolve(np.pad(beyond, (2 * reach, 0)), weight / weight.sum(), mode="valid")
        u = self.u[0] + step * np.arange(-reach, self.u.size + reach)
        p = rest + self.p[0] * ndtr((u - self.u[0]) / meaning.sigma)
        return BlockCurve(u + math.log(meaning.ratio(measure)), p, self.lowest)

    def between(self, top: float) -> BlockCurve:
        """Return the part of the curve from P = `LEAST` to a level, or to where P is almost 1."""
        if self.p[0] >= LEAST and self.u[-1] <= math.log(top):
            return self
        begins, ends = np.searchsorted(self.p, (LEAST, _SURE))
        first = self.u[min(begins, self.u.size - 1)]
        last = min(self.u[min(ends, self.u.size - 1)], math.log(top))
        grid = first + (last - first) * _TOWARDS_THE_FIRST
        return BlockCurve(grid, self.at(grid), self.lowest)

    def at(self, u: FloatArray | float) -> FloatArray:
        """Return P between the levels, interpolated in its logarithm."""
        return np.asarray(np.exp(np.interp(u, self.u, np.log(np.maximum(self.p, _NOTHING)))))


def block_functions(
    names: Sequence[str],
    numbers: Mapping[str, FloatArray],
    measure: str,
    kind: str | None = None,
    *,
    one_class: bool = False,
    levels: int = 80,
    component: str = "single",
    **answering: Unpack[AnsweringFields],
) -> BlockFunctions:
    """Return the fragility of each block over one measure.

    A fragility that is lognormal to 1e-9 is returned as such, every other
    on levels from where P reaches `LEAST`, or jumps above it, to credible shaking, such that the
    error of chords between them is the least, relative to P or to `FLOOR`. One that rises again
    towards weak shaking begins at its lowest.

    Args:
        numbers: what a model reads of them, by field, shape (m,) each; NaN of an option for the
            block's own.
        measure: ``pgv_m_s``, ``pga_g`` or ``sa(1)``, which a model reads alone.
        kind: how they fail; None for what they are given by.
        one_class: the blocks stand for one class: one function, their mean, of one name.
        levels: greatest number of levels of a function.
        component: definition of the horizontal component, as :func:`rbfrag.hazard` has it.
        answering: model and db, as in :func:`rbfrag.predict`.

    Raises:
        InputError: a block or a measure that no model can work with, one that credible shaking
            does not fail, or too few levels.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    model, meaning = model_for(answering, (*numbers, measure), kind), component_named(component)
    measured, curves = curves_of(numbers, measure, model, names, meaning.sigma)
    begun: list[float] = []

    def shown() -> Iterator[BlockCurve]:
        for curve in curves:
            begun.extend([] if curve.lowest is None else [curve.lowest])
            yield curve.smoothed(meaning, measure)

    top, state = TOP[measure], FAILED.get(mode_of_kind(model.row.kind), "failed")
    all_curves = iter([_mean(shown(), top)]) if one_class else shown()
    functions: list[FragilityFunction] = []
    weak: list[str] = []
    of = iter(names)
    while chunk := list(islice(all_curves, _CHUNK)):
        named = list(zip(of, chunk, strict=False))
        weak += [name for name, curve in named if curve.at(math.log(top)) < FLOOR]
        if not weak:
            functions += _functions(named, FragilityFunction("", state, measured), levels, top)
    if weak:
        raise InputError(
            f"{len(weak)} of {len(names)} blocks, first {weak[0]!r}, have no fragility: P stays "
            f"below {FLOOR:g} up to {measure} = {top:g}; omit them"
        )
    warnings = (
        (
            Diagnostic(
                f"P of model {model.name} rises again below {measure} = {max(begun):.2g}, where it "
                "was fitted on too little: the functions begin there, and nothing fails below",
                "function_starts",
            ),
        )
        if begun
        else ()
    )
    return BlockFunctions(functions, about_model(model), warnings)


def about_model(model: FragilityModel) -> tuple[str, str, str]:
    """Return name, term and method of a model."""
    return model.name, model.term.name, model.row.method


def curves_of(
    numbers: Mapping[str, FloatArray],
    measure: str,
    model: FragilityModel,
    names: Sequence[str],
    scatter: float = 0.0,
) -> tuple[IntensityType, Iterator[BlockCurve]]:
    """Return the intensity measure of the levels, and the single-component curve of each block.

    Args:
        scatter: standard deviation of ln of the shaking that is to be integrated: curves reach as
            much farther to both sides.
    """
    if measure not in TOP:
        raise InputError(f"measure = {measure!r}: use one of {', '.join(TOP)}")
    columns = model.method.block.filled(numbers)

    def curves() -> Iterator[BlockCurve]:
        for start in range(0, next(iter(columns.values())).size, _CHUNK):
            rows = slice(start, start + _CHUNK)
            of_blocks = {name: column[rows, None] for name, column in columns.items()}
            yield from _scan_curves(of_blocks, measure, model, names[start:] or names, scatter)

    return IntensityType.of(measure), curves()


def _scan_curves(
    blocks: Mapping[str, FloatArray],
    measure: str,
    model: FragilityModel,
    names: Sequence[str],
    scatter: float,
) -> Iterator[BlockCurve]:
    def probability(u: FloatArray) -> FloatArray:
        return array_answer(model, {**blocks, measure: np.exp(u)}, interval=False).probability

    least = LEAST if scatter == 0.0 else _UNSEEN
    highest = math.log(TOP[measure]) + _REACH * scatter
    u = np.linspace(math.log(_WEAKEST), highest, _SCANNED)
    p = probability(u)
    for row in np.flatnonzero(np.isnan(p).any(axis=1))[:1]:
        raise InputError(
            f"block {names[min(row, len(names) - 1)]!r} has no fragility: its numbers must be "
            "above zero and finite"
        )
    safe = p < least
    last = np.where(safe.any(axis=1), u.size - 1 - safe[:, ::-1].argmax(axis=1), p.argmin(axis=1))
    low = u[np.minimum(last, u.size - 2), None]
    high = low + (u[1] - u[0]) * safe.any(axis=1, keepdims=True)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = probability(middle) < least
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    sure = p > _SURE
    end = np.where(sure.any(axis=1), u[sure.argmax(axis=1)], highest)[:, None]
    end = np.maximum(end, high + _NARROWEST)
    even = np.linspace(0.0, 1.0, _FINE)
    grid = high + (end - high) * (even if scatter else _TOWARDS_THE_FIRST)
    rising = np.maximum.accumulate(probability(grid), axis=1)
    lowest = np.where(p[:, 0] - p.min(axis=1) > FLOOR, np.exp(high[:, 0]), np.nan)
    for levels, row, begins in zip(grid, rising, lowest.tolist(), strict=True):
        yield BlockCurve(levels, row, None if begins != begins else begins)


def _mean(curves: Iterable[BlockCurve], top: float) -> BlockCurve:
    """Return the mean of curves; of curves that begin with a jump, the first ones keep it."""
    grid = np.linspace(math.log(_WEAKEST), math.log(top), 16 * _SCANNED)
    total, jumps = np.zeros(grid.size), []
    for curve in curves:
        total += curve.at(grid) - curve.p[0]
        jumps.append((curve.u[0], curve.p[0]))
    at, height = np.array(sorted(jumps)).T
    sums = np.concatenate([[0.0], np.cumsum(height)])

    def mean(u: FloatArray) -> FloatArray:
        within = sums[np.searchsorted(at, u, side="right")]
        return np.asarray((np.interp(u, grid, total) + within) / at.size)

    ends = grid[np.minimum(np.searchsorted(mean(grid), (LEAST, _SURE)), grid.size - 1)]
    shown = at[(height > FLOOR) & (at >= ends[0]) & (at <= ends[1])][:_BEGINNINGS]
    u = np.unique(
        np.concatenate([ends[0] + np.ptp(ends) * _TOWARDS_THE_FIRST, shown - JUMP, shown])
    )
    return BlockCurve(u, mean(u))


def _functions(
    named: Sequence[tuple[str, BlockCurve]], empty: FragilityFunction, levels: int, top: float
) -> Iterator[FragilityFunction]:
    """Yield the fragility functions of the curves, up to the level `top`."""
    straight = [_lognormal(curve, top) for _, curve in named]
    curved = [c.between(top) for (_, c), line in zip(named, straight, strict=True) if line is None]
    discrete: Iterator[tuple[FloatArray, FloatArray, float]] = iter(())
    if curved:
        u, p = (np.stack([getattr(curve, axis) for curve in curved]) for axis in ("u", "p"))
        discrete = chords(np.exp(u), p[:, None], levels, FLOOR)
    for (name, _), line in zip(named, straight, strict=True):
        if line is None:
            x, (probability,), error = next(discrete)
            yield replace(empty, name=name, levels=x, probability=probability, grid_error=error)
        else:
            yield replace(empty, name=name, median=line[0], beta=line[1])


def _lognormal(curve: BlockCurve, top: float) -> tuple[float, float] | None:
    """Return median and standard deviation of ln of a lognormal function; None for any other.

    Its normal score is straight in ln x; near 1 scores have few digits.
    """
    covered = (curve.p >= LEAST) & (curve.u <= math.log(top))
    u, p = curve.u[covered], curve.p[covered]
    middle = p < 1.0 - 1e-5
    if middle.sum() < 3 or p[0] > FLOOR:  # one that begins with a jump is none
        return None
    slope, intercept = np.polyfit(u[middle], ndtri(p[middle]), 1)
    if slope <= 0.0 or np.abs(ndtr(intercept + slope * u) - p).max() >= _STRAIGHT:
        return None
    return float(np.exp(-intercept / slope)), float(1.0 / slope)


DRAWS = 20_000
"""Draws of what the blocks share: probabilities have a standard error of at most 0.0035."""

_VALUES_AT_ONCE = 2**22
_SHARE_LEVELS = 1001
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
            "it with dependence to enough earthquakes, or choose another model"
        )
    numbers = {"p2": p2, "kr": kr}
    meaning = component_named(component)
    kind, curves = curves_of(numbers, measure, chosen, [name], meaning.sigma)
    curve_of_each = [(ndtri(curve.p), curve.u) for curve in curves]
    blocks = Placement.of_blocks(chosen, numbers)
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
    u = np.linspace(ends.min() - 1e-9, ends.max() + 1e-9, _SHARE_LEVELS)
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
