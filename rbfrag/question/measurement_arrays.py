"""Measurement errors of many blocks: the draws of :mod:`rbfrag.question.measurement`, as arrays.

A row has the draws and the answer of the same single block.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.confidence import quantiles_of
from rbfrag.fragility.dependence import ROOT_TWO_PI
from rbfrag.fragility.method import arrays
from rbfrag.fragility.prediction import with_values
from rbfrag.fragility.prediction_array import PredictionArray, ReasonPart, Reasons, flat
from rbfrag.fragility.validation import NOTABLE_SHARE
from rbfrag.question.measurement import (
    CLIP,
    FLOOR,
    OF_STATED,
    TOGETHER,
    TOLERANCE,
    Root,
    is_obsolete,
    usual_sides,
)
from rbfrag.question.measurement_draws import (
    GMM_SIGMA,
    STEPS,
    WARNED,
    check_draws,
    draw_count,
    drawn_values,
    scores_of,
    source_of,
    split_sigmas,
)
from rbfrag.question.nominal import ask_stated
from rbfrag.question.sections import in_sections
from rbfrag.question.shape_validation import LOCKED, PLANE_TEXTS, REJECTED, STATES, UNSTABLE
from rbfrag.results.diagnostic import diagnostics
from rbfrag.solver.kinds import BY_MECHANICS, KINDS, facts_of
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import MEASURED, NUMBERS, SPACE, measured_by

AT_ONCE = 1 << 17
"""Draws that are answered at a time."""

_BY_ROW = ("mode", "mechanism", "component")
"""Options that each row may have its own of."""


def with_errors_of_arrays(
    answer: Callable[[Mapping[str, Any]], PredictionArray],
    question: Mapping[str, Any],
    kind: Any,
    how: Mapping[str, Any],
    *,
    sensitivity: bool = False,
) -> PredictionArray:
    """Return the answers for many blocks, with the errors of their measurement.

    Args:
        answer: answers a question without such errors.
        question: fields of blocks and shaking: numbers or arrays.
        kind: how the blocks are asked to fail, for all or one each.
        how: the other arguments of :func:`rbfrag.question.question.ask_stated`.
        sensitivity: whether P at usual errors of each field, and the sources of the uncertainty,
            are asked for.
    """
    is_scenario = how.get("gmm") is not None or "rjb_km" in question
    inputs, sigma_inputs = split_sigmas(question, is_scenario=is_scenario)
    nominal = answer(inputs)
    size = nominal.probability.size
    if not size or not (sigma_inputs or sensitivity):
        return nominal
    words = {n: np.broadcast_to(np.array(inputs.pop(n), dtype=object), nominal.probability.shape)
             .ravel() for n in PLANE_TEXTS if n in inputs}  # fmt: skip
    columns: dict[str, Any] = {n: _of_size(v, size) for n, v in flat(inputs)[0].items()}
    sigmas = {
        n: np.nan_to_num(_of_size(v, size), nan=GMM_SIGMA if n == "gmm_sigma" else 0.0)
        for n, v in flat(sigma_inputs)[0].items()
    }
    planes = {n: words.pop(n) for n in SPACE if n in words}
    if planes:
        section, _, _ = in_sections({**columns, **planes}, size)
        columns = {n: v for n, v in section.items() if n not in SPACE}
    for name in ("base", "back"):
        if name in planes:
            columns[name] = np.where(planes[name] == "", np.nan, 0.0)
    if "height_m" in columns:
        columns["beta_deg"] = np.nan_to_num(columns.get("beta_deg", np.zeros(size)))
    _reject_without_field(columns, sigmas)
    result = _Merged(nominal, kind, how, columns, words, sensitivity=sensitivity)
    sound = ~np.isnan(nominal.probability.ravel())
    patterns = np.array([sigma > 0.0 for sigma in sigmas.values()]).reshape(len(sigmas), size)
    kinds_of_rows, group_of = np.unique(patterns, axis=1, return_inverse=True)
    for group, pattern in enumerate(kinds_of_rows.T):
        names = [name for name, sigma_inputs in zip(sigmas, pattern, strict=True) if sigma_inputs]
        rows = np.flatnonzero((group_of.ravel() == group) & sound)
        step = max(1, AT_ONCE // draw_count(names)) if names else 1
        for start in range(0, rows.size if names else 0, step):
            part = rows[start : start + step]
            result.merge(part, {name: sigmas[name][part][:, None] for name in names})
    if sensitivity:
        gmm = sigmas.get("gmm_sigma", np.zeros(size))
        return with_values(result.answer(), sensitivity=result.sensitivity(gmm))
    return result.answer()


def _of_size(values: Any, size: int) -> FloatArray:
    return np.broadcast_to(values, size) if values.size == 1 else values


def _reject_without_field(columns: Mapping[str, Any], sigmas: Mapping[str, FloatArray]) -> None:
    """Reject standard deviations of rows that lack the field, or are given by their parameters."""
    for name, sigma in sigmas.items():
        field = measured_by(name)
        if name == "gmm_sigma":
            continue
        numbers = [~np.isnan(columns[n]) for n in NUMBERS if n in columns]
        lacks = np.isnan(columns.get(field, np.full(sigma.shape, np.nan)))
        wrong = (sigma < 0.0) | ((sigma > 0.0) & (lacks | np.any([lacks, *numbers], axis=0)))
        if wrong.any():
            row = int(np.argmax(wrong))
            raise InputError(
                f"row {row + 1}: {name} = {sigma[row]:g} must be 0 or more and requires {field}: "
                "give both, or none",
                fields=(name, field),
            )


class _Merged:
    """Answers of rows, with those rows replaced that have measurement errors."""

    def __init__(
        self,
        nominal: PredictionArray,
        kind: Any,
        how: Mapping[str, Any],
        columns: Mapping[str, Any],
        words: Mapping[str, Any],
        *,
        sensitivity: bool,
    ) -> None:
        self.nominal, self.kind, self.how = nominal, kind, how
        self.columns, self.words = columns, words
        self.values = {n: getattr(nominal, n).ravel().copy() for n in (*OF_STATED, "in_domain")}
        self.uncertainty: dict[str, FloatArray] | None = {} if sensitivity else None
        self.rows: list[NDArray[np.intp]] = []
        self.notes: list[Any] = []
        self.reasons: list[ReasonPart] = []
        self.slide = False

    def merge(self, rows: NDArray[np.intp], sigmas: Mapping[str, FloatArray]) -> None:
        """Replace the answers of rows by the means over their draws."""
        count, q = draw_count([*sigmas]), quantiles_of(self.nominal.level).normal
        ns, z = arrays(), np.array(scores_of(count))
        parts = [np.arange(count) * step % count for step in STEPS[: len(sigmas)]]
        draws = [((k[None] + 0.5) / count, z[k][None]) for k in parts]
        fields = {n: column[rows][:, None] for n, column in self.columns.items()}
        drawn = drawn_values(fields, sigmas, draws, ns)
        shape = (rows.size, count)
        answer = self._ask({**fields, **drawn}, rows, count, self.how)
        p, low, high = (getattr(answer, n).reshape(shape) for n in OF_STATED)
        codes = answer.state_codes
        states = np.zeros(shape, dtype=np.int8) if codes is None else codes.reshape(shape)
        states = np.where((states == 0) & np.isnan(p), 1 + STATES.index(REJECTED), states)
        locked = states == 1 + STATES.index(LOCKED)
        p, low, high = (np.where(locked, 0.0, column) for column in (p, low, high))
        weight = ((states == 0) | locked).astype(np.float64)
        for i in np.flatnonzero(states.any(axis=1)).tolist():
            self._check(int(rows[i]), states[i])
        with np.errstate(all="ignore"):
            weight /= weight.sum(axis=1, keepdims=True)
            p, low, high = (np.where(weight > 0.0, column, np.nan) for column in (p, low, high))
            eta, lows, highs = (np.clip(ns.ndtri(c), -CLIP, CLIP) for c in (p, low, high))
            below, above = (np.maximum(x / q, FLOOR) for x in (eta - lows, highs - eta))
            mean = np.nansum(weight * p, axis=1)
            ends = [
                ns.ndtr(_ends(eta, below, above, target, column))
                for target, column in (
                    (0.5 - 0.5 * self.nominal.level, lows), (0.5 + 0.5 * self.nominal.level, highs),
                )
            ]  # fmt: skip
            outside = np.nansum(weight * p * ~answer.in_domain.reshape(shape), axis=1)
            if self.uncertainty is not None:
                self._add_sources(rows, [*sigmas], [z for _, z in draws], eta, below + above)
        missing = (states > 0) & ~locked & (states != 1 + STATES.index(UNSTABLE))
        few = missing.mean(axis=1) > WARNED
        if not self.how.get("interval", True):
            few[:] = True
        self.values["probability"][rows] = mean
        for name, end in zip(OF_STATED[1:], ends, strict=True):
            self.values[name][rows] = np.where(few, np.nan, end)
        self.values["in_domain"][rows] = (outside < NOTABLE_SHARE * mean) | (mean == 0.0)
        names = [answer.kind] if answer.kind_codes is None else [
            name for code, name in enumerate(KINDS) if (answer.kind_codes == code).any()
        ]  # fmt: skip
        self.slide |= any("displacement_m" in facts_of(name).parameters for name in names)
        self.rows.append(rows)

    def _add_sources(
        self,
        rows: NDArray[np.intp],
        sigmas: Sequence[str],
        scores: Sequence[FloatArray],
        eta: FloatArray,
        widths: FloatArray,
    ) -> None:
        """Add the sources of rows, as :func:`rbfrag.question.measurement.sources_of` has them.

        Args:
            rows: the rows.
            sigmas: names of their standard deviations.
            scores: z of the draws of each of them.
            eta: probits, NaN of draws that are excluded, shape (rows, draws).
            widths: sums of the standard errors of the probits below and above, likewise.
        """
        assert self.uncertainty is not None
        is_included = ~np.isnan(eta)
        count = is_included.sum(axis=1)
        z, k = np.concatenate(scores), len(scores)
        centred = np.where(is_included, eta - np.nanmean(eta, axis=1, keepdims=True), 0.0)
        means = is_included @ z.T / count[:, None]
        products = (z[:, None] * z).reshape(k * k, -1)
        cov = (is_included @ products.T / count[:, None]).reshape(-1, k, k)
        cov -= means[:, :, None] * means[:, None, :]
        about = centred @ z.T / count[:, None]
        slopes = (np.linalg.pinv(cov, hermitian=True) @ about[:, :, None])[:, :, 0]
        fragility = np.nanmean(0.25 * widths * widths, axis=1)
        total = (centred * centred).sum(axis=1) / count + fragility
        shares = dict(zip(map(source_of, sigmas), (slopes * about / total[:, None]).T, strict=True))
        shares["fragility"] = fragility / total
        shares[TOGETHER] = 1.0 - np.sum([*shares.values()], axis=0)
        for name, share in shares.items():
            empty = np.full(self.nominal.probability.size, np.nan)
            self.uncertainty.setdefault(name, empty)[rows] = share

    def _ask(
        self, fields: Mapping[str, Any], rows: NDArray[np.intp], count: int, how: Mapping[str, Any]
    ) -> Any:
        """Return the answers for a number of draws of rows, fields of shape (rows, count)."""
        inputs = {
            n: np.broadcast_to(v, (rows.size, count)).ravel() for n, v in fields.items()
            if n not in ("base", "back")
        } | {n: np.repeat(word[rows], count) for n, word in self.words.items()}  # fmt: skip

        def repeated(option: Any) -> Any:
            if option is None or isinstance(option, str):
                return option
            return np.repeat(np.array(option, dtype=object)[rows], count).tolist()

        by_row = {n: repeated(how[n]) for n in _BY_ROW if n in how}
        options = {**how, **by_row, "nan": "propagate", "draws": True, "sites": None}
        return ask_stated(inputs, kind=repeated(self.kind), **options)

    def sensitivity(self, gmm_sigma: FloatArray) -> dict[str, FloatArray]:
        """Return the lowest and highest P of each row at a usual error of each measured field."""
        result: dict[str, FloatArray] = {}
        shape = self.nominal.probability.shape
        rows, columns = np.arange(self.nominal.probability.size), dict(self.columns)
        if gmm_sigma.any():
            spread = np.hypot(columns.get("amplification_sigma", 0.0), gmm_sigma)
            columns["amplification_sigma"] = spread
        for name, sides in usual_sides(columns, columns.keys() & {"base", "back"}):
            values = []
            for side in ({}, *sides):
                fields = {n: v[:, None] for n, v in {**columns, **side}.items()}
                answer = self._ask(fields, rows, 1, {**self.how, "interval": False})
                p = np.where(_is(answer, LOCKED), 0.0, answer.probability).ravel()
                values.append(p)
            lacks = np.isnan(columns[name])
            for end, of in (("low", np.fmin), ("high", np.fmax)):
                column = np.where(lacks, np.nan, of.reduce(values))
                result[f"{name}_{end}"] = column.reshape(shape)
        return result

    def _check(self, row: int, codes: NDArray[np.int8]) -> None:
        """Note what is left out of a row, or why it has no answer."""
        try:
            counts = np.bincount(codes, minlength=1 + len(STATES)).tolist()
            notes = check_draws(dict(zip(("", *STATES), counts, strict=True)))
            self.notes += [note.replaced(rows=(row,)) for note in notes]
        except InputError as error:
            self.reasons.append((np.array([row]), np.array([str(error)], dtype=object)))

    def answer(self) -> PredictionArray:
        """Return the answers of all rows."""
        nominal, shape = self.nominal, self.nominal.probability.shape
        rows = np.concatenate([np.empty(0, dtype=np.intp), *self.rows])
        if not rows.size:
            return nominal
        as_stated = {n: getattr(nominal, n).copy() for n in OF_STATED}
        at_rest = np.broadcast_to(_is(nominal, UNSTABLE), shape).ravel()
        fallen = rows[at_rest[rows]]
        for column in as_stated.values():
            column.flat[fallen] = np.nan
        for failed, _ in self.reasons:
            for column in (self.values[n] for n in OF_STATED):
                column[failed] = np.nan
            for column in (self.uncertainty or {}).values():
                column[failed] = np.nan
            self.values["in_domain"][failed] = False
        # mechanics decides about the stated values only
        decided = np.isin(self.values["probability"][rows], (0.0, 1.0))
        changed = rows[~decided & (nominal.how.ravel()[rows] == BY_MECHANICS)]
        nothing = np.full(changed.size, "", dtype=object)
        reasons = [*nominal.reasons.parts, (changed, nothing), *self.reasons]
        ruled = [*(nominal.ruled.parts if nominal.ruled else ()), (changed, nothing)]
        warnings = [
            warning for warning in diagnostics(nominal.warnings)
            if not is_obsolete(warning, [*MEASURED] if self.scenario else [], slides=self.slide)
        ]  # fmt: skip
        return with_values(
            nominal,
            **{name: column.reshape(shape) for name, column in self.values.items()},
            reasons=Reasons(shape, reasons),
            ruled=Reasons(shape, ruled),
            warnings=diagnostics(warnings, self.notes),
            as_stated=as_stated,
            uncertainty=self.uncertainty and {
                name: column.reshape(shape) for name, column in self.uncertainty.items()
            },
        )  # fmt: skip

    @property
    def scenario(self) -> bool:
        """True if a ground-motion model predicts the shaking."""
        return "rjb_km" in self.columns or self.how.get("gmm") is not None


def _is(answer: PredictionArray, state: str) -> Any:
    """Return which elements are in a state."""
    codes = answer.state_codes
    return False if codes is None else codes == 1 + STATES.index(state)


def _ends(
    eta: FloatArray, below: FloatArray, above: FloatArray, target: float, ends: FloatArray
) -> FloatArray:
    """Return the probit below which the mixture of each row has the target share.

    Args:
        eta: probits of the draws, NaN of those that are excluded, shape (rows, draws).
        below: standard errors below, likewise.
        above: standard errors above, likewise.
        target: the share.
        ends: the end of the interval of each draw, likewise.
    """
    ndtr, rows, result = arrays().ndtr, np.arange(len(eta)), np.full(len(eta), np.nan)
    count = np.isfinite(eta).sum(axis=1)
    eta, below, above = (np.where(np.isnan(eta), fill, x)
                         for x, fill in ((eta, np.inf), (below, 1.0), (above, 1.0)))  # fmt: skip
    least, most = np.fmin.reduce(ends, axis=1), np.fmax.reduce(ends, axis=1)
    steps = [
        ((eta == end[:, None]) * (0.5 + 0.5 * (scale == FLOOR))).sum(axis=1) / count
        for end, scale in ((least, above), (most, below))
    ]
    root = Root.between(least, most, (steps[0], steps[1]), target, np.where)
    while True:
        is_open = np.abs(root.step) > TOLERANCE
        if not is_open.all():
            result[rows] = root.t
            root = Root(*(column[is_open] for column in root))
            rows, count, eta, below, above = (
                column[is_open] for column in (rows, count, eta, below, above)
            )
        if not rows.size:
            return result
        z = root.t[:, None] - eta
        scale = np.where(z < 0.0, below, above)
        z /= scale
        share = ndtr(z).sum(axis=1) / count
        z *= z
        z *= -0.5
        np.exp(z, out=z)
        z /= scale
        slope = z.sum(axis=1) / (ROOT_TWO_PI * count)
        root = root.improved(share - target, slope, np.where)
