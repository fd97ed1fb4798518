"""Estimation of the Gaussian copula of failures in one earthquake from outcomes, by pairwise
likelihood.

Pairwise likelihood. For a pair with probabilities P_i, P_j that were predicted without its
earthquake, the copula gives the chance of what both did as a function of R alone. These are kept as
tables (:mod:`rbfrag.fragility.fit.pair_tables`), from which the parameters come, and those of every
resample of earthquakes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize
from scipy.special import ndtri

from rbfrag.errors import FitError, InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.fit.pair_tables import KINDS, PairRows, PairTable, pair_table
from rbfrag.fragility.method import BlockParameters
from rbfrag.solver.results import FloatArray

Indices = NDArray[np.intp]

REPLICATES = 60
LEAST_P, GREATEST_P = 0.02, 0.98
"""Pairs of blocks whose P lies between: others say little, and their P may be wrong."""

FEWEST_EVENTS = 10
FEWEST_PAIRS = 200
"""Of each kind of pair, below which nothing is estimated."""

LENGTHS = (0.05, 10.0)
"""Range of the lengths: the data reach over differences of 3, where longer ones look alike."""

_SHARED_MOST = 0.98


@dataclass(frozen=True)
class DependenceEstimate:
    """An estimated copula.

    Args:
        errors: standard error of each by its name, from resamples of earthquakes.
        earthquakes: number of earthquakes with pairs.
        pairs: number of pairs read of other sites, other components of a site, same component.
        seed: seed of resamples and of the pairs drawn.
    """

    dependence: Dependence
    errors: dict[str, float]
    earthquakes: int
    pairs: tuple[int, int, int]
    replicates: int
    seed: int


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
) -> DependenceEstimate:
    """Estimate the copula of failures from predictions and outcomes.

    Earthquake and site (ρ_e, ρ_s, λ_e) come from pairs of different components, what components
    share from pairs of one component; ρ_v is what is left of 1. Every pair counts the same. Where
    an earthquake has more than 40,000 pairs of a kind, as many are drawn at random and weighted.

    Args:
        replicates: number of resamples of earthquakes for the standard errors; 0 for none.
        seed: seed of the resamples and of pairs that are drawn.

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
    names = [field.name for field in fields(Dependence)]
    return DependenceEstimate(
        dependence=estimate,
        errors=dict(zip(names, scatter, strict=bool(scatter))),
        earthquakes=events,
        pairs=(tables.far.pairs, tables.near.pairs, tables.component.pairs),
        replicates=replicates,
        seed=seed,
    )


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
        tables._reject_few()
        return tables

    def _reject_few(self) -> None:
        for name, table, fewest in (
            ("other sites", self.far, FEWEST_EVENTS),
            ("the two components of a site", self.near, FEWEST_EVENTS),
            ("one component", self.component, FEWEST_EVENTS),
        ):
            if table.pairs < FEWEST_PAIRS or table.event.size < fewest:
                raise FitError(
                    f"the dependence of failures requires {FEWEST_PAIRS} pairs of blocks of "
                    f"{name} in {fewest} earthquakes: there are {table.pairs} in "
                    f"{table.event.size}; add recordings of more earthquakes, with several sites "
                    "and both horizontal components"
                )

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
