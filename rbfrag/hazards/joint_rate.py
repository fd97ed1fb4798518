"""Annual rate of earthquakes in which at least k of several blocks of one site fail.

The ends of the interval of the rate of any failure are its rates where the model's parameters are
moved by their error in the direction that changes the sum of the blocks' rates most.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility.joint import UNKNOWN, Placement, any_fails
from rbfrag.hazards.annual_rate import probability_in
from rbfrag.hazards.joint_thresholds import JointRates, joint_rates
from rbfrag.hazards.rate_density import Indices, SiteMass
from rbfrag.hazards.rate_integration import KernelBlocks, Rates, error_step, probabilities
from rbfrag.hazards.standing_blocks import COPULA, DEPENDENT, INDEPENDENT
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray

NO_LAW = "bounds"
"""Joint law where only bounds are known."""

UNKNOWN_TO_MODEL = "the model has no dependence between the blocks of one earthquake"
SEVERAL_MODELS = "the dependence between blocks of several models is unknown"
BOUNDS_GIVEN = "bounds are given for full dependence and for independence"

MOST_JOINT = 4096
"""Most blocks that the dependence is taken for."""

MOST_REPEATED = 100_000
"""Most blocks of a site of which each is counted by itself for the bounds."""

USUAL_COUNTS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
"""Numbers of failures whose rates are given where none are asked for."""


@dataclass(frozen=True, eq=False)
class CountRate:
    """Annual rate of earthquakes in which at least k blocks fail.

    Args:
        count: number of failures.
        annual_rate: annual rate of earthquakes with as many or more [1/a].
        numerical_error: standard error of the rate as a quadrature, relative to it.
        probability: probability of at least one such earthquake in the period.
    """

    count: int
    annual_rate: float
    numerical_error: float
    probability: float


@dataclass(frozen=True, eq=False)
class JointRate:
    """Annual rates of earthquakes in which several blocks of one site fail.

    Args:
        at_least: how often earthquakes fail some numbers of blocks or more, the first any; empty
            where only bounds are known.
        annual_rate_any_ci: both ends of the interval of the first rate from the parameters of the
            fragility.
        joint_law: how the blocks of one earthquake fail together.
        bounds: the rate and the probability under full dependence, where the block of the greatest
            P fails first, and if blocks fail independently at each level of the shaking.
        warnings: what these numbers take for granted.
    """

    at_least: tuple[CountRate, ...]
    annual_rate_any_ci: tuple[float, float] | None
    joint_law: str
    bounds: Mapping[str, Mapping[str, float]]
    warnings: tuple[str, ...] = ()

    @property
    def annual_rate_any(self) -> float | None:
        """Annual rate of earthquakes with any failure [1/a]; None without a dependence model."""
        return self.at_least[0].annual_rate if self.at_least else None

    @property
    def probability_any(self) -> float | None:
        """Probability of any failure in the period; None without a dependence model."""
        return self.at_least[0].probability if self.at_least else None

    @classmethod
    def of(
        cls,
        any_bounds: Sequence[float],
        years: float,
        rates: JointRates | None = None,
        ends_of_any: tuple[float, float] | None = None,
    ) -> JointRate:
        """Return the rates of one site with their probabilities.

        Earthquakes are the Poisson process, not failures: the probability in T years is
        1 - exp(-λ_any T).

        Args:
            any_bounds: rates at which any fails under full dependence and if independent [1/a].
            years: the period [a].
            rates: what :func:`~rbfrag.hazards.joint_thresholds.joint_rates` gives, of any failure
                first; None where the law is not known.
            ends_of_any: both ends of the interval of the rate of any failure [1/a].
        """
        bounds = {
            name.replace(" ", "_"): {
                "annual_rate_any": float(rate),
                "probability_any": float(probability_in(years, np.asarray(rate))),
            }
            for name, rate in zip((DEPENDENT, INDEPENDENT), any_bounds, strict=True)
        }
        if rates is None:
            return cls((), None, NO_LAW, bounds)
        of_first = rates.rate[:, 0], rates.error, probability_in(years, rates.rate[:, 0])
        tiny = np.finfo(np.float64).tiny
        at_least = tuple(
            CountRate(count, rate, error / max(rate, tiny), probability)
            for count, rate, error, probability in zip(
                rates.counts, *(values.tolist() for values in of_first), strict=True
            )
        )
        return cls(at_least, ends_of_any, COPULA, bounds)

    @classmethod
    def mean(cls, parts: Sequence[JointRate], weights: FloatArray) -> JointRate:
        """Return the weighted mean over branches, of which all or none have a dependence model."""

        def meant(values: Iterable[Any]) -> float:
            return float(sum(w * value for w, value in zip(weights, values, strict=True)))

        bounds = {
            law: {name: meant(part.bounds[law][name] for part in parts) for name in numbers}
            for law, numbers in parts[0].bounds.items()
        }
        warnings = tuple(dict.fromkeys(text for part in parts for text in part.warnings))
        if parts[0].joint_law == NO_LAW:
            return cls((), None, NO_LAW, bounds, warnings)
        at_least = tuple(
            CountRate(
                first.count,
                *(
                    meant(getattr(part.at_least[i], name) for part in parts)
                    for name in ("annual_rate", "numerical_error", "probability")
                ),
            )
            for i, first in enumerate(parts[0].at_least)
        )
        low, high = (
            meant(part.annual_rate_any_ci[i] for part in parts if part.annual_rate_any_ci)
            for i in (0, 1)
        )
        return cls(at_least, (low, high), parts[0].joint_law, bounds, warnings)

    def as_dict(self) -> dict[str, object]:
        """Return the numbers under the keys of the JSON contract."""
        ends = self.annual_rate_any_ci
        return {
            "annual_rate_any": self.annual_rate_any,
            "annual_rate_any_ci": None if ends is None else list(ends),
            "probability_any": self.probability_any,
            "annual_rate_at_least": [dict(vars(rate)) for rate in self.at_least] or None,
            "joint_law": self.joint_law,
            "bounds": {name: dict(values) for name, values in self.bounds.items()},
        }


def joint_at_sites(
    group_rates: Sequence[tuple[Indices, KernelBlocks, Rates]],
    mass: SiteMass,
    at_least: Sequence[int] | None,
    years: float,
    level: float,
    count: FloatArray,
) -> tuple[tuple[JointRate | None, ...], tuple[str, ...]]:
    """Return the annual rates of joint failure of the blocks of each site, and the warnings.

    Args:
        group_rates: blocks of each model with their rates.
        at_least: numbers of failures whose rates are wanted; None for usual ones. What the blocks
            of a site do not reach is left out, unless those of no site do.
        years: period of the probabilities [a].
        level: confidence level of the interval.
        count: number of identical blocks of each row, shape (m,).

    Raises:
        InputError: a number of failures that the blocks of no site reach.
    """
    # At least k failures in one earthquake: λ_k = Σ P(N >= k | u) (-dν(u)), N by the dependence
    # model that is stored with the fragility model.
    sites = mass.mass.shape[0]
    number = np.zeros(sites, dtype=np.intp)
    for indices, blocks, _ in group_rates:
        number += np.bincount(blocks.site, count[indices], sites).astype(np.intp)
    most = int(np.max(number))
    for least in at_least or ():
        if isinstance(least, bool) or not 1 <= least <= most:
            text = f"at least {least} failures of {most} blocks: give numbers from 1 to {most}"
            raise InputError(text)
    result: list[JointRate | None] = [None] * sites
    why: dict[str, None] = {}
    for site in np.flatnonzero(number > 1).tolist():
        site_blocks = []
        for indices, blocks, rates in group_rates:
            rows = np.flatnonzero(blocks.site == site)
            if rows.size:  # identical blocks of a row have azimuths of their own
                repeats = count[indices[rows]].astype(np.intp)
                if number[site] <= MOST_REPEATED:
                    rows = np.repeat(rows, repeats)
                site_blocks.append((blocks.only(rows), rates.gradient[:, rows].sum(axis=1)))
        counts = [k for k in ((1, *at_least) if at_least else USUAL_COUNTS) if k <= number[site]]
        unknown = _unknown([blocks for blocks, _ in site_blocks], int(number[site]))
        result[site] = _of_site(
            site_blocks, mass, site, counts, years, level, has_dependence=not unknown
        )
        if unknown:
            why[unknown] = None
    if not any(result):
        return tuple(result), ()
    counted = int(number[number > 1].max())
    number_text = f"{counted:,}" if sites == 1 else f"up to {counted:,}"
    return tuple(result), (
        Diagnostic(
            f"at least one failure: {number_text} blocks are assumed to be at one site, with "
            "unknown azimuths",
            "unknown_azimuths",
        ),
        *(Diagnostic(f"{text}: {BOUNDS_GIVEN}", "unknown_dependence") for text in why),
    )


def _unknown(groups: Sequence[KernelBlocks], number: int) -> str:
    """Return the reason why the dependence of blocks is unknown; empty where it is known."""
    models = {blocks.model.name: blocks.model for blocks in groups}
    if any(model.dependence is None or model.method.block.size is None
           for model in models.values()):  # fmt: skip
        return UNKNOWN_TO_MODEL
    if len(models) > 1:
        return SEVERAL_MODELS
    if number > MOST_JOINT:
        return f"the dependence of more than {MOST_JOINT:,} blocks is not computed"
    return ""


def _of_site(
    site_blocks: Sequence[tuple[KernelBlocks, FloatArray]],
    mass: SiteMass,
    site: int,
    counts: Sequence[int],
    years: float,
    level: float,
    *,
    has_dependence: bool,
) -> JointRate:
    model, blocks = site_blocks[0][0].model, [group for group, _ in site_blocks]
    # The interval is that of the direction in parameter space along which the sum of the rates
    # changes most: one step down and one up, applied to all blocks together.
    steps: list[FloatArray | float] = [0.0]
    law = model.dependence if has_dependence else None
    if law is not None:
        step = error_step(model, np.sum([gradient for _, gradient in site_blocks], axis=0), level)
        steps = [0.0, -step, step]
    tables = np.stack(
        [
            np.concatenate([probabilities(group, mass.grid, step) for group in blocks])
            for step in steps
        ]
    )
    site_mass = mass.mass[site]
    branches = mass.branches[:, site][mass.weight > 0.0] if mass.branches.size else site_mass[None]
    weights = mass.weight[mass.weight > 0.0]
    parts, ends = [], None
    if law is not None:
        where = _placement(blocks)
        rate = joint_rates(tables, site_mass, where, law).rate[0]
        ends = float(rate[1:].min()), float(rate[1:].max())
    for branch in branches:
        bounds = [float(p @ branch) for p in any_fails(tables[0])]
        rates = None if law is None else joint_rates(tables[:1], branch, where, law, counts)
        parts.append(JointRate.of(bounds, years, rates, ends))
    return JointRate.mean(parts, weights) if len(parts) > 1 else parts[0]


def _placement(groups: Sequence[KernelBlocks]) -> Placement:
    """Return the placement of the blocks of a site, with unknown azimuths, by their medians."""
    block = groups[0].model.method.block
    medians = {
        name: np.concatenate([blocks.numbers[name][blocks.weight.size // 2] for blocks in groups])
        for name in block.names
    }
    placement = Placement.of_numbers(block, medians, polarity=UNKNOWN)
    assert placement is not None
    return placement
