"""Joint failures of the blocks of a shaking map in one earthquake, by Monte Carlo simulation.

The residual of the logarithm of a measure at a site is

    ε = σ [√β B + √(1-β) W(x)] + s ξ

with σ the map's standard deviation there, B common to the earthquake, W(x) the within-event
residual with the spatial correlation of Jayaram and Baker (2009), and s ξ the scatter of a single
component, independent from site to site. Residuals of several measures at a place correlate as in
:func:`rbfrag.fragility.shaking.correlation`; they share the range of the first. Given the
shaking the blocks fail by the copula of the model that answers, so that every block's P is the mean
that :func:`rbfrag.hazards.map_probability.site_probability` integrates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import UNKNOWN, Placement
from rbfrag.fragility.joint_sampling import JointSampler
from rbfrag.fragility.prediction import array_answer
from rbfrag.fragility.uncertain import correlations
from rbfrag.hazards.joint_rate import COPULA, DEPENDENT, INDEPENDENT
from rbfrag.hazards.map_probability import SiteProbability, SiteShaking
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import exact_percent
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.spectral import period_of

Indices = NDArray[np.intp]

EARTH_RADIUS_KM = 6371.0

NEIGHBOURS = 40
"""Places that the value at another one is drawn from."""

_NUGGET = 1e-9
"""Added to the diagonal of the correlations of neighbours, which may lie very close."""

_SOLVED_AT_ONCE = 2**21
"""Numbers of the matrices that are solved at once."""

_PERIODS_S = {"pgv_m_s": 1.0, "pga_g": 0.0}
"""Period whose range is that of a measure [s]; of PGV by usage, for PGV goes with SA(1 s)."""


def correlation_range_km(measure: str) -> float:
    """Return the range b of the within-event residual of a measure's logarithm [km].

        ρ(h) = exp(-3h/b),   b = 8.5 + 17.2 T  for T < 1 s,   b = 22.0 + 3.7 T  for T ≥ 1 s

    Jayaram, N. & Baker, J. W. (2009): Correlation model for spatially distributed ground-motion
    intensities. Earthquake Engineering & Structural Dynamics 38(15), 1687-1708, equations 17 to
    20, below 1 s for regions where Vs30 does not cluster. PGA is taken at T = 0, PGV at T = 1 s,
    b = 25.7 km.

    Args:
        measure: name in :func:`rbfrag.predict`, such as ``pgv_m_s``.
    """
    period = period_of(measure)
    period = _PERIODS_S[measure] if period is None else period
    return 22.0 + 3.7 * period if period >= 1.0 else 8.5 + 17.2 * period


class SpatialField:
    """Standard normal random fields with the correlation exp(-3h/b) at given locations.

    The value at a place is drawn given those at the nearest `NEIGHBOURS` of the places that stand
    before it in a random order: the approximation of Vecchia, A. V. (1988), Journal of the Royal
    Statistical Society B 50(2), 297-312. It is exact up to as many places; of thousands the
    correlations are right to 0.01, in the mean to 0.001. Cost and memory grow with the number of
    places alone.

    Args:
        lon: longitudes [deg], shape (n,); equal places have equal values.
        lat: latitudes [deg], shape (n,).
        range_km: b [km], at which the correlation is 0.05; above zero.
    """

    def __init__(self, lon: FloatArray, lat: FloatArray, range_km: float) -> None:
        coordinates, self._of = np.unique(np.column_stack([lon, lat]), axis=0, return_inverse=True)
        # the order belongs to the approximation, not to the draws
        self._order = np.random.default_rng(0).permutation(len(coordinates))
        points = on_sphere(*coordinates[self._order].T)
        self._neighbours = _earlier_neighbours(points)
        self._weight, self._new = _conditionals(points, self._neighbours, range_km)

    def draw(self, count: int, generator: np.random.Generator) -> FloatArray:
        """Return independent fields, shape (n, count)."""
        value = generator.standard_normal((self._order.size, count))
        value *= self._new[:, None]
        for i in range(1, self._order.size):
            k = min(i, NEIGHBOURS)
            value[i] += self._weight[i, :k] @ value[self._neighbours[i, :k]]
        field = np.empty_like(value)
        field[self._order] = value
        return np.asarray(field[self._of])


def on_sphere(lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Return locations as points on a sphere [km], shape (n, 3)."""
    x, y = np.radians(lon), np.radians(lat)
    around = np.cos(y)
    return EARTH_RADIUS_KM * np.column_stack([around * np.cos(x), around * np.sin(x), np.sin(y)])


