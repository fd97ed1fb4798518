"""Estimation of the Gaussian copula of failures in one earthquake from outcomes, by pairwise
likelihood.

Pairwise likelihood. For a pair with probabilities P_i, P_j that were predicted without its
earthquake, the copula gives the chance of what both did as a function of R alone. Each pair adds
its log likelihood, at every R of a table, to that of its earthquake and cell: what the two share,
and how far apart they are. The parameters come from these tables, and those of every resample of
earthquakes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, astuple, dataclass
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize
from scipy.special import ndtr, ndtri

from rbfrag.errors import FitError, InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.method import BlockParameters
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

REPLICATES = 60
LEAST_P, GREATEST_P = 0.02, 0.98
"""Pairs of blocks whose P lies between: others say little, and their P may be wrong."""

FEWEST_EVENTS = 10
FEWEST_PAIRS = 200
"""Of each kind of pair, below which nothing is estimated."""

LENGTHS = (0.05, 10.0)
"""Range of the lengths: the data reach over differences of 3, where longer ones look alike."""

_SHARED_MOST = 0.98


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
        if kind == OTHER_SITE:  # all, or a random sample of `MOST_PAIRS`
            n, of_site = members.size, np.bincount(rows.site[members]).astype(np.float64)
            total = float(of_site.sum() ** 2 - of_site @ of_site) / 2.0
            if n * (n - 1) // 2 <= 2 * MOST_PAIRS:
                i, j = members[np.stack(np.triu_indices(n, k=1))]
            else:
                i, j = members[generator.integers(n, size=(2, 2 * MOST_PAIRS))]
            unlike = rows.site[i] != rows.site[j]
            i, j = i[unlike][:MOST_PAIRS], j[unlike][:MOST_PAIRS]
        else:
            i, j = _within(members, rows.component if kind == SAME_COMPONENT else rows.site)
            if kind == OTHER_COMPONENT:
                unlike = rows.component[i] != rows.component[j]
                i, j = i[unlike], j[unlike]
            total = float(i.size)
            if i.size > MOST_PAIRS:
                sample = generator.choice(i.size, size=MOST_PAIRS, replace=False)
                i, j = i[sample], j[sample]
        if i.size:
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


class ObservedBlocks(TypedDict):
    """Blocks with their outcomes, for the estimation of a dependence model; arrays of shape (n,).

    Args:
        probability: P of each block, predicted without its earthquake.
        failed: 1 where it failed, 0 where not, NaN where that is not known.
        earthquake: labels.
        site: labels of the recordings within an earthquake.
        component: labels of the horizontal components within a recording.
        p2: squared frequency parameter p² [1/s²].
        y_m_s: toppling velocity k_r g/p [m/s].
    """

    probability: ArrayLike
    failed: ArrayLike
    earthquake: ArrayLike
    site: ArrayLike
    component: ArrayLike
    polarity: ArrayLike
    p2: ArrayLike
    y_m_s: ArrayLike


def estimate_dependence(
    *, replicates: int = REPLICATES, seed: int = 0, **blocks: Unpack[ObservedBlocks]
) -> dict[str, Any]:
    """Estimate the copula of failures from predictions and outcomes.

    Earthquake and site (ρ_e, ρ_s, λ_e) come from pairs of different components, what components
    share from pairs of one component; ρ_v is what is left of 1. Every pair counts the same. Where
    an earthquake has more than 40,000 pairs of a kind, as many are drawn at random and weighted.

    Args:
        replicates: number of resamples of earthquakes for the standard errors; 0 for none.
        seed: seed of the resamples and of pairs that are drawn.

    Returns:
        What a model stores, JSON-able: the parameters of :class:`Dependence` by name, their
        standard ``errors`` from resamples of earthquakes, the numbers of ``earthquakes`` and of
        ``pairs`` (of other sites, other components of a site, the same component), and settings.

    Raises:
        InputError: columns differ in length.
        FitError: too few earthquakes or pairs; the message says which.
    """
    tables = PairTables.of(seed=seed, **blocks)
    estimate, events = tables.likeliest(), tables.earthquakes.size
    generator = np.random.default_rng(seed)
    resampled = []
    for _ in range(replicates):
        times = np.bincount(generator.integers(events, size=events), minlength=events)
        resampled.append(astuple(tables.likeliest(times.astype(np.float64), start=estimate)))
    scatter = np.std(resampled, axis=0, ddof=1).tolist() if replicates > 1 else []
    parameters = asdict(estimate)
    return {
        **parameters,
        "errors": dict(zip(parameters, scatter, strict=bool(scatter))),
        "earthquakes": events,
        "pairs": [tables.far.pairs, tables.near.pairs, tables.component.pairs],
        "replicates": replicates,
        "seed": seed,
    }


def observed_blocks(data: FitData, block: BlockParameters, held_out: FloatArray) -> ObservedBlocks:
    """Return the blocks of a fit with their outcomes, within the fitted range of strength.

    Blocks without a size count as those of one size, their strength as their velocity. Of blocks
    that differ in more than size and strength those are read that have the most of it.

    Args:
        block: what describes its blocks.
        held_out: probabilities of the blocks of the grid without their earthquake, shape (n, m).

    Raises:
        FitError: it is not known which motions are of one site.
    """
    if data.recording is None:
        raise FitError("the motions have no recordings: their components are unknown")
    shape = data.failed.shape

    def broadcast(column: NDArray[np.generic]) -> NDArray[np.generic]:
        return np.broadcast_to(column[:, None], shape).ravel()

    size = np.ones(shape) if block.size is None else data.grid(block.size)
    strength = data.grid("y_m_s" if "y_m_s" in data.blocks else block.strength)
    alike = np.ones(shape[0], dtype=np.bool_)
    for name in block.stored:
        alike &= data.values[name] == data.values[name].max()
    return ObservedBlocks(
        probability=held_out.ravel(),
        failed=np.where(data.read & alike[:, None], data.failed, np.nan).ravel(),
        earthquake=broadcast(data.event),
        site=broadcast(data.recording),
        component=broadcast(data.motion),
        polarity=broadcast(data.polarity),
        p2=size.ravel(),
        y_m_s=strength.ravel(),
    )


@dataclass(frozen=True, eq=False)
class PairTables:
    """Pairwise likelihood of all pairs, tabulated for repeated maximisation.

    Args:
        earthquakes: their labels in the order of their numbers.
        far: of pairs of different sites.
        near: of pairs of the components of one site.
        component: of pairs of one component.
    """

    earthquakes: NDArray[np.str_]
    far: PairTable
    near: PairTable
    component: PairTable

    @classmethod
    def of(cls, *, seed: int = 0, **blocks: Unpack[ObservedBlocks]) -> PairTables:
        """Return the tables of all pairs (see `estimate_dependence`)."""
        numeric = (blocks["probability"], blocks["failed"], blocks["polarity"], blocks["p2"],
                   blocks["y_m_s"])  # fmt: skip
        nested = blocks["earthquake"], blocks["site"], blocks["component"]
        real = [np.asarray(column, dtype=np.float64) for column in numeric]
        labels = [np.asarray(column).astype(str) for column in nested]
        if len({column.shape for column in (*real, *labels)}) != 1 or real[0].ndim != 1:
            raise InputError("the columns that a dependence is estimated from differ in length")
        p, did, side, size, y = real
        read = np.isfinite(did) & (p > LEAST_P) & (p < GREATEST_P) & (size > 0.0) & (y > 0.0)
        names = np.unique(labels[0][read])
        numbers: list[Indices] = []
        for column in labels:  # each within the one before
            codes = np.unique(column[read], return_inverse=True)[1].astype(np.intp)
            within = numbers[-1] * (codes.max(initial=0) + 1) + codes if numbers else codes
            numbers.append(np.unique(within, return_inverse=True)[1].astype(np.intp))
        rows = PairRows(
            bound=np.asarray(ndtri(p[read])),
            side=np.where(did[read] > 0.5, 1.0, -1.0),
            earthquake=numbers[0],
            site=numbers[1],
            component=numbers[2],
            polarity=side[read],
            l=0.5 * np.log(size[read]),
            ln_y=np.log(y[read]),
        )
        generator = np.random.default_rng(seed)
        pair_tables = (pair_table(rows, kind, generator) for kind in KINDS)
        tables = cls(names, *pair_tables)
        for name, table in (
            ("other sites", tables.far),
            ("the two components of a site", tables.near),
            ("one component", tables.component),
        ):
            if table.pairs < FEWEST_PAIRS or table.event.size < FEWEST_EVENTS:
                raise FitError(
                    f"the dependence of failures requires {FEWEST_PAIRS} pairs of blocks of "
                    f"{name} in {FEWEST_EVENTS} earthquakes: there are {table.pairs} in "
                    f"{table.event.size}; add recordings of more earthquakes, with several sites "
                    "and both horizontal components"
                )
        return tables

    def likeliest(
        self, times: FloatArray | None = None, start: Dependence | None = None
    ) -> Dependence:
        """Return the parameters that maximise the pairwise likelihood.

        Args:
            times: how often each earthquake counts, shape of `earthquakes`; None for once.
            start: where the search begins; None for several places.
        """
        counted = np.ones(self.earthquakes.size) if times is None else times
        rho_e, rho_s, l_e = _shared(self.far, self.near, counted, start)
        share, l_v, l_o, l_y = _within_component(
            self.component, counted, start, (rho_e + rho_s, l_e)
        )
        rho_o = (1.0 - rho_e - rho_s) * share
        rho_v = max(0.0, 1.0 - rho_e - rho_s - rho_o)
        return Dependence(rho_e, rho_s, rho_v, rho_o, l_e, l_v, l_o, l_y)


def _shared(
    far: PairTable, near: PairTable, times: FloatArray, start: Dependence | None
) -> tuple[float, float, float]:
    """Return the maximum-likelihood ρ_e, ρ_s and λ_e."""
    of_far, of_near = far.likelihood(times), near.likelihood(times)

    def shares(x: FloatArray) -> tuple[float, float, float]:
        e = _SHARED_MOST * float(x[0])
        return e, (_SHARED_MOST - e) * float(x[1]), float(np.exp(x[2]))

    def loss(x: FloatArray) -> float:
        e, s, length = shares(x)
        at_far, at_near = (np.exp(-table.distance_l / length) for table in (far, near))
        return -of_far(e * at_far) - of_near((e + s) * at_near)

    starts = [(0.1, 0.2, 0.0), (0.05, 0.05, 1.0)]
    if start is not None:
        remaining = _SHARED_MOST - start.rho_e
        starts = [(start.rho_e / _SHARED_MOST, start.rho_s / remaining, float(np.log(start.l_e)))]
    return shares(_least(loss, starts, 2))


def _within_component(
    table: PairTable, times: FloatArray, start: Dependence | None, shared: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Return the maximum-likelihood ρ_o (as a fraction of the remaining variance), λ_v, λ_o and
    λ_y.

    Args:
        table: of pairs of one component.
        times: how often each earthquake counts.
        start: where the search begins.
        shared: ρ_e + ρ_s and λ_e.
    """
    of_own, remaining = table.likelihood(times), 1.0 - shared[0]
    shared_part = shared[0] * np.exp(-table.distance_l / shared[1])

    def loss(x: FloatArray) -> float:
        l_v, l_o, l_y = np.exp(x[1:])  # of a component
        symmetric = (1.0 - x[0]) * np.exp(-table.distance_l / l_v)
        antisymmetric = table.sign * x[0] * np.exp(-table.distance_l / l_o)
        return -of_own(
            shared_part + remaining * (symmetric + antisymmetric) * np.exp(-table.distance_y / l_y)
        )

    starts = [(0.6, 0.9, 1.6, -0.6), (0.6, -0.5, 2.0, -0.6), (0.5, 1.0, -0.4, -1.0)]
    if start is not None:
        share = start.rho_o / max(start.rho_o + start.rho_v, 1e-9)
        l_v, l_o, l_y = np.log([start.l_v, start.l_o, start.l_y]).tolist()
        starts = [(share, l_v, l_o, l_y)]
    # blocks run in one polarity alone do not tell what changes its sign with it: nothing does
    most = 1.0 if (table.sign < 0.0).any() else 0.0
    x = _least(loss, starts, 1, most)
    l_v, l_o, l_y = np.exp(x[1:]).tolist()
    return float(x[0]), l_v, l_o, l_y


def _least(
    loss: Callable[[FloatArray], float],
    starts: Sequence[Sequence[float]],
    shares: int,
    most: float = 1.0,
) -> FloatArray:
    """Minimise a function of fractions and log lengths, from several starting points.

    Args:
        starts: where the search begins.
        shares: how many of its arguments are shares.
        most: greatest share.
    """
    low, high = (float(np.log(length)) for length in LENGTHS)
    bounds = [(0.0, most) if k < shares else (low, high) for k in range(len(starts[0]))]
    scale = 1e4 / max(1.0, abs(loss(np.asarray(starts[0]))))

    def scaled(x: FloatArray) -> float:
        return scale * loss(x)

    minima = [minimize(scaled, np.array(start, float), bounds=bounds) for start in starts]
    return np.asarray(min(minima, key=lambda minimum: float(minimum.fun)).x, dtype=np.float64)
