"""Model predictions for many blocks, and lines of equal probability."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize.elementwise import find_root

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import InputError
from rbfrag.fragility.method import SINGLE
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import INTENSITY, QUANTITIES

ONE_NUMBER_TERMS = ("pgv", "pgv_kr", "pga", "sa10", "pga_tm", "pgd_tm")
"""Terms that are one number."""

MORE_TERMS = ("pgv_pga", "pgv_pga_tm")
"""Terms that are drawn over PGV, all else held."""

# Not to be seen in models of y and one number; large blocks and short periods keep k_r below PGA.
_ANY_P2 = 0.1
_ANY_TM_S = 0.05


@dataclass(frozen=True)
class HeldMeasures:
    """Block size and measures held constant in a figure.

    Args:
        p2: frequency parameter p² [1/s²].
        pga_g: PGA [g], or None for one in proportion to PGV.
        pgv_over_pga_s: PGV/(PGA g) [s] where PGA is in proportion.
        tm_s: mean period [s].
        block_inputs: what else is known of the block.
        words: what is held, for the caption; empty where nothing matters.
        size_is_given: whether the figure is of blocks of this size, and not of any.
    """

    p2: float = _ANY_P2
    pga_g: float | None = None
    pgv_over_pga_s: float = math.nan
    tm_s: float = _ANY_TM_S
    words: str = ""
    size_is_given: bool = False
    block_inputs: Mapping[str, float] = field(default_factory=dict)

    def measures(self, model: FragilityModel, x_m_s: FloatArray) -> dict[str, FloatArray]:
        """Return the measures of motions of given intensities x [m/s], shape (n,)."""
        first, *other_names = model.term.inputs
        unit_inputs = dict.fromkeys(model.term.inputs, 1.0)
        unit_inputs |= {"tm_s": self.tm_s, "p2": self.p2, "kr": 1.0}
        # every term is in proportion to its first measure
        unit = model.method.block.completed(unit_inputs, model.term, SINGLE)["intensity_m_s"]
        measures = {first: x_m_s / unit}
        if "pga_g" in other_names:
            measures["pga_g"] = (
                x_m_s / (self.pgv_over_pga_s * STANDARD_GRAVITY_M_S2)
                if self.pga_g is None
                else np.full(x_m_s.shape, self.pga_g)
            )
        if "tm_s" in other_names:
            measures["tm_s"] = np.full(x_m_s.shape, self.tm_s)
        return measures | {
            name: np.full(x_m_s.shape, value) for name, value in self.block_inputs.items()
        }

    def values(
        self, model: FragilityModel, x_m_s: FloatArray, kr: FloatArray
    ) -> dict[str, FloatArray | float]:
        """Return these motions, with blocks of the held size and given k_r."""
        return {"p2": self.p2, "kr": kr, **self.measures(model, x_m_s)}


def held_measures(
    model: FragilityModel,
    *,
    p2: float | None = None,
    pga_g: float | None = None,
    tm_s: float | None = None,
) -> HeldMeasures:
    """Return the variables held constant in a figure of a model against one intensity.

    What is not given is the middle, of the logarithms, of the range that was fitted: p², Tm, and
    PGV/(PGA g), to which PGA then keeps. Of a model that serves all sizes alike p² may be given for
    the axis of k_r.

    Args:
        p2: frequency parameter p² [1/s²].
        pga_g: PGA [g].
        tm_s: mean period [s].

    Raises:
        InputError: a model that cannot be drawn so, a value that is not above zero, or one
            that the model does not read.
    """
    name = model.term.name
    if name not in (*ONE_NUMBER_TERMS, *MORE_TERMS):
        raise InputError(
            f"model {model.name!r} uses {' and '.join(model.term.inputs)}, not a single "
            "intensity: this figure is for models of "
            f"{', '.join((*ONE_NUMBER_TERMS, *MORE_TERMS))}"
        )
    more, of_size = name in MORE_TERMS, depends_on_size(model)
    read = {"p2": True, "pga_g": more, "tm_s": name == "pgv_pga_tm"}
    for held, value in (("p2", p2), ("pga_g", pga_g), ("tm_s", tm_s)):
        if value is None:
            continue
        if not read[held]:
            raise InputError(
                f"{held} = {value:g} has no effect: the lines of model {model.name!r} do not "
                "depend on it; omit it",
                fields=(held,),
            )
        if not 0.0 < value < math.inf:
            raise InputError(f"{held} = {value:g} is not above zero", fields=(held,))
    if not of_size:
        return HeldMeasures() if p2 is None else HeldMeasures(p2, size_is_given=True)
    size = _middle(model, "p2") if p2 is None else p2
    words = [f"p² = {size:.3g} 1/s²"]
    if not more:
        return HeldMeasures(size, words=f"at {words[0]}", size_is_given=True)
    ratio = _middle(model, "pgv_over_pga_s")
    words.append(f"PGA = {pga_g:g} g" if pga_g is not None else f"PGV/(PGA g) = {ratio:.3g} s")
    period = _ANY_TM_S
    if name == "pgv_pga_tm":
        period = _middle(model, "tm_s") if tm_s is None else tm_s
        words.append(f"Tm = {period:.3g} s")
    return HeldMeasures(size, pga_g, ratio, period, "at " + ", ".join(words), size_is_given=True)


def depends_on_size(model: FragilityModel) -> bool:
    """Return whether P of a model depends on p² at the same y and intensity."""
    if model.term.name not in ONE_NUMBER_TERMS:
        return True
    x = np.ones(_RATIOS.size)
    least, most = (
        array_answer(
            model,
            HeldMeasures(p2).values(model, x, _RATIOS * math.sqrt(p2) / STANDARD_GRAVITY_M_S2),
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
"""Range of y/x in which a block of given probability is looked for."""


def failure_line(
    model: FragilityModel, x_m_s: FloatArray, probability: float, held: HeldMeasures | None = None
) -> FloatArray:
    """Return the toppling velocity y [m/s] that fails with a given probability.

    Args:
        model: a model of a term that is one number, or of PGV with PGA.
        x_m_s: intensities [m/s], shape (n,), > 0.
        held: what does not change along the line; None for the middle of the fitted ranges.

    Returns:
        y, shape (n,); NaN where even the weakest block is less likely to fail, which is where
        a model of no bound runs below zero.
    """
    held = held_measures(model) if held is None else held

    def toppling(y_m_s: FloatArray, x_m_s: FloatArray) -> FloatArray:
        kr = y_m_s * math.sqrt(held.p2) / STANDARD_GRAVITY_M_S2
        return array_answer(model, held.values(model, x_m_s, kr)).probability

    return _of_probability(probability, toppling, x_m_s)


def _of_probability(
    probability: float, toppling: Callable[..., FloatArray], x_m_s: FloatArray, *columns: FloatArray
) -> FloatArray:
    """Return y [m/s] of given probability where toppling(y, x, *others) decreases with y."""
    ends = np.log(_LOWEST * x_m_s), np.log(_HIGHEST * x_m_s)
    root = find_root(
        lambda ln_y, *columns: toppling(np.exp(ln_y), *columns) - probability,
        ends,
        args=(x_m_s, *columns),
    )
    return np.asarray(np.exp(root.x), dtype=np.float64)


def predicted_strengths(
    model: FragilityModel, table: CombinationTable, xp_m_s: FloatArray, probability: float
) -> FloatArray:
    """Return the toppling velocity y [m/s] of given failure probability for each motion.

    Args:
        xp_m_s: toppling spectrum of each row [m/s], shape (n,).

    Returns:
        Shape (n,); NaN where what the model reads is not known.
    """
    stored = (name for name in INTENSITY if QUANTITIES[name].stored)
    columns = {name: table.measure(name) for name in ("p2", *stored)} | {"xp_m_s": xp_m_s}
    inputs = {name: columns[name] for name in ("p2", *model.term.inputs)}
    with np.errstate(divide="ignore", invalid="ignore"):
        p = np.sqrt(table.p2)
        x = np.asarray(model.term.intensity_m_s({**inputs, "p": p}), dtype=np.float64)
    valid = np.isfinite(x) & (x > 0.0)
    for name in model.term.inputs:
        valid &= np.isfinite(inputs[name])
    inputs = {name: column[valid] for name, column in inputs.items()}

    def toppling(y_m_s: FloatArray, _: FloatArray, *columns: FloatArray) -> FloatArray:
        block_inputs = dict(zip(inputs, columns, strict=True))
        kr = y_m_s * np.sqrt(block_inputs["p2"]) / STANDARD_GRAVITY_M_S2
        return array_answer(model, {**block_inputs, "kr": kr}, interval=False).probability

    result = np.full(x.shape, np.nan)
    result[valid] = _of_probability(probability, toppling, x[valid], *inputs.values())
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
