"""The prediction without water pressure, for blocks with water behind them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rbfrag.errors import InputError
from rbfrag.fragility.prediction import A, Prediction, add_warnings, with_values
from rbfrag.question.nominal import described
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kinds import facts_of

OF_BOUND = ("probability", "ci_low", "ci_high")
"""Values of the drained bound."""


def with_drained_bound(
    answer: Callable[[Mapping[str, Any]], A], question: Mapping[str, Any], kind: Any = None
) -> A:
    """Return the prediction; where water stands behind a block, add the one without water pressure.

    The drained bound is the answer to the same question without ``water_m``. It is missing where
    that question has none, as of a block that slides when dry without a displacement limit.

    Args:
        answer: answers a question.
        question: the question: fields of block and shaking.
        kind: how the blocks are asked to fail.
    """
    result = answer(question)
    if not is_wet(question):
        return result
    dry = without_water(question)
    try:
        bound = answer(dry)
    except InputError as error:
        return add_warnings(result, (), (no_drained_bound(error),))
    if isinstance(bound, Prediction):
        (name,) = {"kr", "ky", "ks", "kct"} & {*facts_of(bound.kind).parameters}
        (group,) = described(dry, kind).groups  # without numbers where it is unstable at rest
        values: dict[str, float | None] = {n: getattr(bound, n) for n in OF_BOUND}
        return with_values(result, drained=values | {name: group.numbers.get(name)})
    import numpy as np

    wet = np.asarray(question["water_m"], dtype=np.float64) > 0.0
    answered = np.broadcast_to(wet, bound.probability.shape) & ~np.isnan(result.probability)
    drained = {n: np.where(answered, getattr(bound, n), np.nan) for n in OF_BOUND}
    lost = np.flatnonzero(answered & np.isnan(bound.probability))
    if lost.size:
        note = no_drained_bound(bound.reason.ravel()[lost[0]]).replaced(rows=lost)
        result = add_warnings(result, (), (note,))
    return with_values(result, drained=drained)


def without_water(question: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs without water behind the blocks; arrays keep their length."""
    dry = {n: value for n, value in question.items() if n not in ("water_m", "drainage")}
    water: Any = question.get("water_m")
    if water is not None and not isinstance(water, int | float):
        import numpy as np

        dry["water_m"] = np.zeros(np.shape(water))
    return dry


def no_drained_bound(reason: object) -> Diagnostic:
    """Return the note that there is no prediction without water, with the reason."""
    fields = reason.fields if isinstance(reason, InputError) else ()
    return Diagnostic(f"no drained bound: {reason}", "no_drained_bound", fields=fields)


def is_wet(question: Mapping[str, Any]) -> bool:
    """Return whether water stands behind any block."""
    water: Any = question.get("water_m")
    if water is None or isinstance(water, int | float):
        return bool(water is not None and water > 0.0)
    import numpy as np

    return bool((np.asarray(water, dtype=np.float64) > 0.0).any())
