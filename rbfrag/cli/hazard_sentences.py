"""Answers about many blocks or many earthquakes in words, rounded as an engineer writes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from rbfrag.hazards import between_measures
from rbfrag.results.numbers import count_of, percent, return_period, rounded

if TYPE_CHECKING:
    from rbfrag.hazards.losses import LossAnswer


def rounded_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values with three digits where they are no counts, names or yes and no."""
    return {
        name: float(f"{value:.3g}") if isinstance(value, float) else value
        for name, value in values.items()
    }


def losses_in_words(answer: LossAnswer) -> Iterator[str]:
    """Yield the loss, the failures, how often one fails, and what is not known of them."""
    failures, rate = answer.average_annual_failures, answer.annual_rate_any
    blocks = count_of(int(answer.portfolio.count.sum()), "block")
    if answer.events.is_scenario:
        yield f"{'Expected failures':<28}{rounded(failures)} of {blocks}"
        if rate is not None:
            yield f"{'P(at least one failure)':<28}{percent(rate)}"
    else:
        if answer.average_annual_loss is not None:
            yield f"{'Average annual loss':<28}{rounded(answer.average_annual_loss)}"
        events = f"{answer.events.effective_years:,.0f}-year event set"
        yield f"{'Expected failures':<28}{rounded(failures)} /yr    {blocks}, {events}"
        if rate is not None:
            often = f"return period {return_period(rate)}" if rate > 0.0 else "none"
            yield f"{'At least one failure':<28}{often}"
    yield "Uncertainty of expected failures by source (not combined):"
    yield f"  {' · '.join(_sources(answer))}"


def _sources(answer: LossAnswer) -> Iterator[str]:
    """Yield what the expected failures are uncertain by, source by source."""
    of = answer.uncertainty["average_annual_failures"]

    def ends(source: tuple[float, float]) -> str:
        return f"{rounded(source[0])}–{rounded(source[1])}"

    yield f"event-set sampling {ends(of.counting)}"
    if of.knowledge is not None:
        yield f"fragility parameters {ends(of.knowledge)}"
    if of.branches is not None:
        yield f"logic tree {ends(of.branches)} (5th–95th)"
    if answer.tau is not None:
        low, high = between_measures.factors_between(answer.tau)
        yield f"choice of intensity measure × {low:.2f}–{high:.2f}"


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
