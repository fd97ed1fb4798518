"""What several blocks of one site do together, site by site."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rbfrag.errors import InputError
from rbfrag.hazards.annual_rate import failure_rate
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.joint_rate import MOST_JOINT, USUAL_COUNTS, JointRate
from rbfrag.hazards.joint_thresholds import JointThresholds
from rbfrag.hazards.mass import Indices
from rbfrag.hazards.model_blocks import ModelBlocks, ModelPart, ProbabilityTable
from rbfrag.hazards.shaking import LevelShaking
from rbfrag.solver.results import FloatArray


def joint_rates(
    sites: Sequence[Sequence[HazardCurve]],
    site: Indices,
    parts: Sequence[ModelPart],
    reading: LevelShaking,
    level: float,
    weight: FloatArray,
    at_least: Sequence[int] | None,
    years: float,
) -> tuple[JointRate | None, ...]:
    """Return how often earthquakes fail several blocks of each site; None where it has one."""
    result: list[JointRate | None] = []
    for i, curves in enumerate(sites):
        own = [
            part._replace(
                places=part.places[here],
                numbers={name: each[here] for name, each in part.numbers.items()},
            )
            for part in parts
            if (here := site[part.places] == i).any()
        ]
        n = sum(part.places.size for part in own)
        result.append(
            None if n < 2 else _of_site(curves, own, n, reading, level, weight, at_least, years)
        )
    return tuple(result)


def _of_site(
    curves: Sequence[HazardCurve],
    parts: Sequence[ModelPart],
    n: int,
    reading: LevelShaking,
    level: float,
    weight: FloatArray,
    at_least: Sequence[int] | None,
    years: float,
) -> JointRate:
    blocks = [ModelBlocks.certain(part.numbers, reading, part.model, level) for part in parts]
    tables = [some.tabled(curves) for some in blocks]
    size = tables[0].values.shape[-1]
    greatest, none = np.zeros((1, 1, size)), np.ones((1, 1, size))
    for table in tables:
        p = table.values[:, :1]
        greatest = np.maximum(greatest, p.max(axis=2))
        none = none * (1.0 - p).prod(axis=2)
    first = tables[0]
    any_of = ProbabilityTable(first.low, first.step, np.stack([greatest, 1.0 - none]))
    thresholds, law = None, parts[0].model.dependence
    placement = blocks[0].placement()
    counts = _checked_counts(at_least, n)
    if len(parts) == 1 and n <= MOST_JOINT and law is not None and placement is not None:
        thresholds = JointThresholds.of(first, placement, law, counts)
    each = []
    for curve in curves:
        rates = np.concatenate(
            [failure_rate(curve, t.fine, t.coarse).annual_rate.reshape(3, -1)[0] for t in tables]
        )
        any_bounds = failure_rate(curve, any_of.fine, any_of.coarse)
        each.append(JointRate.of(any_bounds, rates, thresholds, curve, years))
    used = np.flatnonzero(weight > 0.0)
    mean = JointRate.mean([each[i] for i in used.tolist()], weight[used])
    return replace(mean, warnings=(*mean.warnings, *_taken_for_granted(parts, n, thresholds)))


def _taken_for_granted(
    parts: Sequence[ModelPart], n: int, thresholds: JointThresholds | None
) -> Iterator[str]:
    yield f"annual_rate_any: all {n} blocks are taken as those of one site, of unknown azimuth"
    if thresholds is None:
        why = (
            "what the blocks share in one earthquake is not known to this model"
            if any(part.model.dependence is None for part in parts)
            else "what blocks of several models share in one earthquake is not known"
            if len(parts) > 1
            else f"what more than {MOST_JOINT} blocks share in one earthquake is not computed"
        )
        yield (
            f"{why}: bounds has annual_rate_any under full dependence and if they fail "
            "independently"
        )


def _checked_counts(at_least: Sequence[int] | None, n: int) -> list[int]:
    if at_least is None:
        return [count for count in USUAL_COUNTS if count <= n]
    for count in at_least:
        if isinstance(count, bool) or not 1 <= count <= n:
            raise InputError(f"at least {count} failures of {n} blocks: give numbers from 1 to {n}")
    return [1, *at_least]
