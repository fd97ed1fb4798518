"""The inverse of a prediction: the dimension, angle or k_r at which a block has a given P."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rbfrag.errors import InputError
from rbfrag.fragility.prediction import Prediction, is_single, single, with_values
from rbfrag.question.classify import has_shape
from rbfrag.question.measurement import probit
from rbfrag.question.nominal import MEASURED, OF_SHAKING, described
from rbfrag.results.numbers import percent
from rbfrag.vocabulary.quantities import QUANTITIES, name_of

SOLVED = ("width_m", "height_m", "beta_deg", "phi_deg", "kr")

_WIDEST = 120
"""Steps of 5 % or 1° from the stated value, beyond which no solution is looked for."""


def solve(
    answer: Callable[..., Prediction],
    question: Mapping[str, Any],
    kind: str | None,
    target_probability: Any = None,
    solve_for: str | None = None,
) -> Prediction:
    """Return the prediction at the value of a field at which P is the target.

    The bracket widens from the stated value outward, lengths and k_r by 5 %, angles by 1°, until P
    crosses the target; bisection follows. With errors of measurement P is the mean over the draws:
    a standard deviation stays as it is, one in per cent scales. k_r of a geometry is increased by
    a force, for each draw by the same amount.

    Args:
        answer: answers a question, with ``added_kr`` of each draw.
        question: fields of block and shaking, single values.
        kind: how the block is asked to fail.
        target_probability: P that is asked for.
        solve_for: the field or its word.

    Raises:
        InputError: half of the request is missing, the failure mode changes or the range ends
            before P is the target, or the field has no effect.
    """
    field = name_of(solve_for or "")
    words = "width, height, dip, phi or kr"
    if field not in SOLVED or target_probability is None:
        raise InputError(
            f"target_probability and solve_for are required together: give P and {words}",
            fields=("target_probability", "solve_for"),
        )
    if many := [n for n, v in question.items() if not is_single(v)]:
        raise InputError(f"solve_for is for a single block: {many[0]} has several values",
                         fields=("solve_for", many[0]))  # fmt: skip
    target = single("target_probability", target_probability)
    if not 0.0 < target < 1.0:
        raise InputError(
            f"target_probability = {target:g}: give a probability between 0 and 1",
            fields=("target_probability",),
        )
    of_force = field == "kr" and has_shape(question)
    start, ask = _parameter(answer, question, kind, field, of_force=of_force)
    nominal = ask(start)
    aim = probit(target)

    def excess(value: float) -> tuple[float, Prediction]:
        if not (field == "kr" or QUANTITIES[field].range.holds(value)):
            raise InputError("the range of the field ends")
        result = ask(value)
        if result.kind != nominal.kind:
            raise InputError("the failure mode changes")
        return probit(result.probability) - aim, result

    low, high = _bracket(lambda value: excess(value)[0], start, field, target)
    below = excess(low)[0] < 0.0
    while high - low > 1e-9 * max(1.0, abs(low)):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (excess(middle)[0] < 0.0) is below else (low, middle)
    value = 0.5 * (low + high)
    result = excess(value)[1]
    solution = {
        "field": field, "value": value, "stated": start,
        "added_kr": value - start if of_force else None,
    }  # fmt: skip
    return with_values(result, solution=solution)


def _parameter(
    answer: Callable[..., Prediction],
    question: Mapping[str, Any],
    kind: str | None,
    field: str,
    *,
    of_force: bool,
) -> tuple[float, Callable[[float], Prediction]]:
    """Return the stated value of what is changed, and the answer as a function of it."""
    if not of_force:
        level = {"beta_deg": 0.0} if "height_m" in question else {}
        if field not in {**question, **level}:
            raise InputError(
                f"solve_for {field} requires {field}, the value where the search begins",
                fields=("solve_for", field),
            )
        start = single(field, {**level, **question}[field])
        return start, lambda value: answer({**question, field: value})
    bare = {name: value for name, value in question.items() if name not in MEASURED}
    (group,) = described(bare, kind).groups
    if "kr" not in group.numbers:
        raise InputError(
            f"solve_for kr is for blocks that topple, not for kind {group.kind}",
            fields=("solve_for",),
        )
    start = float(group.numbers["kr"])
    if not MEASURED.isdisjoint(question):
        return start, lambda value: answer(question, added_kr=value - start)
    measures = {name: value for name, value in question.items() if name in OF_SHAKING}
    return start, lambda value: answer({**group.numbers, **measures, "kr": value})


def _bracket(
    excess: Callable[[float], float], start: float, field: str, target: float
) -> tuple[float, float]:
    """Return two values between which P crosses the target, the smaller first."""
    first = excess(start)
    why = "no value nearby has this probability"
    for sign in (1.0, -1.0):
        last, value, before = start, start, first
        for _ in range(_WIDEST):
            by_factor = QUANTITIES[field].unit != "deg"
            value = value * (1.0 + 0.05 * sign) if by_factor else value + sign
            try:
                result = excess(value)
            except InputError as error:
                why = str(error)
                break
            if (result < 0.0) is not (first < 0.0):
                return min(last, value), max(last, value)
            if abs(result) > abs(before) + 1e-12 or result == before == first:
                break  # P moves away, or not at all
            last, before = value, result
    raise InputError(
        f"no solve_for {field} gives P = {percent(target)}: {why}", fields=("solve_for",)
    )
