"""A fitted fragility model of any kind, ready to answer. No library is loaded here."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError, ModelError
from rbfrag.fragility.domain import Ratio, Spread, ratios_of, stored_spread
from rbfrag.fragility.measures import CREDIBLE, HIGHEST, LOWEST, TERMS, Term
from rbfrag.fragility.methods import Eta, Form, Method, Numbers, method_named, method_names

LEAST = 1e-290
"""Velocities, accelerations and strengths are taken for at least this, for logarithms."""

FLOOR_NODES = 41
"""Nodes at which the least width of an interval, over its quantile, is tabulated: by eta, and by
y/2x, the share of twice the velocity."""
FLOOR_FROM, FLOOR_STEP = -10.0, 0.5
"""The first node of eta, and from one to the next."""
FLOOR_SHARE_STEP = 0.025


class Range(NamedTuple):
    """Where a value needs no words."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class FragilityModel:
    """One fitted fragility model: a stored row in the form that answers.

    Args:
        row: the model as stored.
        term: the intensity term it reads.
        method: how it was fitted.
        form: the method's formula on that term.
        parameters: values of the coefficients.
        packed_covariance: the covariance on and below its diagonal, row by row, those off it
            doubled.
        floor: least widths of the interval over its quantile at the nodes of eta, and at those of
            y/2x; empty for none.
        vertical: whether it was fitted with vertical motion.
        degrees_of_freedom: of the standard errors, which the interval is widened by, at most the
            earthquakes less one; 0 for none.
        notes: what every answer says of the model, such as where it comes from.
        spread: how the fitted points scatter; None where the row does not say it.
    """

    row: ModelRow
    term: Term
    method: Method
    form: Form
    parameters: tuple[float, ...]
    packed_covariance: tuple[float, ...]
    floor: tuple[tuple[float, ...], ...]
    vertical: bool
    degrees_of_freedom: int
    notes: tuple[str, ...] = ()
    spread: Spread | None = None
    ranges: dict[tuple[str, ...], tuple[Range, ...]] = field(
        default_factory=dict, compare=False, repr=False
    )
    """What :meth:`clear_ranges` has found for some names."""
    ratios: dict[tuple[str, ...], tuple[Ratio, ...]] = field(
        default_factory=dict, compare=False, repr=False
    )
    """What :meth:`ratios_of` has found for some names."""

    @classmethod
    def from_row(cls, row: ModelRow, notes: tuple[str, ...] = ()) -> FragilityModel:
        """Return the model of a stored row.

        Raises:
            ModelError: this rbfrag does not know the model's term or method, or the row is
                not whole.
        """
        try:
            method: Method | None = method_named(row.method)
        except InputError:
            method = None
        form = method.forms.get(row.term) if method is not None else None
        if method is None or form is None:
            raise ModelError(
                f"model {row.name!r} is of kind {row.kind}, term {row.term!r} and method "
                f"{row.method!r}, which this rbfrag does not know (terms {', '.join(TERMS)}; "
                f"methods {', '.join(method_names())}): update rbfrag or choose another model"
            )
        parameters = tuple(float(value) for value in row.coefficients.values())
        size = len(parameters)
        if len(row.covariance) != size or any(len(line) != size for line in row.covariance):
            raise ModelError(
                f"model {row.name!r} has {size} coefficients but a covariance of another size: "
                "fit it again"
            )
        names = form.parameters
        fewest = len(names) - (method.exponent is not None)
        if not fewest <= size <= len(names) or tuple(row.coefficients) != names[:size]:
            raise ModelError(
                f"model {row.name!r} has the coefficients {', '.join(row.coefficients)}, but "
                f"method {row.method} on {row.term} has {', '.join(names)}: fit it again"
            )
        freedom = row.diagnostics.get("degrees_of_freedom")
        return cls(
            row=row,
            term=TERMS[row.term],
            method=method,
            form=form,
            parameters=parameters,
            packed_covariance=packed(row.covariance),
            floor=_floor(row),
            vertical=row.diagnostics.get("vertical", "without") != "without",
            degrees_of_freedom=freedom if isinstance(freedom, int) else 0,
            notes=notes,
            spread=stored_spread(row.name, row.diagnostics),
        )

    @property
    def name(self) -> str:
        """Unique name in the database."""
        return self.row.name

    @property
    def kind(self) -> str:
        """The kind of failure."""
        return self.row.kind

    @property
    def meaning(self) -> str:
        """What the probability is a probability of."""
        if self.kind != self.method.block.kind:
            return f"probability that the block fails ({self.kind})"
        return self.method.meaning

    @property
    def criterion(self) -> float | None:
        """What counts as failure where there are several criteria; None for the usual one."""
        name = self.method.block.criterion
        value = self.row.diagnostics.get(name) if name is not None else None
        return float(value) if isinstance(value, int | float) else None

    @property
    def has_exponent(self) -> bool:
        """Whether the exponent M was estimated: P then depends on p beside y."""
        return self.method.exponent in self.row.coefficients

    def with_ratios(
        self, values: dict[str, Any], of: Mapping[str, Any] | None = None
    ) -> dict[str, Any]:
        """Add the ratios of measures and k/PGA where they are judged by; return the values.

        Args:
            values: completed values.
            of: the same above zero, where `values` may hold a zero that a ratio divides by.
        """
        above_zero = values if of is None else of
        for ratio in self.ratios_of(above_zero):
            values[ratio.name] = ratio.formula(above_zero)
        if "pga_g" in values and "k_over_pga" in self.row.domain:
            values["k_over_pga"] = values[self.method.block.strength] / values["pga_g"]
        return values

    def ratios_of(self, values: Collection[str]) -> tuple[Ratio, ...]:
        """Return the ratios of some values that the model or common sense judges by."""
        key = tuple(values)
        ratios = self.ratios.get(key)
        if ratios is None:
            judged = {*self.row.domain, *CREDIBLE}
            ratios = tuple(
                ratio
                for ratio in ratios_of(key)
                if ratio.name in judged and not self._implied(ratio)
            )
            self.ratios[key] = ratios
        return ratios

    def _implied(self, ratio: Ratio) -> bool:
        """Return whether z is in its range wherever p² and PGV/(PGA g) are in theirs."""
        size = self.row.domain.get(self.method.block.size or "")
        pulse = self.row.domain.get("pgv_over_pga_s")
        if ratio.name != "z" or size is None or pulse is None:
            return False
        low, high = self.row.domain["z"]
        least, most = (math.sqrt(size[i]) * pulse[i] for i in (0, 1))
        return low <= least * (1.0 + 1e-9) and most * (1.0 - 1e-9) <= high

    def clear_ranges(self, values: Collection[str]) -> tuple[Range, ...]:
        """Return the ranges within which nothing is to be said of the values of some names."""
        key = tuple(values)
        ranges = self.ranges.get(key)
        if ranges is None:
            ranges = self.ranges[key] = tuple(
                self._clear_range(name) for name in key if name not in self.method.block.options
            )
        return ranges

    def _clear_range(self, name: str) -> Range:
        low, high = LOWEST, HIGHEST
        for least, most, *_ in (
            self.row.domain.get(name, (low, high)),
            CREDIBLE.get(name, (low, high)),
        ):
            low, high = max(low, least), min(high, most)
        return Range(name, low, high)

    def half_width(self, level: float) -> float:
        """Return the quantile that the interval reaches to.

        Raises:
            InputError: the level is not a number between 0 and 1.
        """
        return student_half_width(checked_level(level), self.degrees_of_freedom)

    def answer(
        self, values: Mapping[str, Any], half_width: float | None, ns: Numbers
    ) -> tuple[Any, Any, Any, Eta]:
        """Return P, the ends of its interval, and eta.

        Args:
            values: completed values, within what the bounds allow.
            half_width: quantile of the confidence level; None for no interval.
            ns: functions for the kind of number given.
        """
        formula = self.form.eta(self.parameters, values, ns)
        link, eta = self.method.link.probability, formula.eta
        middle = link(eta, ns)
        if half_width is None:
            return middle, middle, middle, formula
        error = standard_error(self.packed_covariance, formula.slopes, ns)
        low, high = link(eta - half_width * error, ns), link(eta + half_width * error, ns)
        if self.floor:
            by_eta, by_ratio = self.floor
            ratio = values["y_m_s"] / (2.0 * values["intensity_m_s"])
            least = ns.minimum(
                ns.between(eta, FLOOR_FROM, FLOOR_STEP, by_eta),
                ns.between(ratio, 0.0, FLOOR_SHARE_STEP, by_ratio),
            )
            low, high = widened(half_width * least, middle, low, high, ns)
        return middle, low, high, formula


