"""A claim about critical blocks, and what the data say of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.motions import motion_rows
from rbfrag.db.queries import combination_table
from rbfrag.db.rows import Vertical

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

Verdict = Literal["confirmed", "refuted", "not decided"]

REPLICATIONS = 1000
LEVEL = 0.95


@dataclass(frozen=True)
class Claim:
    """One tested claim.

    Args:
        claim: what is claimed.
        statistic: what was computed, in words.
        value: its value.
        low: lower end of its 95 % interval.
        high: upper end of it.
        rule: when the claim counts as confirmed or refuted.
        verdict: what the rule gives.
        n: critical values used.
        clusters: earthquakes (for pulses: pulses) they come from.
    """

    claim: str
    statistic: str
    value: float
    low: float
    high: float
    rule: str
    verdict: Verdict
    n: int
    clusters: int

    def as_dict(self) -> dict[str, object]:
        """Return all fields by name."""
        return asdict(self)


def cluster_interval(
    cluster: NDArray[np.generic],
    statistic: Callable[[IntArray], float],
    *,
    seed: int,
    replications: int = REPLICATIONS,
) -> tuple[float, float, float]:
    """Return a statistic with its 95 % interval, whole clusters drawn with replacement.

    Args:
        cluster: the cluster of each point, shape (n,).
        statistic: function of the indices of the points that were drawn.
        seed: of the draws.
        replications: how many draws.

    Returns:
        The value on the data, and the 2.5 % and 97.5 % quantiles over the draws.
    """
    names, number = np.unique(cluster, return_inverse=True)
    members = [np.flatnonzero(number == i) for i in range(names.size)]
    rng = np.random.default_rng(seed)
    drawn = [
        statistic(np.concatenate([members[i] for i in rng.integers(names.size, size=names.size)]))
        for _ in range(replications)
    ]
    tail = 0.5 * (1.0 - LEVEL)
    low, high = np.nanquantile(drawn, (tail, 1.0 - tail))
    return statistic(np.arange(number.size)), float(low), float(high)


def verdict_of(confirmed: bool, refuted: bool) -> Verdict:
    """Return the verdict of a rule; neither is not decided."""
    return "confirmed" if confirmed else "refuted" if refuted else "not decided"


AGREES = 1e-9
"""Relative difference of critical values that processors may make."""


def agreement_with_reference(db: str) -> str:
    """Return a sentence: how many of the reference's critical values the database has too."""
    same = other = missing = 0
    for vertical in ("without", "with"):
        present, shipped = (
            _critical_values(db, vertical),
            _critical_values(str(REFERENCE), vertical),
        )
        for key, (status, k) in shipped.items():
            if key not in present:
                missing += 1
            elif present[key][0] == status and (
                math.isclose(present[key][1], k, rel_tol=AGREES) or math.isnan(k)
            ):
                same += 1
            else:
                other += 1
    return (
        f"Of the {same + other + missing:,} combinations of the shipped reference, {same:,} have "
        f"the same status and critical value (to {AGREES:g}) here, {other:,} another one, and "
        f"{missing:,} are not here."
    )


def _critical_values(
    db: str, vertical: Vertical
) -> dict[tuple[str, str, float], tuple[str, float]]:
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection, vertical=vertical)
        sha256 = {row.id: row.sha256 for row in motion_rows(connection)}
    return {
        (sha256[int(motion)], str(polarity), float(p2)): (str(status), float(k))
        for motion, polarity, p2, status, k in zip(
            table.motion_id, table.polarity, table.p2, table.status, table.kr_over_pga, strict=True
        )
    }
