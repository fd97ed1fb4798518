"""Warnings have codes of one list, and stand in every JSON document."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest

from rbfrag.results.diagnostic import CODES, SEVERITIES, Diagnostic, with_diagnostics
from tests.cli.conftest import Shell, shell
from tests.conftest import ROOT

__all__ = ["shell"]


def texts_in_code() -> set[str]:
    """Return all texts in the package's code, where codes are used, without their list."""
    result: set[str] = set()
    for path in (ROOT / "rbfrag").rglob("*.py"):
        if path.name != "diagnostic.py":
            tree = ast.parse(path.read_text(encoding="utf-8"))
            result |= {
                node.value
                for node in ast.walk(tree)
                if isinstance(node, ast.Constant) and isinstance(node.value, str)
            }
    return result


def test_each_code_is_used_and_means_something() -> None:
    by_field = {"water_not_given", "cohesion_not_given"}  # made of the name of the field
    assert {*CODES} - texts_in_code() - by_field == set()
    assert all(severity in SEVERITIES and meaning for severity, meaning in CODES.values())
    with pytest.raises(AssertionError):
        Diagnostic("a text", "a_code_that_nobody_declared")


def test_a_diagnostic_is_its_text_and_keeps_its_code() -> None:
    warning = Diagnostic("wide", "extrapolation", rows=[2, 3])
    assert warning == "wide"
    assert warning.severity == "warning"
    assert warning.replaced(text="wider").code == "extrapolation"
    assert [*warning.replaced(text="wider").rows] == [2, 3]


def test_documents_have_a_diagnostic_for_each_warning(shell: Shell, tmp_path: Path) -> None:
    (tmp_path / "curve.csv").write_text("pgv_m_s,annual_rate\n0.1,0.03\n0.2,0.009\n0.4,0.002\n")
    shape = ("--height", "4", "--width", "2", "--dip", "20", "--phi", "40", "--water", "1")
    documents = [
        json.loads(shell(*words, "--json").stdout)
        for words in (
            ("predict", *shape, "--pgv", "5", "--tm", "0.5"),
            ("hazard", tmp_path / "curve.csv", *shape),
            ("block", *shape),
        )
    ]
    codes = []
    for document in documents:
        assert [diagnostic["text"] for diagnostic in document["diagnostics"]] == document[
            "warnings"
        ]
        codes.append({diagnostic["code"] for diagnostic in document["diagnostics"]})
    assert {"undrained", "extrapolation", "unused_measures", "density_assumed"} <= codes[0]
    assert {"undrained", "curve_ends", "single_component"} <= codes[1]
    assert "back_friction_neglected" in codes[2]


def test_a_document_without_warnings_is_left_as_it_is() -> None:
    assert with_diagnostics({"a": 1}) == {"a": 1}
    assert with_diagnostics([1.0, {"warnings": []}]) == [1.0, {"warnings": [], "diagnostics": []}]
