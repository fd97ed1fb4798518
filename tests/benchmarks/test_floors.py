"""The lowest versions are those of pyproject.toml, and every dependency states one."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.floors import floors


def test_every_dependency_states_its_lowest_version() -> None:
    lowest = floors()
    assert {"numpy", "pandas", "scipy", "typer", "sqlalchemy", "pyarrow", "fastapi"} <= set(lowest)
    assert "pytest" not in lowest
    # statsmodels 0.14.2 rejects pandas 2.1.0
    assert (lowest["statsmodels"], lowest["pandas"]) == ("0.14.2", "2.1.1")


def test_a_dependency_without_a_bound_is_rejected(tmp_path: Path) -> None:
    project = tmp_path / "pyproject.toml"
    project.write_text('[project]\ndependencies = ["numpy"]\n[project.optional-dependencies]\n')
    with pytest.raises(ValueError, match="numpy states no lowest version"):
        floors(project)
