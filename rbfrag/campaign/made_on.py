"""The machine that made a campaign's numbers."""

from __future__ import annotations

from rbfrag.campaign.machine import machine


def made_on() -> str:
    """Return processor and compiler: where both are the same, so is every bit of a result."""
    about = machine()
    return f"{about['processor']}, numba {about['numba']}"
