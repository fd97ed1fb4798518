"""What `rbfrag predict` answers and prints for one block. Loads no command-line library."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rbfrag.cli.block_argument import toppling_block
from rbfrag.cli.output import print_json, print_pairs, print_table, print_warnings

if TYPE_CHECKING:
    from rbfrag.fragility.answers import Prediction


def answer_one(
    p2: float | None,
    kr: float | None,
    block: str | None,
    measures: dict[str, float],
    *,
    motion: str | None,
    polarity: str,
    model: str | None,
    level: float,
    units: str | None,
    dt: float | None,
    db: str | None,
) -> tuple[dict[str, Any], list[str]]:
    """Return the JSON document and the warnings of one block."""
    from rbfrag.fragility.prediction import answer_given
    from rbfrag.fragility.prediction import predict as run

    answer: Any = run
    p2, kr, remarks = toppling_block(p2, kr, block)
    others: list[Prediction] = []
    if motion is not None:
        from rbfrag.cli.motion_argument import find_motion

        prediction: Any = answer(
            p2,
            kr,
            **measures,
            motion=find_motion(motion, db=db, units=units, dt_s=dt),
            polarity=polarity,
            model=model,
            level=level,
            db=db,
        )
        others = [prediction]
    elif model is not None:
        prediction = answer(p2, kr, **measures, model=model, level=level, db=db)
        others = [prediction]
    else:
        from rbfrag.fragility.model_lookup import suited_models

        values = {"p2": p2, "kr": kr, **measures}
        others = [answer_given(each, values, level) for each in suited_models(values, db)]  # type: ignore[misc]
        prediction = others[0]
    document = prediction.as_dict()
    warnings = [*remarks, *prediction.warnings]
    document["warnings"] = warnings
    document["answers"] = [
        {
            "model": each.model,
            "term": each.term,
            "method": each.method,
            "probability": each.probability,
            "ci_low": each.ci_low,
            "ci_high": each.ci_high,
            "in_domain": each.in_domain,
            "recommended": each is prediction,
        }
        for each in others
    ]
    return document, warnings


def show(document: dict[str, Any], warnings: list[str], *, json: bool) -> None:
    """Print an answer."""
    if json:
        print_json(document)
        return
    answers = document.pop("answers")
    polarities = document.pop("polarities", None)
    document.pop("warnings")
    print_pairs(document)
    if polarities:
        print()
        print_table(
            ("polarity", "probability", "ci_low", "ci_high", "intensity_m_s"),
            [
                (name, p["probability"], p["ci_low"], p["ci_high"], p["intensity_m_s"])
                for name, p in polarities.items()
            ],
        )
    if len(answers) > 1:
        print()
        print_table(
            ("model", "term", "probability", "ci_low", "ci_high", "in_domain", "recommended"),
            [
                (a["model"], a["term"], a["probability"], a["ci_low"], a["ci_high"],
                 a["in_domain"], a["recommended"])
                for a in answers
            ],
        )  # fmt: skip
    print_warnings(warnings)
