"""Blocks of one site, the model that answers for them, and a table of their P over the shaking."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, UnknownModelError
from rbfrag.fragility.joint import UNKNOWN, Placement
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.uncertain import normal_steps
from rbfrag.fragility.unusable import refuse_elements
from rbfrag.hazards.annual_rate import Fragility
from rbfrag.hazards.curve import CurveKeywords, HazardCurve
from rbfrag.hazards.shaking import LevelShaking
from rbfrag.question.answers import block_reasons_of, blocks_of_arrays
from rbfrag.question.blocks import NUMBERS
from rbfrag.question.fields import AnsweringFields, BlockFields, V
from rbfrag.question.keywords import LEVEL, BlockKeywords, model_for
from rbfrag.solver.results import FloatArray
from rbfrag.solver.scatter import fraction, lognormal

TABLE_STEP, SMOOTH_STEP = 0.01, 0.02
"""Greatest step of ln x between the nodes of a table of P, as it is and smoothed by scatter."""

FEWEST_NODES = 65

ALL_STAND = "that all of them stand is the question"
"""Why blocks of which one cannot be used are refused."""

_SIGMA_POINTS, _SIGMA_REACH = 15, 5.0
_ALWAYS = 2
"""Size and strength have their points even where certain: what else scatters does not move them."""
_AT_ONCE, _BLOCKS_AT_ONCE = 400_000, 512


def _slices(size: int, most: int) -> Iterator[slice]:
    for start in range(0, size, max(1, most)):
        yield slice(start, start + max(1, most))


@dataclass(frozen=True, eq=False)
class ProbabilityTable:
    """Probabilities on equal steps of ln x, cubics through four nodes between them.

    Args:
        low: ln x of the first node.
        step: step of ln x.
        values: probabilities, shape (..., nodes), an odd number of nodes.
    """

    low: float
    step: float
    values: FloatArray

    @property
    def nodes(self) -> FloatArray:
        """ln x of the nodes."""
        return np.asarray(self.low + self.step * np.arange(self.values.shape[-1]))

    def rows(self) -> FloatArray:
        """Return the probabilities, shape (rows, nodes)."""
        return self.values.reshape(-1, self.values.shape[-1])

    def mass(self, curve: HazardCurve) -> FloatArray:
        """Return how often a year shaking is about each node [1/a], what is beyond at the last."""
        nodes, last = self.nodes, np.log(curve.levels[-1])
        edges = np.append(nodes - 0.5 * self.step, nodes[-1] + 0.5 * self.step)
        mass = -np.diff(curve.rate_from(np.minimum(edges, last)))
        mass[1:-1] -= np.diff(mass, 2) / 24.0  # from what is in a cell to what is at its node
        ends = np.maximum(1.0 - np.abs(nodes - last) / self.step, 0.0)
        return np.asarray(mass + float(curve.annual_rate[-1]) * ends)

    @property
    def fine(self) -> Fragility:
        """The probabilities at levels of the curve's measure, rows x levels."""
        return lambda levels: self._at(levels, 1)

    @property
    def coarse(self) -> Fragility:
        """The same from every second node: what it differs by tells the error of the table."""
        return lambda levels: self._at(levels, 2)

    def _at(self, levels: FloatArray, stride: int) -> FloatArray:
        table = self.rows()[:, ::stride]
        x = (np.log(levels) - self.low) / (self.step * stride)
        x = np.clip(x, 0.0, table.shape[1] - 1.0)
        first = np.clip(np.floor(x).astype(np.intp) - 1, 0, table.shape[1] - 4)
        t = x - first
        result = np.zeros((table.shape[0], levels.size))
        for node in range(4):  # Lagrange's cubic
            others = [other for other in range(4) if other != node]
            weight = np.prod([(t - other) / (node - other) for other in others], axis=0)
            result += weight * table[:, first + node]
        return np.clip(result, 0.0, 1.0, out=result)


class RateKeywords(BlockKeywords[V], CurveKeywords, AnsweringFields, total=False):
    """What blocks are asked about under hazard curves, and by which model."""


class ModelPart(NamedTuple):
    """Blocks that one model answers for.

    Args:
        places: where they stand among all, shape (m,).
        numbers: what the model reads of them, by field, shape (m,) each.
    """

    places: NDArray[np.intp]
    numbers: Mapping[str, FloatArray]
    model: FragilityModel


