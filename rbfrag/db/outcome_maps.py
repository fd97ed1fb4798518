"""The stored maps of outcomes, as arrays: what any block does without another simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sqlalchemy import Connection, case, select

from rbfrag.db.schema import combination, outcome_interval, simulation
from rbfrag.errors import InputError

FloatArray = NDArray[np.float64]

TOPPLES = 1.0
SAFE = 0.0

# What the quotient of a k_r and a PGA may be off where it stands for the search limit itself.
_ROUNDING = 1e-12

SAME_BLOCK = 1e-9
"""Relative difference of k_r/PGA up to which a block that was run is the one asked about."""


@dataclass(frozen=True, eq=False)
class OutcomeMaps:
    """The certified maps of many combinations, and the single blocks that were run beside them.

    Args:
        combination_id: row ids, shape (n,), in the order that was asked for.
        start: where the intervals of each begin, shape (n + 1,): those of number i are
            ``start[i]:start[i + 1]``, by rising k_r/PGA.
        k_lo: lower ends, k_r/PGA. Where intervals leave a gap, nothing is known in it.
        k_hi: upper ends, k_r/PGA.
        outcome: 1 every block of the interval topples, 0 none does, NaN undecided.
        known_from: least k_r/PGA for which anything is known, shape (n,): the search limit, or
            more where a search was given up; inf where nothing is known (``outside_model``).
        run_start: where the single blocks of each begin, shape (n + 1,).
        run_k: their k_r/PGA, rising within a combination.
        run_outcome: 1 topples, 0 does not.
    """

    combination_id: NDArray[np.int64]
    start: NDArray[np.int64]
    k_lo: FloatArray
    k_hi: FloatArray
    outcome: FloatArray
    known_from: FloatArray
    run_start: NDArray[np.int64]
    run_k: FloatArray
    run_outcome: FloatArray

    def outcomes(self, kr_over_pga: ArrayLike) -> FloatArray:
        """Return what becomes of blocks of any strength: 1 topples, 0 safe, NaN not known.

        Above the uppermost interval (and so above K_up) every block is safe: no drive lifts it.
        Where a map has no answer, that of a single block of this strength stands for it, if one
        was run. Otherwise nothing is known, NaN: below the search limit, inside an undecided
        interval (a border between the others is one, some 1e-9 wide), below the point where a
        search was given up, for ``outside_model``, and for a NaN asked about. An end that an
        undecided and a decided interval share is decided: the decided ones are closed.

        Args:
            kr_over_pga: block strength over PGA, shape (m,) for the same of all combinations,
                or (n, m) for each its own.

        Returns:
            Shape (n, m).

        Raises:
            InputError: another shape.
        """
        asked = np.asarray(kr_over_pga, dtype=np.float64)
        n = self.combination_id.size
        if asked.ndim not in (1, 2) or (asked.ndim == 2 and asked.shape[0] != n):
            raise InputError(
                f"kr/PGA must have shape (m,) or ({n}, m) for {n} combinations, not {asked.shape}"
            )
        answer = np.full((n, asked.shape[-1]), np.nan)
        for i in range(n):
            strengths = asked if asked.ndim == 1 else asked[i]
            self._look_up(i, strengths, answer[i])
            self._look_up_runs(i, strengths, answer[i])
        return answer

    def _look_up_runs(self, i: int, k: FloatArray, answer: FloatArray) -> None:
        mine = slice(self.run_start[i], self.run_start[i + 1])
        run_k, outcome = self.run_k[mine], self.run_outcome[mine]
        lacking = np.flatnonzero(np.isnan(answer) & np.isfinite(k))
        if not run_k.size or not lacking.size or np.isinf(self.known_from[i]):
            return
        asked = k[lacking]
        at = np.searchsorted(run_k, asked)
        before, after = np.maximum(at - 1, 0), np.minimum(at, run_k.size - 1)
        nearest = np.where(asked - run_k[before] < run_k[after] - asked, before, after)
        same = np.abs(run_k[nearest] - asked) <= SAME_BLOCK * asked
        answer[lacking[same]] = outcome[nearest[same]]

    def _look_up(self, i: int, k: FloatArray, answer: FloatArray) -> None:
        mine = slice(self.start[i], self.start[i + 1])
        low, high, outcome = self.k_lo[mine], self.k_hi[mine], self.outcome[mine]
        known = k >= self.known_from[i] * (1.0 - _ROUNDING)
        if not low.size:
            answer[known] = SAFE
            return
        at = np.searchsorted(low, k, side="right") - 1
        found = outcome[np.maximum(at, 0)]
        # Between two intervals, where a map holds the decided ones alone, nothing is known.
        found[k > high[np.maximum(at, 0)]] = np.nan
        # A shared end belongs to the decided one of its two neighbours.
        before = np.maximum(at - 1, 0)
        shared = np.isnan(found) & (at > 0) & (k == high[before])
        found[shared] = outcome[before[shared]]
        found[k > high[-1]] = SAFE
        answer[known] = found[known]


def outcome_maps(connection: Connection, combination_id: ArrayLike) -> OutcomeMaps:
    """Return the maps of outcomes of some combinations.

    Args:
        connection: the database.
        combination_id: row ids, such as ``CombinationTable.combination_id``, shape (n,).

    Raises:
        InputError: an id that is not there.
    """
    wanted = np.atleast_1d(np.asarray(combination_id, dtype=np.int64))
    if not wanted.size:
        none, nothing = np.empty(0, dtype=np.int64), np.empty(0)
        start = np.zeros(1, dtype=np.int64)
        four = nothing, nothing, nothing, nothing
        return OutcomeMaps(none, start, *four, start, nothing, nothing)
    owner, low, high, outcome = _intervals(connection, wanted)
    start, number = _of_each(owner, wanted)
    known_from = _known_from(connection, wanted)
    mapped = np.diff(start) > 0
    known_from[mapped] = low[number[start[:-1][mapped]]]
    run_owner, run_k, run_outcome = _runs(connection, wanted)
    run_start, run_number = _of_each(run_owner, wanted)
    return OutcomeMaps(
        combination_id=wanted,
        start=start,
        k_lo=low[number],
        k_hi=high[number],
        outcome=outcome[number],
        known_from=known_from,
        run_start=run_start,
        run_k=run_k[run_number],
        run_outcome=run_outcome[run_number],
    )


def _of_each(
    owner: NDArray[np.int64], wanted: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where the rows of each one wanted begin, and their numbers one after the other."""
    begin = np.searchsorted(owner, wanted, side="left")
    count = np.searchsorted(owner, wanted, side="right") - begin
    start = np.concatenate([[0], np.cumsum(count)])
    return start, np.repeat(begin - start[:-1], count) + np.arange(start[-1])


def _runs(
    connection: Connection, wanted: NDArray[np.int64]
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    column = simulation.c
    code = case((column.outcome == "toppled", TOPPLES), else_=SAFE)
    query = (
        select(column.combination_id, column.kr_over_pga, code)
        .where(
            column.combination_id.between(int(wanted.min()), int(wanted.max())),
            column.outcome.in_(("toppled", "stable")),
        )
        .order_by(column.combination_id, column.kr_over_pga)
    )
    owner, (k, outcome) = _columns(connection.execute(query).all(), 2)
    return owner, k, outcome


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
    owner, (low, high, outcome) = _columns(connection.execute(query).all(), 3)
    return owner, low, high, outcome


def _columns(rows: Sequence[Any], numbers: int) -> tuple[NDArray[np.int64], list[FloatArray]]:
    """Return the combination of each row, and its further numbers by column."""
    columns: list[Any] = list(zip(*rows, strict=True)) if rows else [()] * (1 + numbers)
    owner = np.array(columns[0], dtype=np.int64)
    return owner, [np.array(column, dtype=np.float64) for column in columns[1:]]


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
