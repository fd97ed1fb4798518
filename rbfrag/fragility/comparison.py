"""The answers of all models that suit a question, and whether they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

from rbfrag.fragility.lookup import find_model, suited_models
from rbfrag.fragility.methods import SINGLE
from rbfrag.fragility.model import FragilityModel, Model
from rbfrag.fragility.prediction import Prediction, answer_given, is_clear, single_numbers
from rbfrag.fragility.words import percent

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rbfrag.fragility.prediction_array import PredictionArray
    from rbfrag.fragility.prediction_motion import Polarity
    from rbfrag.motions.recognise import MotionLike

LEAST_APART = 1e-3
"""Intervals that do not overlap are told of where the higher of them begins above this P."""

MOST_LISTED = 3
"""Of more models than these that answer otherwise, the least and the greatest answer are told."""


def candidate_models(
    given: Mapping[str, ArrayLike],
    model: Model | None,
    db: str | PathLike[str] | None,
    *,
    kind: str | None,
    rotation_deg: float | None,
) -> list[FragilityModel]:
    """Return the models that may answer, the one that does first."""
    if model is None:
        return suited_models(given, db, kind=kind, rotation_deg=rotation_deg)
    return [find_model(model, given, db, kind=kind, rotation_deg=rotation_deg)]


def answer_compared(
    models: Sequence[FragilityModel],
    given: Mapping[str, ArrayLike],
    level: float,
    *,
    nan: Literal["propagate", "raise"],
    interval: bool,
    weights: ArrayLike | None,
) -> Prediction | PredictionArray:
    """Return the first model's answer; of single numbers it says which others answer otherwise."""
    first, *others = models
    singles = single_numbers(given)
    given = given if singles is None else singles
    answer = answer_given(first, given, level, nan=nan, interval=interval, weights=weights)
    if type(answer) is not Prediction:
        return answer
    if singles is not None and answer.block_sd is None:
        others = [each for each in others if not _surely_agrees(each, singles, answer)]
    return _with_disagreement(answer, [_one_of(each, given, level, weights) for each in others])


def _surely_agrees(model: FragilityModel, given: dict[str, float], first: Prediction) -> bool:
    """Return whether a model's P of a certain block is within the first one's interval.

    That is faster than its answer.
    """
    try:
        values = model.with_ratios(model.method.block.completed(given, model.term, SINGLE))
        if not is_clear(model, values):
            return False
        probability = model.answer(values, None, SINGLE, given).probability
    except (ArithmeticError, ValueError):
        return False
    return bool(first.ci_low <= probability <= first.ci_high)


def _one_of(
    model: FragilityModel, given: Mapping[str, ArrayLike], level: float, weights: ArrayLike | None
) -> Prediction:
    answer = answer_given(model, given, level, weights=weights)
    assert isinstance(answer, Prediction)
    return answer


def _with_disagreement(first: Prediction, others: Sequence[Prediction]) -> Prediction:
    """Return an answer that says which of the other models answer otherwise."""
    apart = [
        other
        for other in others
        if (least := max(first.ci_low, other.ci_low)) > min(first.ci_high, other.ci_high)
        and least >= LEAST_APART
    ]
    if not apart:
        return first
    if len(apart) <= MOST_LISTED:
        listed = ", ".join(map(_in_words, apart))
    else:
        by_probability = sorted(apart, key=lambda other: other.probability)
        low, high = _in_words(by_probability[0]), _in_words(by_probability[-1])
        listed = f"{len(apart)} others from {low} to {high}"
    text = (
        f"the answers do not agree: {_in_words(first)}, but {listed}, whose "
        "intervals do not overlap with its own: this shaking is not what is usual for the "
        "measures that those read, or a measure is wrong"
    )
    return replace(first, warnings=(*first.warnings, text))


def _in_words(answer: Prediction) -> str:
    p, low, high = map(percent, (answer.probability, answer.ci_low, answer.ci_high))
    return f"{p} ({low} to {high}) by {answer.model}"


def prediction_document(
    given: Mapping[str, ArrayLike],
    *,
    kind: str | None = None,
    rotation_deg: float | None = None,
    motion: MotionLike | None = None,
    polarity: Polarity = "both",
    model: str | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    remarks: Sequence[str] = (),
    weights: ArrayLike | None = None,
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract, and that of every suited model.

    Args:
        given: block and what is known of the motion, by the names of :func:`predict`.
        kind: how the block fails; None for what it is given by.
        rotation_deg: rotation that counts as failure, where models of several are fitted [deg].
        motion: the accelerogram itself.
        polarity: forward, reverse or both; with `motion` only.
        model: name of a stored model; None for the best for each term that the measures
            suffice for.
        level: confidence level of the interval.
        db: database of the models, as for :func:`predict`.
        remarks: warnings about the block, which go before those of the answer.
        weights: of draws of the block, which the arrays are then.

    Raises:
        InputError: a value that cannot be used, or measures no model can work with.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    others: list[Prediction]
    if motion is not None:
        # Kept apart: a motion needs numpy.
        from rbfrag.fragility.prediction_motion import predict_motion

        others = [
            predict_motion(
                given, motion, kind=kind, rotation_deg=rotation_deg, polarity=polarity,
                model=model, level=level, db=db,
            )
        ]  # fmt: skip
    else:
        first, *rest = (
            _one_of(each, given, level, weights)
            for each in candidate_models(given, model, db, kind=kind, rotation_deg=rotation_deg)
        )
        others = [_with_disagreement(first, rest), *rest]
    recommended = others[0]
    document = recommended.as_dict()
    document["warnings"] = [*remarks, *recommended.warnings]
    columns = (
        "model", "term", "method", "probability", "ci_low", "ci_high", "event_low", "event_high",
        "in_domain",
    )  # fmt: skip
    document["answers"] = [
        {**{name: getattr(each, name) for name in columns}, "recommended": each is recommended}
        for each in others
    ]
    return document
