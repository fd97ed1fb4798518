"""Answers about probabilities in words: the headline, labelled lines, and names of models."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rbfrag.results.numbers import confidence, interval, percent, with_interval
from rbfrag.solver.kinds import BY_MECHANICS
from rbfrag.vocabulary.quantities import INTENSITY, MEASURES, NUMBERS, QUANTITIES

if TYPE_CHECKING:
    from rbfrag.db.model_file import ModelRow


def headline(document: Mapping[str, Any]) -> str:
    """Return the probability with its interval: "P(toppling) = 15 %   (95 % confidence …)".

    Args:
        document: an answer under the keys of the JSON contract.
    """
    p, how = document["probability"], document["how"]
    state = document["failure"].replace("_", " ")
    if p in (0.0, 1.0) and how == BY_MECHANICS:
        reason = "   the block is unstable without shaking" if p == 1.0 else ""
        return f"P({state}) = {p:g}{reason}   (by mechanics)"
    ends = confidence(document["level"], interval(document["ci_low"], document["ci_high"]))
    value = percent(p)
    return f"P({state}) {value if value[0] in '<>' else f'= {value}'}   ({ends})"


def lines(document: Mapping[str, Any], given: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield label and text of what was asked and of what the answer holds besides P.

    Args:
        document: an answer under the keys of the JSON contract.
        given: numbers of the block and measures that it is the answer for.
    """
    if shaking := shaking_in_words(document.get("shaking") or {}, given):
        yield "Shaking", shaking
    if (sites := document.get("sites")) is not None:
        yield "Sites", _at_sites_in_words(document, sites)
    if block := block_in_words(document["method"], given):
        yield "Block", block
    if (median_m := document.get("median_displacement_m")) is not None:
        yield "", f"median displacement {median_m:.2g} m"
    if (sd := document.get("block_sd")) is not None:
        yield "", f"block uncertainty: standard deviation of P {sd:.2g}"
    if drained := drained_in_words(document):
        yield "Drained", drained
    inside = "within" if document["in_domain"] else "outside"
    answers = document["model"] if document["how"] != BY_MECHANICS else "mechanics, not the model"
    yield "Model", f"{answers}, {document['data']}; inputs {inside} the fitted range"


def shaking_in_words(shaking: Mapping[str, Any], given: Mapping[str, Any]) -> str:
    """Return the measures of a question: "PGV 0.9 m/s, PGA 0.6 g"; medians where they scatter."""
    parts = [
        f"{_measure(name)} {given[name]:.4g} {QUANTITIES[name].unit}".rstrip()
        for name in INTENSITY
        if isinstance(given.get(name), int | float) and name not in shaking
    ]
    parts += [
        f"median {_measure(name)} {about['median']:.2g} {QUANTITIES[name].unit}, σ_ln "
        f"{about['sigma']:.2g}, integrated"
        for name, about in shaking.items()
    ]
    return ", ".join(parts)


def _at_sites_in_words(document: Mapping[str, Any], sites: float) -> str:
    where = f"in one earthquake at {sites:,g} such site{'s' if sites > 1 else ''}"
    if document["event_low"] is None:
        return f"{where}: unknown which fraction of the blocks fails"
    ends = interval(document["event_low"], document["event_high"])
    level = f"{100.0 * document['level']:g} %"
    return f"{where}, {ends} of the blocks fail ({level} prediction interval)"


def drained_in_words(document: Mapping[str, Any]) -> str:
    """Return the drained bound of a block with water behind it; empty for a dry block.

    Args:
        document: an answer under the keys of the JSON contract.
    """
    bound = document.get("drained")
    if bound is None:
        return ""
    yields = [
        f"{QUANTITIES[n].symbol} = {bound[n]:.3g}, " for n in NUMBERS if bound.get(n) is not None
    ]
    p = with_interval(bound["probability"], bound["ci_low"], bound["ci_high"])
    return f"{''.join(yields)}P = {p}, without water pressure"


def units_to_check(warnings: Iterable[str]) -> list[str]:
    """Return the questions about units, which stand above an answer."""
    return [text for text in warnings if text.startswith("Check the unit")]


def at_sites(number: float) -> str:
    """Return what the range of one earthquake is of."""
    return f"{number:,g} site{'s' if number > 1 else ''} of one earthquake"


def block_in_words(method: str, given: Mapping[str, Any]) -> str:
    """Return the numbers of a block and how it stands: "p² = 7.21 s⁻², k_r = 0.2; rock …".

    Args:
        method: the one that the model which answers is fitted by.
        given: what the question gives, by the names of :func:`rbfrag.predict`.
    """
    from rbfrag.fragility.methods import method_named

    block = method_named(method).block
    values = {name: given.get(name) for name in (block.size, block.strength) if name is not None}
    if not all(isinstance(value, (int, float)) for value in values.values()):
        return ""
    numbers = [
        f"{QUANTITIES[name].symbol} = {value:.3g}{' s⁻²' if name == block.size else ''}"
        for name, value in values.items()
    ]
    limit_m = given.get("displacement_m")
    if isinstance(limit_m, (int, float)):
        numbers.append(f"displacement limit {limit_m:g} m")
    return "; ".join(filter(None, (", ".join(numbers), block.support)))


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
