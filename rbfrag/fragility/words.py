"""What a probability means, in sentences and rounded as people say it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rbfrag.solver.kinds import BY_MECHANICS
from rbfrag.vocabulary.quantities import MEASURES, NUMBERS, QUANTITIES

if TYPE_CHECKING:
    from rbfrag.db.model_file import ModelRow


def percent(share: float) -> str:
    """Return a share in percent with two digits."""
    if 0.0 < share < 5e-5:
        return "below 0.01 %"
    if 0.9995 <= share < 1.0:
        return "above 99.9 %"
    digits = 0 if share in (0.0, 1.0) or 0.0995 <= share < 0.995 else 1 if share >= 0.001 else 2
    return f"{100.0 * share:.{digits}f} %"


def interval(low: float, high: float) -> str:
    """Return an interval of shares in percent; one share where its ends read alike."""
    return " to ".join(dict.fromkeys((percent(low), percent(high))))


def with_interval(share: float, low: float, high: float) -> str:
    """Return a share in percent with its interval, unless that says no more."""
    ends = interval(low, high)
    return ends if ends == percent(share) else f"{percent(share)} ({ends})"


def prediction_in_words(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what P, its interval and the range at some sites mean, in counts of blocks.

    Args:
        document: an answer under the keys of the JSON contract.
    """
    p, level = document["probability"], f"{100.0 * document['level']:g} %"
    low, high = document["ci_low"], document["ci_high"]
    event_low, sites = document["event_low"], document.get("sites")
    questions = units_to_check(document["warnings"])
    if p == 1.0 and document["how"] == BY_MECHANICS:
        return (*questions, "P(failure) = 1   the block is unstable without shaking (by mechanics)")
    of = next((n for n in (100, 1000) if p * n >= 1.0 and (1.0 - p) * n >= 1.0), 10_000)
    if high == 0.0:
        return (*questions, "No such block fails.")
    of_block = document.get("block_sd")
    # what slides too far or slumps past a limit does not fall
    fall = "fall" if document["mode"] == "topple" else "fail"
    count, ends = _count(p, of), _range(low, high, of)
    one = "s" if count in ("1", "fewer than 1") else ""
    known = f"{'' if ends == count else f'{ends} '}as far as the data tell it"
    sentences = [
        *questions,
        f"This block {fall}s or stands; of {of:,} such cases {count} {fall}{one} ({known}, "
        f"{level}).",
    ]
    if sites is not None:
        where = f"At {at_sites(sites)}"
        sentences.append(
            f"{where} it is not known what share of such blocks {fall}s together."
            if event_low is None
            else f"{where}, facing all sides, {_range(event_low, document['event_high'], 100)} of "
            f"100 such blocks {fall} ({level})."
        )
    if of_block is not None:
        sentences.append(
            "The block is uncertain: among what it may be, P differs with a standard deviation of "
            f"{of_block:.2g}."
        )
    for name, about in (document.get("shaking") or {}).items():
        low, high = (about["median"] * math.exp(end * about["sigma"]) for end in (-1.0, 1.0))
        measure, _, unit = name.partition("_")
        sentences.append(
            f"The shaking is uncertain: the median of {measure.upper()} is {about['median']:.3g} "
            f"{unit.replace('_', '/')} with a scatter of {about['sigma']:.2f} in ln, {low:.2g} to "
            f"{high:.2g} in two of three cases."
        )
    return tuple(sentences)


