"""What `rbfrag predict` answers and prints for one block. Loads no command-line library."""

from __future__ import annotations

from typing import Any

from rbfrag.cli.output import print_json, print_pairs, print_table, print_warnings
from rbfrag.cli.parameters.block import toppling_block


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
    from rbfrag.fragility.prediction_document import prediction_document

    p2, kr, remarks = toppling_block(p2, kr, block)
    found = None
    if motion is not None:
        from rbfrag.cli.parameters.motion import find_motion

        found = find_motion(motion, db=db, units=units, dt_s=dt)
    document = prediction_document(
        p2,
        kr,
        measures,
        motion=found,
        polarity=polarity,
        model=model,
        level=level,
        db=db,
        remarks=remarks,
    )
    return document, document["warnings"]


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
