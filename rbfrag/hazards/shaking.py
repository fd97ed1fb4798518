"""Interpretation of the levels of a hazard curve by a model: measure, factor and dispersion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.uncertain import scatter_steps
from rbfrag.hazards.curve import ANSWERED, CurveKeywords, HazardCurve
from rbfrag.hazards.im_uncertainty import CONVERSIONS, velocity_conversion
from rbfrag.question.components import SINGLE_COMPONENT, Component, component_named
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import annual_rate, percent
from rbfrag.solver.results import FloatArray

_SCATTER_POINTS = 25
_REACH = 6.0
"""Standard deviations of the scatter that are integrated over, to both sides."""

NOTABLE = 0.01
"""Part of a rate, or probability, from which on a warning tells of it."""


@dataclass(frozen=True, eq=False)
class HazardLevel:
    """Levels of a curve as a measure of a model: level · shift, with weights.

    Args:
        name: what `predict` calls the measure.
        shift: factors, shape (s,).
        weight: their weights, which sum to 1, shape (s,).
        median: the factor without scatter.
        warnings: what was assumed.
        magnitudes_from_g: as of the curve.
    """

    name: str
    shift: FloatArray
    weight: FloatArray
    median: float
    warnings: tuple[str, ...]
    magnitudes_from_g: float | None = None

    @classmethod
    def of(cls, curve: HazardCurve, **meaning: Unpack[CurveKeywords]) -> HazardLevel:
        """Return the interpretation of a curve's levels; arguments as for :func:`rbfrag.hazard`."""
        if curve.magnitudes_from_g is not None:
            single = cls.about(
                "pgv_m_s", component_named(SINGLE_COMPONENT), warnings=curve.warnings
            )
            return replace(single, magnitudes_from_g=curve.magnitudes_from_g)
        warnings = list(curve.warnings)
        name, factor, spread = _measure(
            curve, meaning.get("convert"), meaning.get("convert_sigma"), warnings
        )
        component = component_of(curve, meaning.get("component"))
        if component is None:
            warnings.append(SINGLE_CURVE)
            component = component_named(SINGLE_COMPONENT)
        elif component.name != SINGLE_COMPONENT:
            warnings.append(component.in_words("the curve is"))
        ratio = None if curve.period_s is None else component.spectral_ratio(curve.period_s)
        return cls.about(name, component, factor, spread, tuple(warnings), ratio)

    @classmethod
    def about(
        cls,
        name: str,
        component: Component,
        factor: float = 1.0,
        spread: float = 0.0,
        warnings: tuple[str, ...] = (),
        ratio: float | None = None,
    ) -> HazardLevel:
        """Return the interpretation of a measure of a given component.

        Args:
            factor: what it is multiplied by.
            spread: standard deviation of the logarithm of what results, beside the component's.
            ratio: ratio of the component, where the levels are of another measure; None for that
                of `name`.
        """
        scatter = math.hypot(component.sigma, spread)
        xi, weight = scatter_steps(scatter, _REACH, _SCATTER_POINTS)
        median = factor / (component.ratio(name) if ratio is None else ratio)
        return cls(name, median * np.exp(scatter * xi), weight, median, warnings)


SINGLE_CURVE = Diagnostic(
    "the hazard curve is assumed to be of a single horizontal component; hazard tools mostly give "
    "RotD50: use component='rotd50'",
    "single_component",
    fields=("component",),
)
"""Note of a rate whose curve does not specify the component."""


def component_of(curve: HazardCurve, name: str | None) -> Component | None:
    """Return the horizontal component of a curve; None where neither user nor file gives it."""
    name = curve.component or None if name is None else name
    return None if name is None else component_named(name)


