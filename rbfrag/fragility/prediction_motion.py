"""The probability that a block fails in a motion that is known itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

from numpy.typing import ArrayLike

from rbfrag.db.rows import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import MEASURES, Prediction, answer_given, is_single, single
from rbfrag.motions.toppling_spectrum import toppling_spectrum

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion


@dataclass(frozen=True)
class MotionPrediction(Prediction):
    """Probability that one block fails in a recorded motion of unknown direction.

    Every number of :class:`Prediction` is the mean of the two polarities.

    Args:
        forward: the answer where positive samples drive forward rotation.
        reverse: the answer where they drive backward.
    """

    forward: Prediction | None = None
    reverse: Prediction | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract, and both polarities."""
        result = super().as_dict()
        both = {name: result.pop(name) for name in ("forward", "reverse")}
        result["polarities"] = {
            name: None if answer is None else answer.as_dict() for name, answer in both.items()
        }
        return result


def predict_motion(
    given: Mapping[str, ArrayLike],
    motion: GroundMotion,
    *,
    kind: str | None,
    rotation_deg: float | None,
    polarity: Literal["forward", "reverse", "both"],
    model: ModelRow | FragilityModel | str | None,
    level: float,
    db: str | PathLike[str] | None,
    nan: Literal["propagate", "raise"],
) -> Prediction:
    """Return the probability for one block; arguments as for :func:`predict`.

    Raises:
        InputError: measures beside the motion, several blocks, an unknown polarity.
    """
    extra = [name for name in given if name in MEASURES]
    if extra:
        raise InputError(
            f"{' and '.join(extra)} given beside a motion: the motion has them; leave them out"
        )
    if polarity not in ("forward", "reverse", "both"):
        raise InputError(f"polarity = {polarity!r}: use 'forward', 'reverse' or 'both'")
    several = [name for name, value in given.items() if not is_single(value)]
    if several:
        raise InputError(
            f"{' and '.join(several)} must be single numbers with a motion: call it once for each "
            "block, or use rbfrag.toppling_spectrum and a model of the term xp"
        )
    block = {name: single(name, value) for name, value in given.items()}
    measures: dict[str, float] = {"pga_g": motion.pga_g, "pgv_m_s": motion.pgv_m_s}
    measures["pgd_m"] = motion.pgd_m
    if motion.tm_s is not None:
        measures["tm_s"] = motion.tm_s
    p2 = block.get("p2")
    answers: dict[str, Prediction] = {}
    for direction in ("forward", "reverse") if polarity == "both" else (polarity,):
        own = {**block, **measures}
        if p2 is not None:
            # p2 itself is refused below
            drawn = p2 if math.isfinite(p2) and p2 > 0.0 else 1.0
            own["xp_m_s"] = float(toppling_spectrum(motion, drawn, direction))
        chosen = find_model(model, own, db, kind=kind, rotation_deg=rotation_deg)
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
        kind=forward.kind,
        failure=forward.failure,
        median_displacement_m=forward.median_displacement_m,
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
