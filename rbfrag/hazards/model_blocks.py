"""Blocks of one site, the model that answers for them, and a table of their P over the shaking."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.joint import UNKNOWN, Placement
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.model import FragilityModel, Model
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.uncertain import normal_steps
from rbfrag.fragility.unusable import block_reasons, refuse_elements
from rbfrag.hazards.annual_rate import Fragility
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.shaking import Shaking
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.scatter import fraction, lognormal

FloatArray = NDArray[np.float64]

TABLE_STEP, SMOOTH_STEP = 0.01, 0.02
"""Greatest step of ln x between the nodes of a table of P, as it is and smoothed by scatter."""

FEWEST_NODES = 65

ALL_STAND = "that all of them stand is the question"
"""Why blocks of which one cannot be used are refused."""

_OF_ROCKING = ("p2", "kr", "restitution")
_SIGMA_POINTS, _SIGMA_REACH = 15, 5.0
_ALWAYS = 2
"""p² and k_r have their points even where certain: what else is uncertain does not move them."""
_AT_ONCE, _BLOCKS_AT_ONCE = 400_000, 512


def _slices(size: int, most: int) -> Iterator[slice]:
    for start in range(0, size, max(1, most)):
        yield slice(start, start + max(1, most))


@dataclass(frozen=True, eq=False)
class BlockTable:
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


@dataclass(frozen=True, eq=False)
class ModelBlocks:
    """Blocks, as certain or uncertain as they are, and the model that answers for them.

    Args:
        p2: p² [1/s²], draws x blocks.
        kr: k_r, draws x blocks.
        weight: weights of the draws, which sum to 1, shape (k,).
        medians: p² and k_r of the medians, shape (m,) each.
        shaking: what the curve's levels are to the model.
        model: the model.
        level: confidence level.
        restitution: of blocks that rock, draws x blocks; None for what angular momentum leaves.
        stated_restitution: the one about which they are drawn, shape (m,); None likewise.
    """

    p2: FloatArray
    kr: FloatArray
    weight: FloatArray
    medians: tuple[FloatArray, FloatArray]
    shaking: Shaking
    model: FragilityModel
    level: float
    restitution: FloatArray | None = None
    stated_restitution: FloatArray | None = None

    @classmethod
    def of(
        cls,
        p2: ArrayLike | None,
        kr: ArrayLike | None,
        *,
        p2_sigma: ArrayLike,
        kr_sigma: ArrayLike,
        restitution: ArrayLike | None,
        restitution_sigma: ArrayLike,
        draws: int,
        seed: int,
        kind: str | None,
        model: Model | None,
        level: float,
        db: str | PathLike[str] | None,
        shaking: Shaking,
    ) -> ModelBlocks:
        """Return the blocks of medians and sigmas; arguments as for :func:`rbfrag.survival`."""
        if p2 is None or kr is None:
            raise InputError("give p2 and kr of the blocks, or a fragility of the curve's measure")
        columns = {
            "p2": p2, "kr": kr, "p2_sigma": p2_sigma, "kr_sigma": kr_sigma,
            "restitution_sigma": restitution_sigma,
            "restitution": np.nan if restitution is None else restitution,
        }  # fmt: skip
        values = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(one, dtype=np.float64)) for one in columns.values())
        )
        stated = None if restitution is None else values[5]
        names = ("p2", "kr", shaking.name) if stated is None else (*_OF_ROCKING, shaking.name)
        chosen = find_model(model, names, db, kind=kind)
        given = dict(zip(columns, values, strict=True))
        if stated is None:
            del given["restitution"], given["restitution_sigma"]
            if values[4].any():
                raise InputError("restitution_sigma goes with restitution: give its mean, too")
        refuse_elements(block_reasons(chosen.method.block, given), ALL_STAND)
        medians = (values[0], values[1])
        z, weight = _standard_draws(values[2:5], draws, seed)
        p2s, krs = (lognormal(z[i], medians[i], values[2 + i]) for i in (0, 1))
        if stated is None:
            return cls(p2s, krs, weight, medians, shaking, chosen, level)
        own = _with_own(chosen, medians, stated)
        scattered = fraction(z[2], own, values[4])
        return cls(p2s, krs, weight, medians, shaking, chosen, level, scattered, own)

    @classmethod
    def certain(
        cls,
        p2: FloatArray,
        kr: FloatArray,
        *,
        shaking: Shaking,
        model: FragilityModel,
        level: float,
        restitution: FloatArray | None = None,
    ) -> ModelBlocks:
        """Return blocks whose parameters are known, shape (m,) each."""
        own = None if restitution is None else _with_own(model, (p2, kr), restitution)
        drawn = None if own is None else own[None]
        return cls(p2[None], kr[None], np.ones(1), (p2, kr), shaking, model, level, drawn, own)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the model and the curve's meaning take for granted."""
        block = self.model.method.block
        presumed = (block.presumes,) if self.model.kind == block.kind and block.presumes else ()
        advice = (self.model.term.advice,) if self.model.term.advice else ()
        return (*self.shaking.warnings, *advice, *presumed, *self.model.notes)

    def placement(self) -> Placement:
        """Return the blocks as those of one site with unknown azimuths."""
        p2, kr = self.medians
        p = np.sqrt(p2)
        return Placement.of(np.log(p), np.log(kr * STANDARD_GRAVITY_M_S2 / p), polarity=UNKNOWN)

    def tabled(self, curves: Sequence[HazardCurve], *, mean: bool = False) -> BlockTable:
        """Return P and the ends of its interval over the levels of some curves.

        The model answers once at each node; scatter of the shaking about the curve's measure is a
        sum over nodes, of which its steps are a multiple.

        Args:
            curves: hazard curves of one measure.
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
        k, m = self.p2.shape
        table = np.zeros((k, 3, 1 if mean else m, size))
        for draws in _slices(k, _AT_ONCE // (min(m, _BLOCKS_AT_ONCE) * values.size)):
            for some in _slices(m, _BLOCKS_AT_ONCE):
                answer = self._predicted(
                    self.p2[draws, some, None], self.kr[draws, some, None],
                    None if self.restitution is None else self.restitution[draws, some, None],
                    {self.shaking.name: values},
                )  # fmt: skip
                bands = np.stack([answer.probability, answer.ci_low, answer.ci_high], axis=1)
                if mean:
                    bands = bands.sum(axis=2, keepdims=True) / m
                part = table[draws] if mean else table[draws, :, some]
                for i, weight in enumerate(self.shaking.weight):
                    part += weight * bands[..., i * each : i * each + size]
        return BlockTable(low, step, table)

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
        p2, kr = self.medians
        shaking = {self.shaking.name: levels[None, :] * self.shaking.median}
        stated = self.stated_restitution
        own = None if stated is None else stated[:, None]
        return self._predicted(p2[:, None], kr[:, None], own, shaking)

    def _predicted(
        self,
        p2: FloatArray,
        kr: FloatArray,
        restitution: FloatArray | None,
        shaking: Mapping[str, Any],
    ) -> PredictionArray:
        own = {} if restitution is None else {"restitution": restitution}
        answer = answer_given(self.model, {"p2": p2, "kr": kr, **own, **shaking}, self.level)
        assert isinstance(answer, PredictionArray)
        return answer


def _with_own(
    model: FragilityModel, medians: tuple[FloatArray, FloatArray], stated: FloatArray
) -> FloatArray:
    """Return restitutions, with that of the block itself where none is stated."""
    p2, kr = medians
    own = model.method.block.filled({"p2": p2, "kr": kr, "restitution": stated})["restitution"]
    return np.asarray(own)


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
