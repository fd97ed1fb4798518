"""One colour and one wording for each failure mode in all figures."""

from __future__ import annotations

from rbfrag.solver.stability.modes import ModeName

# Told apart by people who do not see red and green alike, and in grey.
COLOURS: dict[ModeName, str] = {
    "slide": "#2c6fad",
    "topple": "#d98c1f",
    "slump": "#8c2d4f",
    "confined_topple": "#4c9a6a",
}

LINES: dict[ModeName, str] = {
    "slide": "-",
    "topple": "-.",
    "slump": "--",
    "confined_topple": ":",
}


def words(mode: ModeName) -> str:
    """Return the name of a mode for people."""
    return mode.replace("_", " ")
