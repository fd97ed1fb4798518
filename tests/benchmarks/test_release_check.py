"""Comparisons of the check of a release: versions in three files, lists of files."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.release_check import SHIPPED, differing, shipped_component, versions_agree
from tests.conftest import ROOT


def write_versions(root: Path, *, package: str, cited: str, heading: str) -> Path:
    (root / "rbfrag").mkdir()
    (root / "rbfrag/version.py").write_text(f'__version__ = "{package}"\n')
    (root / "CITATION.cff").write_text(f"cff-version: 1.2.0\nversion: {cited}\n")
    (root / "CHANGELOG.md").write_text(f"# Changelog\n\n{heading}\n\n## [0.0.9] - 2026-01-01\n")
    return root


def test_versions_that_agree(tmp_path: Path) -> None:
    root = write_versions(
        tmp_path, package="0.1.0", cited="0.1.0", heading="## [0.1.0] - 2026-11-23"
    )
    assert versions_agree(root) == "0.1.0"


@pytest.mark.parametrize(
    ("cited", "heading", "reason"),
    [
        ("0.2.0", "## [0.1.0] - 2026-11-23", "CITATION.cff 0.2.0"),
        ("0.1.0", "## [0.2.0] - 2026-11-23", "CHANGELOG.md 0.2.0"),
        ("0.1.0", "## [Unreleased]", "CHANGELOG.md Unreleased"),
        ("0.1.0", "## [0.1.0]", "has no day"),
    ],
)
def test_versions_that_differ(tmp_path: Path, cited: str, heading: str, reason: str) -> None:
    root = write_versions(tmp_path, package="0.1.0", cited=cited, heading=heading)
    with pytest.raises(RuntimeError, match=reason):
        versions_agree(root)


def test_files_too_many_and_too_few() -> None:
    assert differing(["a", "b"], ["b", "a"]) == ""
    assert differing(["a", "cache"], ["a", "b"]) == "not in the commit: cache; missing: b"


def test_a_shipped_library_is_in_the_bill_of_materials() -> None:
    result = shipped_component(ROOT / SHIPPED)
    assert result["name"] == "d3"
    assert result["purl"] == f"pkg:npm/d3@{result['version']}"
    assert f"| D3 {result['version']} |" in (ROOT / "docs/dependencies.md").read_text("utf-8")
