"""A rock mass as scripts read it: a dictionary of plain values, and columns of the block table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.results.diagnostic import Diagnostic, with_prefix
from rbfrag.rockmasses.counts import EqualCounts, ModeCount, StateCount
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.scenario import Average, Scenario
from rbfrag.solver.stability.joint import IS_DRAINED, NO_EFFECT_OF_COHESION, STAYS_UNDRAINED
from rbfrag.solver.stability.modes import MODES, STATES, ModeName

COUNTS = ("count", "share", "has_model", "unstable", "in_domain")
DRAWN = ("gamma_deg", "beta_deg", "phi_deg", "phi_back_deg", "s1_m", "s2_m")
ANSWERS = (
    "probability", "ci_low", "ci_high", "event_low", "event_high", "in_domain", "how", "reason",
)  # fmt: skip
"""Values of modes, realisations and scenarios that documents and tables show as they are."""

OTHER_MODE_DRAINED = (
    "{count} blocks have another mode where their water drains: their drained bound is that of the "
    "limit state of that mode, which may be likelier"
)

NEAR_LIMIT = 0.01
"""Share of impossible realisations above which the description is doubted."""


def as_dict(
    realisations: Realisations,
    counts: Mapping[ModeName, ModeCount],
    crossings: list[EqualCounts],
    answer: Scenario | None = None,
    shaking: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract."""
    return {
        "realisations": realisations.n,
        "blocks": realisations.n_blocks,
        "seed": realisations.seed,
        "impossible": realisations.impossible,
        "variables": {key: str(law) for key, law in realisations.rock_mass.variables.items()},
        "back_fracture": realisations.rock_mass.back_fracture,
        "drainage": None if realisations.drained is None else realisations.rock_mass.drainage,
        "modes": {
            mode: {
                "count": count.count,
                "share": count.share,
                "share_error": count.share_error,
                **_states(count),
                "drained": None if count.drained is None else _states(count.drained),
            }
            for mode, count in counts.items()
        },
        "crossings": [
            {
                name: value if isinstance(value, str) or math.isfinite(value) else None
                for name, value in vars(crossing).items()
            }
            for crossing in crossings
        ],
        "scenario": None if answer is None else _scenario(answer),
        "shaking": None if shaking is None else dict(shaking),
        "warnings": mass_warnings(realisations, answer, in_motion=bool(answer or shaking)),
    }


def _states(count: StateCount) -> dict[str, Any]:
    quantiles = {f"q{100 * q:02.0f}": k for q, k in count.yield_quantiles_g.items()}
    states: dict[str, Any] = dict(count.states.items())
    return {**states, "yield_g": quantiles or None}


def _scenario(answer: Scenario) -> dict[str, Any]:
    drained = answer.drained
    return {
        **answer.measures,
        "model": answer.model,
        "other_models": dict(answer.other_models),
        **{name: getattr(answer, name) for name in ("term", "method", "level")},
        "modes": {
            mode.mode: {
                **{name: getattr(mode, name) for name in COUNTS},
                **_average(mode.covered),
                "drained": None if mode.drained is None else _average(mode.drained),
            }
            for mode in answer.modes
        },
        "covered_share": answer.covered_share,
        "uncovered_share": dict(answer.uncovered_share),
        "covered_only": {
            **_average(answer.covered),
            "drained": None if drained is None else _average(drained.covered),
        },
    }


def _average(average: Average) -> dict[str, Any]:
    values = dict(vars(average))
    return {"covered": values.pop("count"), **values}


