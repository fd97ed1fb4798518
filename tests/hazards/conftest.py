"""Fixtures shared with the tests of models, and models of single measures."""

from __future__ import annotations

from typing import Any

import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import save_model
from rbfrag.fragility.methods import method_named
from tests.fragility.conftest import model as model
from tests.fragility.conftest import row as row

COEFFICIENTS: dict[str, tuple[str, tuple[float, ...]]] = {
    "pgv_kr": ("bounded", (-0.817, 0.128, -0.240, 2.410, 2.113, -1.211)),
    "sa10": ("logistic", (-3.006, 0.348, -0.275, 3.618, -0.412, -2.700)),
    "sa20": ("logistic", (-2.019, 0.388, -0.206, 3.106, -0.449, -3.771)),
    "sa30": ("logistic", (-1.400, 0.425, -0.168, 2.860, -0.500, -4.602)),
    "sa03": ("logistic", (-0.589, 0.280, -0.168, 2.372, 0.107, -2.711)),
    "pga": ("bounded", (-3.897, 1.627, -0.160, 1.659)),
    "pga_sa10": ("bounded", (-2.964, 2.038, -0.235, 2.727, 1.895, -0.327)),
    "pga_sa03_sa10_sa30": (
        "bounded",
        (-3.323, 2.719, -0.261, 3.149, 0.068, 0.172, 0.981, 0.038, 1.004, -0.363),
    ),
}
"""Method and coefficients of models of the measures that a hazard is given in, fitted to 265
recorded motions."""


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
