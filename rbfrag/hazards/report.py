"""Annual rates as scripts read them: a dictionary of plain values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rbfrag.hazards.answer import HazardAnswer
from rbfrag.hazards.curve import HazardCurve


def as_dict(
    curves: Sequence[HazardCurve],
    names: Sequence[str | None],
    answers: Sequence[HazardAnswer],
    remarks: Sequence[str] = (),
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract.

    One block at one site is an object with its contributions; at several sites a list in it.
    Several blocks are a list in it beside what they do in common, at several sites a list of that.
    """
    rows = [
        {
            "site": curve.place or None,
            "block_id": name,
            "annual_rate": float(rates.annual_rate[i]),
            "ci_low": float(rates.ci_low[i]),
            "ci_high": float(rates.ci_high[i]),
            "probability": float(rates.probability[i]),
        }
        for curve, rates in zip(curves, answers, strict=True)
        for i, name in enumerate(names)
    ]
    shared = {
        "years": answers[0].years,
        "level": answers[0].level,
        "model": answers[0].model,
        "term": answers[0].term,
        "method": answers[0].method,
        "imt": curves[0].imt,
    }
    warnings = [*remarks, *dict.fromkeys(word for each in answers for word in each.warnings)]
    if answers[0].joint is not None:
        sites = [_of_site(curve, one) for curve, one in zip(curves, answers, strict=True)]
        common = sites[0] if len(sites) == 1 else {"sites": sites}
        return {**common, **shared, "blocks": rows, "warnings": warnings}
    if len(rows) > 1:
        return {**shared, "answers": rows, "warnings": warnings}
    del rows[0]["block_id"]
    first = answers[0]
    contributions = [
        {"from": low, "to": high, "annual_rate": part}
        for low, high, part in zip(
            first.edges[:-1].tolist(), first.edges[1:].tolist(), first.contribution[0].tolist(),
            strict=True,
        )
    ]  # fmt: skip
    return {**rows[0], **shared, "contributions": contributions, "warnings": warnings}


def _of_site(curve: HazardCurve, answer: HazardAnswer) -> dict[str, Any]:
    """Return what several blocks of one site do in common."""
    assert answer.joint is not None
    return {
        "site": curve.place or None,
        **answer.joint.as_dict(),
        "expected_failures_per_year": answer.expected_failures_per_year,
    }