def _measure(
    curve: HazardCurve, convert: str | None, sigma: float | None, warnings: list[str]
) -> tuple[str, float, float]:
    """Return the name in `predict`, the factor from the unit of the curve, and the dispersion."""
    # A curve of SA can serve models of PGV by a published conversion PGV = factor · SA(T), whose
    # scatter is integrated like that of the component.
    if convert is None:
        if sigma is not None:
            both = ("convert_sigma", "convert")
            raise InputError("convert_sigma requires convert: omit it", fields=both)
        if curve.known_as is None:
            raise InputError(_no_model(curve), fields=("convert",))
        return curve.known_as, 1.0, 0.0
    if curve.measure != "sa_g":
        raise InputError(
            f"{curve.source}: convert = {convert} is for spectral accelerations; the curve is of "
            f"{curve.imt}",
            fields=("convert",),
        )
    used = velocity_conversion(convert)
    if not curve.is_of(used.period_s):
        raise InputError(
            f"{curve.source}: {used.name} is for SA({used.period_s:g}), not for {curve.imt}: "
            f"choose the curve with imt 'SA({used.period_s:g})'",
            fields=("imt",),
        )
    spread = used.scatter if sigma is None else sigma
    if not 0.0 < spread < math.inf:
        raise InputError(
            f"convert_sigma = {spread:g}: give the standard deviation of ln PGV about the "
            "conversion, above zero",
            fields=("convert_sigma",),
        )
    warnings.append(
        Diagnostic(
            f"PGV is predicted from {curve.imt}: median {used.factor:.4g} m/s per g, σ_ln "
            f"{spread:g}, integrated ({used.source})",
            "spectral_conversion",
        )
    )
    if curve.known_as is not None:
        text = f"{curve.imt} need not be converted: there are models of it"
        warnings.append(Diagnostic(text, "conversion_not_needed"))
    return "pgv_m_s", used.factor, spread


def _no_model(curve: HazardCurve) -> str:
    also = [item.name for item in CONVERSIONS.values() if curve.is_of(item.period_s)]
    converted = f", or turn it into PGV with convert {' or '.join(also)}" if also else ""
    advice = f"give a curve of one of {ANSWERED}{converted}"
    return f"{curve.source}: no model reads {curve.imt} alone: {advice}"


def describe_ends(
    curves: Sequence[HazardCurve],
    site: NDArray[np.intp],
    rate: FloatArray,
    above: FloatArray,
    above_at_most: FloatArray,
    below: FloatArray,
) -> Iterator[str]:
    """Yield warnings where shaking beyond the ends of curves may matter; the worst case is named.

    Args:
        curves: the curve of each site.
        site: index of each block's site, shape (m,).
        rate: rates of failure [1/a], shape (m,); NaN of blocks that cannot be used.
        above: part from beyond the last level, at least [1/a], shape (m,).
        above_at_most: the same at most.
        below: probability of failure at the first level, shape (m,).
    """
    more = above_at_most - above
    of_block = " of a block" if rate.size > 1 else ""
    for doubtful, size in ((more > NOTABLE * rate, more), (below > NOTABLE, below)):
        if not doubtful.any():
            continue
        worst = int(np.argmax(np.where(doubtful, size, -1.0)))
        curve, sites = curves[site[worst]], np.unique(site[doubtful]).size
        of_site = f" of {curve.place}" if len(curves) > 1 and curve.place else ""
        more_sites = f" (and {sites - 1:,} more of {len(curves):,} sites)" if sites > 1 else ""
        if size is more:
            yield Diagnostic(
                f"the hazard curve{of_site} ends at {curve.level_text(-1)}: stronger shaking may "
                f"add up to {annual_rate(float(more[worst]))} /yr to the rate{of_block}"
                f"{more_sites}",
                "curve_ends",
            )
        else:
            yield Diagnostic(
                f"the hazard curve{of_site} begins at {curve.level_text(0)}, where "
                f"P(failure){of_block} is already {percent(float(below[worst]))}: weaker shaking "
                f"is neglected (unconservative){more_sites}",
                "curve_ends",
            )
