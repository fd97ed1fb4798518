"""Blocks that fail exactly as a formula says; slides of less than 1 mm are censored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.fit.data import LEAST_DISPLACEMENT_M, FitSource
from rbfrag.fragility.method import arrays
from rbfrag.fragility.methods import method_named
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import NUMERICS_VERSION
from tests.synthetic import unknown_measures

TRUE = {
    ("sliding", "pgv_pga"): (0.3, 0.8, 3.5, -0.6, 1.0),
    ("sliding", "pgv_pga_m"): (0.2, 0.8, 3.8, 0.4, -0.8, 1.4),
    ("sliding", "pgv_pga_ia"): (-0.9, 1.1, 2.9, 0.7, -0.9, 1.4),
    ("slumping", "pgv_pga_m"): (1.2, 3.0, 2.5, 1.2, 0.5),
    ("slumping", "pgv_pga"): (1.2, 3.0, 2.5, 1.2),
    ("confined_toppling", "pgv_pga_m"): (1.1, 2.6, 2.2, 0.4, 0.2),
    ("confined_toppling", "pgv_pga"): (1.2, 2.6, 2.3, 0.4),
}
METHOD_OF = {
    "sliding": method_named("displacement"),
    "slumping": method_named("capacity"),
    "confined_toppling": method_named("confined"),
}


def drawn(kind: str, term: str, n: int = 4000, seed: int = 1) -> FitSource:
    """Return combinations, each with one block that slides, or one under six scaled records."""
    rng = np.random.default_rng(seed)
    event = np.sort(rng.integers(0, 20, n))
    pulse = np.exp(rng.normal(-2.5, 0.5, n))
    z = rng.standard_normal(n)
    result = np.ones(n, dtype=bool)
    if kind == "sliding":
        pga = np.exp(rng.normal(-1.5, 0.6, n))
        values = {
            "ky": pga * rng.uniform(0.05, 0.95, n),
            "pga_g": pga,
            "pgv_m_s": pulse * pga * STANDARD_GRAVITY_M_S2,
            "displacement_m": np.ones(n),
            "magnitude": rng.uniform(5.0, 8.0, 20)[event],
        }
        values["arias_m_s"] = values["pgv_m_s"] ** 2 * np.exp(rng.normal(2.5, 0.7, n))
        unit = METHOD_OF[kind].forms[term].eta(TRUE[kind, term], values, arrays())
        slid = np.exp((unit.eta + z) * np.exp(unit.log_sigma))
        assert (slid < LEAST_DISPLACEMENT_M).any()
        k = values["ky"] / pga
        table = _table(event, pga, values["pgv_m_s"], result, k, np.full(n, np.nan))
        of_motion = {name: values[name] for name in ("magnitude", "arias_m_s")}
        return FitSource(
            replace(table, measures={**table.measures, **of_motion}),
            np.full(n, np.nan), k[:, None], np.full((n, 1), np.nan), slid[:, None],
        )  # fmt: skip
    ks, ps2 = np.exp(rng.normal(-1.5, 0.4, n)), np.exp(rng.normal(1.0, 0.8, n))
    pga = np.exp(rng.normal(-1.5, 0.6, n))
    magnitude = rng.uniform(5.5, 7.8, 20)[event]
    ratio = np.tile(np.geomspace(0.02, 0.95, 6), (n, 1))
    scaled = ks[:, None] / ratio
    values = {
        METHOD_OF[kind].block.strength: ks[:, None],
        "p": np.sqrt(ps2)[:, None],
        "pga_g": scaled,
        "pgv_m_s": scaled * (pulse * STANDARD_GRAVITY_M_S2)[:, None],
        "magnitude": magnitude[:, None],
    }
    eta = METHOD_OF[kind].forms[term].eta(TRUE[kind, term], values, arrays()).eta
    failed = (eta > rng.standard_normal(eta.shape)).astype(float)
    pgv = pulse * pga * STANDARD_GRAVITY_M_S2
    table = _table(event, pga, pgv, result & False, np.full(n, np.nan), ps2, ks, magnitude)
    return FitSource(table, np.full(n, np.nan), ratio, failed)


def _table(
    event: NDArray[np.int64],
    pga: NDArray[np.float64],
    pgv: NDArray[np.float64],
    result: NDArray[np.bool_],
    k_over_pga: NDArray[np.float64],
    p2: NDArray[np.float64],
    yield_g: NDArray[np.float64] | None = None,
    magnitude: NDArray[np.float64] | None = None,
) -> CombinationTable:
    n = event.size
    none = np.full(n, np.nan)
    return CombinationTable(
        combination_id=np.arange(1, n + 1),
        motion_id=np.arange(1, n + 1),
        event_id=np.array([f"event-{i:02d}" for i in event], dtype=object),
        event_guessed=np.zeros(n, dtype=bool),
        polarity=np.full(n, "forward", dtype=object),
        p2=p2,
        status=np.where(result, "found", "not_searched").astype(object),
        search_limit=np.full(n, 0.01),
        kr_over_pga=k_over_pga,
        upper=np.full(len(p2), np.nan),
        kr=k_over_pga * pga,
        y_m_s=none,
        pga_g=pga,
        pgv_m_s=pgv,
        pgd_m=none,
        tm_s=none,
        natural_key=np.array([f"key-{i:06d}" for i in range(n)], dtype=object),
        block=np.full(n, None, dtype=object),
        yield_g=none if yield_g is None else yield_g,
        numerics_version=np.full(n, NUMERICS_VERSION, dtype=object),
        measures=unknown_measures(n) | ({} if magnitude is None else {"magnitude": magnitude}),
    )