def parts_by_model(
    given: Mapping[str, Any], measure: str, answering: AnsweringFields
) -> tuple[list[ModelPart], tuple[str, ...], NDArray[np.object_]]:
    """Return blocks by the model that answers for them.

    Returns:
        The parts, what is to be said of the blocks, and of each why it cannot be used, empty for
        those that can.

    Raises:
        InputError: blocks that are described twice or in part, or are of one kind without a model.
        UnknownModelError: no model of that name, or of the one kind that there is.
    """
    blocks, whole = blocks_of_arrays(given)
    reason = block_reasons_of(blocks, whole)
    parts = []
    for group in blocks.groups:
        places = np.arange(whole) if group.places is None else group.places
        try:
            chosen = model_for(answering, (*group.numbers, measure), group.kind)
        except (InputError, UnknownModelError) as error:
            if len(blocks.groups) == 1:
                raise
            reason[places] = np.where(reason[places] == "", str(error), reason[places])
            continue
        own = np.flatnonzero(reason[places] == "")
        if own.size:
            values = {n: np.broadcast_to(v, places.shape)[own] for n, v in group.numbers.items()}
            parts.append(ModelPart(places[own], values, chosen))
    return parts, blocks.remarks, reason


@dataclass(frozen=True, eq=False)
class ModelBlocks:
    """Blocks of one kind, as certain or uncertain as they are, and the model that answers for them.

    Args:
        numbers: what the model reads of them, by field, draws x blocks each.
        weight: weights of the draws, which sum to 1, shape (k,).
        medians: the same of the medians, shape (m,) each.
        shaking: what the curve's levels are to the model.
        remarks: what is to be said of the blocks.
    """

    numbers: Mapping[str, FloatArray]
    weight: FloatArray
    medians: Mapping[str, FloatArray]
    shaking: LevelShaking
    model: FragilityModel
    level: float
    remarks: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        given: Mapping[str, Any],
        shaking: LevelShaking,
        *,
        draws: int,
        seed: int,
        answering: AnsweringFields,
    ) -> ModelBlocks:
        """Return the blocks of medians and standard deviations."""
        stated = dict(given)
        for sigma in [name for name in stated if name.endswith("_sigma")]:
            of = sigma.removesuffix("_sigma")
            # what a block has of itself is not known before its model is
            if of not in (*NUMBERS, *stated) and np.any(stated.pop(sigma)):
                raise InputError(f"{sigma} goes with {of}: give its mean, too")
        if all(name == "kind" or name.endswith("_sigma") for name in stated):
            raise InputError("give p2 and kr of the blocks, or a fragility of the curve's measure")
        parts, remarks, reason = parts_by_model(stated, shaking.name, answering)
        refuse_elements(reason, ALL_STAND, BlockFields.__optional_keys__)
        if len(parts) > 1:
            kinds = " and ".join(part.model.row.kind for part in parts)
            raise InputError(f"the blocks are of kinds {kinds}: ask of each kind by itself")
        (part,) = parts
        size, block = reason.size, part.model.method.block
        order = np.argsort(part.places)
        values = {name: each[order] for name, each in part.numbers.items()}
        for name in stated:
            if name.endswith("_sigma") and name not in block.sigmas and np.any(stated[name]):
                kind = part.model.row.kind
                raise InputError(f"{name} does not go with kind {kind}: leave it out")
        numbers = {name: value for name, value in values.items() if not name.endswith("_sigma")}
        medians = {name: np.asarray(each) for name, each in block.filled(numbers).items()}
        scatters = {name: f"{name}_sigma" for name in block.sigmas.values() if name in medians}
        z, weight = _standard_draws(
            [values.get(sigma, np.zeros(size)) for sigma in scatters.values()], draws, seed
        )
        drawn = {name: each[None] for name, each in medians.items()}
        for (name, sigma), points in zip(scatters.items(), z, strict=True):
            law = fraction if name in block.fractions else lognormal
            drawn[name] = law(points, medians[name], values.get(sigma, np.zeros(size)))
        whole = (weight.size, size)
        drawn = {name: np.broadcast_to(each, whole) for name, each in drawn.items()}
        level = answering.get("level", LEVEL)
        return cls(drawn, weight, medians, shaking, part.model, level, remarks)

    @classmethod
    def certain(
        cls,
        numbers: Mapping[str, FloatArray],
        shaking: LevelShaking,
        model: FragilityModel,
        level: float,
    ) -> ModelBlocks:
        """Return blocks whose parameters are known, shape (m,) each."""
        medians = {n: np.asarray(v) for n, v in model.method.block.filled(numbers).items()}
        drawn = {name: each[None] for name, each in medians.items()}
        return cls(drawn, np.ones(1), medians, shaking, model, level)

    @property
    def count(self) -> int:
        """Number of blocks."""
        return next(iter(self.medians.values())).size

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the model and the curve's meaning take for granted."""
        block = self.model.method.block
        assumed = (block.support,) if self.model.kind == block.kind and block.support else ()
        return (*self.remarks, *self.shaking.warnings, *assumed, *self.model.notes)

    def placement(self) -> Placement | None:
        """Return the blocks as those of one site with unknown azimuths; None without a size."""
        return Placement.of_numbers(self.model.method.block, self.medians, polarity=UNKNOWN)

    def tabled(self, curves: Sequence[HazardCurve], *, mean: bool = False) -> ProbabilityTable:
        """Return P and the ends of its interval over the levels of some curves.

        The model answers once at each node; scatter of the shaking about the curve's measure is a
        sum over nodes, of which its steps are a multiple.

        Args:
            mean: the mean over the blocks instead of each.
        """
        ends = (c.levels[-1] if c.end_level is None else c.end_level for c in curves)
        low = math.log(min(float(curve.levels[0]) for curve in curves))
        shift = np.log(self.shaking.shift)
        apart = float(shift[1] - shift[0]) if shift.size > 1 else 0.0
        each = max(1, math.ceil(apart / SMOOTH_STEP))
        step = apart / each if apart > 0.0 else TABLE_STEP
        size = max(FEWEST_NODES, math.ceil((math.log(max(ends)) - low) / step) + 1)
        size += 1 - size % 2  # so that every second node is a table too
        reach = each * (shift.size - 1)
        values = np.exp(low + float(shift[0]) + step * np.arange(size + reach))
        k, m = self.weight.size, self.count
        table = np.zeros((k, 3, 1 if mean else m, size))
        for draws in _slices(k, _AT_ONCE // (min(m, _BLOCKS_AT_ONCE) * values.size)):
            for some in _slices(m, _BLOCKS_AT_ONCE):
                own = {name: each[draws, some, None] for name, each in self.numbers.items()}
                answer = self._predicted(own, {self.shaking.name: values})
                bands = np.stack([answer.probability, answer.ci_low, answer.ci_high], axis=1)
                if mean:
                    bands = bands.sum(axis=2, keepdims=True) / m
                part = table[draws] if mean else table[draws, :, some]
                for i, weight in enumerate(self.shaking.weight):
                    part += weight * bands[..., i * each : i * each + size]
        return ProbabilityTable(low, step, table)

    def outside(self, levels: FloatArray) -> NDArray[np.bool_]:
        """Return where median blocks and levels are outside the model's domain, (m, n)."""
        return np.asarray(~self._at_medians(levels).in_domain)

    def share_outside(self, levels: FloatArray) -> FloatArray:
        """Return which part of the median blocks' P is outside the model's domain, shape (n,)."""
        answer = self._at_medians(levels)
        p = np.maximum(answer.probability, np.finfo(np.float64).tiny)
        share: FloatArray = (p * ~answer.in_domain).sum(axis=0) / p.sum(axis=0)
        return share

    def _at_medians(self, levels: FloatArray) -> PredictionArray:
        shaking = {self.shaking.name: levels[None, :] * self.shaking.median}
        return self._predicted({n: each[:, None] for n, each in self.medians.items()}, shaking)

    def _predicted(
        self, numbers: Mapping[str, FloatArray], shaking: Mapping[str, Any]
    ) -> PredictionArray:
        return array_answer(self.model, {**numbers, **shaking}, self.level)


def _standard_draws(
    sigmas: Sequence[FloatArray], draws: int, seed: int
) -> tuple[list[FloatArray], FloatArray]:
    """Return standard normal values of each parameter, draws x blocks each, and weights.

    One block: a product of steps, exact for smooth integrands. Several: scrambled Sobol points
    (Owen 1998), normal by their quantiles.
    """
    m = sigmas[0].size
    if not any(sigma.any() for sigma in sigmas):
        return [np.zeros((1, m)) for _ in sigmas], np.ones(1)
    if m == 1:
        steps = [normal_steps(_SIGMA_POINTS if s.any() else 1, _SIGMA_REACH) for s in sigmas]
        weight = np.ones(1)
        for _, of_one in steps:
            weight = np.outer(weight, of_one).ravel()
        return [
            z.reshape(-1, 1) for z in np.meshgrid(*(x for x, _ in steps), indexing="ij")
        ], weight
    if isinstance(draws, bool) or not 1 <= draws <= 2**16:
        raise InputError(f"draws = {draws}: give a number from 1 to 65536")
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    uncertain = [i for i, sigma in enumerate(sigmas) if sigma.any() or i < _ALWAYS]
    points = Sobol(len(uncertain) * m, rng=np.random.default_rng(seed)).random(
        1 << (draws - 1).bit_length()
    )
    z = ndtri(points[:draws])
    place = {i: slice(k * m, (k + 1) * m) for k, i in enumerate(uncertain)}
    each = [z[:, place[i]] if i in place else np.zeros((draws, m)) for i in range(len(sigmas))]
    return each, np.full(draws, 1.0 / draws)
