"""The stored maps of outcomes, as arrays: what any block does without another simulation."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sqlalchemy import Connection, case, select

from rbfrag.db.schema import combination, outcome_interval
from rbfrag.errors import InputError
from rbfrag.solver.results import FloatArray

TOPPLES = 1.0
SAFE = 0.0

# What the quotient of a k_r and a PGA may be off where it stands for the search limit itself.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class OutcomeMaps:
    """The certified maps of many combinations.

    Args:
        combination_id: row ids, shape (n,), in the order that was asked for.
        intervals: of each combination lower end and upper end, k_r/PGA, and outcome of its
            intervals, shape (3, intervals), by rising k_r/PGA: 1 every block topples, 0 none does,
            NaN undecided. Where intervals leave a gap, nothing is known in it.
        known_from: least k_r/PGA for which anything is known, shape (n,): the search limit, or
            more where a search was given up; inf where nothing is known (``outside_model``).
    """

    combination_id: NDArray[np.int64]
    intervals: tuple[FloatArray, ...]
    known_from: FloatArray

    def outcomes(self, kr_over_pga: ArrayLike) -> FloatArray:
        """Return what becomes of blocks of any strength: 1 topples, 0 safe, NaN not known.

        Above the uppermost interval (and so above K_up) every block is safe: no shaking lifts it.
        Where a map has no answer, NaN: below the search limit, inside an undecided
        interval (a border between the others is one, some 1e-9 wide), below the point where a
        search was given up, for ``outside_model``, and for a NaN asked about. An end that an
        undecided and a decided interval share is decided: the decided ones are closed.

        Args:
            kr_over_pga: block strength over PGA, shape (m,) for the same of all combinations,
                or (n, m) for each its own.

        Returns:
            Shape (n, m).
        """
        ratios = np.asarray(kr_over_pga, dtype=np.float64)
        n = self.combination_id.size
        if ratios.ndim not in (1, 2) or (ratios.ndim == 2 and ratios.shape[0] != n):
            raise InputError(
                f"kr/PGA must have shape (m,) or ({n}, m) for {n} combinations, not {ratios.shape}"
            )
        answer = np.full((n, ratios.shape[-1]), np.nan)
        for i in range(n):
            self._look_up(i, ratios if ratios.ndim == 1 else ratios[i], answer[i])
        return answer

    def _look_up(self, i: int, k: FloatArray, answer: FloatArray) -> None:
        low, high, outcome = self.intervals[i]
        known = k >= self.known_from[i] * (1.0 - _ROUNDING)
        if not low.size:
            answer[known] = SAFE
            return
        at = np.searchsorted(low, k, side="right") - 1
        outcomes = outcome[np.maximum(at, 0)]
        # Between two intervals, where a map holds the decided ones alone, nothing is known.
        outcomes[k > high[np.maximum(at, 0)]] = np.nan
        # A shared end belongs to the decided one of its two neighbours.
        before = np.maximum(at - 1, 0)
        shared = np.isnan(outcomes) & (at > 0) & (k == high[before])
        outcomes[shared] = outcome[before[shared]]
        outcomes[k > high[-1]] = SAFE
        answer[known] = outcomes[known]


def outcome_maps(connection: Connection, combination_id: ArrayLike) -> OutcomeMaps:
    """Return the maps of outcomes of some combinations.

    Args:
        combination_id: row ids, such as ``CombinationTable.combination_id``, shape (n,).
    """
    wanted = np.atleast_1d(np.asarray(combination_id, dtype=np.int64))
    ids: list[int] = wanted.tolist()
    first, last = min(ids, default=0), max(ids, default=0)
    search, interval = combination.c, outcome_interval.c
    query = select(search.id, search.status, search.search_limit)
    # without any interval: no block that moves, or no model
    known_from = {
        row_id: limit if status == "no_motion" else np.inf
        for row_id, status, limit in connection.execute(query.where(search.id.between(first, last)))
    }
    missing = [row_id for row_id in ids if row_id not in known_from]
    if missing:
        raise InputError(f"there is no combination {missing[0]} in the database")
    code = case((interval.outcome == "topples", TOPPLES), (interval.outcome == "safe", SAFE))
    stored = (
        select(interval.combination_id, interval.k_lo, interval.k_hi, code)
        .where(interval.combination_id.between(first, last))
        .order_by(interval.combination_id, interval.k_lo)
    )
    rows: defaultdict[int, list[tuple[float, ...]]] = defaultdict(list)
    for owner, *ends_and_outcome in connection.execute(stored):
        rows[owner].append(tuple(ends_and_outcome))
    known_from |= {owner: intervals[0][0] for owner, intervals in rows.items()}
    return OutcomeMaps(
        combination_id=wanted,
        intervals=tuple(np.array(rows[i], dtype=np.float64).reshape(-1, 3).T for i in ids),
        known_from=np.array([known_from[i] for i in ids], dtype=np.float64),
    )
