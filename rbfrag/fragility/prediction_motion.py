"""The probability that a block topples in a motion that is known itself."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.db.rows import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.answers import MotionPrediction, Prediction, PredictionArray
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import answer_given
from rbfrag.motions.toppling_spectrum import toppling_spectrum

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion


def predict_motion(
    given: Mapping[str, ArrayLike],
    motion: GroundMotion,
    *,
    polarity: Literal["forward", "reverse", "both"],
    model: ModelRow | FragilityModel | str | None,
    level: float,
    db: str | PathLike[str] | None,
    nan: Literal["propagate", "raise"],
) -> Prediction | PredictionArray:
    """Return the probability for one block; arguments as for :func:`predict`.

    Raises:
        InputError: measures beside the motion, several blocks, an unknown polarity.
    """
    extra = [name for name in given if name not in ("p2", "kr")]
    if extra:
        raise InputError(
            f"{' and '.join(extra)} given beside a motion: the motion has them; leave them out"
        )
    if polarity not in ("forward", "reverse", "both"):
        raise InputError(f"polarity = {polarity!r}: use 'forward', 'reverse' or 'both'")
    p2, kr = np.asarray(given["p2"]), np.asarray(given["kr"])
    if p2.ndim or kr.ndim:
        raise InputError(
            "p2 and kr must be single numbers with a motion: call it once for each block, or use "
            "rbfrag.toppling_spectrum and a model of the term xp"
        )
    measures: dict[str, float] = {"pga_g": motion.pga_g, "pgv_m_s": motion.pgv_m_s}
    measures["pgd_m"] = motion.pgd_m
    if motion.tm_s is not None:
        measures["tm_s"] = motion.tm_s
    size = float(p2) if p2.dtype.kind in "fiu" else 1.0
    drawn = size if np.isfinite(size) and size > 0.0 else 1.0  # p2 itself is refused below
    answers: dict[str, Prediction] = {}
    for direction in ("forward", "reverse") if polarity == "both" else (polarity,):
        x = toppling_spectrum(motion, drawn, direction)
        own = {**given, **measures, "xp_m_s": float(x)}
        chosen = find_model(model, own, db)
        answer = answer_given(chosen, own, level, nan=nan)
        assert isinstance(answer, Prediction)
        answers[direction] = answer
    if polarity != "both":
        return answers[polarity]
    return _mean(answers["forward"], answers["reverse"])


def _mean(forward: Prediction, reverse: Prediction) -> MotionPrediction:
    def half(name: str) -> float:
        return 0.5 * (float(getattr(forward, name)) + float(getattr(reverse, name)))

    said = [f"forward: {text}" for text in forward.warnings]
    said += [f"reverse: {text}" for text in reverse.warnings]
    return MotionPrediction(
        probability=half("probability"),
        ci_low=half("ci_low"),
        ci_high=half("ci_high"),
        level=forward.level,
        model=forward.model,
        term=forward.term,
        method=forward.method,
        y_m_s=forward.y_m_s,
        intensity_m_s=half("intensity_m_s"),
        in_domain=forward.in_domain and reverse.in_domain,
        warnings=tuple(said),
        pgv_over_pga_s=forward.pgv_over_pga_s,
        forward=forward,
        reverse=reverse,
    )
