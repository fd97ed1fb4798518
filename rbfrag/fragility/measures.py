"""Intensity terms: combinations of intensity measures as a velocity in m/s.

Each is pure arithmetic on single numbers or arrays and loads no library.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.vocabulary import quantities as vocabulary
from rbfrag.vocabulary.quantities import INTENSITY, SPECTRAL

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


def _first_at_1s(sa10_g: Any, *_rest: Any) -> Any:
    """Return V_1.0 [m/s]; the other intensity measures are separate predictors."""
    return spectral_velocity_m_s(sa10_g, 1.0)


def _first_over_p(pga_g: Any, *rest: Any) -> Any:
    """Return PGA·g/p [m/s], with p last; the other intensity measures are separate predictors."""
    return pga_g * STANDARD_GRAVITY_M_S2 / rest[-1]


_PGV, _SA = "peak ground velocity", "spectral acceleration at 1 s, as a velocity"
_PGA = "peak ground acceleration over the block's frequency parameter"
_SA_SYMBOL = "SA(1.0)·g·T/2π"

TERMS: Mapping[str, Term] = {
    term.name: term
    for term in (
        Term("pgv_kr", f"{_PGV}, with the block's strength", "PGV", ("pgv_m_s",), _first),
        Term("pgv", _PGV, "PGV", ("pgv_m_s",), _first),
        Term("pga_sa03_sa10_sa30", f"{_SA}, with PGA and those at 0.3 and 3 s", _SA_SYMBOL,
             ("sa10_g", "pga_g", "sa03_g", "sa30_g"), _first_at_1s),
        Term("pga_tm", "peak ground acceleration over mean frequency", "PGA·g·Tm/2π",
             ("pga_g", "tm_s"),  # equation (4.31)
             lambda pga_g, tm_s: pga_g * STANDARD_GRAVITY_M_S2 * tm_s / (2.0 * math.pi)),
        Term("pga_sa10", f"{_SA}, with PGA", _SA_SYMBOL, ("sa10_g", "pga_g"), _first_at_1s),
        Term("sa10", _SA, _SA_SYMBOL, ("sa10_g",), _first_at_1s),
        Term("pga", _PGA, "PGA·g/p", ("pga_g",), _first_over_p, of_block=("p",)),
        Term("pgd_tm", "peak ground displacement times mean frequency", "2π·PGD/Tm",
             ("pgd_m", "tm_s"),  # equation (4.31)
             lambda pgd_m, tm_s: pgd_m * (2.0 * math.pi) / tm_s, variance_degree=2, by_name=True),
        Term("pgv_pga", f"{_PGV}, with PGA", "PGV", ("pgv_m_s", "pga_g"), _first),
        Term("pgv_pga_tm", f"{_PGV}, with PGA and Tm", "PGV", ("pgv_m_s", "pga_g", "tm_s"), _first),
        Term("pgv_pga_sa10_sa30", f"{_PGV}, with PGA and spectral accelerations at 1 and 3 s",
             "PGV", ("pgv_m_s", "pga_g", "sa10_g", "sa30_g"), _first),
        Term("pga_sa10_sa30", f"{_SA}, with PGA and that at 3 s", _SA_SYMBOL,
             ("sa10_g", "pga_g", "sa30_g"), _first_at_1s),
        Term("pga_m", f"{_PGA}, with magnitude", "PGA·g/p", ("pga_g", "magnitude"), _first_over_p,
             of_block=("p",)),
        Term("pgv_pga_m", f"{_PGV}, with PGA and magnitude", "PGV",
             ("pgv_m_s", "pga_g", "magnitude"), _first),
        Term("pgv_pga_ia", f"{_PGV}, with PGA and Arias intensity", "PGV",
             ("pgv_m_s", "pga_g", "arias_m_s"), _first),
        Term("xp", "toppling spectrum", "X(p)", ("xp_m_s", "pga_g"), _first),
    )
}  # fmt: skip
"""The terms by name."""

SCATTERED = {
    f"{name.partition('_')[0]}_sigma": name
    for name, measure in vocabulary.MEASURES.items()
    if measure.uncertain
}
"""By the name of its standard deviation each measure that may be known with scatter."""

SIGMAS = {measure: sigma for sigma, measure in SCATTERED.items()}
"""The name of the standard deviation of each such measure."""

AMPLIFIED = {name: measure.power for name, measure in vocabulary.MEASURES.items() if measure.power}
"""Measures that grow with the amplitude of the shaking, and to which power."""

ABOUT_SCATTER = frozenset({*SCATTERED, "pgv_tau", "amplification_sigma"})
"""What a question may state of the scatter of its measures."""

MEASURES = frozenset({*INTENSITY, "xp_m_s", *ABOUT_SCATTER})
"""The names of all that a question states of the shaking: measures and their scatter."""

_RANKS = {vocabulary.MEASURES[name].rank: name for name in INTENSITY}
ALONE = tuple(_RANKS[rank] for rank in sorted(_RANKS) if rank)
"""Measures that a shipped model reads alone, by falling skill."""

SINGLE_TERMS = ("pgv", "pga_tm", "pgd_tm")
"""Terms that are one number of the shaking: what the dissertation compares."""


def spectral(sa_g: Mapping[float, T]) -> dict[str, T]:
    """Return spectral accelerations [g] by name instead of by period [s].

    Raises:
        InputError: no mapping, or a period of which there is no model.
    """
    if not isinstance(sa_g, Mapping):
        raise InputError(
            f"sa_g = {sa_g!r}: give accelerations [g] by period [s], such as {{1: 0.4}}"
        )
    for period in sa_g:
        if period not in SPECTRAL:
            raise InputError(
                f"sa_g has the period {period!r} s: SA is supported at "
                f"{', '.join(f'{supported:g}' for supported in SPECTRAL)} s"
            )
    return {SPECTRAL[period]: value for period, value in sa_g.items()}


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
    return tuple(name for name in TERMS if set(TERMS[name].inputs) <= set(names))


def least_inputs(terms: Iterable[str]) -> list[tuple[str, ...]]:
    """Return the minimal sets of intensity measures that suffice for any of the terms."""
    sets = [TERMS[name].inputs for name in terms if name in TERMS]
    sets = [inputs for inputs in dict.fromkeys(sets) if set(inputs) <= set(INTENSITY)]
    return [inputs for inputs in sets if not any(set(other) < set(inputs) for other in sets)]


LOWEST, HIGHEST = 1e-9, 1e9
"""Beyond these no rock block and no earthquake exists, and arithmetic might overflow."""

CREDIBLE = {
    name: quantity.credible
    for name, quantity in vocabulary.QUANTITIES.items()
    if quantity.credible is not None
}
"""Least and greatest credible value of a question, and what is said of others."""
