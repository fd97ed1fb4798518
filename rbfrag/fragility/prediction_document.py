"""What `predict` answers for one block as scripts read it. Loads no library."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from rbfrag.fragility.answers import Prediction
from rbfrag.fragility.lookup import suited_models
from rbfrag.fragility.predict import answer_given, predict

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion


def prediction_document(
    p2: float,
    kr: float,
    measures: dict[str, float],
    *,
    motion: GroundMotion | None = None,
    polarity: str = "both",
    model: str | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    remarks: Sequence[str] = (),
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract, and that of every suited model.

    Args:
        p2: frequency parameter p² of the block [1/s²].
        kr: its yield acceleration coefficient for toppling at rest.
        measures: what is known of the motion, by the names of :func:`rbfrag.predict`.
        motion: the accelerogram itself.
        polarity: forward, reverse or both; with `motion` only.
        model: name of a stored model; None for the best for each term that the measures
            suffice for.
        level: confidence level of the interval.
        db: database of the models, as for :func:`rbfrag.predict`.
        remarks: warnings about the block, which go before those of the answer.

    Raises:
        InputError: a value that cannot be used, or measures no model can work with.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    answer: Any = predict
    others: list[Prediction]
    if motion is not None:
        known = {**measures, "motion": motion, "polarity": polarity}
        others = [answer(p2, kr, **known, model=model, level=level, db=db)]
    elif model is not None:
        others = [answer(p2, kr, **measures, model=model, level=level, db=db)]
    else:
        values = {"p2": p2, "kr": kr, **measures}
        others = [answer_given(each, values, level) for each in suited_models(values, db)]  # type: ignore[misc]
    recommended = others[0]
    document: dict[str, Any] = recommended.as_dict()
    document["warnings"] = [*remarks, *recommended.warnings]
    document["answers"] = [
        {
            "model": each.model,
            "term": each.term,
            "method": each.method,
            "probability": each.probability,
            "ci_low": each.ci_low,
            "ci_high": each.ci_high,
            "in_domain": each.in_domain,
            "recommended": each is recommended,
        }
        for each in others
    ]
    return document
