"""Answers about many blocks or many earthquakes in words, rounded as an engineer writes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbfrag.results.numbers import count_of


def campaign_in_words(report: Mapping[str, Any]) -> str:
    """Return what a campaign has stored.

    Args:
        report: an answer of `rbfrag simulate` under the keys of the JSON contract.
    """
    total, before = report["combinations"], report["resumed"]
    parts = [
        f"{report[key]:,} {text}"
        for key, text in (
            ("found", "with a critical value"),
            ("below_limit", "of which nothing fails down to the search limit"),
            ("no_motion", "that move nothing"),
            ("outside_model", "outside the model"),
            ("not_searched", "with outcomes of a grid alone"),
        )
        if report[key]
    ]
    stored = f", {before:,} of them before" if before else ""
    return (
        f"{count_of(total, 'combination')} of kind {report['kind']} "
        f"{'is' if total == 1 else 'are'} stored{stored}: {', '.join(parts) or 'none'}."
    )
