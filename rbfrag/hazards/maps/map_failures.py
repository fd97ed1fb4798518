"""Joint failures of the blocks of a shaking map in one earthquake, by Monte Carlo simulation.

The residual of the logarithm of a measure at a site is

    ε = σ [√β B + √(1-β) W(x)] + s ξ

with σ the map's standard deviation there, B common to the earthquake, W(x) the within-event
residual with the spatial correlation of Jayaram and Baker (2009), and s ξ the scatter of a single
component, independent from site to site. Residuals of several measures at a place correlate as in
:func:`rbfrag.fragility.shaking.correlation`; they share the range of the first. Given the
shaking the blocks fail by the copula of the model that answers, so that every block's P is the mean
that :func:`rbfrag.hazards.maps.site_probability.site_probability` integrates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from rbfrag.errors import InputError
from rbfrag.fragility.joint import UNKNOWN, Placement
from rbfrag.fragility.prediction import array_answer
from rbfrag.fragility.shaking_points import correlations
from rbfrag.hazards.maps.site_probability import SiteProbability
from rbfrag.hazards.maps.site_shaking import SiteShaking
from rbfrag.hazards.maps.spatial_field import SpatialField, correlation_range_km
from rbfrag.hazards.standing_blocks import COPULA, normals_by_law
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import exact_percent
from rbfrag.solver.results import FloatArray

Indices = NDArray[np.intp]

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

DRAWS, MOST_DRAWS = 100, 10_000
"""Draws where none are asked for: as many as `_VALUES` allow of the blocks drawn, in this range."""

_VALUES = 5_000_000
_FEWEST, _MOST = 10, 1_000_000
_VALUES_AT_ONCE, _RESIDUALS_AT_ONCE = 2_000_000, 12_000_000


@dataclass(frozen=True)
class Failures:
    """Number of failures under one dependence model.

    Args:
        probability_any: probability that at least one fails.
        p05: number that is not exceeded with probability 0.05.
        p50: the same of 0.5.
        p95: the same of 0.95.
    """

    probability_any: float
    p05: float
    p50: float
    p95: float

    KEYS: ClassVar[tuple[str, ...]] = (
        "failures_p05", "failures_p50", "failures_p95", "probability_any"
    )  # fmt: skip

    def as_dict(self) -> dict[str, float]:
        """Return the numbers under the keys of the JSON contract."""
        values = (self.p05, self.p50, self.p95, self.probability_any)
        return dict(zip(self.KEYS, values, strict=True))


@dataclass(frozen=True, eq=False)
class MapFailures:
    """Failures of all blocks of a map in its earthquake.

    Args:
        expected: their expected number, Σ w P.
        by_law: what is drawn, by law: the model's copula, or, where it has none, both bounds.
        range_km: range of the correlation of the shaking [km]; None where it is taken as certain.
        drawn: weighted number of failures in each draw by law, shape (draws,).
    """

    expected: float
    by_law: Mapping[str, Failures]
    range_km: float | None
    drawn: Mapping[str, FloatArray]

    @property
    def draws(self) -> int:
        """Number of draws."""
        return next(iter(self.drawn.values())).size

    def as_dict(self) -> dict[str, object]:
        """Return the numbers under the keys of the JSON contract."""
        failures = self.by_law.get(COPULA)
        numbers = dict.fromkeys(Failures.KEYS) if failures is None else failures.as_dict()
        bounds = (
            {}
            if failures
            else {name.replace(" ", "_"): law.as_dict() for name, law in self.by_law.items()}
        )
        return {
            "expected_failures": self.expected,
            **numbers,
            "joint_law": "bounds" if failures is None else COPULA,
            **({"bounds": bounds} if bounds else {}),
            "draws": self.draws,
        }

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


@dataclass(frozen=True, eq=False)
class SiteLocations:
    """Coordinates of sites, and the groups that form one site for the blocks.

    Args:
        lon: longitudes [deg], shape (n,).
        lat: latitudes [deg], shape (n,).
        group: numbers of what is one site, shape (n,).
    """

    lon: FloatArray
    lat: FloatArray
    group: Indices

    @classmethod
    def of(
        cls, lon: FloatArray, lat: FloatArray, names: NDArray[np.object_] | None = None
    ) -> SiteLocations:
        """Return locations grouped into sites by name, or else within 0.001° (100 m).

        Args:
            lon: longitudes [deg], shape (n,).
            lat: latitudes [deg], shape (n,).
            names: names of their sites, shape (n,), or None.
        """
        if names is None:
            cells = np.rint(np.column_stack([lon, lat]) / _SAME_SITE_DEG).astype(np.int64)
            group = np.unique(cells, axis=0, return_inverse=True)[1]
        else:
            group = np.unique(names.astype(str), return_inverse=True)[1]
        return cls(lon, lat, np.asarray(group, dtype=np.intp))

    def only(self, chosen: Indices) -> SiteLocations:
        """Return a selection of the locations."""
        return SiteLocations(self.lon[chosen], self.lat[chosen], self.group[chosen])


def map_failures(
    answer: SiteProbability,
    numbers: Mapping[str, FloatArray],
    locations: SiteLocations,
    *,
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
        weight: how many blocks each one stands for, shape (m,); None for 1.
        draws: number of draws, 10 or more; None for 100, and for more where blocks are few.
        between: β, 0 to 1.
        range_km: range of the within-event correlation [km]; None for that of the first measure
            that the model reads (:func:`~rbfrag.hazards.maps.spatial_field.correlation_range_km`).
        on_progress: called with (draws done, draws in all).

    Raises:
        InputError: a number of draws, a seed or a share that makes no sense.
    """
    # Joint failures on a map: residuals of the shaking are drawn as a spatially correlated field
    # plus a between-event term, then blocks by the dependence model at their site.
    columns = answer.shaking.model.method.block.filled(numbers)
    weights = np.ones(next(iter(columns.values())).size) if weight is None else weight
    expected = answer.pair_probability * weights[answer.block]
    pairs = _worth_drawing(expected)
    site, blocks = answer.site[pairs], answer.block[pairs]
    draws = _number(draws, site.size)
    if not 0.0 <= between <= 1.0:
        raise InputError(
            f"between = {between:g}: a fraction of the variance must be between 0 and 1"
        )
    if seed < 0:
        raise InputError(f"seed = {seed}: give 0 or more")
    if range_km is None:
        range_km = correlation_range_km(answer.shaking.names[0])
    used, site_index = np.unique(site, return_inverse=True)
    residuals = _Residuals(answer.shaking, used, locations.only(used), between, range_km)
    model, block_numbers = (
        answer.shaking.model,
        {n: values[blocks] for n, values in columns.items()},
    )
    where = Placement.of_numbers(
        model.method.block, block_numbers, site=locations.group[site], polarity=UNKNOWN
    )
    laws = normals_by_law(model.dependence, where, site.size)
    generator = np.random.default_rng(seed)
    drawn = {name: np.zeros(draws) for name in laws}
    any_fails = {name: np.zeros(draws, dtype=np.bool_) for name in laws}
    block_columns = {name: values[:, None] for name, values in block_numbers.items()}
    at_once = max(1, _VALUES_AT_ONCE // max(site.size, 1))
    start = 0
    for logs in residuals.in_parts(draws if site.size else 0, at_once, generator):
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
    by_law = {
        name: Failures(
            # the frequency, between bounds that hold for every law
            float(np.clip(any_fails[name].mean(), *bounds)),
            *(float(q) for q in np.quantile(counts, QUANTILES, method="inverted_cdf")),
        )
        for name, counts in drawn.items()
    }
    is_uncertain = bool(answer.shaking.integrated)
    return MapFailures(float(expected.sum()), by_law, range_km if is_uncertain else None, drawn)


def _number(draws: int | None, blocks: int) -> int:
    if draws is None:
        return min(max(DRAWS, _VALUES // max(blocks, 1)), MOST_DRAWS)
    if not _FEWEST <= draws <= _MOST:
        raise InputError(f"draws = {draws}: give {_FEWEST} to {_MOST}")
    return draws


def _worth_drawing(expected: FloatArray) -> Indices:
    """Return the indices of the most probable failures, all but `LEFT_OUT` of the sum."""
    order = np.argsort(expected, kind="stable")
    below = np.cumsum(expected[order])
    first = int(np.searchsorted(below, LEFT_OUT * below[-1])) if below.size else 0
    return np.sort(order[first:])


class _Residuals:
    """Sampler of residuals of the logarithms of the measures at sites."""

    def __init__(
        self,
        shaking: SiteShaking,
        site: Indices,
        locations: SiteLocations,
        between: float,
        range_km: float,
    ) -> None:
        self._deviations = shaking.deviations[site]
        self._scatter = shaking.scatter
        self._parts = np.sqrt(between), np.sqrt(1.0 - between)
        self._factor = np.linalg.cholesky(correlations(shaking.names))
        self._field = (
            SpatialField(locations.lon, locations.lat, range_km) if shaking.integrated else None
        )
        self._group = np.unique(locations.group, return_inverse=True)[1]

    def in_parts(
        self, draws: int, at_once: int, generator: np.random.Generator
    ) -> Iterator[FloatArray]:
        """Yield residuals of a few draws at a time; a field costs little more for many draws."""
        many = max(at_once, _RESIDUALS_AT_ONCE // max(self._deviations.size, 1))
        for start in range(0, draws, many):
            logs = self.draw(min(many, draws - start), generator)
            for first in range(0, logs.shape[1], at_once):
                yield logs[:, first : first + at_once]

    def draw(self, count: int, generator: np.random.Generator) -> FloatArray:
        """Return residuals, shape (sites, count, k)."""
        n, k = self._deviations.shape
        logs = np.zeros((n, count, k))
        if self._field is not None:
            between_scale, within_scale = self._parts
            event = between_scale * generator.standard_normal((count, k))
            within = self._field.draw(count * k, generator).reshape(n, count, k)
            logs += (event + within_scale * within) @ self._factor.T * self._deviations[:, None]
        if self._scatter > 0.0:
            xi = generator.standard_normal((int(self._group.max(initial=-1)) + 1, count))
            logs += self._scatter * xi[self._group][:, :, None]
        return logs
