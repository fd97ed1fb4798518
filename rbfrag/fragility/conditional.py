"""Conditional fragility: failure in a second shock of blocks that survived a first, by damage
state, compared with intact blocks.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from rbfrag.db.shock_pairs import ShockEnd, StoredShockPair
from rbfrag.fragility.confidence import ParameterErrors, packed, quantiles_of
from rbfrag.fragility.fit.result import cr3
from rbfrag.fragility.method import SINGLE, LinearPredictor
from rbfrag.solver.results import Outcome

STATES = (0.0, 0.5, 1.0)
"""Upper ends of the classes of state: displacement or rotation that the first shock left, over the
limit. The lowest is of blocks that it did not move."""

SHAKING = (1.0, 2.0, 4.0, math.inf)
"""Upper ends of the classes of the second shock: its PGA over the block's yield acceleration."""

LEVEL = 0.95

Measure = Literal["", "displacement_m", "peak_rad"]


class FailureShare(NamedTuple):
    """Fraction of blocks that fail, with its confidence interval for a finite number of
    earthquakes.

    Args:
        ci_low: lower end of the interval, clustered by the earthquake of the second shock.
    """

    fails: int
    probability: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True)
class ConditionalShare:
    """Blocks of one class that survived the first shock, under the second.

    Args:
        displacement_m: displacement that counts as failure [m]; None of kinds that rotate.
        rotation_deg: rotation that does [deg]; None of slides, and for failure past recovery.
        state_from: least state that the first shock left, over the limit; above it, but for 0.
        state_to: greatest; of failure past recovery, over the rotation without strength.
        pga_over_yield_from: PGA of the second shock over the block's yield acceleration, above.
        pga_over_yield_to: up to; None without end.
        blocks: how many: pairs of motions x polarities x blocks.
        earthquakes: earthquakes of their second shocks.
        of_station: how many of them met two shocks of one station.
        fails: how many fail in the second shock, as the first left them.
        probability: their share: P(fails in the second | survived the first in this state).
        ci_low: lower end of its interval, clustered by the earthquake of the second shock.
        ci_high: upper end.
        intact_fails: how many of the same blocks fail in the second shock from their first place.
        intact_probability: their share.
        intact_ci_low: lower end of its interval.
        intact_ci_high: upper end.
        ratio: of both shares; None where no intact block fails.
        unknown: blocks left out, whose model ends before they fail or come to rest.
    """

    displacement_m: float | None
    rotation_deg: float | None
    state_from: float
    state_to: float
    pga_over_yield_from: float
    pga_over_yield_to: float | None
    blocks: int
    earthquakes: int
    of_station: int
    fails: int
    probability: float
    ci_low: float
    ci_high: float
    intact_fails: int
    intact_probability: float
    intact_ci_low: float
    intact_ci_high: float
    ratio: float | None
    unknown: int


def conditional_shares(
    rows: Sequence[StoredShockPair], measure: Measure, limits: Iterable[float | None]
) -> tuple[ConditionalShare, ...]:
    """Return the fraction of survivors of a first shock that fail in a second, by limit, state and
    shaking.

    A block fails when its measure reaches the limit, counted from its first place, or when it is
    past recovery. It survived the first shock if it then came to rest within the limit.

    Args:
        rows: blocks under two motions.
        measure: what counts.
        limits: displacements [m] or rotations [rad] that count as failure; None for past recovery.

    Returns:
        The classes that hold a block.
    """
    return tuple(share for limit in limits for share in _of_limit(rows, measure, limit))


def _of_limit(
    rows: Sequence[StoredShockPair], measure: Measure, limit: float | None
) -> Iterable[ConditionalShare]:
    attribute = "displacement_m" if measure == "displacement_m" else "rotation_rad"
    classes: dict[tuple[int, int], list[tuple[StoredShockPair, bool, bool]]] = {}
    unknown: Counter[tuple[int, int]] = Counter()
    for row in rows:
        pair = row.record
        if _fails(pair.first, measure, limit) is not False:
            continue
        state = (getattr(pair.first, attribute) or 0.0) / (limit or pair.critical_rad or math.inf)
        # one that leans on its back plane may rest beyond the rotation at which it would balance
        cell = _class(STATES, min(state, STATES[-1])), _class(SHAKING, row.pga_g / pair.yield_g)
        after, intact = (_fails(end, measure, limit) for end in (pair.second, pair.intact))
        if after is None or intact is None:
            unknown[cell] += 1
        else:
            classes.setdefault(cell, []).append((row, after, intact))
    for (state_class, shaking), blocks in sorted(classes.items()):
        event = np.unique([row.event_id for row, *_ in blocks], return_inverse=True)[1]
        after_share, intact_share = (
            share_of_events(np.array([block[column] for block in blocks]), event)
            for column in (1, 2)
        )
        end = SHAKING[shaking]
        yield ConditionalShare(
            displacement_m=limit if measure == "displacement_m" else None,
            rotation_deg=None
            if measure == "displacement_m" or limit is None
            else round(math.degrees(limit), 9),
            state_from=STATES[max(state_class - 1, 0)],
            state_to=STATES[state_class],
            pga_over_yield_from=0.0 if shaking == 0 else SHAKING[shaking - 1],
            pga_over_yield_to=None if math.isinf(end) else end,
            blocks=len(blocks),
            earthquakes=int(event.max()) + 1,
            of_station=sum(row.record.pairing == "station" for row, *_ in blocks),
            **after_share._asdict(),
            **{f"intact_{name}": value for name, value in intact_share._asdict().items()},
            ratio=after_share.fails / intact_share.fails if intact_share.fails else None,
            unknown=unknown[state_class, shaking],
        )


def _class(ends: Sequence[float], value: float) -> int:
    return next(number for number, end in enumerate(ends) if value <= end)


def _fails(end: ShockEnd, measure: Measure, limit: float | None) -> bool | None:
    """Return whether a block fails; None if unknown."""
    value = getattr(end, measure)
    if end.outcome == Outcome.TOPPLED or (None not in (limit, value) and value >= limit):
        return True
    return False if end.outcome == Outcome.STABLE else None


def share_of_events(fails: np.ndarray, event: np.ndarray, level: float = LEVEL) -> FailureShare:
    """Return a fraction of failures with its confidence interval, clustered by earthquake.

    The interval is that of a logistic model of one constant: F(eta ± t(ν) se) with the covariance
    of leaving earthquakes out, as that of every fit here. Where none or all fail it is the exact
    one (Clopper and Pearson 1934) with as many observations as there are earthquakes.

    Args:
        fails: whether each block fails, shape (n,).
        event: number of its earthquake, from 0, shape (n,).
    """
    n, count = fails.size, int(fails.sum())
    share, events = count / n, int(event.max()) + 1
    if count in (0, n):
        open_end = (0.5 * (1.0 - level)) ** (1.0 / events)
        return FailureShare(
            count, share, *((0.0, 1.0 - open_end) if count == 0 else (open_end, 1.0))
        )
    if events == 1:
        return FailureShare(count, share, 0.0, 1.0)
    size = np.bincount(event)
    excess = np.bincount(event, fails - share)
    steps = (excess / ((n - size) * share * (1.0 - share)))[:, None]
    errors = ParameterErrors(packed(cr3(steps).tolist()), tuple(map(tuple, steps.tolist())))
    half = errors.half_width(LinearPredictor(None, (1.0,)), quantiles_of(level), SINGLE)
    eta = math.log(share / (1.0 - share))
    low, high = (1.0 / (1.0 + math.exp(-(eta + side * half))) for side in (-1.0, 1.0))
    return FailureShare(count, share, low, high)
