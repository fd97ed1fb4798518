"""Fixtures shared with the tests of models, and models of single measures."""

from __future__ import annotations

from typing import Any

import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import save_model
from rbfrag.fragility.completion import Regression, encode_regressions
from rbfrag.fragility.methods import method_named
from tests.fragility.conftest import model as model
from tests.fragility.conftest import row as row

COEFFICIENTS: dict[str, tuple[str, tuple[float, ...]]] = {
    "pgv": ("toppling", (1.862, 0.567, 4.683, -0.155, -1.474)),
    "sa": ("toppling", (-2.163, 0.155, -0.109, 3.402)),
    "pga": ("toppling", (-1.167, 0.126, 2.977, 1.908, 3.284)),
    "pgv_pga": ("toppling", (2.356, 0.648, 2.292, 4.494, 1.018, 2.115)),
}
"""Method and coefficients of models of the measures that a hazard is given in, fitted to 749
recorded motions."""

REGRESSIONS = {
    "sa(1)": Regression([[-0.4, 0.77]] * 6, [0.35] * 6, [[0.3, 0.6]] * 6),
    "pga_g": Regression([[-2.2]] * 6, [0.55] * 6, [[0.6, 0.8]] * 6),
    "pga_g sa(1)": Regression([[-0.7, 0.6]] * 6, [0.23] * 6, [[0.2, 0.5]] * 6),
    "pga_g sa(0.3) sa(1)": Regression([[-0.3, 0.8]] * 6, [0.2] * 6, [[0.1, 0.4]] * 6),
    "pga_g sa(0.3) sa(1) sa(3)": Regression([[-0.2, 0.85]] * 6, [0.16] * 6, [[0.1, 0.3]] * 6),
    "pgv_m_s pga_g": Regression([[-0.2, -0.3, -0.04]] * 6, [0.2] * 6, [[0.2, 0.6]] * 6),
}
"""Of their spectral velocity, at all sizes alike."""


def measure_row(term: str, **changes: Any) -> ModelRow:
    """A stored model of a measure."""
    method, values = COEFFICIENTS[term]
    size = len(values)
    chosen: dict[str, Any] = {
        "name": f"{method}-{term}",
        "term": term,
        "method": method,
        "coefficients": dict(zip(method_named(method).forms[term].parameters, values, strict=True)),
        "covariance": tuple(tuple(0.003 * (i == j) for j in range(size)) for i in range(size)),
        "domain": {"p2": (0.1, 30.0)},
        "data_fingerprint": "f",
        "diagnostics": {"degrees_of_freedom": 46},
        "completions": encode_regressions(REGRESSIONS),
    }
    return ModelRow(**{**chosen, **changes})


@pytest.fixture(scope="session")
def measures_db(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A database of those models."""
    path = str(tmp_path_factory.mktemp("measures") / "models.db")
    with opened_database(path, create=True) as engine, engine.begin() as connection:
        for term in COEFFICIENTS:
            save_model(connection, measure_row(term))
    return path
