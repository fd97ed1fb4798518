"""Building blocks of fitting methods. No library is loaded here.

A method says P = F(eta): its parameters, eta with its slopes, the link F, what mechanics rules out
and how it is fitted. Formulas are written once over a namespace: :data:`SINGLE` for numbers,
:func:`arrays` for numpy arrays.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from operator import mul
from typing import Any, Literal, NamedTuple, Protocol

from rbfrag.fragility.dependence import normal_quantile, normal_share
from rbfrag.fragility.measures import Term
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.kinds import BY_MECHANICS
from rbfrag.vocabulary.quantities import QUANTITIES

_LARGEST_EXPONENT = 709.0

Values = Mapping[str, Any]
"""What formulas read by name: block, intensity measures and what follows; numbers or arrays."""

Parameters = Sequence[float]
"""Values of the parameters of a formula, in its order."""


class ArrayNamespace(NamedTuple):
    """Elementary functions for formulas, of numbers or of arrays.

    Args:
        ndtr: standard normal distribution function.
        maximum: the larger of two.
        minimum: the smaller of two.
        sin: sine of an angle [rad].
        cos: its cosine.
        ndtri: its inverse.
        step_sums: Σ (x·d)² and Σ (x·d)⁴ over the steps d of parameters that leave earthquakes
            out, from :class:`rbfrag.fragility.confidence.ParameterErrors` and the predictor.
    """

    log: Callable[[Any], Any]
    exp: Callable[[Any], Any]
    sqrt: Callable[[Any], Any]
    ndtr: Callable[[Any], Any]
    maximum: Callable[[Any, Any], Any]
    minimum: Callable[[Any, Any], Any]
    sin: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    ndtri: Callable[[Any], Any]
    step_sums: Callable[[Any, LinearPredictor], tuple[Any, Any]]


SINGLE = ArrayNamespace(
    math.log, lambda x: math.exp(x) if x < _LARGEST_EXPONENT else math.inf, math.sqrt, normal_share,
    max, min, math.sin, math.cos, normal_quantile, lambda errors, x: errors.sums_of_number(x),
)  # fmt: skip
"""For single numbers."""


@cache
def arrays() -> ArrayNamespace:
    """Return the elementary functions of numpy arrays."""
    import numpy as np
    from scipy.special import ndtr, ndtri

    return ArrayNamespace(
        np.log, np.exp, np.sqrt, ndtr, np.maximum, np.minimum, np.sin, np.cos,
        ndtri, lambda errors, x: errors.sums_of_arrays(x),
    )  # fmt: skip


class LinearPredictor(NamedTuple):
    """Linear predictor eta with its slopes and dispersion.

    Args:
        eta: the argument of the link.
        slopes: derivatives of eta by the parameters.
        log_sigma: logarithm of the scatter, for models with normal scatter of a critical value.
        sigma_slopes: its derivatives by the parameters.
        node_slopes: where a spectral velocity is completed by a regression, derivatives by the
            coefficients and the scatter of the regression at the block's size.
        node_weights: weights of the nodes of p² in these.
    """

    eta: Any
    slopes: tuple[Any, ...]
    log_sigma: Any = None
    sigma_slopes: tuple[Any, ...] = ()
    node_slopes: tuple[Any, ...] = ()
    node_weights: tuple[Any, ...] = ()

    @property
    def all_slopes(self) -> tuple[Any, ...]:
        """Derivatives by the parameters and those of the regression at each node."""
        at_nodes = (weight * slope for weight in self.node_weights for slope in self.node_slopes)
        return (*self.slopes, *at_nodes)


def linear(b: Sequence[float], *features: Any) -> LinearPredictor:
    """Return eta = Σ b·feature, whose slopes are the features."""
    return LinearPredictor(sum(map(mul, b, features)), features)


class Link(NamedTuple):
    """A function from eta to probability.

    Args:
        name: as reports call it.
        probability: F(eta, functions).
        density: F'(eta, functions).
        quantile: eta of a probability between 0 and 1, from it and functions.
        formula: P of eta as mathtext.
    """

    name: str
    probability: Callable[[Any, ArrayNamespace], Any]
    density: Callable[[Any, ArrayNamespace], Any]
    quantile: Callable[[Any, ArrayNamespace], Any]
    formula: str


NORMAL = Link(
    "normal",
    lambda eta, ns: ns.ndtr(eta),
    lambda eta, ns: ns.exp(-0.5 * eta * eta) / math.sqrt(2.0 * math.pi),
    lambda p, ns: ns.ndtri(p),
    r"\Phi(\eta)",
)
LOGIT = Link(
    "logit",
    lambda eta, ns: 1.0 / (1.0 + ns.exp(-eta)),
    lambda eta, ns: ns.exp(-abs(eta)) / (1.0 + ns.exp(-abs(eta))) ** 2,
    lambda p, ns: ns.log(p / (1.0 - p)),
    r"1/(1 + e^{-\eta})",
)


class MechanicalBound(NamedTuple):
    """Condition under which mechanics rules out failure: P is 0 whatever the model predicts.

    Args:
        holds: whether (where) it is so, from values by name.
        about: name of the value that decides.
        text: of a rejected value what it must be; of P = 0 the reason, with the names of values
            in braces: "k_r{kr} is not below PGA{pga_g}".
        how: what answers then, in place of the model.
    """

    holds: Callable[[Values], Any]
    about: str
    text: str
    how: str = BY_MECHANICS

    def reason(self, values: Values) -> str:
        """Return the reason of P = 0 with values by name, or in general where there are none."""
        equal = {
            name: f" = {value:.3g} {QUANTITIES[name].unit}".rstrip()
            for name, value in values.items()
            if f"{{{name}}}" in self.text
        }
        return self.text.format_map(defaultdict(str, equal))


ABOVE_TWICE_PGV = MechanicalBound(
    lambda v: v["y_m_s"] >= 2.0 * v["pgv_m_s"],
    "y_m_s",
    "PGV{pgv_m_s} is at most half the toppling velocity k_r g/p{y_m_s}: no excursion from "
    "rest topples the block",
)
ABOVE_SPECTRUM = MechanicalBound(
    lambda v: v["y_m_s"] >= v["intensity_m_s"],
    "y_m_s",
    "the toppling spectrum X(p){intensity_m_s} of the motion is at most the toppling velocity "
    "k_r g/p{y_m_s}: no excursion from rest topples the block",
    "by the spectrum bound",
)


@dataclass(frozen=True)
class BlockParameters:
    """Parameters that describe a block in predictions.

    Args:
        kind: the kind of failure that they stand for where none is named.
        strength: name of the yield acceleration coefficient among them.
        size: name of the squared frequency parameter [1/s²] among them, if there is one.
        at_rest: the bound that PGA below the yield acceleration is.
        criterion: name of the criterion of failure that a model is fitted for, if there are
            several.
        options: names of what else a question may state.
        stored: stored numbers of a combination's block in addition to its size, for `adjust`, by
            name: the values whose combinations fits use; empty for all.
        fractions: those of the options that lie between 0 and 1 and whose scatter is one of
            their value; of strength and size it is one of the logarithm.
        adjust: changes the values by what is stated so, before anything reads them.
        rejects: the combinations of values that no block has.
        safe_steps: how many steps the stored grid goes on for fits above its strongest block, all
            of them safe by mechanics.
        smallest_p2: size [1/s²] from which on answers are within the fitted range; blocks below
            are fitted too.
        completed_from: motions whose spectra complete a spectral velocity: those that shake a block
            which fits are judged on, or all.
        points: how stored combinations become what a fit reads (`rbfrag.fragility.fit.data`): of
            blocks of any strength, of stored blocks under scaled records, or of displacements.
        support: what answers for its own kind take for granted of how a block stands; empty for
            nothing.
    """

    names: tuple[str, ...]
    kind: str
    strength: str
    size: str | None
    at_rest: MechanicalBound
    criterion: str | None = None
    options: tuple[str, ...] = ()
    stored: Mapping[str, tuple[float, ...]] = field(default_factory=dict, hash=False)
    fractions: tuple[str, ...] = ()
    adjust: Callable[[dict[str, Any], ArrayNamespace], None] | None = None
    rejects: tuple[MechanicalBound, ...] = ()
    safe_steps: int = 0
    smallest_p2: float = 0.0
    completed_from: Literal["judged", "all"] = "judged"
    points: Literal["strengths", "scaled_records", "displacements"] = "strengths"
    support: str = ""

    @cached_property
    def sigmas(self) -> dict[str, str]:
        """Parameters that may be uncertain, by the name of their standard deviation."""
        uncertain = (self.size, self.strength, *self.fractions)
        return {f"{name}_sigma": name for name in uncertain if name is not None}

    def criterion_of(self, diagnostics: Mapping[str, object]) -> float | None:
        """Return the failure criterion in a model's diagnostics; None for the usual one."""
        value = diagnostics.get(self.criterion) if self.criterion is not None else None
        return float(value) if isinstance(value, int | float) else None

    def filled(self, values: Values) -> dict[str, Any]:
        """Return arrays with the block's own value where an option is NaN.

        Args:
            values: the question, arrays that numpy can broadcast.
        """
        import numpy as np

        filled = dict(values)
        for name in self.options:
            if self.adjust is None or name not in values or not np.isnan(values[name]).any():
                continue
            inputs = {n: np.asarray(value) for n, value in values.items() if n != name}
            with np.errstate(all="ignore"):
                self.adjust(inputs, arrays())
            if name in inputs:
                filled[name] = np.where(np.isnan(values[name]), inputs[name], values[name])
        return filled

    def completed(
        self,
        inputs: Values,
        term: Term,
        ns: ArrayNamespace,
        velocity: Callable[[Values, ArrayNamespace], Values] | None = None,
    ) -> dict[str, Any]:
        """Return the inputs with the derived variables of the formulas.

        These are ``intensity_m_s`` and, for a block of a size, ``p`` [1/s] and ``y_m_s`` = k g/p.
        Values that no logarithm takes are left to the caller.

        Args:
            velocity: returns the spectral velocity and its scatter by name, of a model that reads
                them.
        """
        values = dict(inputs)
        if self.adjust is not None:
            self.adjust(values, ns)
        if self.size is not None:
            values["p"] = p = ns.sqrt(values[self.size])
        if velocity is not None:
            values |= velocity(values, ns)
        values["intensity_m_s"] = term.intensity_m_s(values)
        if self.size is not None:
            values["y_m_s"] = values[self.strength] * STANDARD_GRAVITY_M_S2 / p
        return values


