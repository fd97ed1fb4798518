"""Dependence of the failures of blocks in one earthquake: the parameters of the Gaussian copula.

Block i fails if Z_i ≤ Φ⁻¹(P_i) with Z_i standard normal, so that every P stays as it is. What two
blocks of one earthquake share is the correlation of their Z; blocks of different earthquakes share
nothing. For single numbers no library is loaded; what needs arrays is in
:mod:`rbfrag.fragility.joint` and :mod:`rbfrag.fragility.joint_sampling`.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from rbfrag.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ROOT_HALF = math.sqrt(0.5)
ROOT_TWO_PI = math.sqrt(2.0 * math.pi)


class Loadings(NamedTuple):
    """Scatter of a completed spectral velocity in Z, before Z is scaled to variance 1: √w of
    :class:`Dependence`, split by what shares it.

    Args:
        event: √(w f_e), shared by all blocks of an earthquake.
        site: √(w (f_s - f_e)), shared by those of one site in addition.
        component: √(w (1 - f_s)), shared by those of one component in addition.
    """

    event: Any
    site: Any
    component: Any

    @property
    def variance(self) -> Any:
        """Variance of Z before it is scaled, 1 + w."""
        return 1.0 + self.event**2 + self.site**2 + self.component**2


EXACT = Loadings(0.0, 0.0, 0.0)
"""Loadings where the spectral velocity is exact, or the model reads none."""


class Shares(NamedTuple):
    """Shares ρ of :class:`Dependence` of like blocks, numbers or arrays."""

    rho_e: Any
    rho_s: Any
    rho_v: Any
    rho_o: Any


@dataclass(frozen=True)
class Dependence:
    """Correlation of the latent variables Z of two blocks in one earthquake.

        R = ρ_e exp(-D/λ_e)                                    any two blocks
          + ρ_s exp(-D/λ_e)                                    of the same site
          + [ρ_v exp(-D/λ_v) + q ρ_o exp(-D/λ_o)] exp(-d/λ_y)  and of the same component

    with D = |l_i - l_j|, l = ln(p s), d = |ln y_i - ln y_j|, q = +1 for the same polarity and -1
    for opposite ones. D and d, and so all lengths, are differences of logarithms without unit.

    Where a spectral velocity is completed by a regression, whose scatter has the share w = (h b σ)²
    of η, R becomes [R + √(w_i w_j) f]/√((1 + w_i)(1 + w_j)): f is f_e for blocks of one earthquake,
    f_s of one site and 1 of one component.

    Args:
        rho_e: share of the variance of Z that all blocks of an earthquake have in common, 0 to 1.
        rho_s: what those of one recording site have in common beyond it.
        rho_v: what those of one component have in common beyond that, whatever the polarity.
        rho_o: what changes its sign with the polarity. The four add up to 1.
        l_e: length λ_e in ln p over which earthquake and site are forgotten.
        l_v: the same of the component's symmetric part.
        l_o: the same of its antisymmetric part.
        l_y: length in ln y over which the component is forgotten.

    Raises:
        InputError: a share is below 0, they do not add up to 1, or a length is not above 0.
    """

    rho_e: float
    rho_s: float
    rho_v: float
    rho_o: float
    l_e: float
    l_v: float
    l_o: float
    l_y: float

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if name.startswith("rho") and not 0.0 <= value <= 1.0:
                raise InputError(f"{name} is a fraction between 0 and 1, not {value!r}")
            if name.startswith("l_") and not 0.0 < value < math.inf:
                raise InputError(f"{name} is a length above 0 and finite, not {value!r}")
        total = self.rho_e + self.rho_s + self.rho_v + self.rho_o
        if abs(total - 1.0) > 1e-9:
            raise InputError(
                f"rho_e + rho_s + rho_v + rho_o is {total:.10g} and must be 1: they are fractions "
                "of one variance"
            )

    def of_pairs(
        self,
        distance_l: NDArray[np.float64],
        distance_y: NDArray[np.float64],
        same_site: NDArray[np.bool_],
        same_component: NDArray[np.bool_],
        sign: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return the correlation R of pairs of blocks in one earthquake.

        Args:
            distance_l: D, any shape.
            distance_y: d, same shape.
            same_site: whether they are of one site.
            same_component: whether they are of one component of it.
            sign: q, the product of the polarities.
        """
        import numpy as np

        shared = self.rho_e + self.rho_s * same_site
        symmetric = self.rho_v * np.exp(-distance_l / self.l_v)
        antisymmetric = sign * self.rho_o * np.exp(-distance_l / self.l_o)
        component = same_component * (symmetric + antisymmetric) * np.exp(-distance_y / self.l_y)
        return np.asarray(shared * np.exp(-distance_l / self.l_e) + component)

    def shares(self, loadings: Loadings = EXACT) -> Shares:
        """Return the shares of like blocks whose spectral velocity is completed alike."""
        variance = loadings.variance
        return Shares(
            (self.rho_e + loadings.event**2) / variance,
            (self.rho_s + loadings.site**2) / variance,
            (self.rho_v + loadings.component**2) / variance,
            self.rho_o / variance,
        )


def normal_share(z: float) -> float:
    """Return Φ(z), the standard normal distribution function."""
    return 0.5 * math.erfc(-z * ROOT_HALF)


def normal_quantile(probability: float) -> float:
    """Return the standard normal quantile Φ⁻¹ of a probability from 0 to 1, to double precision.

    Halley's steps on ln Φ, from 26.2.23 of Abramowitz and Stegun (1964), which is right to 4.5e-4.
    """
    if probability > 0.5:
        return -normal_quantile(1.0 - probability)
    if probability <= 0.0:
        return -math.inf
    target = math.log(probability)
    t = math.sqrt(-2.0 * target)
    z = (2.515517 + t * (0.802853 + t * 0.010328)) / (
        1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308))
    ) - t
    for _ in range(60):
        share = 0.5 * math.erfc(-z * ROOT_HALF)
        hazard = math.exp(-0.5 * z * z) / (ROOT_TWO_PI * share)
        step = (target - math.log(share)) / hazard
        step /= 1.0 - 0.5 * step * (z + hazard)
        z += step
        if -1e-5 < step < 1e-5:  # each step leaves a cube of the last
            break
    return z
