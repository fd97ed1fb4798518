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
    "pgv_kr": ("bounded", (-0.988, 2.461, 1.808, -0.176, -1.314)),
    "sa10": ("logistic", (-3.335, 0.524, -0.424, 3.717, -0.458, -2.271)),
    "pga": ("bounded", (-3.407, 1.602, -0.224, 1.351, -0.420)),
    "pga_sa10": ("bounded", (-2.853, 1.882, -0.266, 2.455, 1.666, -0.333)),
    "pga_sa03_sa10_sa30": (
        "bounded", (-2.381, 1.955, -0.338, 2.889, 0.280, 0.928, 0.990, -0.455)
    ),
}  # fmt: skip
"""Method and coefficients of models of the measures that a hazard is given in, fitted to 749
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
