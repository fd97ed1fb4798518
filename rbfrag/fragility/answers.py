"""What a prediction answers: plain frozen data."""

from __future__ import annotations

from dataclasses import dataclass
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
        }


@dataclass(frozen=True, eq=False)
class PredictionArray:
    """Probabilities of many blocks or motions; all arrays have the broadcast shape.

    Args:
        probability: P; NaN where the input cannot be used.
        ci_low: lower end of the confidence interval of P.
        ci_high: upper end of it.
        in_domain: True where block and motion lie in the ranges that were fitted.
        reason: why an answer is missing, ruled or to be doubted; empty text elsewhere.
        y_m_s: toppling velocity of the blocks [m/s].
        intensity_m_s: intensity term of the motions [m/s].
        level: confidence level of the interval.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
    """

    probability: NDArray[np.float64]
    ci_low: NDArray[np.float64]
    ci_high: NDArray[np.float64]
    in_domain: NDArray[np.bool_]
    reason: NDArray[np.object_]
    y_m_s: NDArray[np.float64]
    intensity_m_s: NDArray[np.float64]
    level: float
    model: str
    term: str
    method: str
