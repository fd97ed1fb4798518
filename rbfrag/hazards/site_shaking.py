"""The shaking at many sites in one earthquake, as a model reads it, and what is not known of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards.conversions import Component
from rbfrag.hazards.correlations import correlations
from rbfrag.solver.results import FloatArray


@dataclass(frozen=True, eq=False)
class SiteShaking:
    """Measures of single components at n sites, whose logarithms are normal.

    Args:
        model: the model that reads them.
        median: medians of the measures that it reads, in its order, shape (n, k).
        deviations: standard deviations of their logarithms at a site as they are known, shape
            (n, k); zero where the value is taken as certain.
        scatter: standard deviation of ln(single component/definition), common to all measures.
        integrated: the measures that have deviations.
    """

    model: FragilityModel
    median: FloatArray
    deviations: FloatArray
    scatter: float
    integrated: tuple[str, ...]

    @classmethod
    def of(
        cls,
        measures: Mapping[str, FloatArray],
        component: Component,
        std_ln: Mapping[str, FloatArray],
        model: FragilityModel,
    ) -> SiteShaking:
        """Return the shaking of :func:`rbfrag.hazards.site_probability.site_probability`."""
        names = model.term.inputs
        given = {name: std_ln[name] for name in names if name in std_ln}
        nothing = np.zeros(measures[names[0]].size)
        return cls(
            model=model,
            median=np.stack([measures[name] / component.ratio for name in names], axis=-1),
            deviations=np.stack([given.get(name, nothing) for name in names], axis=-1),
            scatter=component.scatter,
            integrated=tuple(given),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """The measures."""
        return self.model.term.inputs

    @cached_property
    def factors(self) -> FloatArray:
        """Lower factors of the covariances of the logarithms, shape (n, k, k)."""
        own = correlations(self.names) * self.deviations[:, :, None] * self.deviations[:, None, :]
        return _cholesky(own + self.scatter**2)

    def at(self, site: NDArray[np.intp], scores: FloatArray) -> dict[str, FloatArray]:
        """Return measures by name, shape (sites, points), at normal scores, shape (points, k)."""
        logs = self.factors[site] @ scores.T
        return self.shaken(site, np.moveaxis(logs, 1, -1))

    def shaken(self, site: NDArray[np.intp], logs: FloatArray) -> dict[str, FloatArray]:
        """Return measures by name with residuals of their logarithms, shape (sites, points, k)."""
        return {
            name: self.median[site, None, i] * np.exp(logs[:, :, i])
            for i, name in enumerate(self.names)
        }


def _cholesky(covariance: FloatArray) -> FloatArray:
    """Return lower factors of covariances that may be singular, shape (n, k, k)."""
    n, k, _ = covariance.shape
    factor = np.zeros((n, k, k))
    for i in range(k):
        for j in range(i + 1):
            rest = covariance[:, i, j] - np.einsum("sm,sm->s", factor[:, i, :j], factor[:, j, :j])
            if i == j:
                factor[:, i, i] = np.sqrt(np.maximum(rest, 0.0))
            else:
                pivot = factor[:, j, j]
                factor[:, i, j] = np.divide(rest, pivot, out=np.zeros(n), where=pivot > 0.0)
    return factor
