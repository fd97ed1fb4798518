"""The lowest versions that the package allows:  python benchmarks/floors.py > floors.txt

Prints a constraints file for pip from the bounds in pyproject.toml; standard library only, so that
it runs before anything is installed. `make floors` tests the package with these versions.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

TOOLS = ("dev", "docs", "bench", "release", "samples")
"""Extras that no user of the package needs: their bounds are not promised."""

_BOUND = re.compile(r"([A-Za-z0-9._-]+)(?:\[[^\]]*\])?\s*>=\s*([0-9.]+)")


def floors(project: Path = ROOT / "pyproject.toml") -> dict[str, str]:
    """Return the lowest version of each dependency, its bounds as pyproject.toml states them.

    Raises:
        ValueError: a dependency without a lower bound.
    """
    about = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
    requirements = list(about["dependencies"])
    for extra, names in about["optional-dependencies"].items():
        if extra not in TOOLS:
            # an extra that names others of this package: theirs are here already
            requirements += [name for name in names if not name.startswith("rbfrag[")]
    lowest = {}
    for dependency in requirements:
        match = _BOUND.match(dependency)
        if match is None:
            raise ValueError(f"{dependency} states no lowest version")
        lowest[match[1]] = match[2]
    return lowest


def main() -> int:
    for name, version in sorted(floors().items()):
        print(f"{name}=={version}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
