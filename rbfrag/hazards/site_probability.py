"""The probability of failure at many sites whose shaking is known with uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.prediction import array_answer
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.uncertain import normal_steps
from rbfrag.hazards.conversions import Component
from rbfrag.hazards.site_shaking import SiteShaking
from rbfrag.question.fields import AnsweringFields, V
from rbfrag.question.keywords import LEVEL, BlockKeywords, model_for, parts_of
from rbfrag.solver.results import FloatArray

Indices = NDArray[np.intp]

REACH = 4.0
"""Standard deviations of the shaking that are integrated over, to both sides."""

NOTHING = 1e-9
"""Where even the strongest of these has a smaller probability, zero is answered."""

_SILENT = (2.0, 0.0, -2.0)
"""Scores of the first measure below which is not integrated where nothing fails at one of them."""

_STEP = 0.2
"""Greatest step in ln PGV: fragilities are wider."""

_CHUNK = 400_000

_MOST_GRID, _SOBOL_POWER = 2, 10
"""Most variables that a grid of points is laid over, and the power of two that draw more."""


@dataclass(frozen=True, eq=False)
class SiteProbability:
    """Probabilities at n sites.

    Args:
        probability: P at each site, the mean over the blocks of a class, shape (n,).
        ci_low: lower end of its interval, as far as the data tell the parameters of the model.
        ci_high: upper end.
        in_domain: whether every block and the site's shaking lie in the ranges fitted.
        level: confidence level.
        shaking: what the model reads of the shaking, and its scatter.
        site: sites of the pairs of site and block of which any can fail, shape (k,).
        block: their blocks.
        each: P of each pair.
    """

    probability: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    in_domain: NDArray[np.bool_]
    level: float
    shaking: SiteShaking
    site: Indices
    block: Indices
    each: FloatArray


class _Question(BlockKeywords[V], AnsweringFields, total=False):
    """What is asked of blocks at sites."""


def site_probability(
    measures: Mapping[str, FloatArray],
    *numbers: FloatArray,
    component: Component,
    weight: FloatArray | None = None,
    own_block: bool = False,
    std_ln: Mapping[str, FloatArray] | None = None,
    **question: Unpack[_Question[FloatArray]],
) -> SiteProbability:
    """Return probabilities at sites, integrated over what is not known of the shaking.

    The best model that the measures suffice for reads its own of them. Their logarithms at a site
    are taken as normal about those of the given values, with the given standard deviations and the
    correlations of :func:`~rbfrag.hazards.correlations.correlation`; to these the scatter of a
    single component about the stated definition is added, common to all.

    Args:
        measures: what is known of the shaking at the sites, by the names of
            :func:`rbfrag.predict` (pgv_m_s [m/s], pga_g and sa10_g [g], …), each of shape (n,).
        numbers: p2 [1/s²] and kr of the blocks, shape (m,), or (n,) with `own_block`, if they are
            not given by name.
        weight: weights of the blocks of a class, shape (m,); None for equal ones.
        own_block: every site has its own block; otherwise all blocks stand at every site.
        std_ln: standard deviations of the measures' logarithms by name, shape (n,); a measure
            without one is taken as certain.
        question: the numbers of blocks that their one kind reads, NaN of an option for the
            blocks' own, and model, level and db as in :func:`rbfrag.predict`.
    """
    given, answering = parts_of(numbers, question, BlockKeywords, AnsweringFields)
    kind, level = given.pop("kind", None), answering.get("level", LEVEL)
    shaking = SiteShaking.of(
        measures, component, std_ln or {}, model_for(answering, (*given, *measures), kind)
    )
    columns = shaking.model.method.block.filled(given)
    size = next(iter(columns.values())).size
    chosen, n = shaking.model, shaking.median.shape[0]
    weights = np.full(size, 1.0) if weight is None else weight
    weights = np.ones(n) if own_block else weights / weights.sum()
    blocks = 1 if own_block else size
    across = bool(shaking.integrated)
    widest = float(shaking.factors[:, 0, 0].max(initial=0.0))
    # a first measure that is certain beside others that are not
    widest = widest or float(shaking.deviations.max(initial=0.0))

    def answers(site: Indices, block: Indices, points: FloatArray) -> PredictionArray:
        """Return answers for pairs of site and block at normal scores, shape (pairs, points)."""
        own = {name: values[block, None] for name, values in columns.items()}
        return array_answer(chosen, {**own, **shaking.at(site, points)}, level)

    k = len(shaking.names)
    in_domain = np.empty(n, dtype=bool)
    median_point = np.zeros((1, k))
    strong = median_point if widest == 0.0 else _strongest(k, across=across)
    alive = []
    for sites in _chunks(np.arange(n), _CHUNK // (blocks * len(strong))):
        site = np.repeat(sites, blocks)
        block = site if own_block else np.tile(np.arange(blocks), sites.size)
        # the median answers for the domain, the strongest shaking for what can fail at all
        median = answers(site, block, median_point)
        in_domain[sites] = median.in_domain.reshape(-1, blocks).all(axis=1)
        strongest = np.nan_to_num(answers(site, block, strong).ci_high, nan=np.inf).max(axis=1)
        alive.append(np.stack([site, block])[:, strongest > NOTHING])
    site, block = np.concatenate(alive, axis=1)
    points, both = median_point, np.ones(1)
    silent = np.full(site.size, -np.inf)
    if widest > 0.0:
        points, both = _points(k, widest, across=across)
        for score in _SILENT:  # the highest of these at which nothing fails yet
            for some in _chunks(np.flatnonzero(silent == -np.inf), _CHUNK // len(strong)):
                strong[:, 0] = score
                most = np.nan_to_num(answers(site[some], block[some], strong).ci_high, nan=np.inf)
                silent[some[most.max(axis=1) <= NOTHING]] = score
    each = np.zeros((3, site.size))
    for score in np.unique(silent):
        above = points[:, 0] > score
        for some in _chunks(np.flatnonzero(silent == score), _CHUNK // int(above.sum())):
            answer = answers(site[some], block[some], points[above])
            each[0, some] = answer.probability @ both[above]
            each[1, some] = answer.ci_low @ both[above]
            each[2, some] = answer.ci_high @ both[above]
    probability, low, high = (
        np.bincount(site, row * weights[block], n).astype(np.float64) for row in each
    )
    return SiteProbability(
        probability, low, high, in_domain, level, shaking, site, block, each=each[0]
    )


def _chunks(places: NDArray[np.intp], size: int) -> list[NDArray[np.intp]]:
    return [places[i : i + max(size, 1)] for i in range(0, places.size, max(size, 1))]


def _strongest(k: int, *, across: bool) -> FloatArray:
    """Return scores of the strongest shaking, the first measure at its reach, shape (points, k)."""
    others = np.array(list(product((-3.0, 0.0, 3.0) if across else (0.0,), repeat=k - 1)))
    return np.column_stack([np.full(len(others), REACH), others])


def _points(k: int, widest: float, *, across: bool) -> tuple[FloatArray, FloatArray]:
    """Return points of k standard normal variables, shape (points, k), and their weights.

    One variable is taken in equal steps, a second in five; four and more are drawn by a sequence of
    low discrepancy (Sobol), whose mean is good to some thousandths of P.

    Args:
        widest: greatest standard deviation that the first one stands for.
        across: False where the others do not vary beside the first.
    """
    if k > _MOST_GRID and across:
        from scipy.stats import norm, qmc

        sobol = qmc.Sobol(k, scramble=True, rng=np.random.default_rng(0))
        drawn = norm.ppf(sobol.random_base2(_SOBOL_POWER))
        return drawn, np.full(len(drawn), 1.0 / len(drawn))
    count = 2 * math.ceil(REACH * widest / _STEP) + 1
    x, wx = normal_steps(min(max(count, 9), 65), REACH)
    y, wy = normal_steps(5 if k > 1 and across else 1, 3.0)
    points = np.zeros((x.size * y.size, k))
    points[:, 0] = np.repeat(x, y.size)
    points[:, 1:2] = np.tile(y, x.size)[:, None]
    return points, np.repeat(wx, y.size) * np.tile(wy, x.size)
