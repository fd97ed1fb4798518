"""A critical result as scripts read it: a dictionary of plain values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import CriticalResult

NOT_PROVEN = (
    "the scale is the smallest that was seen to fail: the scales between those that were looked "
    "at (5 % apart) are not proven safe"
)


def as_dict(
    result: CriticalResult, *, remarks: Sequence[str] = (), full_map: bool = False
) -> dict[str, Any]:
    """Return the answer with the keys of the JSON contract.

    Args:
        result: the answer, of any kind.
        remarks: warnings about the motion, which go before those of the answer.
        full_map: put the map of outcomes in.
    """
    if "scale" in result.of_kind:
        answer = _scaled(result)
    elif "displacement_m" in result.of_kind:
        answer = _sliding(result)
    else:
        answer = _strength(result)
    answer |= {"polarity": result.polarity, "pga_g": result.pga_g}
    answer["warnings"] = [*remarks, *result.warnings]
    if result.of_kind.get("scale") is not None:
        answer["warnings"].append(NOT_PROVEN)
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


def _strength(result: CriticalResult) -> dict[str, Any]:
    return {
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
    }


def _sliding(result: CriticalResult) -> dict[str, Any]:
    return {
        "kind": result.kind,
        "displacement_m": result.of_kind["displacement_m"],
        "ky_over_pga": result.kr_over_pga,
        "lower": result.lower,
        "upper": result.upper,
        "ky": result.kr,
        "status": result.status,
        "search_limit": result.search_limit,
        "certified": result.certified,
        "n_runs": result.n_runs,
    }


def _scaled(result: CriticalResult) -> dict[str, Any]:
    its = result.of_kind
    scale, limit, leaves_g = its["scale"], its["scale_limit"], its["leaves_g"]
    y_m_s = None
    if scale is not None:
        y_m_s = its["yield_g"] / scale * STANDARD_GRAVITY_M_S2 / math.sqrt(result.p2)
    return {
        "kind": result.kind,
        "rotation_deg": its["rotation_deg"],
        "scale": scale,
        "lower": its["lower_scale"],
        "upper": scale,
        "status": result.status,
        "starts_scale": its["starts_scale"],
        "scale_limit": limit if math.isfinite(limit) else None,
        "certified": result.certified,
        "reentrant": result.reentrant,
        "n_runs": result.n_runs,
        "k_over_pga": result.kr_over_pga,
        "pga_at_failure_g": None if scale is None else scale * result.pga_g,
        "y_m_s": y_m_s,
        its["yield_name"]: its["yield_g"],
        "ps2": result.p2,
        "leaves_g": leaves_g if math.isfinite(leaves_g) else None,
    }