NOT_LIFTED = MechanicalBound(
    lambda v: v["kr"] >= v["pga_g"],
    "kr",
    "k_r{kr} is not below PGA{pga_g}: the block cannot uplift without vertical motion",
)
TOPPLING_BLOCK = BlockParameters(
    ("p2", "kr"), "toppling", "kr", "p2", NOT_LIFTED,
    # the stored grid ends at 4 PGV, and no excursion from rest exceeds 2 PGV
    safe_steps=10,
    support="assumed backed by a rock face; a free-standing block overturns in weaker shaking "
    "(kind='rocking')",
)  # fmt: skip
"""Blocks known by p² [1/s²] and the yield acceleration coefficient k_r."""


class Factor(Protocol):
    """A factor h on eta, of size or restitution, which has no parameter to be fitted."""

    @property
    def formula(self) -> str:
        """The factor as mathtext."""

    def of(self, values: Values, ns: ArrayNamespace) -> Any:
        """Return h from completed values by name."""


class SizeFactor(NamedTuple):
    """Size factor of eta: h(p) = exp(A l - B l²), l = ln p with p in 1/s.

    Without it a model is too vague for small blocks and too sure for large ones. A factor on all of
    eta keeps P monotone in the block's strength and in the shaking, which factors on single terms
    do not. Outside p² from 0.1 to 30 1/s² it stays at its value at the edge.

    A and B are chosen, not estimated: such that the calibration slope of each block size is level
    on earthquakes left out (docs/theory/fragility.md).
    """

    a: float
    b: float = 0.0

    @property
    def formula(self) -> str:
        """The size factor h as mathtext."""
        if not self.b:
            return rf"p^{{{self.a:g}}}"
        return rf"\exp({self.a:g}\,\ln p - {self.b:g}\,\ln^2 p)"

    def of(self, values: Values, ns: ArrayNamespace) -> Any:
        """Return h at the frequency parameter p [1/s] among the values."""
        l = ln_size(values, ns)  # noqa: E741  as in the formula
        return ns.exp((self.a - self.b * l) * l)


