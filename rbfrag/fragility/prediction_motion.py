"""The probability that one block fails in a motion that is known itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from os import PathLike
from typing import Any, Literal

from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.measures import SPECTRAL, STATED
from rbfrag.fragility.model import Model
from rbfrag.fragility.prediction import (
    MotionPrediction,
    Prediction,
    answer_given,
    is_single,
    single,
)
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.recognise import MotionLike, as_motion
from rbfrag.motions.toppling_spectrum import toppling_spectrum

Polarity = Literal["forward", "reverse", "both"]

SIMULATED = (
    "what a known motion does to an uncertain block is simulated, by rbfrag respond with draws or "
    "rbfrag.respond_draws"
)


def predict_motion(
    given: Mapping[str, ArrayLike],
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
    """Return the probability for one block; arguments as for :func:`rbfrag.predict`."""
    if sites is not None:
        text = "sites given beside a motion, which shakes one: give its measures instead"
        raise InputError(text, fields=("sites",))
    if weights is not None:
        raise InputError(f"weights given beside a motion: {SIMULATED}")
    motion = as_motion(motion)
    extra = [name for name in given if name in STATED]
    if extra:
        raise InputError(
            f"{' and '.join(extra)} given beside a motion: the motion has them; leave them out"
        )
    if polarity not in ("forward", "reverse", "both"):
        raise InputError(f"polarity = {polarity!r}: use 'forward', 'reverse' or 'both'")
    uncertain = [name for name in given if name.endswith("_sigma")]
    if uncertain:
        raise InputError(f"{uncertain[0]} given beside a motion: {SIMULATED}")
    several = [name for name, value in given.items() if not is_single(value)]
    if several:
        raise InputError(
            f"{' and '.join(several)} must be single numbers with a motion: call it once for each "
            "block, or use rbfrag.toppling_spectrum and a model of the term xp"
        )
    block = {name: single(name, value) for name, value in given.items()}
    answers: dict[str, Prediction] = {}
    for direction in ("forward", "reverse") if polarity == "both" else (polarity,):
        # what the term X(p) does not read is of use only to a model that is named
        known = measures_of(motion, block.get("p2"), direction, spectrum=model is not None)
        own = {**block, **known}
        chosen = find_model(model, own, db, kind=kind, rotation_deg=rotation_deg)
        answer = answer_given(chosen, own, level)
        assert isinstance(answer, Prediction)
        answers[direction] = answer
    if polarity != "both":
        return answers[polarity]
    return _mean(answers["forward"], answers["reverse"])


def _mean(forward: Prediction, reverse: Prediction) -> MotionPrediction:
    def mean(name: str) -> float | None:
        one, other = getattr(forward, name), getattr(reverse, name)
        return None if one is None or other is None else 0.5 * (float(one) + float(other))

    warnings = [f"forward: {text}" for text in forward.warnings]
    warnings += [f"reverse: {text}" for text in reverse.warnings]
    means: dict[str, Any] = {
        name: mean(name)
        for name in ("probability", "ci_low", "ci_high", "intensity_m_s", "unknown_share")
    }
    return MotionPrediction(
        **{
            **vars(forward),
            **means,
            "in_domain": forward.in_domain and reverse.in_domain,
            "warnings": tuple(warnings),
        },
        forward=forward,
        reverse=reverse,
    )


def measures_of(
    motion: GroundMotion,
    p2: float | None,
    polarity: Literal["forward", "reverse"],
    *,
    spectrum: bool = False,
) -> dict[str, float]:
    """Return the measures of a motion by the names of :func:`rbfrag.predict`, and X(p).

    Args:
        motion: the accelerogram.
        p2: frequency parameter p² of the block [1/s²]; None where the block has none that a
            toppling spectrum is drawn for.
        polarity: how the motion points at the slope.
        spectrum: spectral accelerations too.
    """
    measures: dict[str, float] = {"pga_g": motion.pga_g, "pgv_m_s": motion.pgv_m_s}
    measures["pgd_m"] = motion.pgd_m
    if motion.tm_s is not None:
        measures["tm_s"] = motion.tm_s
    if spectrum:
        spectral = motion.spectral_accelerations
        measures |= {name: spectral[name] for name in SPECTRAL.values()}
    if p2 is not None:
        # a p2 that cannot be used is refused by the prediction
        drawn = p2 if math.isfinite(p2) and p2 > 0.0 else 1.0
        measures["xp_m_s"] = float(toppling_spectrum(motion, drawn, polarity))
    return measures
