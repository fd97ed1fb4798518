"""The stored maps of outcomes, as arrays: what any block does without another simulation."""

from __future__ import annotations

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
        start: where the intervals of each begin, shape (n + 1,): those of number i are
            ``start[i]:start[i + 1]``, by rising k_r/PGA.
        k_lo: lower ends, k_r/PGA. Where intervals leave a gap, nothing is known in it.
        k_hi: upper ends, k_r/PGA.
        outcome: 1 every block of the interval topples, 0 none does, NaN undecided.
        known_from: least k_r/PGA for which anything is known, shape (n,): the search limit, or
            more where a search was given up; inf where nothing is known (``outside_model``).
    """

    combination_id: NDArray[np.int64]
    start: NDArray[np.int64]
    k_lo: FloatArray
    k_hi: FloatArray
    outcome: FloatArray
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
        mine = slice(self.start[i], self.start[i + 1])
        low, high, outcome = self.k_lo[mine], self.k_hi[mine], self.outcome[mine]
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
    if not wanted.size:
        none, nothing = np.empty(0, dtype=np.int64), np.empty(0)
        start = np.zeros(1, dtype=np.int64)
        return OutcomeMaps(none, start, nothing, nothing, nothing, nothing)
    owner, low, high, outcome = _intervals(connection, wanted)
    start, number = _of_each(owner, wanted)
    known_from = _known_from(connection, wanted)
    mapped = np.diff(start) > 0
    known_from[mapped] = low[number[start[:-1][mapped]]]
    return OutcomeMaps(
        combination_id=wanted,
        start=start,
        k_lo=low[number],
        k_hi=high[number],
        outcome=outcome[number],
        known_from=known_from,
    )


def _of_each(
    owner: NDArray[np.int64], wanted: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where the rows of each one wanted begin, and their numbers one after the other."""
    begin = np.searchsorted(owner, wanted, side="left")
    count = np.searchsorted(owner, wanted, side="right") - begin
    start = np.concatenate([[0], np.cumsum(count)])
    return start, np.repeat(begin - start[:-1], count) + np.arange(start[-1])


def _intervals(
    connection: Connection, wanted: NDArray[np.int64]
) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
    column = outcome_interval.c
    code = case((column.outcome == "topples", TOPPLES), (column.outcome == "safe", SAFE))
    query = (
        select(column.combination_id, column.k_lo, column.k_hi, code)
        .where(column.combination_id.between(int(wanted.min()), int(wanted.max())))
        .order_by(column.combination_id, column.k_lo)
    )
    rows = [tuple(row) for row in connection.execute(query)]
    table = np.array(rows, dtype=np.float64).reshape(-1, 4)
    return table[:, 0].astype(np.int64), table[:, 1], table[:, 2], table[:, 3]


def _known_from(connection: Connection, wanted: NDArray[np.int64]) -> FloatArray:
    """Return where knowledge begins without any interval: no block that moves, or no model."""
    column = combination.c
    rows = connection.execute(
        select(column.id, column.status, column.search_limit).where(
            column.id.between(int(wanted.min()), int(wanted.max()))
        )
    )
    begins = {row_id: limit if status == "no_motion" else np.inf for row_id, status, limit in rows}
    missing = [row_id for row_id in wanted.tolist() if row_id not in begins]
    if missing:
        raise InputError(f"there is no combination {missing[0]} in the database")
    return np.array([begins[row_id] for row_id in wanted.tolist()])
