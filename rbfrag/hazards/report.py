"""Annual rates as scripts read them, a dictionary of plain values, and in a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility.words import percent
from rbfrag.hazards.answer import HazardAnswer
from rbfrag.hazards.curve import HazardCurve


def as_dict(
    curves: Sequence[HazardCurve],
    names: Sequence[Sequence[str | None]],
    answers: Sequence[HazardAnswer],
    remarks: Sequence[str] = (),
    refused: Mapping[int, Mapping[str, str]] | None = None,
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract.

    One block at one site is an object with its contributions; at several sites a list in it.
    Several blocks are a list in it beside what they do in common, at several sites a list of that.
    Those that cannot be used stand in the list without numbers, at several sites at its end.

    Args:
        names: identifiers of the blocks of each site.
        refused: rows of the table of blocks that cannot be used, by their index: ``block_id``,
            ``site_id`` and ``reason``.
    """
    rows = [
        {
            "site": curve.place or None,
            "block_id": name,
            "annual_rate": float(rates.annual_rate[i]),
            "ci_low": float(rates.ci_low[i]),
            "ci_high": float(rates.ci_high[i]),
            "numerical_error": float(rates.numerical_error[i]),
            "probability": float(rates.probability[i]),
            **_quantiles(rates, i),
        }
        for curve, own, rates in zip(curves, names, answers, strict=True)
        for i, name in enumerate(own)
    ]
    first = answers[0]
    shared = {
        "years": first.years,
        "level": first.level,
        "model": first.model,
        "term": first.term,
        "method": first.method,
        "imt": curves[0].imt,
        "curve_kind": first.curve_kind,
    }
    warnings = [*remarks, *_warnings(curves, answers)]
    if refused or any(len(own) > 1 for own in names):
        rows = _with_refused(rows, refused or {}, in_order=len(answers) == 1)
        sites = [_of_site(curve, one) for curve, one in zip(curves, answers, strict=True)]
        common = sites[0] if len(sites) == 1 else {"sites": sites}
        return {**common, **shared, "blocks": rows, "warnings": warnings}
    branches = {"branches": [one.as_dict() for one in first.branches]} if first.branches else {}
    if len(rows) > 1:
        return {**shared, "answers": rows, "warnings": warnings}
    del rows[0]["block_id"]
    contributions = [
        {"from": low, "to": high, "annual_rate": part}
        for low, high, part in zip(
            first.edges[:-1].tolist(), first.edges[1:].tolist(), first.contribution[0].tolist(),
            strict=True,
        )
    ]  # fmt: skip
    return {
        **rows[0], **shared, **branches, "contributions": contributions, "warnings": warnings,
    }  # fmt: skip


def _with_refused(
    rows: list[dict[str, Any]], refused: Mapping[int, Mapping[str, str]], *, in_order: bool
) -> list[dict[str, Any]]:
    """Return the rows with their reasons, and those that cannot be used among them."""
    empty = dict.fromkeys(rows[0])
    answered = iter([{**row, "reason": ""} for row in rows])
    others = {
        i: {**empty, "site": about.get("site_id"), "block_id": about["block_id"],
            "reason": about["reason"]}
        for i, about in refused.items()
    }  # fmt: skip
    if not in_order:
        return [*answered, *others.values()]
    places = range(max(len(rows) + len(refused), *refused, 0) + 1)
    merged = (others[i] if i in others else next(answered, None) for i in places)
    return [row for row in merged if row is not None]


def _warnings(curves: Sequence[HazardCurve], answers: Sequence[HazardAnswer]) -> list[str]:
    """Return the warnings, each once; one that does not hold of every site names its own."""
    everywhere = set.intersection(*(set(each.warnings) for each in answers))
    named = {
        text if text in everywhere or not curve.place else f"{curve.place}: {text}": None
        for curve, each in zip(curves, answers, strict=True)
        for text in each.warnings
    }
    return list(named)


def _quantiles(answer: HazardAnswer, i: int) -> dict[str, float]:
    """Return the quantiles of a block's rate over the branches of a logic tree."""
    return {
        f"annual_rate_p{round(100.0 * q):02d}": float(rates["annual_rate"][i])
        for q, rates in answer.quantiles.items()
    }


def _of_site(curve: HazardCurve, answer: HazardAnswer) -> dict[str, Any]:
    """Return what the blocks of one site do in common."""
    rate = answer.annual_rate_any
    common: dict[str, Any] = {"site": curve.place or None}
    if answer.joint is None:
        common |= {"annual_rate_any": rate, "probability_any": float(answer.probability[0])}
    else:
        common |= answer.joint.as_dict()
    common["expected_failures_per_year"] = answer.expected_failures_per_year
    common |= {
        f"annual_rate_any_p{round(100.0 * q):02d}": rates["annual_rate_any"]
        for q, rates in answer.quantiles.items()
        if "annual_rate_any" in rates
    }
    if answer.branches:
        common["branches"] = [one.as_dict() for one in answer.branches]
    return common


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


def beyond_in_words(answer: HazardAnswer) -> tuple[str, ...]:
    """Return what shaking beyond the end of a curve may do to one block, where that is much."""
    rate = float(answer.annual_rate[0])
    most = rate + float(answer.above_at_most[0] - answer.above[0])
    if not most > 2.0 * rate:
        return ()
    return (
        "The curve ends too early to tell: with the stronger shaking that it leaves out it may be "
        f"up to {once_in(most)}.",
    )
