"""Made-up critical values and a model of them, for figures."""

from __future__ import annotations

import numpy as np

from rbfrag.db.model_file import ModelRow
from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.model import FragilityModel
from rbfrag.solver.results import NUMERICS_VERSION
from tests.synthetic import unknown_measures

N = 400


def critical_values(n: int = N) -> CombinationTable:
    """Critical values that grow with PGV; every tenth lies below the search limit."""
    random = np.random.default_rng(6)
    pgv = np.exp(random.uniform(-4, 0.3, n))
    y = np.abs(0.72 * pgv + random.normal(size=n) * np.sqrt(1e-4 + 2e-3 * pgv))
    result = np.arange(n) % 10 != 0
    keep = np.where(result, 1.0, np.nan)
    p2 = random.choice([30.0, 3.0, 0.3], n)
    tm = np.exp(random.uniform(-2, 0.5, n))
    ratio = 2.0 * np.pi / (tm * np.sqrt(p2))
    return CombinationTable(
        combination_id=np.arange(n),
        motion_id=np.arange(n),
        event_id=np.array([f"event-{i % 7}" for i in range(n)], dtype=object),
        event_guessed=np.zeros(n, dtype=bool),
        polarity=np.full(n, "forward", dtype=object),
        p2=p2,
        status=np.where(result, "found", "below_limit").astype(object),
        search_limit=np.full(n, 0.01),
        kr_over_pga=keep * np.minimum(1.2 / ratio, 0.9),
        upper=np.full(len(p2), np.nan),
        kr=keep * y / 9.80665,
        y_m_s=keep * y,
        pga_g=np.full(n, 0.5),
        pgv_m_s=pgv,
        pgd_m=0.1 * pgv,
        tm_s=tm,
        natural_key=np.arange(n).astype(str).astype(object),
        block=np.full(n, None, dtype=object),
        yield_g=np.full(n, np.nan),
        numerics_version=np.full(n, NUMERICS_VERSION, dtype=object),
        measures=unknown_measures(n),
    )


def straight_line_model(term: str = "pgv") -> FragilityModel:
    """A straight-line model with a domain."""
    coefficients = {"c0": 0.002, "c1": 0.72, "v0": 1e-4, "v1": 2e-3}
    if term == "pgd_tm":
        coefficients["v2"] = 0.0
    return FragilityModel.from_row(
        ModelRow(
            name=f"wls-{term}",
            term=term,
            method="wls",
            coefficients=coefficients,
            covariance=tuple(map(tuple, (1e-6 * np.eye(len(coefficients))).tolist())),
            domain={"p2": (0.1, 30.0), "intensity_m_s": (0.02, 1.2), "y_m_s": (0.01, 1.0)},
            data_fingerprint="",
            diagnostics={"n": 360, "events": 7},
        )
    )
