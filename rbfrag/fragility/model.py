"""A fitted fragility model of any kind, ready for predictions. No library is loaded here."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, cast

from rbfrag.db.model_file import MODEL_FORM, ModelRow
from rbfrag.errors import InputError, ModelError
from rbfrag.fragility.completion import (
    MOMENTS,
    Completion,
    Regression,
    decode_regression,
    encode_regressions,
    is_exact,
    key_of,
    used_inputs,
)
from rbfrag.fragility.confidence import ParameterErrors, Quantiles, packed
from rbfrag.fragility.dependence import EXACT, Dependence, Loadings
from rbfrag.fragility.domain import RATIOS, Ratio, Spread, ratios_of, stored_spread
from rbfrag.fragility.measures import ABOUT_SCATTER, CREDIBLE, HIGHEST, LOWEST, TERMS, Term
from rbfrag.fragility.method import ArrayNamespace, Form, LinearPredictor, MechanicalBound, Method
from rbfrag.fragility.methods import method_named, method_names
from rbfrag.results.diagnostic import Diagnostic

LEAST = 1e-290
"""Velocities, accelerations and strengths are taken for at least this, for logarithms."""


_SHIPPED = {ratio.name: ratio for ratio in RATIOS if ratio.shipped is not None}

AT_REST = "unstable without shaking: check dip and friction"
"""Warning of a block that fails without an earthquake."""

IS_ESTIMATED = "dependence_estimated"
"""Diagnostic of a fit: whether the dependence model was part of it."""

LOSSES = "losses_by_inputs"
"""Diagnostic of a fit: log losses on earthquakes held out by the measures that are given."""

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
        regress: returns the regression of the spectral velocity on some measures, with what is to
            be said of it, where the row has none for them.
        completion: the spectral velocity from what is given; None of a model that reads none, and
            before :meth:`for_inputs`.
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
    regress: Regress | None = field(default=None, compare=False, repr=False)
    completion: Completion | None = None
    completed_models: dict[tuple[str, ...], FragilityModel] = field(
        default_factory=dict, compare=False, repr=False
    )
    """What :meth:`for_inputs` has returned for some measures."""
    used_inputs: dict[tuple[str, ...], tuple[str, ...]] = field(
        default_factory=dict, compare=False, repr=False
    )
    """The measures that are used of some names."""
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
        regress: Regress | None = None,
    ) -> FragilityModel:
        """Return the model of a stored row.

        Args:
            data: the database that it is stored in, as people call it.
            complete: returns a row with its dependence model, if it can be estimated.
            regress: returns the regression on some measures that the row has none for.

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
        notes: tuple[Diagnostic, ...] = ()
        if form.advice and form.velocity is None:
            notes = (Diagnostic(form.advice, "model_choice"),)
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
            regress=regress,
        )

    def for_inputs(self, names: Collection[str]) -> FragilityModel:
        """Return the model that completes its spectral velocity from the given measures.

        Args:
            names: what is given of block and shaking.

        Raises:
            ModelError: there is no regression on these measures.
        """
        velocity = self.form.velocity
        if velocity is None:
            return self
        key = tuple(names)
        used = self.used_inputs.get(key)
        if used is None:
            used = self.used_inputs[key] = used_inputs(TERMS[self.row.term], velocity, names)
        if self.completion is not None and self.completion.used == used:
            return self
        model = self.completed_models.get(used)
        if model is None:
            model = self._completed_from(used)
            self.completed_models[used] = model
        return model

    def _completed_from(self, used: tuple[str, ...]) -> FragilityModel:
        velocity, notes = self.form.velocity, self.notes
        assert velocity is not None
        regression, errors, row = None, self.errors, self.row
        if not is_exact(used):
            regression = decode_regression(self.row.completions, used)
            if regression is None and self.regress is not None:
                regression, warnings = self.regress(self.row, used)
                notes = (*notes, *warnings)
                if regression is not None:  # models travel as rows
                    stored = encode_regressions({key_of(used): regression})
                    row = replace(
                        row, completions="\n".join(filter(None, (row.completions, stored)))
                    )
            if regression is None:
                raise ModelError(
                    f"model {self.name!r} has no regression of its spectral velocity on "
                    f"{' and '.join(used)}: fit it again in a database with response spectra"
                )
            nodes = tuple(tuple(map(tuple, steps)) for steps in regression.steps)
            errors = replace(errors, node_steps=nodes) if nodes else errors
        if self.form.advice and len({*used} - {"magnitude"}) == 1:
            notes = (*notes, Diagnostic(self.form.advice, "model_choice"))
        completion = Completion(velocity, used, regression)
        term = replace(self.term, inputs=used)
        return replace(
            self, row=row, term=term, errors=errors, notes=notes, completion=completion,
            ranges={}, ratios={},
        )  # fmt: skip

    def completed(self, inputs: Mapping[str, Any], ns: ArrayNamespace) -> dict[str, Any]:
        """Return the inputs with the derived variables of the formulas; see
        :meth:`rbfrag.fragility.method.BlockParameters.completed`.
        """
        velocity = None if self.completion is None else self.completion.velocities
        return self.method.block.completed(inputs, self.term, ns, velocity)

    def moved(self, step: Sequence[float]) -> FragilityModel:
        """Return the model with a step added to its parameters, and to its regression if the step
        goes on with the coefficients and the scatter at each of its sizes.
        """
        k, completion = len(self.parameters), self.completion
        parameters = tuple(b + d for b, d in zip(self.parameters, step[:k], strict=True))
        if completion is not None and completion.regression is not None and len(step) > k:
            completion = replace(completion, regression=completion.regression.moved(step[k:]))
        return replace(self, parameters=parameters, completion=completion)

    def linear_predictor(
        self, values: Mapping[str, Any], ns: ArrayNamespace
    ) -> tuple[LinearPredictor, Any]:
        """Return eta and its slopes before a factor, and that factor.

        With the scatter σ of a completed spectral velocity, η* = h η/D with D² = 1 + (h b σ)² and
        b the parameter of ln of the velocity. Slopes of η*, over h/D: those of η, that of b less
        η* h b σ²/D; b u by the coefficients of the regression with regressors u; and
        -η* h b² σ/D by σ.

        Args:
            values: as :meth:`completed` returns them.
        """
        unscaled, h = self.form.unscaled(self.parameters, values, ns)
        moments = values.get(MOMENTS)
        if moments is None:
            return unscaled, h
        b, sigma = self.parameters[-1], moments.sigma
        reach = h * (b * sigma)
        root = ns.sqrt(1.0 + reach * reach)
        factor = h / root
        pull = unscaled.eta * factor * reach / root
        if not self.errors.node_steps:
            return unscaled, factor
        predictor = LinearPredictor(
            unscaled.eta,
            (*unscaled.slopes[:-1], unscaled.slopes[-1] - pull * sigma),
            node_slopes=(*(b * u for u in moments.regressors), -b * pull),
            node_weights=moments.weights,
        )
        return predictor, factor

    def loadings(self, numbers: Mapping[str, Any], ns: ArrayNamespace) -> Loadings:
        """Return what the completion of the spectral velocity adds to the dependence of blocks.

        Args:
            numbers: parameters of the blocks by name.
        """
        if self.completion is None or self.completion.regression is None:
            return EXACT
        values, block = dict(numbers), self.method.block
        if block.adjust is not None:
            block.adjust(values, ns)
        values["p"] = ns.sqrt(values[str(block.size)])
        sigma, of_event, of_site = self.completion.scatter(values, ns)
        h = 1.0 if self.form.size_factor is None else self.form.size_factor.of(values, ns)
        reach = h * (self.parameters[-1] * sigma)
        parts = of_event, of_site - of_event, 1.0 - of_site
        return Loadings(*(reach * ns.sqrt(ns.maximum(part, 0.0)) for part in parts))

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
            if name == MOMENTS:
                continue
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

    def excursions(self, values: dict[str, Any]) -> Iterator[tuple[str, float, Any]]:
        """Yield the edges of the fitted ranges, with whether completed values lie beyond each."""
        values = self.with_ratios(values)
        for name, (low, high) in self.row.domain.items():
            if name in values:
                yield name, low, values[name] < low * (1.0 - 1e-9)
                yield name, high, values[name] > high * (1.0 + 1e-9)

    def lies_outside(self, values: dict[str, Any], ns: ArrayNamespace) -> Any:
        """Return whether completed values lie outside the fitted ranges."""
        outside: Any = False
        for _, _, holds in self.excursions(values):
            outside = outside | holds
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
        unscaled, h = self.linear_predictor(values, ns)
        eta = unscaled.eta * h
        link = self.method.link.probability
        middle = link(eta, ns)
        log_sigma = unscaled.log_sigma
        if quantiles is None:
            return Answer(middle, None, None, eta, log_sigma)
        reach = h * self.errors.half_width(unscaled, quantiles, ns)
        return Answer(middle, link(eta - reach, ns), link(eta + reach, ns), eta, log_sigma)


Regress = Callable[[ModelRow, tuple[str, ...]], tuple[Regression | None, tuple[Diagnostic, ...]]]
"""Returns the regression of a model's spectral velocity on measures, and what is said of it."""

Model = ModelRow | FragilityModel | str
"""A model as callers give it: itself, as it is stored, or by the name of a stored one."""
