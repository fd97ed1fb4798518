"""Probability that one block fails in a given motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from os import PathLike
from typing import Any, Literal

from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.fragility.measures import MEASURES
from rbfrag.fragility.model import Model
from rbfrag.fragility.model_selection import find_model, unused_measures
from rbfrag.fragility.prediction import (
    MotionPrediction,
    Prediction,
    add_warnings,
    answer_given,
    is_single,
    single,
)
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.results.diagnostic import diagnostics
from rbfrag.vocabulary.quantities import INTENSITY
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, spectral_name

Polarity = Literal["forward", "reverse", "both"]

UNRECORDED = ("magnitude",)
"""What is known of an earthquake and not seen in its record."""

NOT_OF_A_RECORD = ("rjb_km", "vs30_m_s", "amplification")
"""What says how strong the shaking is where there is no record of it."""

SIMULATED = (
    "what a known motion does to an uncertain block is simulated, by rbfrag respond with draws or "
    "rbfrag.respond_draws"
)


def predict_motion(
    inputs: Mapping[str, ArrayLike],
    motion: MotionLike,
    *,
    kind: str | None,
    rotation_deg: float | None,
    polarity: Polarity,
    model: Model | None,
    level: float,
    db: str | PathLike[str] | None,
    weights: ArrayLike | None = None,
    sites: float | None = None,
) -> Prediction:
    """Return the failure probability of one block in a motion; arguments as for
    :func:`rbfrag.predict`.
    """
    if sites is not None:
        text = "sites cannot be combined with a motion: give its intensity measures instead"
        raise InputError(text, fields=("sites",))
    if weights is not None:
        raise InputError(f"weights cannot be combined with a motion: {SIMULATED}")
    motion = as_motion(motion)
    extra = [
        name
        for name in inputs
        if (name in MEASURES or name in NOT_OF_A_RECORD) and name not in UNRECORDED
    ]
    if extra:
        raise InputError(
            f"{' and '.join(extra)} cannot be combined with a motion, which has them: omit them"
        )
    if polarity not in ("forward", "reverse", "both"):
        raise InputError(f"polarity = {polarity!r}: use 'forward', 'reverse' or 'both'")
    uncertain = [name for name in inputs if name.endswith("_sigma")]
    if uncertain:
        raise InputError(f"{uncertain[0]} cannot be combined with a motion: {SIMULATED}")
    several = [name for name, value in inputs.items() if not is_single(value)]
    if several:
        raise InputError(
            f"{' and '.join(several)} must be single numbers with a motion: call it once for each "
            "block, or use rbfrag.toppling_spectrum and a model of the term xp"
        )
    block = {name: single(name, value) for name, value in inputs.items()}
    measures = {name: value for name, value in block.items() if name in UNRECORDED}
    measures |= measures_of(motion)
    ordinates = [spectral_name(period_s) for period_s in SPECTRUM_PERIODS_S]
    computed = (*ordinates, "xp_m_s") if "p2" in block else ordinates
    chosen = find_model(
        model, (*block, *measures, *computed), db, kind=kind, rotation_deg=rotation_deg
    )
    if not set(ordinates).isdisjoint(chosen.term.inputs):
        measures |= zip(ordinates, motion.spectrum_g, strict=True)
    answers: dict[str, Prediction] = {}
    directions: tuple[Literal["forward", "reverse"], ...] = (
        ("forward", "reverse") if polarity == "both" else (polarity,)
    )
    for direction in directions:
        motion_inputs = {**block, **measures}
        if "xp_m_s" in chosen.term.inputs:
            # a p2 that cannot be used is rejected by the prediction
            p2 = block["p2"] if 0.0 < block["p2"] < math.inf else 1.0
            motion_inputs["xp_m_s"] = float(toppling_spectrum(motion, p2, direction))
        answer = answer_given(chosen, motion_inputs, level)
        assert isinstance(answer, Prediction)
        answers[direction] = add_warnings(answer, unused_measures(chosen, block))
    if polarity != "both":
        return answers[polarity]
    return _mean(answers["forward"], answers["reverse"])


def _mean(forward: Prediction, reverse: Prediction) -> MotionPrediction:
    def mean(name: str) -> float | None:
        first, other = getattr(forward, name), getattr(reverse, name)
        return None if first is None or other is None else 0.5 * (float(first) + float(other))

    warnings = [
        text if text in other.warnings else text.replaced(text=f"{polarity}: {text}")
        for polarity, answer, other in (
            ("forward", forward, reverse),
            ("reverse", reverse, forward),
        )
        for text in diagnostics(answer.warnings)
    ]
    means: dict[str, Any] = {
        name: mean(name) for name in ("probability", "ci_low", "ci_high", "intensity_m_s")
    }
    return MotionPrediction(
        **{
            **vars(forward),
            **means,
            "how": max(forward.how, reverse.how, key=lambda how: how.startswith("model")),
            "in_domain": forward.in_domain and reverse.in_domain,
            "warnings": diagnostics(warnings),
        },
        forward=forward,
        reverse=reverse,
    )


def measures_of(motion: GroundMotion) -> dict[str, float]:
    """Return the intensity measures of a motion by the names of :func:`rbfrag.predict`.

    Without spectral accelerations, which take longer.
    """
    measures = vars(motion.measures).items()
    return {name: value for name, value in measures if name in INTENSITY and value is not None}