_LEAST_P, _GREATEST_P = math.sqrt(0.1), math.sqrt(30.0)
"""Ends of the sizes that fits read [1/s]."""


def ln_size(values: Values, ns: ArrayNamespace) -> Any:
    """Return l = ln p, p in 1/s, limited to the sizes that fits read, p² from 0.1 to 30 1/s²."""
    return ns.log(ns.minimum(ns.maximum(values["p"], _LEAST_P), _GREATEST_P))


Velocity = Callable[[Mapping[float, Any], Any, ArrayNamespace], Any]
"""Logarithm of a block-relative spectral velocity from spectral ordinates [g] by period [s], p
[1/s] and functions."""


class SpectralPredictor(NamedTuple):
    """The block-relative spectral velocity that a form reads; its last parameter multiplies ln of
    it.

    Args:
        ln_velocity: its logarithm.
        over: the measure that it is regressed on as a ratio to: PGV or PGA; empty for none.
        optional: measures that the regression reads where they are given.
    """

    ln_velocity: Velocity
    over: str = ""
    optional: tuple[str, ...] = ()


@dataclass(frozen=True)
class Form:
    """A fitting method applied to one intensity term.

    Args:
        parameters: their names; the method's `exponent` stands last and may be missing.
        formula: eta before the size factor and its slopes, from the parameters, values by name and
            functions.
        bounds: what mechanics forbids.
        start: where the search for the likeliest parameters begins; empty where none is needed.
        size_factor: what eta is multiplied by; None for nothing.
        terms: what each parameter multiplies in the sum that the formula is of, as mathtext; "1"
            for nothing, empty for a parameter outside the sum.
        equation: eta before the size factor of that sum, <sum>, and of parameters <name>,
            <+name> with their sign, <exp name>, as mathtext.
        where: what the symbols mean, likewise.
        advice: what every answer says of a form that knows little; with a spectral velocity what
            an answer from a single measure says; empty for nothing.
        hint: what an answer says that leaves out given measures; empty for nothing.
        velocity: the spectral velocity that it reads; None for none.
        positive: parameters that a fit holds above zero, because stronger blocks would fail more
            often.
    """

    parameters: tuple[str, ...]
    formula: Callable[[Sequence[float], Values, ArrayNamespace], LinearPredictor]
    bounds: tuple[MechanicalBound, ...] = ()
    start: tuple[float, ...] = ()
    size_factor: Factor | None = None
    terms: tuple[str, ...] = ()
    equation: str = "<sum>"
    where: str = ""
    advice: str = ""
    hint: str = ""
    velocity: SpectralPredictor | None = None
    positive: tuple[str, ...] = ()

    def unscaled(
        self, parameters: Sequence[float], values: Values, ns: ArrayNamespace
    ) -> tuple[LinearPredictor, Any]:
        """Return eta and its slopes before the size factor, and the factor.

        Args:
            parameters: of the formula, in its order.
            values: completed values by name.
        """
        formula = self.formula(parameters, values, ns)
        return formula, 1.0 if self.size_factor is None else self.size_factor.of(values, ns)

    def eta(
        self, parameters: Sequence[float], values: Values, ns: ArrayNamespace
    ) -> LinearPredictor:
        """Return eta and its slopes; arguments as for :meth:`unscaled`."""
        unscaled, h = self.unscaled(parameters, values, ns)
        slopes = tuple(h * slope for slope in unscaled.slopes)
        return unscaled._replace(eta=h * unscaled.eta, slopes=slopes)


