"""The functions P = F(eta) that binary outcomes are fitted by."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility import formulas

if TYPE_CHECKING:
    from statsmodels.genmod.families.links import Link as StatsmodelsLink

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Link:
    """One function from eta to probability.

    Args:
        name: as reports call it.
        code: its number in :mod:`rbfrag.fragility.formulas`.
        probability: F(eta).
        slope: dF/deta.
        eta: the inverse of F.
        sign: +1, or -1 where statsmodels counts eta the other way.
    """

    name: str
    code: int
    probability: Callable[[FloatArray], FloatArray]
    slope: Callable[[FloatArray], FloatArray]
    eta: Callable[[FloatArray], FloatArray]
    sign: float = 1.0

    def statsmodels(self) -> StatsmodelsLink:
        """Return the same link as statsmodels has it (with `sign` taken off)."""
        from statsmodels.genmod.families import links

        made: Any = {"logit": links.Logit, "loglog": links.LogLog, "complement": links.LogC}
        found: StatsmodelsLink = made[self.name]()
        return found


def _logistic(eta: FloatArray) -> FloatArray:
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * eta)))


def _logistic_slope(eta: FloatArray) -> FloatArray:
    return np.asarray(0.25 / np.cosh(np.clip(0.5 * eta, -300.0, 300.0)) ** 2)


def _decay(eta: FloatArray) -> FloatArray:
    return np.exp(-np.clip(eta, -30.0, 700.0))


LOGIT = Link(
    "logit",
    formulas.LOGIT,
    _logistic,
    _logistic_slope,
    lambda p: np.log(p / (1.0 - p)),
)
LOGLOG = Link(
    "loglog",
    formulas.LOGLOG,
    lambda eta: np.exp(-_decay(eta)),
    lambda eta: _decay(eta) * np.exp(-_decay(eta)),
    lambda p: -np.log(-np.log(p)),
)
COMPLEMENT = Link(
    "complement",
    formulas.COMPLEMENT,
    lambda eta: -np.expm1(-np.clip(eta, 1e-12, 700.0)),
    lambda eta: np.exp(-np.clip(eta, 0.0, 700.0)),
    lambda p: -np.log1p(-p),
    sign=-1.0,
)
