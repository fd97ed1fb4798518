"""Range of the fitted points: of each variable and ratio, and their joint scatter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.domain import INSIDE, ratios_of
from rbfrag.solver.results import FloatArray


def ranges_of(values: Mapping[str, FloatArray]) -> dict[str, tuple[float, float]]:
    """Return the range of the finite values of each variable."""
    finite = {name: v[np.isfinite(v)] for name, v in values.items()}
    return {name: (float(v.min()), float(v.max())) for name, v in finite.items() if v.size}


def ratio_columns(measures: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return every ratio that the intensity measures allow; not finite without shaking."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return {ratio.name: np.asarray(ratio.formula(measures)) for ratio in ratios_of(measures)}


def joint_scatter(
    names: Sequence[str], values: Mapping[str, FloatArray], fitted: NDArray[np.bool_]
) -> dict[str, object] | None:
    """Return the scatter of the fitted points in the logarithms of the predictors.

    Args:
        values: by name, of a shape that broadcasts to that of `fitted`.
        fitted: which points are fitted, shape (n, m).

    Returns:
        names, centre, inverse covariance and the radius that the share `INSIDE` of the points lies
        within, JSON-able; None where there are no points. A direction in which the points do not
        scatter counts nothing: the ranges of single variables hold there.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.stack([np.log(np.broadcast_to(values[n], fitted.shape)) for n in names], axis=-1)
    points = logs[fitted & np.isfinite(logs).all(axis=-1)]
    if len(points) <= len(names):
        return None
    centre = points.mean(axis=0)
    inverse = np.linalg.pinv(np.atleast_2d(np.cov(points.T)), rcond=1e-10, hermitian=True)
    from_centre = points - centre
    distance = np.sqrt(np.einsum("ij,jk,ik->i", from_centre, inverse, from_centre, optimize=True))
    return {
        "names": list(names),
        "centre": centre.tolist(),
        "inverse_covariance": inverse.tolist(),
        "radius": float(np.quantile(distance, INSIDE, method="higher")) * (1.0 + 1e-9),
    }
