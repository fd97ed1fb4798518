"""Answers about many blocks or many earthquakes in words, rounded as an engineer writes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rbfrag.cli.sentences import rounded
from rbfrag.fragility.words import percent, with_interval
from rbfrag.hazards import between_measures
from rbfrag.hazards.report import once_in

if TYPE_CHECKING:
    from rbfrag.hazards.losses import LossAnswer
    from rbfrag.hazards.survival import SurvivalAnswer


def several(number: int, what: str) -> str:
    """Return a number of things, in the plural where it is not one."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def rounded_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values with three digits where they are no counts, names or yes and no."""
    return {
        name: float(f"{value:.3g}") if isinstance(value, float) else value
        for name, value in values.items()
    }


def place_in_words(lon: float, lat: float) -> str:
    """Return a place of a longitude and latitude [deg] with letters in the place of signs."""
    return f"{abs(lat):.3f} {'S' if lat < 0.0 else 'N'}, {abs(lon):.3f} {'W' if lon < 0.0 else 'E'}"


def most_often(names: Sequence[str | None], rates: Sequence[float], most: int = 3) -> str:
    """Return which of several blocks fail most often, the first of them, each with its rate.

    Args:
        names: identifiers of the blocks; a block without one is called by its number.
        rates: how often each fails [1/a].
        most: how many are named at most.
    """
    first = sorted(range(len(rates)), key=lambda i: -rates[i])[:most]
    named = [f"{names[i] or f'block {i + 1}'} ({once_in(rates[i])})" for i in first]
    if len(named) == 1:
        return f"Most often fails {named[0]}."
    return f"Most often fail {', '.join(named[:-1])} and {named[-1]}."


def map_in_words(document: Mapping[str, Any], *, own: bool) -> Iterator[str]:
    """Yield where blocks topple most, and how many are expected to.

    Args:
        document: an answer of `rbfrag shakemap` under the keys of the JSON contract.
        own: blocks at places of their own, and not one at every node.
    """
    place = place_in_words(document["largest_at_lon"], document["largest_at_lat"])
    likely, places = document["places_above_1_percent"], document["places"]
    yield (
        f"{'A block' if own else 'Such a block'} topples with a probability of up to "
        f"{percent(document['largest_probability'])}, at {place}; it is above 1 % at {likely:,} "
        f"of {several(places, 'place')}."
    )
    if own:
        some = document["probability_any"]
        yield (
            f"{rounded(document['expected_failures'])} of {several(places, 'block')} are expected "
            "to topple"
            + ("" if some is None else f", at least one with a probability of {percent(some)}")
            + "."
        )


def survival_in_words(answer: SurvivalAnswer) -> Iterator[str]:
    """Yield how likely the blocks stand, and what that says of the hazard."""
    one = answer.blocks == 1
    who = "the block stands" if one else f"all {answer.blocks} blocks stand"
    sd = f" (standard deviation {answer.age_sd_years:,.6g})" if answer.age_sd_years else ""
    rate = answer.annual_rate_any
    often = "never fails" if rate == 0.0 else f"fails {once_in(rate)} on average"
    yield (
        f"{_condition(answer)}, {who} for {answer.age_years:,.6g} years{sd} with a probability of "
        f"{with_interval(answer.probability_standing, answer.ci_low, answer.ci_high)}; "
        f"{'it' if one else 'one of them'} {often}."
    )
    five = answer.factor_5_percent
    if five is None:
        yield "No factor on its rates makes that improbable: the blocks say nothing against it."
    elif five < 1.0:
        yield (
            "That is less than 5 %: it would be 5 % if all rates of the hazard were multiplied by "
            f"{float(f'{five:.2g}'):,.15g}."
        )
    else:
        yield (
            f"Standing does not contradict it: all rates of the hazard would have to be about "
            f"{float(f'{five:.2g}'):,.15g} times as high to leave 5 %."
        )


def _condition(answer: SurvivalAnswer) -> str:
    if len(answer.branches) == 1:
        return "If the hazard is right"
    weighted = answer.branches[0].name != answer.hazard
    return f"Over {answer.hazard}" if weighted else f"If the hazard of {answer.hazard} is right"


def losses_in_words(answer: LossAnswer) -> Iterator[str]:
    """Yield how many blocks fail, how often one does, what it costs, and what is not known."""
    failures, rate = answer.average_annual_failures, answer.annual_rate_any
    blocks = several(int(answer.portfolio.count.sum()), "block")
    if answer.events.is_scenario:
        yield f"{rounded(failures)} of {blocks} are expected to fail."
        if rate is not None:
            yield f"At least one fails with a probability of {percent(rate)}."
    else:
        yield (
            f"{rounded(failures)} failures a year are expected of {blocks}; the events cover "
            f"{answer.events.effective_years:,.0f} years."
        )
        if rate is not None:
            often = f"{once_in(rate)} on average" if rate > 0.0 else "never"
            yield f"An earthquake fails at least one of them {often}."
        if answer.average_annual_loss is not None:
            yield f"The average annual loss is {rounded(answer.average_annual_loss)}."
    yield from _not_known(answer)


def _not_known(answer: LossAnswer) -> Iterator[str]:
    """Yield what is not known of the failures expected, a sentence each: they do not add up."""
    of, level = answer.uncertainty["average_annual_failures"], f"{100.0 * answer.level:g} %"

    def ends(interval: tuple[float, float]) -> str:
        return f"between {rounded(interval[0])} and {rounded(interval[1])}"

    another = "other ground motions of it" if answer.events.is_scenario else "another event set"
    yield f"Counting: {another} as long would give {ends(of.counting)} ({level})."
    if of.knowledge is not None:
        yield f"Knowledge: the data leave the model open {ends(of.knowledge)} ({level})."
    if answer.tau is not None:
        yield between_measures.in_words(answer.tau)
    if of.branches is not None:
        yield f"Branches: 90 % of the logic tree lies {ends(of.branches)}."
    elif len(answer.events.realization_weights) > 1:
        yield (
            "Branches: counting makes most of what the realizations differ by; hazard curves of "
            "them tell more."
        )


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
        f"{several(total, 'combination')} of kind {report['kind']} "
        f"{'is' if total == 1 else 'are'} stored{stored}: {', '.join(parts) or 'none'}."
    )
