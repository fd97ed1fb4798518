"""What a prediction answers: plain frozen data."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Prediction:
    """Probability that one block topples in one motion.

    Args:
        probability: P, between 0 and 1.
        ci_low: lower end of the confidence interval of P.
        ci_high: upper end of it.
        level: confidence level of the interval.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        y_m_s: the block's toppling velocity k_r g/p [m/s].
        intensity_m_s: the intensity term of the motion [m/s].
        in_domain: True when block and motion lie in the ranges that were fitted.
        warnings: sentences about suspicious input or an answer to be doubted.
        pgv_over_pga_s: PGV over PGA [s] where both are known, else None: what tells long from
            short pulses where Tm is not known.
    """

    probability: float
    ci_low: float
    ci_high: float
    level: float
    model: str
    term: str
    method: str
    y_m_s: float
    intensity_m_s: float
    in_domain: bool
    warnings: tuple[str, ...] = ()
    pgv_over_pga_s: float | None = None

    def as_dict(self) -> dict[str, object]:
        """Return the answer under the keys of the JSON contract."""
        return {
            "probability": self.probability,
            "ci_low": self.ci_low,
            "ci_high": self.ci_high,
            "level": self.level,
            "model": self.model,
            "term": self.term,
            "method": self.method,
            "y_m_s": self.y_m_s,
            "intensity_m_s": self.intensity_m_s,
            "in_domain": self.in_domain,
            "warnings": list(self.warnings),
            "pgv_over_pga_s": self.pgv_over_pga_s,
        }


@dataclass(frozen=True)
class MotionPrediction(Prediction):
    """Probability that one block topples in a recorded motion of unknown direction.

    Every number of :class:`Prediction` is the mean of the two polarities.

    Args:
        forward: the answer where positive samples drive forward rotation.
        reverse: the answer where they drive backward.
    """

    forward: Prediction | None = None
    reverse: Prediction | None = None

    def as_dict(self) -> dict[str, object]:
        """Return the answer under the keys of the JSON contract, and both polarities."""
        result = super().as_dict()
        result["polarities"] = {
            name: None if answer is None else answer.as_dict()
            for name, answer in (("forward", self.forward), ("reverse", self.reverse))
        }
        return result


class Reasons:
    """Sentences by element, kept as one number each until somebody reads them."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        """Start with no sentence for any element."""
        self.shape = shape
        self._places: list[NDArray[np.intp]] = []
        self._texts: list[NDArray[np.object_]] = []

    def put(self, places: NDArray[np.intp], texts: NDArray[np.object_]) -> None:
        """Keep the texts of the elements at flat positions."""
        self._places.append(places)
        self._texts.append(texts)

    def array(self) -> NDArray[np.object_]:
        """Return the text of every element, empty where there is none."""
        import numpy as np

        result = np.full(self.shape, "", dtype=object)
        for places, texts in zip(self._places, self._texts, strict=True):
            result.flat[places] = texts
        return result


@dataclass(frozen=True, eq=False)
class PredictionArray:
    """Probabilities of many blocks or motions; all arrays have the broadcast shape.

    Args:
        probability: P; NaN where the input cannot be used.
        ci_low: lower end of the confidence interval of P.
        ci_high: upper end of it.
        in_domain: True where block and motion lie in the ranges that were fitted.
        reasons: why an answer is missing, ruled or to be doubted; read them by :attr:`reason`.
        y_m_s: toppling velocity of the blocks [m/s].
        intensity_m_s: intensity term of the motions [m/s].
        level: confidence level of the interval.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        notes: sentences about the model that hold for every element.
    """

    probability: NDArray[np.float64]
    ci_low: NDArray[np.float64]
    ci_high: NDArray[np.float64]
    in_domain: NDArray[np.bool_]
    reasons: Reasons
    y_m_s: NDArray[np.float64]
    intensity_m_s: NDArray[np.float64]
    level: float
    model: str
    term: str
    method: str
    notes: tuple[str, ...] = ()

    @cached_property
    def reason(self) -> NDArray[np.object_]:
        """Why an answer is missing, ruled or to be doubted; empty text elsewhere."""
        return self.reasons.array()
