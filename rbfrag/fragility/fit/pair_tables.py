"""Tables of the pairwise log likelihood of blocks over their correlation.

Each pair adds its log likelihood, at every R of the table, to that of its earthquake and cell: what
the two share, and how far apart they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import ndtr

from rbfrag.solver.results import FloatArray

Indices = NDArray[np.intp]

KINDS = OTHER_SITE, OTHER_COMPONENT, SAME_COMPONENT = (0, 1, 2)
"""Kinds of pairs: of different sites, of the two components of a site, of one component."""

MOST_PAIRS = 40_000
"""Pairs of one kind and earthquake; of more as many are drawn at random, and count for all."""

ANGLES = np.linspace(-1.0, 1.0, 41) * np.arcsin(0.999)
"""asin R of the tables."""

_PANEL_NODES, _PANEL_WEIGHTS = np.polynomial.legendre.leggauss(3)
_AT_ONCE = 2**16
_MOST_CELLS = 2000


@dataclass(frozen=True, eq=False)
class PairRows:
    """Blocks with their outcomes, as the pairwise likelihood uses them; indices without gaps.

    Args:
        bound: Φ⁻¹(P) of the prediction without the block's earthquake, shape (n,).
        side: +1 where it failed, -1 where not, shape (n,).
        earthquake: number of the earthquake, shape (n,).
        site: number of the recording within all, shape (n,).
        component: number of the component within all, shape (n,).
        polarity: +1 or -1, shape (n,).
        l: ln of p, p in 1/s, shape (n,).
        ln_y: ln of y, y in m/s, shape (n,).
    """

    bound: FloatArray
    side: FloatArray
    earthquake: Indices
    site: Indices
    component: Indices
    polarity: FloatArray
    l: FloatArray  # noqa: E741  the symbol of the formula
    ln_y: FloatArray


@dataclass(frozen=True, eq=False)
class PairTable:
    """Log likelihoods of pairs of one kind over R, summed by earthquake and cell.

    Args:
        distance_l: D of each cell, shape (c,).
        distance_y: d of each cell, shape (c,).
        sign: product of the polarities in each cell, shape (c,).
        event: number of each earthquake that has pairs, shape (g,).
        value: log likelihood at R = sin of `ANGLES`, shape (g, c, angles).
    """

    distance_l: FloatArray
    distance_y: FloatArray
    sign: FloatArray
    event: Indices
    value: FloatArray
    pairs: int

    def likelihood(self, times: FloatArray) -> Callable[[FloatArray], float]:
        """Return the log likelihood of all pairs by R of the cells; earthquakes are weighted by
        `times`.
        """
        total = np.tensordot(times[self.event], self.value, axes=1)
        spline = CubicSpline(ANGLES, total.T)
        cell = np.arange(total.shape[0])
        step = ANGLES[1] - ANGLES[0]

        def value(r: FloatArray) -> float:
            angle = np.arcsin(np.clip(r, -0.999, 0.999))
            at = np.clip(((angle - ANGLES[0]) / step).astype(np.intp), 0, ANGLES.size - 2)
            x = angle - ANGLES[at]
            c = spline.c[:, at, cell]
            return float((((c[0] * x + c[1]) * x + c[2]) * x + c[3]).sum())

        return value


def pair_table(rows: PairRows, kind: int, generator: np.random.Generator) -> PairTable:
    """Return the table of the pairs of one of `KINDS`; a random sample where pairs are too many."""
    parts = [*_pairs(rows, kind, generator)]
    if not parts:
        nothing = np.empty(0)
        return PairTable(nothing, nothing, nothing, np.empty(0, np.intp), np.empty((0, 0, 0)), 0)
    event, i, j, weight = (np.concatenate(part) for part in zip(*parts, strict=True))
    d_l = np.abs(rows.l[i] - rows.l[j])
    # beyond a component neither y nor polarity counts
    is_component = kind == SAME_COMPONENT
    d_y = np.abs(rows.ln_y[i] - rows.ln_y[j]) if is_component else np.zeros(i.size)
    sign = rows.polarity[i] * rows.polarity[j] if is_component else np.zeros(i.size)
    cell, count = _cells(d_l, d_y, sign)
    number = np.bincount(cell, minlength=count)
    middle_l, middle_y, side = (
        np.bincount(cell, v, minlength=count) / number for v in (d_l, d_y, sign)
    )
    events, place = np.unique(event, return_inverse=True)
    value = np.zeros((events.size * count, ANGLES.size))
    target = place * count + cell
    order = np.argsort(target, kind="stable")
    for start in range(0, order.size, _AT_ONCE):
        chunk = order[start : start + _AT_ONCE]
        log_likelihood = _log_likelihoods(rows, i[chunk], j[chunk]) * weight[chunk]
        at, first = np.unique(target[chunk], return_index=True)
        value[at] += np.add.reduceat(log_likelihood, first, axis=1).T
    value = value.reshape(events.size, count, ANGLES.size)
    return PairTable(middle_l, middle_y, side, events, value, int(event.size))


def _pairs(
    rows: PairRows, kind: int, generator: np.random.Generator
) -> Iterator[tuple[Indices, Indices, Indices, FloatArray]]:
    """Yield the earthquake, both rows and the weight of the pairs of one kind, by earthquake."""
    for number in np.unique(rows.earthquake):
        members = np.flatnonzero(rows.earthquake == number)
        if kind == SAME_COMPONENT:
            i, j = _within(members, rows.component)
        elif kind == OTHER_COMPONENT:
            i, j = _within(members, rows.site)
            unlike = rows.component[i] != rows.component[j]
            i, j = i[unlike], j[unlike]
        else:
            i, j = _across(members, rows.site, generator)
        if i.size:
            total = _number_across(rows.site[members]) if kind == OTHER_SITE else i.size
            if i.size > MOST_PAIRS:
                sample = generator.choice(i.size, size=MOST_PAIRS, replace=False)
                i, j = i[sample], j[sample]
            yield np.full(i.size, number), i, j, np.full(i.size, total / i.size)


def _within(rows: Indices, label: Indices) -> tuple[Indices, Indices]:
    """Return all pairs of rows with the same label."""
    first, second = [rows[:0]], [rows[:0]]
    for name in np.unique(label[rows]):
        members = rows[label[rows] == name]
        i, j = np.triu_indices(members.size, k=1)
        first.append(members[i])
        second.append(members[j])
    return np.concatenate(first), np.concatenate(second)


def _across(
    rows: Indices, site: Indices, generator: np.random.Generator
) -> tuple[Indices, Indices]:
    """Return pairs of rows with different labels: all, or a random sample of `MOST_PAIRS`."""
    n = rows.size
    if n * (n - 1) // 2 <= 2 * MOST_PAIRS:
        i, j = np.triu_indices(n, k=1)
    else:
        i, j = generator.integers(n, size=(2, 2 * MOST_PAIRS))
    i, j = rows[i], rows[j]
    unlike = site[i] != site[j]
    return i[unlike][:MOST_PAIRS], j[unlike][:MOST_PAIRS]


def _number_across(label: Indices) -> float:
    number = np.bincount(label).astype(np.float64)
    return float(number.sum() ** 2 - number @ number) / 2.0


def _cells(d_l: FloatArray, d_y: FloatArray, sign: FloatArray) -> tuple[Indices, int]:
    """Return the cell of each pair, by distance, and the number of cells."""
    width = 1e-6
    while True:
        steps = [np.rint(d_l / width).astype(np.int64), np.rint(d_y / width).astype(np.int64)]
        code = (steps[0] * (steps[1].max() + 1) + steps[1]) * 3 + sign.astype(np.int64) + 1
        codes, cell = np.unique(code, return_inverse=True)
        if codes.size <= _MOST_CELLS:
            return cell.astype(np.intp), int(codes.size)
        width = max(2.0 * width, 0.01)


def _log_likelihoods(rows: PairRows, i: Indices, j: Indices) -> FloatArray:
    """Return ln P of the joint outcomes at every R of the table, shape (angles, n)."""
    side = rows.side[i] * rows.side[j]
    a, b = rows.side[i] * rows.bound[i], rows.side[j] * rows.bound[j]
    squares, product = 0.5 * (a * a + b * b), a * b * side
    half = 0.5 * (ANGLES[1] - ANGLES[0])
    panels = np.empty((ANGLES.size - 1, i.size))
    for k, middle in enumerate(ANGLES[:-1] + half):
        total = np.zeros(i.size)
        for node, weight in zip(_PANEL_NODES, _PANEL_WEIGHTS, strict=True):
            sine = np.sin(middle + half * node)
            total += weight * np.exp((product * sine - squares) / (1.0 - sine * sine))
        panels[k] = total * (half / (2.0 * np.pi))
    # Φ₂ grows from its value at R = 0, which is the product; Φ₂ of both sides with their signs
    grown = np.concatenate([np.zeros((1, i.size)), np.cumsum(panels, axis=0)])
    grown -= grown[ANGLES.size // 2]
    return np.asarray(np.log(np.maximum(ndtr(a) * ndtr(b) + side * grown, 1e-12)))
