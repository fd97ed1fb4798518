"""Critical scales and sliding strengths as scripts read them: dictionaries of plain values."""

from __future__ import annotations

import math
from typing import Any

from rbfrag.solver.search.displacement import SlidingResult
from rbfrag.solver.search.scale import ScaledResult


def scaled_as_dict(result: ScaledResult) -> dict[str, Any]:
    """Return a critical scale with the keys of the JSON contract; None where there is no number."""
    found = result.scale is not None
    return {
        "kind": result.kind,
        "rotation_deg": result.rotation_deg,
        "scale": result.scale,
        "lower": result.lower,
        "upper": result.upper,
        "status": result.status,
        "starts_scale": result.starts,
        "scale_limit": result.scale_limit if math.isfinite(result.scale_limit) else None,
        "certified": result.certified,
        "reentrant": result.reentrant,
        "n_runs": result.n_runs,
        "k_over_pga": result.k_over_pga(result.scale) if result.scale is not None else None,
        "pga_at_failure_g": result.scale * result.pga_g if result.scale is not None else None,
        "y_m_s": result.y_m_s,
        "ks" if result.kind == "slumping" else "kct": result.yield_g,
        "ps2": result.p2,
        "leaves_g": result.leaves_g if math.isfinite(result.leaves_g) else None,
        "polarity": result.polarity,
        "pga_g": result.pga_g,
        "warnings": [*result.warnings, *([NOT_PROVEN] if found else [])],
    }


NOT_PROVEN = (
    "the scale is the smallest that was seen to fail: the scales between those that were looked "
    "at (5 % apart) are not proven safe"
)


def sliding_as_dict(result: SlidingResult) -> dict[str, Any]:
    """Return a critical sliding strength with the keys of the JSON contract."""
    return {
        "kind": "sliding",
        "displacement_m": result.displacement_m,
        "ky_over_pga": result.ky_over_pga,
        "lower": result.lower,
        "upper": result.upper,
        "ky": result.ky,
        "status": result.status,
        "search_limit": result.search_limit,
        "certified": result.status != "outside_model",
        "n_runs": result.n_runs,
        "polarity": result.polarity,
        "pga_g": result.pga_g,
        "warnings": list(result.warnings),
    }
