"""What the levels of a hazard curve are to a model: its measure, a factor, and a scatter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.hazards.annual_rate import normal_steps
from rbfrag.hazards.answer import _measure
from rbfrag.hazards.conversions import component as component_named
from rbfrag.hazards.curve import HazardCurve

FloatArray = NDArray[np.float64]

_SCATTER_POINTS = 17
_REACH = 4.0
"""Standard deviations of the scatter that are integrated over, to both sides."""
_STEP = 0.1
"""Greatest step of the measure's logarithm."""


@dataclass(frozen=True, eq=False)
class Shaking:
    """How a model reads a level of a curve: as the measure at level · shift, with weights.

    Args:
        name: what `predict` calls the measure.
        shift: factors, shape (s,).
        weight: their weights, which sum to 1, shape (s,).
        median: the factor without scatter.
        warnings: what was assumed.
    """

    name: str
    shift: FloatArray
    weight: FloatArray
    median: float
    warnings: tuple[str, ...]

    @classmethod
    def of(
        cls,
        curve: HazardCurve,
        *,
        convert: str | None = None,
        convert_sigma: float | None = None,
        component: str | None = None,
    ) -> Shaking:
        """Return what a curve's levels are; arguments as for :func:`rbfrag.hazard`."""
        warnings = list(curve.warnings)
        name, factor, spread = _measure(curve, convert, convert_sigma, warnings)
        meaning = component_named("single" if component is None else component)
        if component is None:
            warnings.append(
                "the curve's horizontal component is taken as a single one, which the models are "
                "fitted on; hazard products often mean rotd50 or the geometric mean: say which"
            )
        else:
            warnings.append(
                f"the curve is of {meaning.title}; Beyer and Bommer (2006) relate it to one component"
                if meaning.name != "single"
                else "the curve is of a single component, as the models are"
            )
        scatter = math.hypot(meaning.scatter, spread)
        steps = max(_SCATTER_POINTS, 2 * math.ceil(_REACH * scatter / _STEP) + 1)
        xi, weight = normal_steps(1 if scatter == 0.0 else steps, _REACH)
        median = factor / meaning.ratio
        return cls(name, median * np.exp(scatter * xi), weight, median, tuple(warnings))
