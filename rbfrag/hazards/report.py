"""Annual rates as scripts read them, a dictionary of plain values, and in a sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rbfrag.hazards import between_measures
from rbfrag.hazards.answer import HazardAnswer
from rbfrag.results.numbers import (
    NEVER,
    confidence,
    return_period,
    return_periods,
    with_interval,
    years,
)
from rbfrag.solver.kinds import by_model
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import QUANTITIES


def as_dict(
    answer: HazardAnswer,
    names: Sequence[str | None],
    remarks: Sequence[str] = (),
    refused: Mapping[int, Mapping[str, str]] | None = None,
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract.

    One block is an object with its contributions. Several are a list in it, beside what they do in
    common, at several sites beside a list of that. Those that cannot be used stand in the list
    without numbers.

    Args:
        names: identifiers of the blocks.
        refused: rows of the table of blocks that cannot be used, by their index: ``block_id``,
            ``site_id`` and ``reason``.
    """
    places = [curve.place or None for curve in answer.curves]
    columns = rate_columns(answer)
    rows = [
        {"site": places[site], "block_id": name, **dict(zip(columns, values, strict=True))}
        for site, name, *values in zip(
            answer.site.tolist(), names,
            *(or_null(column) for column in columns.values()),
            strict=True,
        )
    ]  # fmt: skip
    for row in rows:
        bound = row.pop("drained_annual_rate", None)
        row["drained"] = None if bound is None else {"annual_rate": float(bound)}
    shared = {
        "years": answer.years,
        "level": answer.level,
        "how": by_model(answer.model),
        "model": answer.model,
        "term": answer.term,
        "method": answer.method,
        "imt": answer.curves[0].imt,
        "curve_kind": answer.curve_kind,
        "between_measures": between_measures.as_dict(answer.tau),
    }
    warnings = [*remarks, *answer.warnings]
    branches = {"branches": [one.as_dict() for one in answer.branches]} if answer.branches else {}
    if refused or len(rows) > 1:
        rows = _with_refused(rows, refused or {})
        return {
            **_in_common(answer, places), **shared, **branches, "blocks": rows,
            "warnings": warnings,
        }  # fmt: skip
    del rows[0]["block_id"]
    contributions = [
        {"from": low, "to": high, "annual_rate": part}
        for low, high, part in zip(
            answer.edges[:-1].tolist(), answer.edges[1:].tolist(),
            answer.contribution[0].tolist(), strict=True,
        )
    ]  # fmt: skip
    return {
        **rows[0], **shared, **branches, "contributions": contributions, "warnings": warnings,
    }  # fmt: skip


def rate_columns(answer: HazardAnswer) -> dict[str, Any]:
    """Return the rates and what is not known of them by the names of tables and JSON."""
    columns = {
        "annual_rate": answer.annual_rate,
        "ci_low": answer.ci_low,
        "ci_high": answer.ci_high,
        "numerical_error": answer.numerical_error,
        "probability": answer.probability,
    }
    if answer.drained is not None:
        columns["drained_annual_rate"] = answer.drained
    if answer.quantiles:
        columns |= {"branches_low": answer.branches_low, "branches_high": answer.branches_high}
    for q, values in answer.quantiles.items():
        columns[f"annual_rate_p{round(100.0 * q):02d}"] = values
    return columns


def shares_between(answer: HazardAnswer, levels: FloatArray) -> FloatArray:
    """Return the shares of the first block's rate that come from shaking between levels."""
    rate = max(float(answer.annual_rate[0]), np.finfo(float).tiny)
    below = np.append(0.0, answer.contribution[0].cumsum()) / rate
    return np.diff(np.interp(np.log(levels), np.log(answer.edges), below))


def or_null(column: Any) -> list[float | None]:
    """Return the values of an array, None for NaN."""
    return [None if math.isnan(value) else value for value in column.tolist()]


def _with_refused(
    rows: list[dict[str, Any]], refused: Mapping[int, Mapping[str, str]]
) -> list[dict[str, Any]]:
    """Return the rows with their reasons, and those that cannot be used among them."""
    empty = dict.fromkeys(rows[0])
    answered = iter([{**row, "reason": ""} for row in rows])
    others = {
        i: {**empty, "site": about.get("site_id"), "block_id": about["block_id"],
            "reason": about["reason"]}
        for i, about in refused.items()
    }  # fmt: skip
    places = range(max(len(rows) + len(refused), *refused, 0) + 1)
    merged = (others[i] if i in others else next(answered, None) for i in places)
    return [row for row in merged if row is not None]


def _in_common(answer: HazardAnswer, places: Sequence[str | None]) -> dict[str, Any]:
    """Return what all blocks, and those of each site, do in common."""
    common: dict[str, Any] = {"annual_rate_any": answer.annual_rate_any}
    if len(places) == 1:
        common = {"site": places[0], **common}
        if answer.joint is not None:
            common |= answer.joint.as_dict()
    elif any(answer.joints):
        common["sites"] = [
            {"site": place, **joint.as_dict()}
            for place, joint in zip(places, answer.joints, strict=True)
            if joint is not None
        ]
    return {
        **common,
        "expected_failures_per_year": answer.expected_failures_per_year,
        "expected_failures_low": answer.total_low,
        "expected_failures_high": answer.total_high,
    }


def rate_in_words(document: Mapping[str, Any], ends_early: str = "") -> tuple[str, ...]:
    """Return the return period of a block with its interval, its rate, and the drained bound.

    Args:
        document: an answer of `rbfrag hazard` for one block under the keys of the JSON contract.
        ends_early: what :func:`range_in_words` says of a curve that ends too early.
    """
    rate, low, high = (document[name] for name in ("annual_rate", "ci_low", "ci_high"))
    length_years, bound = document["years"], document.get("drained")
    ends = confidence(document["level"], return_periods(low, high))
    chances = [1.0 - math.exp(-end * length_years) for end in (low, high)]
    sentences = [ends_early or f"Return period of failure {return_period(rate)}   ({ends})"]
    sentences.append(
        f"Mean annual rate {rate:.2g} /yr; P(failure in {length_years:g} years) = "
        f"{with_interval(document['probability'], *chances)}"
    )
    if bound is not None:
        sentences.append(f"Drained return period {return_period(bound['annual_rate'])}")
    return tuple(sentences)


def range_in_words(answer: HazardAnswer) -> str:
    """Return the range of the return period where the curve ends too early; empty elsewhere.

    Stronger shaking than the last level may more than double the rate of the one block.
    """
    rate = float(answer.annual_rate[0])
    most = rate + float(answer.above_at_most[0] - answer.above[0])
    if not most > 2.0 * rate:
        return ""
    curve = answer.curves[0]
    known = QUANTITIES.get(curve.measure)
    unit = "g" if known is None else known.unit
    least = f"between {years(most)} and {return_period(rate)}"
    return (
        f"Return period of failure {least if rate > NEVER else f'at least {years(most)} years'}: "
        f"the hazard curve ends at {curve.imt} = {curve.levels[-1]:g} {unit}"
    )
