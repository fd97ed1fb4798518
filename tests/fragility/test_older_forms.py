"""Models of older forms are rejected, with the line that fits them again."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from rbfrag.cli.main import app
from rbfrag.db.engine import opened_database
from rbfrag.db.model_file import MODEL_FORM, ModelRow
from rbfrag.db.models import save_model
from rbfrag.errors import ModelError
from rbfrag.fragility.model import FragilityModel
from rbfrag.question.question import predict


def app_command(name: str) -> Any:
    return get_command(app).get_command(None, name)  # type: ignore[attr-defined, arg-type]


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({}, "rbfrag fit --term pgv --method wls --name mine --replace"),
        (
            {"diagnostics": {"suite": "my suite", "vertical": "both", "doubtful_pgd": True}},
            "rbfrag fit --term pgv --method wls --suite 'my suite' --vertical both --doubtful-pgd "
            "--name mine --replace",
        ),
        (
            {
                "name": "slow slump", "kind": "slumping", "term": "pgv_pga", "method": "capacity",
                "coefficients": {"c": 0.0, "b": 1.0, "s0": -1.0},
                "diagnostics": {"rotation_deg": 2.0, "suite": None, "vertical": "without"},
            },
            "rbfrag fit --kind slumping --term pgv_pga --method capacity --rotation 2.0 "
            "--name 'slow slump' --replace",
        ),
        (
            {"method": "lognormal", "coefficients": {"a": 1.0, "b": 1.0, "m_minus_1": 0.1}},
            "rbfrag fit --term pgv --method lognormal --free-m --name mine --replace",
        ),
    ],
)  # fmt: skip
def test_the_line_fits_it_again(
    row: Callable[..., ModelRow], changes: dict[str, object], line: str
) -> None:
    with pytest.raises(ModelError, match="fitted by an older rbfrag") as rejected:
        FragilityModel.from_row(row(**{"name": "mine", "form": MODEL_FORM - 1, **changes}))
    assert str(rejected.value).endswith(line)
    assert len(str(rejected.value)) < 500
    words = shlex.split(line)[2:]
    asked = app_command("fit").make_context("fit", words).params
    assert asked["name"] == changes.get("name", "mine")
    assert asked["replace"] is True


def test_predict_rejects_it(row: Callable[..., ModelRow], tmp_path: Path) -> None:
    file = tmp_path / "old.db"
    with opened_database(file, create=True) as engine, engine.begin() as connection:
        save_model(connection, replace(row(), form=1))
    for named in (None, "wls-pgv"):
        with pytest.raises(ModelError, match="rbfrag fit --term pgv --method wls"):
            predict(3.0, 0.1, pgv_m_s=0.6, db=file, model=named)
