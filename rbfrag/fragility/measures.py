"""Intensity terms: combinations of intensity measures as a velocity in m/s.

Each is pure arithmetic on single numbers or arrays and loads no library.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeVar

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.vocabulary import quantities as vocabulary
from rbfrag.vocabulary.quantities import INTENSITY
from rbfrag.vocabulary.spectral import SpectralMapping, SpectralSet, period_of

T = TypeVar("T")


@dataclass(frozen=True)
class Term:
    """One intensity term.

    Args:
        name: name in options and in the database.
        title: name for people.
        symbol: symbol of the nomenclature.
        inputs: measures of the motion it needs, as named in `predict`; the first one says
            how strong the shaking is, and is zero when there is none.
        formula: the term from its inputs, in the order of `inputs`.
        variance_degree: degree of the dissertation's variance polynomial in this term.
        of_block: what the formula reads of the block, after the inputs.
        by_name: its models answer where they are named or the default, never by themselves.
    """

    name: str
    title: str
    symbol: str
    inputs: tuple[str, ...]
    formula: Callable[..., Any]
    variance_degree: int = 1
    of_block: tuple[str, ...] = ()
    by_name: bool = False

    @property
    def label(self) -> str:
        """Axis label with the unit."""
        return f"{self.title}, {self.symbol} [m/s]"

    def intensity_m_s(self, measures: Mapping[str, Any]) -> Any:
        """Return the term [m/s] from intensity measures, and p of the block [1/s] where required,
        by name.

        More than it needs may be given.
        """
        return self.formula(*[measures[name] for name in (*self.inputs, *self.of_block)])


def spectral_velocity_m_s(sa_g: Any, period_s: float) -> Any:
    """Return V_T = SA·g·T/2π [m/s] from a spectral acceleration [g] and its period [s]."""
    return sa_g * (STANDARD_GRAVITY_M_S2 * period_s / (2.0 * math.pi))


def _first(*measures: Any) -> Any:
    """Return the first intensity measure [m/s]; the others are separate predictors."""
    return measures[0]


def _first_over_p(pga_g: Any, *rest: Any) -> Any:
    """Return PGA·g/p [m/s], with p last; the other intensity measures are separate predictors."""
    return pga_g * STANDARD_GRAVITY_M_S2 / rest[-1]


def _last(*measures: Any) -> Any:
    """Return the block-relative spectral velocity [m/s], which stands last."""
    return measures[-1]


_PGV = "peak ground velocity"

TERMS: Mapping[str, Term] = {
    term.name: term
    for term in (
        Term("xp", "toppling spectrum", "X(p)", ("xp_m_s", "pga_g"), _first),
        Term("pgv_pga_ia", f"{_PGV}, with PGA and Arias intensity", "PGV",
             ("pgv_m_s", "pga_g", "arias_m_s"), _first),
        Term("pgv_pga_m", f"{_PGV}, with PGA and magnitude", "PGV",
             ("pgv_m_s", "pga_g", "magnitude"), _first),
        Term("pgv_pga", f"{_PGV}, with PGA", "PGV", ("pgv_m_s", "pga_g"), _first),
        Term("pga", "peak ground acceleration over the block's frequency parameter", "PGA·g/p",
             ("pga_g",), _first_over_p, of_block=("p",)),
        Term("pgv", _PGV, "PGV", ("pgv_m_s",), _first),
        Term("sa", "spectral velocity at the block's periods", "V(p)", (), _last,
             of_block=("velocity_m_s",)),
        Term("pga_tm", "peak ground acceleration over mean frequency", "PGA·g·Tm/2π",
             ("pga_g", "tm_s"),  # equation (4.31)
             lambda pga_g, tm_s: pga_g * STANDARD_GRAVITY_M_S2 * tm_s / (2.0 * math.pi)),
        Term("pgd_tm", "peak ground displacement times mean frequency", "2π·PGD/Tm",
             ("pgd_m", "tm_s"),  # equation (4.31)
             lambda pgd_m, tm_s: pgd_m * (2.0 * math.pi) / tm_s, variance_degree=2, by_name=True),
    )
}  # fmt: skip
"""The terms by name."""

SIGMAS = SpectralMapping(
    {
        name: f"{name.partition('_')[0]}_sigma"
        for name, measure in vocabulary.MEASURES.items()
        if measure.uncertain
    },
    "{}_sigma".format, "sa_g",
)  # fmt: skip
"""The name of the standard deviation of each measure that may be known with scatter."""

SCATTERED = SpectralMapping(
    {sigma: measure for measure, sigma in SIGMAS.items()},
    lambda name: name.removesuffix("_sigma"), "sa_sigma",
)  # fmt: skip
"""By the name of its standard deviation each such measure."""

AMPLIFIED = SpectralMapping(
    {name: measure.power for name, measure in vocabulary.MEASURES.items() if measure.power},
    lambda _: 1, "sa_g",
)  # fmt: skip
"""Measures that grow with the amplitude of the shaking, and to which power."""

ABOUT_SCATTER = SpectralSet({*SCATTERED, "sa_sigma", "pgv_tau", "amplification_sigma"})
"""What a question may state of the scatter of its measures."""

MEASURES = SpectralSet(
    {*INTENSITY, *ABOUT_SCATTER, *(name for term in TERMS.values() for name in term.inputs)}
)
"""The names of all that a question states of the shaking: measures and their scatter."""

SINGLE_TERMS = ("pgv", "pga_tm", "pgd_tm")
"""Terms that are one number of the shaking: what the dissertation compares."""


def intensity_term(name: str) -> Term:
    """Return the term with this name."""
    try:
        return TERMS[name]
    except KeyError:
        raise InputError(
            f"unknown intensity term {name!r}: use one of {', '.join(TERMS)}"
        ) from None


def terms_from(names: Collection[str]) -> tuple[str, ...]:
    """Return the names of the terms that the given intensity measures suffice for."""
    return tuple(name for name, term in TERMS.items() if not missing_inputs(term, names))


def missing_inputs(term: Term, names: Collection[str]) -> tuple[str, ...]:
    """Return the intensity measures that a term needs in addition to the given ones."""
    if not term.inputs and not any(period_of(name) is not None for name in names):
        return ("sa_g",)
    return tuple(name for name in term.inputs if name not in names)


def least_inputs(terms: Iterable[str]) -> list[tuple[str, ...]]:
    """Return the minimal sets of intensity measures that suffice for any of the terms."""
    sets = [TERMS[name].inputs or ("sa_g",) for name in terms if name in TERMS]
    sets = [inputs for inputs in dict.fromkeys(sets) if set(inputs) <= {*INTENSITY, "sa_g"}]
    return [inputs for inputs in sets if not any(set(other) < set(inputs) for other in sets)]


@cache
def most_over_pga(name: str) -> float:
    """Return the credible multiple of PGA of a spectral acceleration; ∞ for other measures.

    749 recorded motions reach 6.4 times PGA at 0.2 s, 4.2 at 1 s and 0.5 at 10 s.
    """
    period_s = period_of(name)
    return math.inf if period_s is None else 8.0 * min(1.0, 2.0 / period_s)


LOWEST, HIGHEST = 1e-9, 1e9
"""Beyond these no rock block and no earthquake exists, and arithmetic might overflow."""

CREDIBLE = SpectralMapping(
    {
        name: quantity.credible
        for name, quantity in vocabulary.QUANTITIES.items()
        if quantity.credible is not None
    },
    lambda name: vocabulary.QUANTITIES[name].credible, "sa_g",
)  # fmt: skip
"""Least and greatest credible value of a question, and what is said of others."""
