"""Cases that every change of the solver must survive, each against an integrator of its own.

    python -m benchmarks.hard_cases [MODULE ...] [--write]

Every module of this folder has a function `rows()` that runs its seeded cases and returns the rows
of one table; it prints a line to stderr for each case that is wrong or beyond its error estimate.
"""

from __future__ import annotations

from typing import NamedTuple


class Row(NamedTuple):
    """One row of the table: what was tried, against what, and how it went.

    Args:
        subject: the cases, in few words.
        against: what judges, which shares no code with the solver: an integrator, a closed form.
        tried: how many cases.
        wrong: how many with a wrong outcome, or with an error beyond the estimate.
        within: how many within the error estimate, or certified.
        undecided: how many without: undetermined, not certified, or without an estimate.
    """

    subject: str
    against: str
    tried: int
    wrong: int
    within: int
    undecided: int