def drained_in_words(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the drained bound of a block with water behind it; empty for a dry block.

    Args:
        document: an answer under the keys of the JSON contract.
    """
    bound = document.get("drained")
    if bound is None:
        return ()
    yields = [
        f"{QUANTITIES[n].symbol} = {bound[n]:.3g}, " for n in NUMBERS if bound.get(n) is not None
    ]
    p = with_interval(bound["probability"], bound["ci_low"], bound["ci_high"])
    return (f"Drained, without water pressure: {''.join(yields)}P = {p}.",)


def units_to_check(warnings: Iterable[str]) -> list[str]:
    """Return the questions about units, which stand above an answer."""
    return [text for text in warnings if text.startswith("Check the unit")]


def at_sites(number: float) -> str:
    """Return what the range of one earthquake is of."""
    return f"{number:,g} site{'s' if number > 1 else ''} of one earthquake"


def _count(share: float, of: int) -> str:
    count = round(share * of)
    if count in (0, of) and 0.0 < share < 1.0:
        return "fewer than 1" if count == 0 else f"more than {of - 1:,}"
    return f"{count:,}"


def _range(low: float, high: float, of: int) -> str:
    ends = _count(low, of), _count(high, of)
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def block_in_words(method: str, given: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what is asked about: the numbers of a block, and how it is taken to stand.

    Args:
        method: the one that the model which answers is fitted by.
        given: what the question gives, by the names of :func:`rbfrag.predict`.
    """
    from rbfrag.fragility.methods import method_named

    block = method_named(method).block
    values = {name: given.get(name) for name in (block.size, block.strength) if name is not None}
    if not all(isinstance(value, (int, float)) for value in values.values()):
        return ()
    units = {block.size: " 1/s²"}
    too_far = given.get("displacement_m")
    limit = (
        (f"It has failed when it has slid further than {too_far:g} m.",)
        if isinstance(too_far, (int, float))
        else ()
    )
    numbers = " and ".join(
        f"{QUANTITIES[name].symbol} = {value:.3g}{units.get(name, '')}"
        for name, value in values.items()
    )
    stands = (f"{block.support[:1].upper()}{block.support[1:]}.",) if block.support else ()
    return (f"The block has {numbers}.", *limit, *stands)


GLOSSARY = {
    "p²": "15/p² m is a rectangle's diagonal",
    "k_r": "acceleration in g that lifts it",
    "k_y": "acceleration in g that moves it",
    "in domain": "such as the data",
    "copula": "how the failures of one earthquake go together",
}
"""What a geologist cannot know of the words in answers."""


def glossary(*texts: str) -> str:
    """Return what words of some texts mean, each once; empty where none needs it."""
    meanings = (f"{word}: {GLOSSARY[word]}" for word in GLOSSARY if any(word in t for t in texts))
    return "; ".join(meanings)


def model_in_words(document: Mapping[str, Any]) -> str:
    """Return what people call the model of an answer: what it reads, and what tells it apart."""
    from rbfrag.fragility.measures import TERMS
    from rbfrag.fragility.method import TOPPLING_BLOCK
    from rbfrag.fragility.methods import method_named

    if (term := TERMS.get(document["term"])) is None:  # several models
        return str(document["model"])
    read = map(_measure, term.inputs)
    method = method_named(document["method"])
    kind = "" if method.block is TOPPLING_BLOCK else method.block.kind.replace("_", " ")
    own = "" if method.forms[term.name].rank == 0 else method.name
    sized = "size-dependent" if "block's" in term.title else ""
    return ", ".join(filter(None, (*read, sized, kind, own)))


def row_in_words(row: ModelRow) -> str:
    """Return what people call a stored model."""
    return model_in_words({"model": row.name, "term": row.term, "method": row.method})


def measures_in_words(names: Sequence[str]) -> str:
    """Return measures as people call them: "PGV and SA(1 s)"."""
    *others, last = map(_measure, names)
    return " and ".join(filter(None, (", ".join(others), last)))


def _measure(name: str) -> str:
    return MEASURES[name].title or QUANTITIES[name].symbol


def fitted_in_words(diagnostics: Mapping[str, Any]) -> str:
    """Return what a model is fitted on: outcomes, or critical values; empty where not stored."""
    outcomes, events = diagnostics.get("n_outcomes"), diagnostics.get("events")
    if not ((number := outcomes or diagnostics.get("n")) and events):
        return ""
    what = "outcomes" if outcomes else "critical values"
    recorded = diagnostics.get("recorded_events") != 0
    of = "earthquakes" if recorded else "synthetic pulses, which are not earthquakes"
    return f"fitted on {number:,} {what} of {events:,} {of}"