@dataclass(frozen=True)
class Method:
    """A fitting method.

    Args:
        name: name in options and in the database.
        block: what describes its blocks.
        link: F in P = F(eta).
        forms: its formulas by name of the measure.
        meaning: what the probability is one of, in words.
        fit: how it is fitted: to ``outcomes`` of the grid by maximum likelihood, or to critical
            values by a weighted straight ``line``, by a ``log_line`` through their logarithms, or
            by any formula with normal dispersion (``censored``); the last two with censoring.
        exponent: name of the parameter that is fitted where the exponent M is asked for.
        failure: words for what a question asks the probability of, from its values and the
            model's criterion; None: the name of the kind.
        median_of: name of the block's parameter whose median is given with the probability.
        doubts: yields (holds, name of the value, text) where the model makes no sense, from
            parameters, values and functions.
    """

    name: str
    block: BlockParameters
    link: Link
    forms: Mapping[str, Form] = field(repr=False)
    meaning: str
    fit: Literal["outcomes", "line", "log_line", "censored"]
    exponent: str | None = None
    failure: Callable[[Values, float | None], str] | None = None
    median_of: str | None = None
    doubts: (
        Callable[[Sequence[float], Values, ArrayNamespace], Iterator[tuple[Any, str, str]]] | None
    ) = None

    @property
    def reads(self) -> Literal["outcomes", "critical"]:
        """Data of the fit: outcomes of blocks on the grid, or critical values."""
        return "outcomes" if self.fit == "outcomes" else "critical"


OF_CRITICAL = (
    "probability that the critical toppling velocity of the motion is at least the block's; "
    "safe islands below the critical value are not taken off"
)
OF_OUTCOME = "probability that the block topples"