def mass_warnings(
    realisations: Realisations, answer: Scenario | None, *, in_motion: bool
) -> list[str]:
    """Return the warnings about a rock mass and its scenario.

    Args:
        answer: probabilities by measures of the motion, if there are any.
        in_motion: whether failures in motion are part of the answer.
    """
    warnings = [] if answer is None else list(answer.warnings)
    if in_motion and realisations.drained is not None:
        warnings += notes_on_water(realisations)
        modes = (blocks.stability.mode_code for blocks in (realisations, realisations.drained))
        changed = np.flatnonzero(np.not_equal(*modes) & realisations.is_block)
        if changed.size:
            text = OTHER_MODE_DRAINED.format(count=changed.size)
            warnings.append(Diagnostic(text, "other_mode", rows=changed))
    bonded = np.flatnonzero(realisations.of_mode("topple") & (realisations.cohesion_pa > 0.0))
    if bonded.size:
        note = with_prefix(f"{bonded.size} toppling blocks: ", NO_EFFECT_OF_COHESION)
        warnings.append(note.replaced(rows=bonded))
    lifts = np.flatnonzero(realisations.is_block & realisations.stability.toe_lifts)
    if lifts.size:
        text = (
            f"{lifts.size} confined topples: the bond of the base is so strong that the toe lifts "
            "off before it slides: their yields are upper bounds"
        )
        warnings.append(Diagnostic(text, "upper_bound", rows=lifts))
    bad = realisations.n - realisations.n_blocks
    if bad > NEAR_LIMIT * realisations.n:
        text = (
            f"{bad} of {realisations.n} realisations are no block and are left out of all "
            f"fractions: {realisations.why_impossible}: a lognormal or a truncated distribution "
            "may describe the measurements better"
        )
        rows = np.flatnonzero(~realisations.is_block)
        warnings.insert(0, Diagnostic(text, "rejected_realisations", rows=rows))
    return [*warnings, *realisations.rock_mass.remarks]


def notes_on_water(realisations: Realisations) -> tuple[str, ...]:
    """Return what the water does while the blocks move; nothing of dry blocks."""
    if realisations.drained is None:
        return ()
    return (STAYS_UNDRAINED if realisations.is_wet.any() else IS_DRAINED,)


def block_columns(
    realisations: Realisations, answer: Scenario | None = None
) -> dict[str, NDArray[Any]]:
    """Return the columns of the block table, one row a realisation.

    A realisation that is no block has a row, too: without mode, with weight 0 and its reason.
    ``kr`` is the toppling yield at rest without vertical acceleration, NaN for other modes;
    ``yield_g`` is the yield of the governing mode. Where water stands behind the blocks,
    ``drained_yield_g`` and ``drained_probability`` are the drained bound.

    Args:
        answer: the answers to a scenario of theirs, which add the measures of the motion and
            ``probability, ci_low, ci_high, event_low, event_high, in_domain``.
    """
    stability, is_block = realisations.stability, realisations.is_block

    def only_blocks(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(is_block, values, np.nan)

    columns: dict[str, NDArray[Any]] = {
        "block_id": np.arange(1, realisations.n + 1),
        "p2_1_s2": only_blocks(stability.p2),
        "kr": only_blocks(realisations.kr_at_rest),
        "mode": _names(MODES, stability.mode_code, is_block),
        "weight": is_block.astype(np.float64),
    }
    if answer is not None:
        for name, value in answer.measures.items():
            columns[name] = np.full(realisations.n, value)
    columns |= {
        "state": _names(STATES, stability.state_code, is_block),
        "yield_g": only_blocks(stability.yield_acceleration),
        "ky": only_blocks(stability.ky),
        "alpha1_deg": only_blocks(realisations.blocks.alpha1_deg),
        "alpha3_deg": only_blocks(realisations.blocks.alpha3_deg),
        **{name: getattr(realisations, name) for name in DRAWN},
        "r3_m": only_blocks(realisations.blocks.r3_m),
    }
    for name in ("cohesion_pa", "water_m", "jrc"):
        if np.any(getattr(realisations, name)[is_block]):
            columns[name] = getattr(realisations, name)
    if realisations.drained is not None:
        drained = realisations.drained.stability
        columns["drained_yield_g"] = only_blocks(drained.yield_acceleration)
    if answer is None:
        return columns | {"reason": realisations.reason}
    if answer.drained is not None:
        columns["drained_probability"] = answer.drained.probability
    return columns | {name: getattr(answer, name) for name in ANSWERS}


def toppling_blocks(
    realisations: Realisations,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return p² [1/s²] and k_r of the stable toppling blocks, and their share of all blocks."""
    stands, after = realisations.stability.yield_acceleration > 0.0, realisations.in_time
    chosen = after.of_mode("topple", "stable") & (after.kr_at_rest > 0.0) & stands
    chosen &= ~after.ends_with_slip
    share = float(chosen.sum()) / max(realisations.n_blocks, 1)
    return after.stability.p2[chosen], after.kr_at_rest[chosen], share


def _names(
    names: tuple[str, ...], codes: NDArray[np.int8], is_block: NDArray[np.bool_]
) -> NDArray[np.object_]:
    return np.array([*names, ""], dtype=object)[np.where(is_block, codes, -1)]
