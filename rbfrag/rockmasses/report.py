"""What a rock mass answers as scripts read it: a dictionary of plain values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rbfrag.rockmasses.counts import Crossing, ModeCount
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.scenario import Average, Scenario
from rbfrag.solver.stability.modes import ModeName

NEAR_LIMIT = 0.01
"""Share of impossible realisations above which the description is doubted."""


def as_dict(
    made: Realisations,
    counts: Mapping[ModeName, ModeCount],
    crossings: list[Crossing],
    answer: Scenario | None = None,
    shaking: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract.

    Args:
        made: the realisations.
        counts: blocks by mode.
        crossings: where cumulative counts cross.
        answer: the answer to a scenario, if one was asked for.
        shaking: what a motion did to the blocks, if they were run under one.
    """
    return {
        "realisations": made.n,
        "blocks": made.n_blocks,
        "seed": made.seed,
        "impossible": made.impossible,
        "variables": {key: str(law) for key, law in made.rock_mass.variables.items()},
        "back_fracture": made.rock_mass.back_fracture,
        "modes": {
            mode: {
                "count": count.count,
                "share": count.share,
                "share_error": count.share_error,
                **count.states,
                "yield_g": {f"q{100 * q:02.0f}": k for q, k in count.yield_quantiles_g.items()}
                or None,
            }
            for mode, count in counts.items()
        },
        "crossings": [
            {
                "below": crossing.below,
                "above": crossing.above,
                "pga_g": crossing.pga_g,
                "standard_error_g": crossing.standard_error_g
                if math.isfinite(crossing.standard_error_g)
                else None,
                "count": crossing.count,
            }
            for crossing in crossings
        ],
        "scenario": None if answer is None else _scenario(answer),
        "shaking": None if shaking is None else dict(shaking),
        "warnings": _warnings(made, answer),
    }


def _scenario(answer: Scenario) -> dict[str, Any]:
    return {
        **answer.measures,
        "model": answer.model,
        "other_models": dict(answer.other_models),
        "term": answer.term,
        "method": answer.method,
        "level": answer.level,
        "modes": {
            mode.mode: {
                "count": mode.count,
                "share": mode.share,
                "has_model": mode.has_model,
                "unstable": mode.unstable,
                "in_domain": mode.in_domain,
                **_average(mode.covered),
            }
            for mode in answer.modes
        },
        "covered_share": answer.covered_share,
        "uncovered_share": dict(answer.uncovered_share),
        "covered_only": _average(answer.covered),
    }


def _average(average: Average) -> dict[str, Any]:
    return {
        "covered": average.count,
        "probability": average.probability,
        "standard_error": average.standard_error,
        "ci_low": average.ci_low,
        "ci_high": average.ci_high,
    }


def _warnings(made: Realisations, answer: Scenario | None) -> list[str]:
    warnings = [] if answer is None else list(answer.warnings)
    bad = made.n - made.n_blocks
    if bad > NEAR_LIMIT * made.n:
        why = "; ".join(f"{count} times {text}" for text, count in made.impossible.items())
        warnings.insert(
            0,
            f"{bad} of {made.n} realisations are no block and are left out of all shares: {why}: "
            "a lognormal or a truncated distribution may describe the measurements better",
        )
    return warnings