def _earlier_neighbours(points: FloatArray) -> Indices:
    """Return the nearest preceding points of each point, shape (n, NEIGHBOURS).

    Of point i only the first min(i, NEIGHBOURS) count.
    """
    from scipy.spatial import KDTree

    n = len(points)
    neighbours = np.zeros((n, NEIGHBOURS), dtype=np.intp)
    for i in range(1, min(n, NEIGHBOURS + 1)):
        neighbours[i, :i] = np.arange(i)
    start = NEIGHBOURS + 1
    while start < n:
        # of the points before a doubled end at least half stand before each of the second half
        end = min(2 * start, n)
        tree, waiting, count = KDTree(points[:end]), np.arange(start, end), 4 * NEIGHBOURS
        while waiting.size:
            near = np.asarray(tree.query(points[waiting], k=min(count, end))[1])
            before = near < waiting[:, None]
            enough = before.sum(axis=1) >= NEIGHBOURS
            first = np.argsort(~before[enough], axis=1, kind="stable")[:, :NEIGHBOURS]
            neighbours[waiting[enough]] = np.take_along_axis(near[enough], first, axis=1)
            waiting, count = waiting[~enough], 2 * count
        start = end
    return neighbours


def _conditionals(
    points: FloatArray, neighbours: Indices, range_km: float
) -> tuple[FloatArray, FloatArray]:
    """Return the weights of the neighbours, and the conditional standard deviations."""
    weight, new = np.zeros(neighbours.shape), np.ones(len(points))
    # points with the same number of neighbours: the first ones one by one, the rest in batches
    n, step = len(points), _SOLVED_AT_ONCE // NEIGHBOURS**2
    batches = [(np.array([i]), i) for i in range(1, min(n, NEIGHBOURS))]
    batches += [
        (np.arange(start, min(start + step, n)), NEIGHBOURS) for start in range(NEIGHBOURS, n, step)
    ]
    for rows, k in batches:
        near = points[neighbours[rows, :k]]
        between = _correlation(near[:, :, None] - near[:, None, :], range_km)
        between[:, np.arange(k), np.arange(k)] += _NUGGET
        there = _correlation(near - points[rows][:, None], range_km)
        weight[rows, :k] = np.linalg.solve(between, there[:, :, None])[:, :, 0]
        explained = (weight[rows, :k] * there).sum(axis=1)
        new[rows] = np.sqrt(np.maximum(1.0 - explained, 0.0))
    return weight, new


def _correlation(apart: FloatArray, range_km: float) -> FloatArray:
    """Return exp(-3h/b) of vectors; the chord h of 100 km is a metre shorter than the arc."""
    h = np.sqrt(np.einsum("...i,...i->...", apart, apart))
    return np.asarray(np.exp(-3.0 / range_km * h))


BETWEEN = 0.346**2 / (0.346**2 + 0.552**2)
"""β, the share of the map's variance that is taken as between-event, 0.28.

That of PGV for M ≥ 5.5 of Boore, D. M., Stewart, J. P., Seyhan, E. & Atkinson, G. M. (2014):
NGA-West2 equations for predicting PGA, PGV, and 5% damped PSA for shallow crustal earthquakes.
Earthquake Spectra 30(3), 1057-1085 (τ = 0.346, φ = 0.552). A ShakeMap states the total deviation
alone. Where many stations recorded the earthquake, its B is nearly known and less is shared; the
deviation itself, which is conditional on the stations, is then smaller near them.
"""

LEFT_OUT = 1e-4
"""Part of the expected failures that the least probable blocks may hold and not be drawn."""

QUANTILES = (0.05, 0.5, 0.95)
FAILURES = ("failures_p05", "failures_p50", "failures_p95", "probability_any")

DRAWS, MOST_DRAWS = 100, 10_000
"""Draws where none are asked for: as many as `_VALUES` allow of the blocks drawn, in this range."""

_VALUES = 5_000_000
_FEWEST, _MOST = 10, 1_000_000
_VALUES_AT_ONCE, _RESIDUALS_AT_ONCE = 2_000_000, 12_000_000


Normals = Callable[[int, np.random.Generator], FloatArray]
"""Draws standard normals of some blocks, shape (draws, n)."""


