"""How often blocks fail, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbfrag.fragility.words import percent


def once_in(annual_rate: float) -> str:
    """Return a rate as people say it: once in so many years."""
    if not annual_rate > 1e-8:
        return "less than once in a hundred million years"
    years = float(f"{1.0 / annual_rate:.2g}")
    return f"once in {years:,.0f} years" if years >= 10.0 else f"once in {years:g} years"


def rate_in_words(document: Mapping[str, Any]) -> str:
    """Return how often one block fails.

    Args:
        document: an answer of `rbfrag hazard` for one block under the keys of the JSON contract.
    """
    rate, ends = document["annual_rate"], (document["ci_high"], document["ci_low"])
    most, least = (once_in(end).removeprefix("once in ").removesuffix(" years") for end in ends)
    interval = f" ({most} to {least}, {100.0 * document['level']:g} %)"
    return (
        f"The block fails {once_in(rate)} on average{interval if min(ends) > 1e-8 else ''}, with a "
        f"probability of {percent(document['probability'])} in {document['years']:g} years."
    )
