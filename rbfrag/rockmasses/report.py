"""A rock mass and its failures as scripts read them: dictionaries, and columns of block tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.results.diagnostic import Diagnostic, with_prefix
from rbfrag.rockmasses.counts import EqualCounts, ModeCount, ScaleFailures, StateCount
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.scenario import Scenario
from rbfrag.rockmasses.shaking import OPEN, OUTCOMES, ShakenMass
from rbfrag.solver.kinds import BY_MECHANICS, FOLLOWED
from rbfrag.solver.quantity import json_value
from rbfrag.solver.stability.joint import IS_DRAINED, NO_EFFECT_OF_COHESION, STAYS_UNDRAINED
from rbfrag.solver.stability.modes import MODES, STATES, ModeName, words_of_mode

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
        "crossings": [json_value(crossing) for crossing in crossings],
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
                **mode.covered.as_dict(),
                "drained": None if mode.drained is None else mode.drained.as_dict(),
            }
            for mode in answer.modes
        },
        "covered_share": answer.covered_share,
        "uncovered_share": dict(answer.uncovered_share),
        "covered_only": {
            **answer.covered.as_dict(),
            "drained": None if drained is None else drained.covered.as_dict(),
        },
    }


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


def failures_as_dict(
    shaken: ShakenMass, scales: Sequence[ScaleFailures], level: float
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract."""
    shaking = shaken.shaking
    return {
        "motion": shaking.motion.label,
        "vertical": None if shaking.vertical is None else shaking.vertical.label,
        "polarity": shaking.polarity,
        "displacement_limit_m": shaken.limits.displacement_m,
        "rotation_limit_deg": shaken.limits.rotation_deg,
        "level": level,
        "runs": shaken.runs,
        "scales": [
            {
                "scale": result.scale,
                "pga_g": result.pga_g,
                "pgv_m_s": result.scale * shaking.motion.pgv_m_s,
                "modes": {mode: of_mode.as_dict() for mode, of_mode in result.modes.items()},
                "all": result.total.as_dict(),
                "final_modes": final_modes(shaken, i),
            }
            for i, result in enumerate(scales)
        ],
    }


def final_modes(shaken: ShakenMass, i: int) -> dict[ModeName, dict[str, int]]:
    """Return the number of blocks by initial and final mode at one scale; ``none``: never moved."""
    names = (*MODES, "none")
    table = {}
    for mode in MODES:
        blocks = shaken.realisations.of_mode(mode)
        if blocks.any():
            counts = np.bincount(shaken.final_code[i, blocks] % len(names), minlength=len(names))
            table[mode] = dict(zip(names, counts.tolist(), strict=True))
    return table


def failure_warnings(shaken: ShakenMass) -> list[str]:
    """Return warnings about the motion, and about blocks with their number."""
    by_mode = {mode: int(shaken.realisations.of_mode(mode).sum()) for mode in MODES}
    return [
        *shaken.warnings,
        *(
            Diagnostic(
                f"{count} of {by_mode[mode]} blocks of mode {words_of_mode(mode)}: {text}",
                "model_limits",
            )
            for (mode, text), count in shaken.about.items()
        ),
    ]


def outcome_columns(shaken: ShakenMass) -> dict[str, NDArray[Any]]:
    """Return the columns of the block table, one row per realisation and scale."""
    columns = block_columns(shaken.realisations)
    reason = columns.pop("reason")
    scales = np.array(shaken.shaking.scales)
    m, n = shaken.code.shape
    names = np.array([*OUTCOMES, ""], dtype=object)
    run = np.isin(names.astype(str), ("stays", "fails", *OPEN)) & (names != "bond_breaks")
    ways = np.where(run, FOLLOWED, np.where(names == "", "", BY_MECHANICS)).astype(object)
    return {
        **{name: np.tile(values, m) for name, values in columns.items()},
        "scale": np.repeat(scales, n),
        "pga_g": np.repeat(shaken.pga_g, n),
        "outcome": names[shaken.code.reshape(-1)],
        "final_mode": np.array([*MODES, ""], dtype=object)[shaken.final_code.reshape(-1)],
        "how": ways[shaken.code.reshape(-1)],
        "displacement_m": shaken.displacement_m.reshape(-1),
        "rotation_deg": np.degrees(shaken.rotation_rad.reshape(-1)),
        "reason": np.tile(reason, m),
    }
