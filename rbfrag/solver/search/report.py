"""A critical result as scripts read it: a dictionary of plain values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rbfrag.solver.results import CriticalResult


def as_dict(
    result: CriticalResult, *, remarks: Sequence[str] = (), full_map: bool = False
) -> dict[str, Any]:
    """Return the answer with the keys of the JSON contract.

    Args:
        result: the answer.
        remarks: warnings about the motion, which go before those of the answer.
        full_map: put the map of outcomes in.
    """
    answer: dict[str, Any] = {
        "kr_over_pga": result.kr_over_pga,
        "lower": result.lower,
        "upper": result.upper,
        "kr": result.kr,
        "y_m_s": result.y_m_s,
        "status": result.status,
        "search_limit": result.search_limit,
        "certified": result.certified,
        "k_up_over_pga": result.k_up_over_pga,
        "undecided": result.undecided,
        "island_width": result.island_width,
        "kr_over_pga_resolved": result.kr_over_pga_resolved,
        "reentrant": result.reentrant,
        "n_runs": result.n_runs,
        "p2": result.p2,
        "polarity": result.polarity,
        "pga_g": result.pga_g,
        "warnings": [*remarks, *result.warnings],
    }
    if full_map:
        answer["map"] = map_rows(result)
    return answer


def map_rows(result: CriticalResult) -> list[dict[str, Any]]:
    """Return the map of outcomes, one row per interval of k_r/PGA, rising."""
    found = result.intervals
    return [
        {"k_lo": low, "k_hi": high, "outcome": outcome}
        for low, high, outcome in zip(
            found.k_lo.tolist(), found.k_hi.tolist(), found.outcome, strict=True
        )
    ]
