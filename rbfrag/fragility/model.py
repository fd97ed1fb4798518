"""A fitted fragility model of any kind, ready for predictions. No library is loaded here."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

from rbfrag.db.model_file import MODEL_FORM, ModelRow
from rbfrag.errors import InputError, ModelError
from rbfrag.fragility.confidence import ParameterErrors, Quantiles, packed
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.domain import RATIOS, Ratio, Spread, ratios_of, stored_spread
from rbfrag.fragility.measures import ABOUT_SCATTER, CREDIBLE, HIGHEST, LOWEST, TERMS, Term
from rbfrag.fragility.method import ArrayNamespace, Form, MechanicalBound, Method
from rbfrag.fragility.methods import method_named, method_names
from rbfrag.results.diagnostic import Diagnostic

LEAST = 1e-290
"""Velocities, accelerations and strengths are taken for at least this, for logarithms."""


_SHIPPED = {ratio.name: ratio for ratio in RATIOS if ratio.shipped is not None}

AT_REST = "unstable without shaking: check dip and friction"
"""Warning of a block that fails without an earthquake."""

IS_ESTIMATED = "dependence_estimated"
"""Diagnostic of a fit: whether the dependence model was part of it."""

NO_EVENT_RANGE = Diagnostic(
    "no prediction interval for a single earthquake: no dependence model is stored with this "
    "model; fit it again with dependence, of enough earthquakes, sites and components",
    "no_prediction_interval",
)


class Answer(NamedTuple):
    """Prediction of a model for a block and a motion, numbers or arrays.

    Args:
        probability: P.
        eta: argument of the link; None where nothing had to be evaluated, and where the block is
            uncertain.
        log_sigma: logarithm of the scatter, of models that have one.
        block_sd: standard deviation of P over what an uncertain block may be; None of a certain
            one.
        outside: share of what it may be that lies outside the fitted ranges; None likewise.
    """

    probability: Any
    low: Any
    high: Any
    eta: Any
    log_sigma: Any
    block_sd: Any = None
    outside: Any = None


SYNTHETIC = Diagnostic(
    "the model is fitted to synthetic pulses, without any recorded earthquake: its probabilities "
    "do not hold for earthquakes",
    "synthetic_data",
)


@dataclass(frozen=True)
class FragilityModel:
    """A fitted fragility model: a stored row in the form used for predictions.

    Args:
        term: the intensity term it reads.
        form: the method's formula on that term.
        parameters: values of the coefficients.
        errors: how well they are known.
        vertical: whether it was fitted with vertical motion.
        notes: what every answer says of the model.
        spread: how the fitted points scatter; None where the row does not say it.
        data: the database that it is stored in, as people call it; None of a row by itself.
        complete: returns a row with its dependence model; None where it cannot be estimated.
    """

    row: ModelRow
    term: Term
    method: Method
    form: Form
    parameters: tuple[float, ...]
    errors: ParameterErrors
    vertical: bool
    notes: tuple[Diagnostic, ...] = ()
    spread: Spread | None = None
    data: str | None = None
    complete: Callable[[ModelRow], ModelRow] | None = field(default=None, compare=False, repr=False)
    ranges: dict[tuple[str, ...], list[tuple[str, float, float]]] = field(
        default_factory=dict, compare=False, repr=False
    )
    """What :meth:`clear_ranges` has found for some names."""
    ratios: dict[tuple[str, ...], tuple[Ratio, ...]] = field(
        default_factory=dict, compare=False, repr=False
    )
    """What :meth:`ratios_of` has found for some names."""

    @classmethod
    def from_row(
        cls,
        row: ModelRow,
        data: str | None = None,
        complete: Callable[[ModelRow], ModelRow] | None = None,
    ) -> FragilityModel:
        """Return the model of a stored row.

        Args:
            data: the database that it is stored in, as people call it.
            complete: returns a row with its dependence model, if it can be estimated.

        Raises:
            ModelError: the model is of another form, this rbfrag does not know its term or
                method, or the row is not whole.
        """
        if row.form != MODEL_FORM:
            raise ModelError(
                f"model {row.name!r} was fitted by another version of rbfrag: fit it again"
            )
        try:
            method: Method | None = method_named(row.method)
        except InputError:
            method = None
        form = method.forms.get(row.term) if method is not None else None
        if method is None or form is None:
            raise ModelError(
                f"model {row.name!r} is of kind {row.kind}, term {row.term!r} and method "
                f"{row.method!r}, which is not supported by this version (terms "
                f"{', '.join(TERMS)}; methods {', '.join(method_names())}): update rbfrag or "
                "choose another model"
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
        steps = row.leave_out_steps or ()
        if len(steps) == 1 or any(len(step) != size for step in steps):
            raise ModelError(
                f"model {row.name!r} has {size} coefficients but leave-one-earthquake-out steps "
                "of another size: fit it again"
            )
        term = TERMS[row.term]
        notes = (Diagnostic(form.advice, "model_choice"),) if form.advice else ()
        if row.diagnostics.get("recorded_events") == 0:
            notes = (*notes, SYNTHETIC)
        return cls(
            row=row,
            term=term,
            method=method,
            form=form,
            parameters=parameters,
            errors=ParameterErrors(packed(row.covariance), steps),
            vertical=row.diagnostics.get("vertical", "without") != "without",
            notes=notes,
            spread=stored_spread(row.name, row.diagnostics),
            data=data,
            complete=complete,
        )

    @property
    def dependence(self) -> Dependence | None:
        """Gaussian copula of blocks in one earthquake, if stored with the model.

        The first question estimates and stores it where the fit has not.
        """
        if self.complete is not None and self.row.diagnostics.get(IS_ESTIMATED) is False:
            # workers get the row, and all later questions this model
            object.__setattr__(self, "row", self.complete(self.row))
        stored = self.row.dependence
        if stored is None:
            return None
        names = Dependence.__dataclass_fields__
        return Dependence(**{name: float(cast("float", stored[name])) for name in names})

    @property
    def name(self) -> str:
        """Unique name in the database."""
        return self.row.name

    @property
    def kind(self) -> str:
        """The kind of failure."""
        return self.row.kind

    @property
    def uncertain(self) -> bool:
        """True if the model integrates over uncertain blocks or shaking."""
        return False

    @property
    def of_uncertain_block(self) -> bool:
        """True if the block is uncertain; answers then have a standard deviation of P."""
        return False

    @property
    def scattered(self) -> bool:
        """True if the shaking is uncertain; P then includes shaking outside the fitted ranges."""
        return False

    @property
    def meaning(self) -> str:
        """Event whose probability the model predicts."""
        if self.kind != self.method.block.kind:
            return f"probability that the block fails ({self.kind})"
        return self.method.meaning

    @property
    def criterion(self) -> float | None:
        """Failure criterion where there are several; None for the usual one."""
        return self.method.block.criterion_of(self.row.diagnostics)

    def with_ratios(
        self, values: dict[str, Any], of: Mapping[str, Any] | None = None
    ) -> dict[str, Any]:
        """Add the ratios of intensity measures and k/PGA for the range checks; return the values.

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
        """Return the ratios used in the range checks of these values."""
        key = tuple(values)
        ratios = self.ratios.get(key)
        if ratios is None:
            judged = {*self.row.domain, *CREDIBLE}
            ratios = tuple(
                ratio
                for ratio in ratios_of(key)
                if (ratio.name in judged or ratio.shipped) and not self._implied(ratio)
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

    def clear_ranges(self, values: Collection[str]) -> list[tuple[str, float, float]]:
        """Return the names of values, with the range of each within which no warning is given."""
        key = tuple(values)
        ranges = self.ranges.get(key)
        if ranges is not None:
            return ranges
        block, domain, ranges = self.method.block, self.row.domain, []
        for name in key:
            low, high = LOWEST, HIGHEST
            if name in block.sigmas or name in ABOUT_SCATTER:
                low = 0.0
            elif name in domain or name not in block.options:
                limits = [domain.get(name, (low, high))]
                if name in _SHIPPED:
                    limits = [_SHIPPED[name].limits(domain)]
                for least, most, *_ in (*limits, CREDIBLE.get(name, (low, high))):
                    low, high = max(low, least), min(high, most)
            else:
                continue
            ranges.append((name, low, high))
        self.ranges[key] = ranges
        return ranges

    def lies_outside(self, values: dict[str, Any], ns: ArrayNamespace) -> Any:
        """Return whether completed values lie outside the fitted ranges."""
        values = self.with_ratios(values)
        outside: Any = False
        for name, (low, high) in self.row.domain.items():
            if name in values:
                value = values[name]
                outside = outside | (value < low * (1.0 - 1e-9)) | (value > high * (1.0 + 1e-9))
        if self.spread is not None:
            outside = outside | (self.spread.holds(values, ns) ^ True)
        return outside

    def bounds(self, names: Collection[str]) -> tuple[MechanicalBound, ...]:
        """Return the mechanical bounds that apply to the named inputs."""
        bounds, at_rest = self.form.bounds, self.method.block.at_rest
        if "pga_g" not in names or self.vertical or at_rest in bounds:
            return bounds
        return (at_rest, *bounds)

    def answer(
        self,
        values: Mapping[str, Any],
        quantiles: Quantiles | None,
        ns: ArrayNamespace,
        inputs: Mapping[str, Any],
    ) -> Answer:
        """Return P with its confidence interval, and eta.

        Args:
            values: completed values, within what the bounds allow.
            quantiles: of the confidence level; None for P and eta alone.
            inputs: the values that were completed, which a model of uncertain blocks completes
                for each that one may be.
        """
        del inputs
        unscaled, h = self.form.unscaled(self.parameters, values, ns)
        eta = unscaled.eta * h
        link = self.method.link.probability
        middle = link(eta, ns)
        log_sigma = unscaled.log_sigma
        if quantiles is None:
            return Answer(middle, None, None, eta, log_sigma)
        reach = h * self.errors.half_width(unscaled.slopes, quantiles, ns)
        return Answer(middle, link(eta - reach, ns), link(eta + reach, ns), eta, log_sigma)


Model = ModelRow | FragilityModel | str
"""A model as callers give it: itself, as it is stored, or by the name of a stored one."""
