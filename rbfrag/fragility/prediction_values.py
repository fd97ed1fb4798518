"""The numbers that a prediction works with, from those that are given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

NEUTRAL: Mapping[str, float] = {"pgv_m_s": 1.0, "pga_g": 5.0, "tm_s": 1.0, "pgd_m": 1.0}
"""What stands for a measure that is not given where a formula does not read it."""


def neutral_tm_s(model: FragilityModel) -> float:
    """Return a Tm [s] within the model's fitted range."""
    return min(max(model.limits[6], 0.02), 10.0)


def derived(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values with PGV/(PGA g) [s] where both are known."""
    if "pgv_m_s" in values and "pga_g" in values:
        values["pgv_over_pga_s"] = pgv_over_pga_s(values["pgv_m_s"], values["pga_g"])
    return values


def pgv_over_pga_s(pgv_m_s: Any, pga_g: Any) -> Any:
    """Return PGV/(PGA g) [s]."""
    return pgv_m_s / (pga_g * STANDARD_GRAVITY_M_S2)
