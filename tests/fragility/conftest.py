"""Critical values drawn from a straight line with known variance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rbfrag.db.model_file import ModelRow
from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.model import FragilityModel
from rbfrag.solver.results import NUMERICS_VERSION
from tests.fragility.portfolio_draws import SHARED
from tests.synthetic import unknown_measures

G = 9.80665
P2 = (30.0, 10.0, 3.0, 1.0, 0.3, 0.1)


def critical_values(
    *,
    events: int = 40,
    motions: int = 4,
    line: tuple[float, float] = (0.002, 0.72),
    variance: tuple[float, ...] = (1e-4, 2e-3),
    event_share: float = 0.0,
    term: str = "pgv",
    censor: bool = False,
    seed: int = 1,
) -> CombinationTable:
    """Draw y* = c0 + c1 x + noise; `event_share` of the noise variance is common to an event."""
    random = np.random.default_rng(seed)
    n_motions = events * motions
    motion = np.repeat(np.arange(n_motions), 2 * len(P2))
    n = motion.size
    event = motion // motions
    pgv = np.exp(random.uniform(np.log(0.02), np.log(1.5), n_motions))[motion]
    tm = np.exp(random.uniform(np.log(0.15), np.log(1.2), n_motions))[motion]
    pga = (pgv * 2 * np.pi / tm / G * np.exp(random.normal(0, 0.2, n_motions)[motion])) + 0.01
    pgd = pgv * tm / (2 * np.pi) * np.exp(random.normal(0, 0.5, n_motions)[motion])
    x = {"pgv": pgv, "pga_tm": pga * G * tm / (2 * np.pi), "pgd_tm": 2 * np.pi * pgd / tm}[term]
    v = sum(c * x**k for k, c in enumerate(variance))
    common = random.normal(size=events)[event]
    expected = random.normal(size=n)
    y = line[0] + line[1] * x
    y = y + np.sqrt(v) * (np.sqrt(event_share) * common + np.sqrt(1 - event_share) * expected)
    p2 = np.tile(P2, 2 * n_motions)
    kr = y * np.sqrt(p2) / G
    result = kr > 0.01 * pga if censor else np.ones(n, dtype=bool)
    keep = lambda a: np.where(result, a, np.nan)  # noqa: E731
    return CombinationTable(
        combination_id=np.arange(1, n + 1),
        motion_id=motion + 1,
        event_id=np.array([f"event-{i}" for i in event], dtype=object),
        event_guessed=np.zeros(n, dtype=bool),
        polarity=np.tile(np.repeat(["forward", "reverse"], len(P2)), n_motions).astype(object),
        p2=p2,
        status=np.where(result, "found", "below_limit").astype(object),
        search_limit=np.full(n, 0.01),
        kr_over_pga=keep(kr / pga),
        upper=np.full(len(p2), np.nan),
        kr=keep(kr),
        y_m_s=keep(y),
        pga_g=pga,
        pgv_m_s=pgv,
        pgd_m=pgd,
        tm_s=tm,
        natural_key=np.array([f"key-{i:06d}" for i in range(n)], dtype=object),
        block=np.full(n, None, dtype=object),
        yield_g=np.full(n, np.nan),
        numerics_version=np.full(n, NUMERICS_VERSION, dtype=object),
        measures=unknown_measures(n),
    )


@pytest.fixture(scope="session")
def draw() -> Callable[..., CombinationTable]:
    """The function that draws critical values."""
    return critical_values


def model_row(term: str = "pgv", **changes: object) -> ModelRow:
    """A stored model with round numbers."""
    coefficients = {"c0": 0.002, "c1": 0.72, "v0": 4e-5, "v1": 3e-3}
    if term == "pgd_tm":
        coefficients["v2"] = 5e-3
    errors = np.array([0.001, 0.02, 1e-5, 4e-4, 1e-3][: len(coefficients)])
    correlation = 0.7 * np.eye(errors.size) + 0.3
    values: dict[str, object] = {
        "name": f"wls-{term}",
        "term": term,
        "method": "wls",
        "coefficients": coefficients,
        "covariance": tuple(map(tuple, (correlation * np.outer(errors, errors)).tolist())),
        "domain": {
            "p2": (0.1, 30.0),
            "intensity_m_s": (0.02, 1.5),
            "y_m_s": (0.005, 1.4),
            "tm_s": (0.1, 1.5),
        },
        "data_fingerprint": "0" * 64,
        "dependence": SHARED,
    }
    return ModelRow(**{**values, **changes})  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def row() -> Callable[..., ModelRow]:
    """The function that makes a stored model."""
    return model_row


@pytest.fixture(scope="session")
def model(row: Callable[..., ModelRow]) -> FragilityModel:
    """A model on PGV with round numbers."""
    return FragilityModel.from_row(row())