def standard_error(packed_covariance: Sequence[float], slopes: Sequence[Any], ns: Numbers) -> Any:
    """Return sqrt(fᵀ Σ f) for the slopes f and a packed covariance Σ."""
    total, k = 0.0, 0
    for i, slope in enumerate(slopes):
        inner = packed_covariance[k + i] * slope
        for j in range(i):
            inner = inner + packed_covariance[k + j] * slopes[j]
        total = total + inner * slope
        k += i + 1
    return ns.sqrt(ns.maximum(total, 0.0))


def widened(least: Any, middle: Any, low: Any, high: Any, ns: Numbers) -> tuple[Any, Any]:
    """Return the ends of an interval of at least some width, inside 0 and 1.

    What lacks is added in proportion to what is left below and above the middle.
    """
    lacking = ns.maximum(least - (high - low), 0.0)
    low, high = low - lacking * middle, high + lacking * (1.0 - middle)
    below, above = ns.maximum(-low, 0.0), ns.maximum(high - 1.0, 0.0)
    return ns.maximum(low - above, 0.0), ns.minimum(high + below, 1.0)


def packed(covariance: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    """Return a covariance as :func:`standard_error` reads it."""
    return tuple(
        float(covariance[i][j]) * (1.0 if i == j else 2.0)
        for i in range(len(covariance))
        for j in range(i + 1)
    )


def _floor(row: ModelRow) -> tuple[tuple[float, ...], ...]:
    floor = row.diagnostics.get("interval_floor") or ()
    if isinstance(floor, list | tuple) and len(floor) == FLOOR_NODES:
        # stored before there was a second table, which must not be the lower one then
        floor = [*floor, *[max(floor)] * FLOOR_NODES]
    if not isinstance(floor, list | tuple) or len(floor) not in (0, 2 * FLOOR_NODES):
        raise ModelError(
            f"model {row.name!r} holds a table of least widths of another size: fit it again"
        )
    values = tuple(float(value) for value in floor)
    return (values[:FLOOR_NODES], values[FLOOR_NODES:]) if values else ()


# Quantiles by own code: `rbfrag predict` takes 50 ms from the shell, and loading scipy.special for
# stdtrit would add 310, loading statistics for NormalDist 11. Arrays read the same number, so that
# they answer as single ones do: stdtrit differs by 1e-11 at level .999999, and is out by 1e-4 at
# level 1e-6 with 4 degrees of freedom. The tests compare with scipy.stats.

FEWEST_FREEDOMS = 2
"""With fewer degrees of freedom the normal quantile answers."""


def checked_level(level: object) -> float:
    """Return a confidence level, or refuse what is none."""
    if not isinstance(level, int | float) or not 0.0 < level < 1.0:
        raise InputError(
            f"level = {level!r}: a confidence level lies between 0 and 1, such as 0.95"
        )
    return level


@lru_cache(maxsize=256)
def student_half_width(level: float, degrees_of_freedom: int) -> float:
    """Return t such that a Student number lies within ±t with probability `level`.

    Clustered errors come from as many independent numbers as there are earthquakes: their
    intervals reach to Student's t with one degree of freedom less, not to the normal quantile.

    Args:
        level: confidence level, between 0 and 1.
        degrees_of_freedom: earthquakes less one; 0 for the normal quantile.
    """
    target = 0.5 * (1.0 - checked_level(level))
    t = _where_tail_is(target, 0, 1.0)
    if degrees_of_freedom < FEWEST_FREEDOMS:
        return t
    start = t * (1.0 + (t * t + 1.0) / (4.0 * degrees_of_freedom))
    return _where_tail_is(target, degrees_of_freedom, start)


def _where_tail_is(target: float, nu: int, t: float) -> float:
    """Return the t beyond which lies a probability, by Newton's method on its logarithm."""
    for _ in range(100):
        tail, density = _upper_tail(t, nu)
        # the logarithm bends one way: the steps end from one side
        step = tail / density * math.log(tail / target)
        t += step
        if abs(step) <= 1e-14 * t:
            break
    return t


def _upper_tail(t: float, nu: int) -> tuple[float, float]:
    """Return the probability of more than t, and the density there."""
    if nu < FEWEST_FREEDOMS:
        density = math.exp(-0.5 * t * t) / math.sqrt(2.0 * math.pi)
        return 0.5 * math.erfc(t * math.sqrt(0.5)), density
    scale = math.lgamma(0.5 * (nu + 1)) - math.lgamma(0.5 * nu) - 0.5 * math.log(nu * math.pi)
    density = math.exp(scale - 0.5 * (nu + 1) * math.log1p(t * t / nu))
    # For whole nu the distribution function is a finite sum (Abramowitz & Stegun 26.7.3-4),
    # subtracted from a half; the tail of interest is far from rounding.
    theta = math.atan(t / math.sqrt(nu))
    cos2, remainder = math.cos(theta) ** 2, nu % 2
    term, total = (math.cos(theta) if remainder else 1.0), 0.0
    for k in range(remainder, nu - 1, 2):
        total += term
        term *= cos2 * (k + 1) / (k + 2)
    inside = math.sin(theta) * total
    if remainder:
        inside = (theta + inside) * 2.0 / math.pi
    return max(0.5 * (1.0 - inside), 1e-300), density
