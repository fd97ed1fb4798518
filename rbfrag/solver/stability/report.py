"""A block's stability as scripts read it: a dictionary of plain values."""

from __future__ import annotations

import math
from typing import Any

from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import Stability


def as_dict(block: Block, found: Stability) -> dict[str, Any]:
    """Return the answer with the keys of the JSON contract.

    A yield acceleration that no number expresses is None; the state says why.

    Args:
        block: the block.
        found: its stability.
    """
    answer: dict[str, Any] = {
        "mode": found.mode,
        "state": found.state,
        "p2": block.p2,
        "kr": _finite(found.kr),
        "ky": _finite(found.ky),
        "ks": _finite(found.ks),
        "kct": _finite(found.kct),
        "yield_acceleration": _finite(found.yield_acceleration),
        "alpha1_deg": block.alpha1_deg,
        "alpha3_deg": block.alpha3_deg,
        "gamma_deg": block.gamma_deg,
        "r1_m": block.r1_m,
        "r2_m": block.r2_m,
        "r3_m": block.r3_m,
        "s1_m": block.s1_m,
        "s2_m": block.s2_m,
        "area_m2": block.area_m2,
        "shape_factor": block.shape_factor,
        "delta_deg": found.delta_deg,
        "margins": [
            {"variable": m.variable, "change_deg": m.change_deg, "mode": m.mode}
            for m in found.margins
        ],
        "cohesion": None,
        "warnings": list(found.warnings),
    }
    if found.cohesion is not None:
        answer["cohesion"] = {
            "ratio": found.cohesion.ratio,
            "ky": _finite(found.cohesion.ky),
            "phi_equivalent_deg": found.cohesion.phi_equivalent_deg,
            "ky_equivalent": _finite(found.cohesion.ky_equivalent),
        }
    return answer


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
