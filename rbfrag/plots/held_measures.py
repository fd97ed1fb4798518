"""What a figure of one intensity holds fixed, for models that read more than that one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.formulas import EXPONENTS
from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

ONE_NUMBER_TERMS = ("pgv", "pga_tm", "pgd_tm")
"""Terms for which a probability depends on y and the term alone."""

MORE_TERMS = ("pgv_pga", "pgv_pga_tm")
"""Terms that are drawn over PGV, all else held."""

# Neither matters to models of one number; large blocks and short periods keep k_r below PGA.
_ANY_P2 = 0.1
_ANY_TM_S = 0.05


@dataclass(frozen=True)
class HeldMeasures:
    """Block size and measures that do not change over a figure.

    Args:
        p2: frequency parameter p² [1/s²].
        pga_g: PGA [g], or None for one in proportion to PGV.
        pgv_over_pga_s: PGV/(PGA g) [s] where PGA is in proportion.
        tm_s: mean period [s].
        words: what is held, for the caption; empty where nothing matters.
    """

    p2: float = _ANY_P2
    pga_g: float | None = None
    pgv_over_pga_s: float = math.nan
    tm_s: float = _ANY_TM_S
    words: str = ""

    def measures(self, model: FragilityModel, x_m_s: FloatArray) -> dict[str, FloatArray]:
        """Return the measures of motions of some intensities x [m/s], shape (n,)."""
        name = model.term.name
        tm = np.full(x_m_s.shape, self.tm_s)
        if name == "pga_tm":
            return {"pga_g": x_m_s * (2.0 * math.pi) / (STANDARD_GRAVITY_M_S2 * tm), "tm_s": tm}
        if name == "pgd_tm":
            return {"pgd_m": x_m_s * tm / (2.0 * math.pi), "tm_s": tm}
        measures = {"pgv_m_s": x_m_s}
        if name in MORE_TERMS:
            measures["pga_g"] = (
                x_m_s / (self.pgv_over_pga_s * STANDARD_GRAVITY_M_S2)
                if self.pga_g is None
                else np.full(x_m_s.shape, self.pga_g)
            )
        if name == "pgv_pga_tm":
            measures["tm_s"] = tm
        return measures

    def fitted_range(
        self, model: FragilityModel, low_m_s: float, high_m_s: float
    ) -> tuple[float, float]:
        """Return where PGV [m/s] is fitted: in its range, and PGV/PGA in its own where PGA is held.

        Args:
            model: the model.
            low_m_s: lower edge of the fitted intensities [m/s].
            high_m_s: upper edge.
        """
        if self.pga_g is None:
            return low_m_s, high_m_s
        ground = self.pga_g * STANDARD_GRAVITY_M_S2
        low, high = (float(edge) * ground for edge in model.row.domain["pgv_over_pga_s"])
        return max(low_m_s, low), max(min(high_m_s, high), max(low_m_s, low))


def held_measures(
    model: FragilityModel,
    *,
    p2: float | None = None,
    pga_g: float | None = None,
    tm_s: float | None = None,
) -> HeldMeasures:
    """Return what a figure of a model over one intensity holds.

    What is not given is the middle, of the logarithms, of the range that was fitted: p², Tm, and
    PGV/(PGA g), to which PGA then keeps.

    Args:
        model: the model that is drawn.
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
            f"model {model.name!r} reads {' and '.join(model.term.inputs)}, and one intensity "
            "cannot stand for them: this figure draws models of "
            f"{', '.join((*ONE_NUMBER_TERMS, *MORE_TERMS))}"
        )
    if not EXPONENTS.isdisjoint(model.row.coefficients):
        raise InputError(
            f"model {model.name!r} has an estimated exponent M: its probability depends on the "
            "size of the block too; draw one fitted with M = 1"
        )
    read = {"p2": name in MORE_TERMS, "pga": name in MORE_TERMS, "tm": name == "pgv_pga_tm"}
    for option, value in (("p2", p2), ("pga", pga_g), ("tm", tm_s)):
        if value is None:
            continue
        if not read[option]:
            raise InputError(
                f"--{option} = {value:g} changes nothing: the lines of model {model.name!r} do "
                "not depend on it; leave it out"
            )
        if not 0.0 < value < math.inf:
            raise InputError(f"--{option} = {value:g} is not above zero")
    if name not in MORE_TERMS:
        return HeldMeasures()
    size = _middle(model, "p2") if p2 is None else p2
    ratio = _middle(model, "pgv_over_pga_s")
    words = [f"p² = {size:.3g} 1/s²"]
    words.append(f"PGA = {pga_g:g} g" if pga_g is not None else f"PGV/(PGA g) = {ratio:.3g} s")
    period = _ANY_TM_S
    if name == "pgv_pga_tm":
        period = _middle(model, "tm_s") if tm_s is None else tm_s
        words.append(f"Tm = {period:.3g} s")
    return HeldMeasures(size, pga_g, ratio, period, "at " + ", ".join(words))


def _middle(model: FragilityModel, name: str) -> float:
    try:
        low, high = model.row.domain[name]
    except KeyError:
        raise InputError(
            f"model {model.name!r} does not say what range of {name} it was fitted to: fit it again"
        ) from None
    return math.sqrt(float(low) * float(high))