def normals_by_law(law: Dependence | None, where: Placement | None, n: int) -> dict[str, Normals]:
    """Return samplers of the standard normals of n blocks in one earthquake, by dependence model.

    Args:
        law: the copula; None where it is not known, which leaves the bounds.
        where: the blocks; None where they have no size.
        n: their number.
    """
    if law is not None and where is not None:
        return {COPULA: JointSampler(law, where).normals}
    return {
        DEPENDENT: lambda draws, generator: np.broadcast_to(
            generator.standard_normal((draws, 1)), (draws, n)
        ),
        INDEPENDENT: lambda draws, generator: generator.standard_normal((draws, n)),
    }


@dataclass(frozen=True, eq=False)
class MapFailures:
    """Failures of all blocks of a map in its earthquake.

    Args:
        expected: their expected number, Σ w P.
        by_law: by law (the model's copula, or, where it has none, both bounds) the probability
            that any fails, and numbers that are not exceeded with a probability of 5, 50 and 95 %,
            under the keys of the JSON contract.
        range_km: range of the correlation of the shaking [km]; None where it is taken as certain.
        drawn: weighted number of failures in each draw by law, shape (draws,).
    """

    expected: float
    by_law: Mapping[str, Mapping[str, float]]
    range_km: float | None
    drawn: Mapping[str, FloatArray]

    @property
    def draws(self) -> int:
        """Number of draws."""
        return next(iter(self.drawn.values())).size

    def as_dict(self) -> dict[str, object]:
        """Return the numbers under the keys of the JSON contract."""
        document: dict[str, object] = {"expected_failures": self.expected}
        if COPULA in self.by_law:
            document |= {**self.by_law[COPULA], "joint_law": COPULA}
        else:
            bounds = {name.replace(" ", "_"): numbers for name, numbers in self.by_law.items()}
            document |= {**dict.fromkeys(FAILURES), "joint_law": "bounds", "bounds": bounds}
        return {**document, "draws": self.draws}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the assumptions behind these numbers."""
        warnings = []
        if self.range_km is not None:
            text = (
                f"failures and probability_any take {exact_percent(BETWEEN)} of the variance of "
                "the map's values as common to the earthquake, and the rest as correlated over "
                f"{self.range_km:g} km (Jayaram and Baker 2009)"
            )
            warnings.append(Diagnostic(text, "spatial_correlation"))
        if COPULA not in self.by_law:
            text = (
                "what the blocks share in one earthquake is not known to this model: bounds has "
                "both under full dependence and if they fail independently"
            )
            warnings.append(Diagnostic(text, "unknown_dependence"))
        return tuple(warnings)


_SAME_SITE_DEG = 0.001


def group_sites(
    lon: FloatArray, lat: FloatArray, names: NDArray[np.object_] | None = None
) -> Indices:
    """Return the number of the site of each place, by name, or else within 0.001° (100 m)."""
    if names is None:
        cells = np.rint(np.column_stack([lon, lat]) / _SAME_SITE_DEG).astype(np.int64)
        return np.asarray(np.unique(cells, axis=0, return_inverse=True)[1], dtype=np.intp)
    return np.asarray(np.unique(names.astype(str), return_inverse=True)[1], dtype=np.intp)


def map_failures(
    answer: SiteProbability,
    numbers: Mapping[str, FloatArray],
    lon: FloatArray,
    lat: FloatArray,
    *,
    site_names: NDArray[np.object_] | None = None,
    weight: FloatArray | None = None,
    draws: int | None = None,
    seed: int = 0,
    between: float = BETWEEN,
    range_km: float | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> MapFailures:
    """Return the number of blocks that fail together, for unknown azimuths.

    Args:
        numbers: what the model read of the blocks, by field, shape (m,) each.
        lon: longitudes of the sites of the answer [deg], shape (n,).
        lat: their latitudes [deg].
        site_names: names of what is one site for the blocks, shape (n,); None for places within
            0.001°.
        weight: how many blocks each one stands for, shape (m,); None for 1.
        draws: number of draws, 10 or more; None for 100, and for more where blocks are few.
        between: β, 0 to 1.
        range_km: range of the within-event correlation [km]; None for that of the first measure
            that the model reads (:func:`~rbfrag.hazards.map_failures.correlation_range_km`).
        on_progress: called with (draws done, draws in all).

    Raises:
        InputError: a number of draws, a seed or a share that makes no sense.
    """
    # Joint failures on a map: residuals of the shaking are drawn as a spatially correlated field
    # plus a between-event term, then blocks by the dependence model at their site.
    columns = answer.shaking.model.method.block.filled(numbers)
    weights = np.ones(next(iter(columns.values())).size) if weight is None else weight
    expected = answer.pair_probability * weights[answer.block]
    # the most probable failures, all but `LEFT_OUT` of the sum
    order = np.argsort(expected, kind="stable")
    below = np.cumsum(expected[order])
    first = int(np.searchsorted(below, LEFT_OUT * below[-1])) if below.size else 0
    pairs = np.sort(order[first:])
    site, blocks = answer.site[pairs], answer.block[pairs]
    if draws is None:
        draws = min(max(DRAWS, _VALUES // max(site.size, 1)), MOST_DRAWS)
    elif not _FEWEST <= draws <= _MOST:
        raise InputError(f"draws = {draws}: give {_FEWEST} to {_MOST}")
    if not 0.0 <= between <= 1.0:
        raise InputError(
            f"between = {between:g}: a fraction of the variance must be between 0 and 1"
        )
    if seed < 0:
        raise InputError(f"seed = {seed}: give 0 or more")
    if range_km is None:
        range_km = correlation_range_km(answer.shaking.names[0])
    used, site_index = np.unique(site, return_inverse=True)
    group = group_sites(lon, lat, site_names)
    model, block_numbers = (
        answer.shaking.model,
        {n: values[blocks] for n, values in columns.items()},
    )
    where = Placement.of_blocks(model, block_numbers, site=group[site], polarity=UNKNOWN)
    laws = normals_by_law(model.dependence, where, site.size)
    generator = np.random.default_rng(seed)
    drawn = {name: np.zeros(draws) for name in laws}
    any_fails = {name: np.zeros(draws, dtype=np.bool_) for name in laws}
    block_columns = {name: values[:, None] for name, values in block_numbers.items()}
    at_once = max(1, _VALUES_AT_ONCE // max(site.size, 1))
    start = 0
    sites = used, lon[used], lat[used], group[used]
    for logs in _residuals(
        answer.shaking, sites, between, range_km, draws if site.size else 0, at_once, generator
    ):
        count = logs.shape[1]
        part = slice(start, start + count)
        start += count
        shaken = answer.shaking.shaken(used, logs)
        values = {name: measure[site_index] for name, measure in shaken.items()}
        prediction = array_answer(model, {**block_columns, **values}, interval=False)
        for name, normals in laws.items():
            fails = ndtr(normals(count, generator).T) <= prediction.probability
            drawn[name][part] = weights[blocks] @ fails
            any_fails[name][part] = fails.any(axis=0)
        if on_progress is not None:
            on_progress(start, draws)
    counted = answer.pair_probability[expected > 0.0]
    bounds = float(counted.max(initial=0.0)), min(float(counted.sum()), 1.0)
    by_law = {}
    for name, counts in drawn.items():
        ends = np.quantile(counts, QUANTILES, method="inverted_cdf").tolist()
        # the frequency, between bounds that hold for every law
        p_any = float(np.clip(any_fails[name].mean(), *bounds))
        by_law[name] = dict(zip(FAILURES, (*ends, p_any), strict=True))
    is_uncertain = bool(answer.shaking.integrated)
    return MapFailures(float(expected.sum()), by_law, range_km if is_uncertain else None, drawn)


def _residuals(
    shaking: SiteShaking,
    sites: tuple[Indices, FloatArray, FloatArray, Indices],
    between: float,
    range_km: float,
    draws: int,
    at_once: int,
    generator: np.random.Generator,
) -> Iterator[FloatArray]:
    """Yield residuals of the logarithms of the measures, a few draws at a time, (sites, draws, k).

    Args:
        sites: indices of the sites, their longitudes and latitudes [deg], and the numbers of what
            is one site for the blocks.
    """
    site, lon, lat, group = sites
    deviations = shaking.deviations[site]
    n, k = deviations.shape
    factor = np.linalg.cholesky(correlations(shaking.names))
    field = SpatialField(lon, lat, range_km) if shaking.integrated else None
    group = np.unique(group, return_inverse=True)[1]
    # a field costs little more for many draws
    many = max(at_once, _RESIDUALS_AT_ONCE // max(deviations.size, 1))
    for start in range(0, draws, many):
        count = min(many, draws - start)
        logs = np.zeros((n, count, k))
        if field is not None:
            event = np.sqrt(between) * generator.standard_normal((count, k))
            within = field.draw(count * k, generator).reshape(n, count, k)
            logs += (event + np.sqrt(1.0 - between) * within) @ factor.T * deviations[:, None]
        if shaking.scatter > 0.0:
            xi = generator.standard_normal((int(group.max(initial=-1)) + 1, count))
            logs += shaking.scatter * xi[group][:, :, None]
        for first in range(0, count, at_once):
            yield logs[:, first : first + at_once]
