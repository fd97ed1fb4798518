"""constraints.txt: the versions that make installs, one of each package, within its bounds."""

from __future__ import annotations

import re
import sys
import tomllib
from itertools import chain

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.conftest import ROOT

LINE = re.compile(r"([A-Za-z0-9][A-Za-z0-9._-]*)==([0-9][A-Za-z0-9.]*)")


def test_constraints() -> None:
    comment, *lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert comment == "# Written by: make constraints"
    # names and versions alone: no address of an index, no path of a machine
    matches = {line: LINE.fullmatch(line) for line in lines}
    assert [line for line, match in matches.items() if match is None] == []
    versions = {canonicalize_name(match[1]): match[2] for match in matches.values() if match}
    assert len(versions) == len(lines)
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    extras = project["optional-dependencies"]
    named = ("plot", "postgres", "parquet", "excel", "gis", "mseed", "dask", "mesh", "service")
    declared = chain(
        project["dependencies"],
        *(extras[name] for name in (*named, "docs", "notebook", "samples", "dev")),
    )
    checked = 0
    for requirement in map(Requirement, declared):
        if requirement.name != "rbfrag":
            version = versions[canonicalize_name(requirement.name)]
            assert requirement.specifier.contains(version), requirement
            checked += 1
    assert checked > 30


@pytest.mark.skipif(sys.platform == "win32", reason="make is of Unix")
def test_makefile_and_ci_use_them() -> None:
    assert "$(CONSTRAINTS:%=--constraint %)" in (ROOT / "Makefile").read_text(encoding="utf-8")
    for file in (".ci/run", ".github/workflows/test.yml"):
        assert "--constraint constraints.txt" in (ROOT / file).read_text(encoding="utf-8")
