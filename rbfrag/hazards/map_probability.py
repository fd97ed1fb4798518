"""Probability of failure at many sites with uncertain shaking."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.confidence import quantiles_of
from rbfrag.fragility.measures import SIGMAS
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.fragility.prediction_array import predict_many
from rbfrag.fragility.shaking import Scatter, with_uncertain_velocity
from rbfrag.fragility.uncertain import GroundMotionQuadrature, UncertainModel
from rbfrag.question.components import Component
from rbfrag.question.fields import AnsweringFields, BlockKeywords, V
from rbfrag.question.keywords import LEVEL, model_for, parts_of
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import ANSWERING, BLOCKS


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
        """Return the shaking of :func:`rbfrag.hazards.map_probability.site_probability`."""
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
                SIGMAS[name]: self.deviations[site, self.names.index(name)]
                for name in self.integrated
            },
            **({"amplification_sigma": np.array([self.scatter])} if self.scatter else {}),
        }

    def shaken(self, site: NDArray[np.intp], logs: FloatArray) -> dict[str, FloatArray]:
        """Return the measures by name for residuals of their logarithms, (sites, points, k)."""
        return {
            name: self.median[site, None, i] * np.exp(logs[:, :, i])
            for i, name in enumerate(self.names)
        }


Indices = NDArray[np.intp]

NOTHING = 1e-9
"""Where certain shaking has a smaller probability, zero is answered."""

_STRONGEST, RARE = 4.8, 1e-5
"""Where P is smaller at this score of the first measure, zero is answered: 8e-7 of the shaking is
stronger."""

_SILENT = (3.0, 1.5, 0.0, -1.5)
"""Scores of the first measure below which is not integrated where nothing fails at one of them."""

_CHUNK = 100_000


@dataclass(frozen=True, eq=False)
class SiteProbability:
    """Failure probabilities at n sites.

    Args:
        probability: P at each site, the mean over the blocks of a class, shape (n,).
        ci_low: lower end of its confidence interval (parameters of the model).
        ci_high: upper end.
        in_domain: whether every block and the site's shaking lie in the ranges fitted.
        level: confidence level.
        shaking: what the model reads of the shaking, and its scatter.
        site: sites of the pairs of site and block of which any can fail, shape (k,).
        block: their blocks.
        pair_probability: P of each pair.
    """

    probability: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    in_domain: NDArray[np.bool_]
    level: float
    shaking: SiteShaking
    site: Indices
    block: Indices
    pair_probability: FloatArray


class _Question(BlockKeywords[V], AnsweringFields, total=False):
    """Keywords of the blocks at sites, with model, level and database."""


def site_probability(
    measures: Mapping[str, FloatArray],
    *numbers: FloatArray,
    component: Component,
    weight: FloatArray | None = None,
    own_block: bool = False,
    std_ln: Mapping[str, FloatArray] | None = None,
    **question: Unpack[_Question[FloatArray]],
) -> SiteProbability:
    """Return failure probabilities at sites, integrated over the uncertainty of the shaking.

    The best model that the measures suffice for reads its own of them. Their logarithms at a site
    are taken as normal about those of the given values, with the given standard deviations and the
    correlations of :func:`~rbfrag.fragility.shaking.correlation`; to these the scatter of a
    single component about the stated definition is added, common to all.

    Args:
        measures: what is known of the shaking at the sites, by the names of
            :func:`rbfrag.predict` (pgv_m_s [m/s], pga_g and sa(1) [g], …), each of shape (n,).
        numbers: p2 [1/s²] and kr of the blocks, shape (m,), or (n,) with `own_block`, if they are
            not given by name.
        weight: weights of the blocks of a class, shape (m,); None for equal ones.
        own_block: every site has its own block; otherwise all blocks stand at every site.
        std_ln: standard deviations of the measures' logarithms by name, shape (n,); where one that
            the model uses is missing all values are assumed to be exact, except PGA in
            addition to PGV.
        question: the numbers of blocks that their one kind reads, NaN of an option for the
            blocks' own, and model, level and db as in :func:`rbfrag.predict`.
    """
    inputs, answering = parts_of(numbers, question, BLOCKS, ANSWERING)
    kind, level = inputs.pop("kind", None), answering.get("level", LEVEL)
    shaking = SiteShaking.of(
        measures, component, std_ln or {}, model_for(answering, (*inputs, *measures), kind)
    )
    columns = shaking.model.method.block.filled(inputs)
    size = next(iter(columns.values())).size
    chosen, n = shaking.model, shaking.median.shape[0]
    weights = np.full(size, 1.0) if weight is None else weight
    weights = np.ones(n) if own_block else weights / weights.sum()
    blocks = 1 if own_block else size
    of_measures, _ = Scatter.of(chosen.term, shaking.inputs_at(np.arange(n)))

    def scattered(site: Indices, block: Indices) -> tuple[Scatter | None, dict[str, FloatArray]]:
        pairs = {
            **{name: values[block] for name, values in columns.items()},
            **shaking.inputs_at(site),
        }
        return (
            (None, pairs)
            if of_measures is None
            else with_uncertain_velocity(chosen, of_measures, pairs)
        )

    def pairs_of(site: Indices, block: Indices) -> dict[str, FloatArray]:
        """Return block parameters and shaking for pairs of site and block."""
        return scattered(site, block)[1]

    scatter, _ = scattered(np.zeros(1, dtype=np.intp), np.zeros(1, dtype=np.intp))

    # P = E[P(block | im)] over ln im ~ N(median, σ). Most pairs are clear: where even the median
    # fails with certainty or a strong deviation with no probability, fewer points suffice.
    in_domain = np.empty(n, dtype=bool)
    pairs: dict[float, list[Indices]] = {}
    for sites in _chunks(np.arange(n), _CHUNK // blocks):
        site = np.repeat(sites, blocks)
        block = site if own_block else np.tile(np.arange(blocks), sites.size)
        inputs = pairs_of(site, block)
        measures = {name: inputs[name] for name in (*columns, *shaking.names)}
        median = array_answer(chosen, measures, level, interval=False)
        in_domain[sites] = median.in_domain.reshape(-1, blocks).all(axis=1)
        both = np.stack([site, block])
        if scatter is None:
            pairs.setdefault(-np.inf, []).append(both[:, ~(median.probability <= NOTHING)])
            continue
        points = GroundMotionQuadrature(chosen, scatter)
        for score in (_STRONGEST, *_SILENT):  # the highest of these at which nothing fails yet
            fails = points.fails_at(
                pairs_of(*both), score, RARE if score == _STRONGEST else NOTHING
            )
            if score < _STRONGEST:
                pairs.setdefault(score, []).append(both[:, ~fails])
            both = both[:, fails]
        pairs.setdefault(-np.inf, []).append(both)
    answers = [(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp), *np.empty((3, 0)))]
    for score, pair_parts in pairs.items():
        site, block = np.concatenate(pair_parts, axis=1)
        model = chosen
        if scatter is not None:
            points = GroundMotionQuadrature(chosen, scatter, score)
            model = UncertainModel.over(chosen, points=points, judged=False)
        for part in _chunks(np.arange(site.size), _CHUNK):
            answer = predict_many(
                model, pairs_of(site[part], block[part]), quantiles_of(level),
                interval=True, reject_nan=False,
            )  # fmt: skip
            answers.append(
                (site[part], block[part], answer.probability, answer.ci_low, answer.ci_high)
            )
    site, block, *estimates = (np.concatenate(column) for column in zip(*answers, strict=True))
    probability, low, high = (
        np.bincount(site, row * weights[block], n).astype(np.float64) for row in estimates
    )
    return SiteProbability(
        probability,
        low,
        high,
        in_domain,
        level,
        shaking,
        site,
        block,
        pair_probability=estimates[0],
    )


def _chunks(indices: NDArray[np.intp], size: int) -> list[NDArray[np.intp]]:
    return [indices[i : i + max(size, 1)] for i in range(0, indices.size, max(size, 1))]
