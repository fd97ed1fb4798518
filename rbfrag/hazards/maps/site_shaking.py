"""Uncertain shaking at many sites in one earthquake, as the predictors of a model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.measures import SCATTERED
from rbfrag.fragility.model import FragilityModel
from rbfrag.question.components import Component
from rbfrag.solver.results import FloatArray


@dataclass(frozen=True, eq=False)
class SiteShaking:
    """Single-component measures at n sites, with lognormal uncertainty.

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
        """Return the shaking of :func:`rbfrag.hazards.maps.site_probability.site_probability`."""
        names = model.term.inputs
        # each measure varies by its own; one without is taken as certain
        sigmas = {name: std_ln[name] for name in names if name in std_ln}
        nothing = np.zeros(measures[names[0]].size)
        return cls(
            model=model,
            median=np.stack([measures[name] / component.ratio(name) for name in names], axis=-1),
            deviations=np.stack([sigmas.get(name, nothing) for name in names], axis=-1),
            scatter=component.sigma,
            integrated=tuple(sigmas),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the measures."""
        return self.model.term.inputs

    def inputs_at(self, site: NDArray[np.intp]) -> dict[str, FloatArray]:
        """Return the medians by name, and their dispersions, at selected sites."""
        return {
            **{name: self.median[site, i] for i, name in enumerate(self.names)},
            **{
                sigma: self.deviations[site, self.names.index(name)]
                for sigma, name in SCATTERED.items()
                if name in self.integrated
            },
            **({"amplification_sigma": np.array([self.scatter])} if self.scatter else {}),
        }

    def shaken(self, site: NDArray[np.intp], logs: FloatArray) -> dict[str, FloatArray]:
        """Return the measures by name for residuals of their logarithms, (sites, points, k)."""
        return {
            name: self.median[site, None, i] * np.exp(logs[:, :, i])
            for i, name in enumerate(self.names)
        }
