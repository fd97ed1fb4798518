"""A copula, and portfolios of blocks at random, for tests of joint failures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement, joint_excess

LAW = Dependence(0.055, 0.162, 0.270, 0.513, 1.7, 2.5, 5.1, 0.67)


SHARED = {"rho_e": 0.136, "rho_s": 0.236, "rho_v": 0.219, "rho_o": 0.409,
          "l_e": 1.0, "l_v": 2.5, "l_o": 6.7, "l_y": 0.5}  # fmt: skip
"""A copula as models store it."""


def anywhere(n: int, seed: int) -> Placement:
    """Return blocks of two earthquakes, three sites and two components, on both sides."""
    random = np.random.default_rng(seed)
    return Placement.of(
        random.uniform(-1.2, 1.7, n), random.normal(size=n), earthquake=random.integers(2, size=n),
        site=random.integers(3, size=n), component=random.integers(2, size=n),
        polarity=random.choice((-1, 1), size=n),
    )  # fmt: skip


def correlation(law: Dependence, blocks: Placement) -> NDArray[np.float64]:
    """Return the correlation matrix R of blocks of known azimuth, shape (n, n)."""

    def pairs(column: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        return column[:, None], column[None, :]

    earthquake, site, component = (
        np.equal(*pairs(label)) for label in (blocks.earthquake, blocks.site, blocks.component)
    )
    r = law.of_pairs(
        np.abs(np.subtract(*pairs(blocks.l))), np.abs(np.subtract(*pairs(blocks.ln_y))),
        earthquake & site, earthquake & site & component,
        np.multiply.outer(blocks.polarity, blocks.polarity).astype(np.float64),
    )  # fmt: skip
    r *= earthquake
    np.fill_diagonal(r, 1.0)
    return r


def bivariate_normal(a, b, r):
    """Return Φ₂(a, b; R), the probability that two standard normals are below a and b."""
    return joint_excess(a, b, r) + ndtr(a) * ndtr(b)
