"""Model predictions for many blocks, and lines of equal probability."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.optimize.elementwise import find_root

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.fragility.measures import SINGLE_TERMS
from rbfrag.fragility.method import arrays
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import QUANTITIES
from rbfrag.vocabulary.spectral import period_of

# Without effect on models of y over one intensity; large blocks and short periods keep k_r below
# PGA.
_ANY_P2 = 0.1
_ANY_TM_S = 0.05


@dataclass(frozen=True)
class HeldMeasures:
    """Abscissa of a chart, and the block size and intensity measures held constant in it.

    Args:
        across: name of the measure of the abscissa; ``intensity_m_s`` for the intensity term [m/s]
            of a model of :data:`SINGLE_TERMS`.
        p2: frequency parameter p² [1/s²].
        constants: measures held constant, by name.
        pgv_over_pga_s: PGV/(PGA g) [s] of a model of PGV with PGA whose PGA is not held.
        words: what is held, for the caption; empty where nothing matters.
        size_is_given: whether the figure is of blocks of this size, and not of any.
        block_inputs: further inputs of the block.
    """

    across: str
    p2: float = _ANY_P2
    constants: Mapping[str, float] = field(default_factory=dict)
    pgv_over_pga_s: float = math.nan
    words: str = ""
    size_is_given: bool = False
    block_inputs: Mapping[str, float] = field(default_factory=dict)

    def values(self, model: FragilityModel, x: FloatArray, kr: FloatArray) -> dict[str, Any]:
        """Return motions of the values x of the abscissa, with blocks of the held size and k_r."""
        first = model.term.inputs[0]
        values: dict[str, Any] = {"p2": self.p2, **self.constants, **self.block_inputs}
        if self.across == "intensity_m_s":
            # each of these terms is in proportion to its first measure
            values[first] = x / model.term.intensity_m_s({**values, first: 1.0})
        else:
            values[self.across] = x
        if "pga_g" in model.term.inputs and "pga_g" not in values:
            values["pga_g"] = x / (self.pgv_over_pga_s * STANDARD_GRAVITY_M_S2)
        return {"kr": kr, **{name: np.broadcast_to(v, x.shape) for name, v in values.items()}}

    def scale_m_s(self, x: FloatArray) -> FloatArray:
        """Return the velocity [m/s] that values of the abscissa correspond to, roughly."""
        is_acceleration = self.across == "pga_g" or period_of(self.across) is not None
        return x * STANDARD_GRAVITY_M_S2 / math.sqrt(self.p2) if is_acceleration else x


def chart_axis(model: FragilityModel) -> str | None:
    """Return the abscissa of the design chart of a model, as in :class:`HeldMeasures`.

    None for a model without a chart: one of several spectral accelerations, or of them with another
    measure.
    """
    names = model.term.inputs
    if model.term.name in SINGLE_TERMS:
        return "intensity_m_s"
    across = "pgv_m_s" if "pgv_m_s" in names else names[0]
    held = {"tm_s", "magnitude"} | ({"pga_g"} if across == "pgv_m_s" else set())
    return across if across != "xp_m_s" and {across, *held} >= {*names} else None


def held_names(model: FragilityModel) -> list[str]:
    """Return the names of the measures held constant in the design chart of a model."""
    if not depends_on_size(model):
        return []
    across, names = chart_axis(model), model.term.inputs
    return [name for name in names if name != (names[0] if across == "intensity_m_s" else across)]


def held_measures(
    model: FragilityModel, *, p2: float | None = None, **constants: float | None
) -> HeldMeasures:
    """Return the variables held constant in a figure of a model against one intensity measure.

    Default is the middle, of the logarithms, of the fitted range of p² and T_m, and a PGA in
    proportion to PGV, with the middle of PGV/(PGA g). A model that serves all sizes alike may be
    given p² for the axis of k_r.

    Args:
        p2: frequency parameter p² [1/s²].
        constants: values of measures held constant, by name; None for the default.

    Raises:
        InputError: a model without a chart, a value that is not above zero, or one that the model
            does not use.
    """
    across = chart_axis(model)
    if across is None:
        raise InputError(
            f"model {model.name!r} uses {' and '.join(model.term.inputs)}: a design chart is of "
            "one intensity measure, or of PGV with PGA (and Tm)"
        )
    held = held_names(model)
    for name, value in (("p2", p2), *constants.items()):
        if value is None:
            continue
        if name not in ("p2", *held):
            raise InputError(
                f"{name} = {value:g} has no effect: the chart of model {model.name!r} does not "
                "depend on it, or it is an axis; omit it",
                fields=(name,),
            )
        if not 0.0 < value < math.inf:
            raise InputError(f"{name} = {value:g} is not above zero", fields=(name,))
    if not depends_on_size(model):
        any_tm = {"tm_s": _ANY_TM_S} if "tm_s" in model.term.inputs else {}
        return HeldMeasures(across, p2 or _ANY_P2, any_tm, size_is_given=p2 is not None)
    size, ratio = p2 or _middle(model, "p2"), math.nan
    values: dict[str, float] = {}
    words = [f"p² = {size:.3g} 1/s²"]
    for name in held:
        if name == "pga_g" and constants.get(name) is None:
            ratio = _middle(model, "pgv_over_pga_s")
            words.append(f"PGV/(PGA g) = {ratio:.3g} s")
            continue
        values[name] = constants.get(name) or _middle(model, name)
        symbol = QUANTITIES[name].symbol.replace("_", "")
        words.append(f"{symbol} = {values[name]:.3g} {QUANTITIES[name].unit}".rstrip())
    return HeldMeasures(across, size, values, ratio, "at " + ", ".join(words), size_is_given=True)


def depends_on_size(model: FragilityModel) -> bool:
    """Return whether P of a model depends on p² at the same y and intensity."""
    if model.term.name not in SINGLE_TERMS:
        return True
    x = np.ones(_RATIOS.size)
    constants = {"tm_s": _ANY_TM_S} if "tm_s" in model.term.inputs else {}
    least, most = (
        array_answer(
            model,
            HeldMeasures("intensity_m_s", p2, constants).values(
                model, x, _RATIOS * math.sqrt(p2) / STANDARD_GRAVITY_M_S2
            ),
        ).probability
        for p2 in (0.3, 10.0)
    )
    return not np.allclose(least, most, rtol=1e-9, atol=1e-12)


_RATIOS = np.geomspace(0.02, 2.0, 9)
"""y over the intensity at which two sizes are compared."""


def _middle(model: FragilityModel, name: str) -> float:
    try:
        low, high = model.row.domain[name]
    except KeyError:
        raise InputError(
            f"model {model.name!r} has no fitted range of {name}: fit it again"
        ) from None
    return math.sqrt(float(low) * float(high))


_LOWEST, _HIGHEST = 1e-4, 50.0
"""Range of y over its scale in which a block of given probability is looked for."""


def failure_line(
    model: FragilityModel, x: FloatArray, probability: float, held: HeldMeasures | None = None
) -> FloatArray:
    """Return the toppling velocity y [m/s] that fails with a given probability.

    Args:
        model: a model with a chart (:func:`chart_axis`).
        x: values of the abscissa, shape (n,), > 0.
        held: what does not change along the line; None for the middle of the fitted ranges.

    Returns:
        y, shape (n,); NaN where even the weakest block is less likely to fail, which is where
        a model of no bound runs below zero.
    """
    held = held_measures(model) if held is None else held

    def toppling(y_m_s: FloatArray, x: FloatArray) -> FloatArray:
        kr = y_m_s * math.sqrt(held.p2) / STANDARD_GRAVITY_M_S2
        return array_answer(model, held.values(model, x, kr)).probability

    return _of_probability(probability, toppling, held.scale_m_s(x), x)


def _of_probability(
    probability: float, toppling: Callable[..., FloatArray], scale_m_s: FloatArray,
    *columns: FloatArray,
) -> FloatArray:  # fmt: skip
    """Return y [m/s] of given probability where toppling(y, *columns) decreases with y.

    Args:
        scale_m_s: velocity [m/s] of which y is a reasonable multiple.
    """
    ends = np.log(_LOWEST * scale_m_s), np.log(_HIGHEST * scale_m_s)
    root = find_root(
        lambda ln_y, *columns: toppling(np.exp(ln_y), *columns) - probability, ends, args=columns
    )
    return np.asarray(np.exp(root.x), dtype=np.float64)


def predicted_strengths(
    model: FragilityModel,
    table: CombinationTable,
    probability: float,
    measures: Mapping[str, FloatArray] = MappingProxyType({}),
) -> FloatArray:
    """Return the toppling velocity y [m/s] of given failure probability for each motion.

    Args:
        measures: columns by name, shape (n,), which replace those of the table: the toppling
            spectrum and spectral accelerations.

    Returns:
        Shape (n,); NaN where a predictor of the model is not known.
    """
    names = ("p2", *model.term.inputs)
    inputs = {n: measures[n] if n in measures else table.measure(n) for n in names}
    valid = np.all([np.isfinite(column) & (column > 0.0) for column in inputs.values()], axis=0)
    inputs = {name: column[valid] for name, column in inputs.items()}
    scale_m_s = model.completed({**inputs, "kr": np.ones(valid.sum())}, arrays())["intensity_m_s"]

    def toppling(y_m_s: FloatArray, *columns: FloatArray) -> FloatArray:
        block_inputs = dict(zip(inputs, columns, strict=True))
        kr = y_m_s * np.sqrt(block_inputs["p2"]) / STANDARD_GRAVITY_M_S2
        return array_answer(model, {**block_inputs, "kr": kr}, interval=False).probability

    result = np.full(valid.shape, np.nan)
    result[valid] = _of_probability(probability, toppling, scale_m_s, *inputs.values())
    return result


_SMOOTH_OVER = 0.12
"""Standard deviation of the weights along a smooth line, of the range of its abscissae."""


def smooth_line(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Return a smooth line through positive points, in logarithms of both.

    Each value is that of a straight line fitted about its place with Gaussian weights (Cleveland
    1979, with another weight).

    Args:
        x: abscissae of the points, shape (n,).
        y: their ordinates, shape (n,).
        at: abscissae of the line, shape (m,).

    Returns:
        Shape (m,).
    """
    ln_x, ln_y, ln_at = np.log(x), np.log(y), np.log(at)
    width = max(_SMOOTH_OVER * float(np.ptp(ln_x)), 1e-6)
    off = ln_x - ln_at[:, None]
    weight = np.exp(-0.5 * (off / width) ** 2)
    weight /= weight.sum(axis=1, keepdims=True)
    mean_off, mean = (weight * off).sum(axis=1), weight @ ln_y
    aside = off - mean_off[:, None]
    spread = np.maximum((weight * aside**2).sum(axis=1), np.finfo(float).tiny)
    slope = (weight * aside * ln_y).sum(axis=1) / spread
    return np.asarray(np.exp(mean - slope * mean_off))
