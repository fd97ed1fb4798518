"""Shared fixtures: where the real files are, and the rule for their absence."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def _folder(variable: str, default: str) -> Path:
    folder = Path(os.environ.get(variable) or ROOT / default)
    if folder.is_dir():
        return folder
    reason = f"no real files at {folder}: set {variable} to the folder that holds them"
    if os.environ.get("RBFRAG_TEST_REQUIRE_FILES"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def records_dir() -> Path:
    """Folder of real accelerograms with MANIFEST.csv."""
    return _folder("RBFRAG_TEST_RECORDS", "../shared/motions")


@pytest.fixture(scope="session")
def formats_dir() -> Path:
    """Folder of sample files of other tools."""
    return _folder("RBFRAG_TEST_FORMATS", "../shared/formats")
