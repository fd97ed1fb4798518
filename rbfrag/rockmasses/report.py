"""A rock mass as scripts read it: a dictionary of plain values, and columns of the block table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.rockmasses.counts import Crossing, ModeCount
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.scenario import Average, Scenario
from rbfrag.solver.stability.modes import MODES, STABLE, STATES, TOPPLE, ModeName

NEAR_LIMIT = 0.01
"""Share of impossible realisations above which the description is doubted."""


def as_dict(
    made: Realisations,
    counts: Mapping[ModeName, ModeCount],
    crossings: list[Crossing],
    answer: Scenario | None = None,
    shaking: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract."""
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


def block_columns(made: Realisations, answer: Scenario | None = None) -> dict[str, NDArray[Any]]:
    """Return the columns of the block table, one row a realisation.

    A realisation that is no block has a row, too: without mode, with weight 0 and its reason.
    ``kr`` is the toppling yield at rest without vertical acceleration, NaN for other modes;
    ``yield_g`` is the yield of the governing mode.

    Args:
        made: the realisations.
        answer: the answers to a scenario of theirs, which add the measures of the motion and
            ``probability, ci_low, ci_high, in_domain``.
    """
    found, fine = made.stability, made.is_block

    def only_blocks(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(fine, values, np.nan)

    columns: dict[str, NDArray[Any]] = {
        "block_id": np.arange(1, made.n + 1),
        "p2_1_s2": only_blocks(found.p2),
        "kr": only_blocks(made.kr_at_rest),
        "mode": _names(MODES, found.mode_code, fine),
        "weight": fine.astype(np.float64),
    }
    if answer is not None:
        for name, value in answer.measures.items():
            columns[name] = np.full(made.n, value)
    columns |= {
        "state": _names(STATES, found.state_code, fine),
        "yield_g": only_blocks(found.yield_acceleration),
        "ky": only_blocks(found.ky),
        "alpha1_deg": only_blocks(made.blocks.alpha1_deg),
        "alpha3_deg": only_blocks(made.blocks.alpha3_deg),
        "gamma_deg": made.gamma_deg,
        "beta_deg": made.beta_deg,
        "phi_deg": made.phi_deg,
        "phi_back_deg": made.phi_back_deg,
        "s1_m": made.s1_m,
        "s2_m": made.s2_m,
        "r3_m": only_blocks(made.blocks.r3_m),
    }
    if answer is None:
        return columns | {"reason": made.reason}
    return columns | {
        "probability": answer.probability,
        "ci_low": answer.ci_low,
        "ci_high": answer.ci_high,
        "in_domain": answer.in_domain,
        "reason": answer.reason,
    }


def toppling_blocks(
    made: Realisations,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return p² [1/s²] and k_r of the stable toppling blocks, and their share of all blocks."""
    found = made.stability
    chosen = made.is_block & (found.mode_code == TOPPLE) & (found.state_code == STABLE)
    chosen &= made.kr_at_rest > 0.0
    share = float(chosen.sum()) / max(made.n_blocks, 1)
    return found.p2[chosen], made.kr_at_rest[chosen], share


def _names(
    names: tuple[str, ...], codes: NDArray[np.int8], fine: NDArray[np.bool_]
) -> NDArray[np.object_]:
    return np.array([*names, ""], dtype=object)[np.where(fine, codes, -1)]
