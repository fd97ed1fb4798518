"""Write P and its interval for each draw of eight blocks: the fixture of `test_check_values.py`.

Run once in a worktree of commit dfc2e98b, whose models the check values belong to:

    git worktree add ../reference dfc2e98b
    PYTHONPATH=../reference python tests/question/measurement/draws_of_reference.py

The lattice and the distributions are written out here, independent of the package.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri

import rbfrag

FIXTURE = Path(__file__).with_name("reference_draws.npz")
N = 512
Z = (1, 182667, 469891, 498753, 110745, 250185, 118627)

SLAB = {"height_m": 2.0, "width_m": 0.4, "beta_deg": 0.0, "phi_deg": 40.0}
FOUR = {"height_m": 0.1, "width_m": 0.04, "beta_deg": 2.0, "phi_deg": 3.0}
ROWS: tuple[tuple[dict[str, Any], dict[str, float]], ...] = (
    ({**SLAB, "pgv_m_s": 0.9}, FOUR),
    ({**SLAB, "pgv_m_s": 0.9}, {"beta_deg": 2.0}),
    ({**SLAB, "pgv_m_s": 0.9}, {"width_m": 0.008, "beta_deg": 1.0}),
    ({**SLAB, "beta_deg": 9.0, "pgv_m_s": 0.9}, FOUR),
    (
        {"height_m": 1.0, "width_m": 2.0, "beta_deg": 20.0, "phi_deg": 35.0,
         "displacement_m": 0.1, "pgv_m_s": 0.6, "pga_g": 0.6},
        {"beta_deg": 2.0, "phi_deg": 3.0},
    ),
    (
        {"s1_m": 2.0, "s2_m": 0.8, "gamma_deg": 80.0, "beta_deg": 18.0, "phi_deg": 40.0,
         "phi_back_deg": 35.0, "displacement_m": 0.1, "pgv_m_s": 0.9, "pga_g": 0.8},
        {"s1_m": 0.2, "s2_m": 0.08, "gamma_deg": 3.0, "beta_deg": 2.0, "phi_deg": 3.0,
         "phi_back_deg": 3.0},
    ),
    (
        {"height_m": 2.0, "width_m": 0.4, "beta_deg": 0.0, "kind": "rocking", "pgv_m_s": 0.6,
         "pga_g": 0.6},
        {"height_m": 0.1, "width_m": 0.04, "beta_deg": 2.0},
    ),
    (
        {**SLAB, "magnitude": 6.8, "rjb_km": 12.0, "vs30_m_s": 760.0,
         "amplification": 1.0},
        {**FOUR, "amplification": 0.2},
    ),
)  # fmt: skip


def drawn(inputs: dict[str, Any], sigmas: dict[str, float]) -> dict[str, Any]:
    """Return the inputs with an array of draws for each uncertain field."""
    values = dict(inputs)
    i = np.arange(N)
    for step, (name, sigma) in zip(Z, sigmas.items(), strict=False):
        z = ndtri((i * step % N) / N + 0.5 / N)
        if name == "amplification":
            values[name] = np.exp(sigma * z)
        elif name.endswith("_m"):
            values[name] = inputs[name] * np.exp(np.sqrt(np.log1p((sigma / inputs[name]) ** 2)) * z)
        else:
            values[name] = inputs[name] + sigma * z  # far from the ends of its range
    return values


def main() -> None:
    """Answer all draws and write them."""
    columns: dict[str, Any] = {}
    for number, (inputs, sigmas) in enumerate(ROWS, 1):
        answer = rbfrag.predict(**drawn(inputs, sigmas))
        excluded = answer.reason == "unstable"
        assert not np.isnan(answer.probability[~excluded]).any()
        for name in ("probability", "ci_low", "ci_high"):
            columns[f"{name}_{number}"] = np.where(excluded, np.nan, getattr(answer, name))
    np.savez_compressed(FIXTURE, **columns)


if __name__ == "__main__":
    sys.exit(main())
