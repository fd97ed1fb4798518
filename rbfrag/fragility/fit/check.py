"""Comparison of stored models with the current data: changes of the data, and
leave-one-earthquake-out calibration.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, cast

from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import load_model
from rbfrag.db.rows import Selection
from rbfrag.errors import FitError, InputError, ModelError
from rbfrag.fragility.fit.data import CERTIFIED, FitSource, fit_data, read_source
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.fit.scores import CalibrationBins, calibration_bins
from rbfrag.fragility.measures import intensity_term
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from rbfrag.results.numbers import count_of
from rbfrag.results.result import ResultList, TextLine, TextTable

if TYPE_CHECKING:
    from sqlalchemy import Connection

State = Literal["unchanged", "changed", "no data", "unreadable"]


@dataclass(frozen=True)
class ModelCheck:
    """State of the data of one model: unchanged, changed or missing.

    Args:
        state: ``unchanged``; ``changed`` (fit it again); ``no data`` (the database holds models
            without the data they came from, as a reference does); ``unreadable``.
        remark: what changed, or why that is unknown; empty if unchanged.
    """

    name: str
    state: State
    remark: str


@dataclass(frozen=True, eq=False, repr=False)
class ModelChecks(ResultList):
    """Comparison of the data of all models with those that they were fitted to."""

    checks: Sequence[ModelCheck]

    @property
    def is_passed(self) -> bool:
        """False where data have changed, or a model is invalid."""
        return not any(check.state in ("changed", "unreadable") for check in self.checks)

    def sentences(self) -> Iterator[str]:
        """Yield the number of models by the state of their data."""
        counts = Counter(check.state for check in self.checks)
        states = ", ".join(f"{number} {state}" for state, number in counts.items())
        yield f"{count_of(len(self.checks), 'fitted model')}: {states}".removesuffix(": ")

    def lines(self) -> Iterator[TextLine]:
        """Yield each remark with its models."""
        models: dict[str, list[str]] = {}
        for check in self.checks:
            if check.remark:
                models.setdefault(check.remark, []).append(check.name)
        for remark, names in models.items():
            yield TextLine("Remark", f"{', '.join(names)}: {remark}")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:  # noqa: ARG002
        """Yield the models with the state of their data."""
        yield TextTable(("model", "data"), [(check.name, check.state) for check in self.checks])

    def rows(self) -> list[dict[str, Any]]:
        """Return the checks under the keys of the JSON contract."""
        return [asdict(check) for check in self.checks]


def selection_of(row: ModelRow) -> Selection:
    """Return the data selection of a fit."""
    diagnostics = cast("Mapping[str, Any]", row.diagnostics)
    return {
        "suite": diagnostics.get("suite"),
        "vertical": diagnostics.get("vertical", "without"),
        "doubtful_pgd": bool(diagnostics.get("doubtful_pgd", False)),
        "include_structures": bool(diagnostics.get("include_structures", False)),
        "rotation_deg": diagnostics.get("rotation_deg"),
    }


def source_of(connection: Connection, row: ModelRow) -> FitSource:
    """Return the current data for the fit of a stored model."""
    block = method_named(row.method).block
    source = read_source(connection, block, kind=row.kind, **selection_of(row))
    return replace(source, narrow=narrow_of(row))


def narrow_of(row: ModelRow) -> float:
    """Return the maximum relative width at which a fit counted a critical value as found."""
    return float(cast("float", row.diagnostics.get("narrow", CERTIFIED)))


def check_models(connection: Connection, rows: list[ModelRow]) -> ModelChecks:
    """Compare the fingerprint of each model with that of its current data."""
    sources: dict[tuple[Any, ...], FitSource] = {}
    return ModelChecks([_check(connection, row, sources) for row in rows])


def _check(
    connection: Connection, row: ModelRow, sources: dict[tuple[Any, ...], FitSource]
) -> ModelCheck:
    try:
        model = FragilityModel.from_row(row)
    except ModelError as error:
        return ModelCheck(row.name, "unreadable", str(error))
    key = (row.kind, narrow_of(row), *selection_of(row).values())
    try:
        if key not in sources:
            sources[key] = source_of(connection, row)
        data = fit_data(sources[key], method_named(row.method), model.term, kind=row.kind)
    except (FitError, InputError) as error:
        return ModelCheck(row.name, "no data", str(error))
    if data.fingerprint == row.data_fingerprint:
        return ModelCheck(row.name, "unchanged", "")
    then, now = row.diagnostics.get("n"), int(data.observed.sum())
    counts = f"fitted to {then} critical values, {now} today" if then != now else "other values"
    return ModelCheck(row.name, "changed", f"{counts}: fit it again in its place, by rbfrag fit")


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Calibration of one model on held-out earthquakes.

    Args:
        bins: predicted and observed.
        outcomes: what the outcomes are, in words.
    """

    name: str
    bins: CalibrationBins
    scores: Mapping[str, float]
    outcomes: str


def held_out_of(connection: Connection, name: str | None, *, seed: int = 0) -> HeldOut:
    """Fit a stored model again, holding out each earthquake in turn.

    Args:
        name: the model; None for the default.
    """
    row = load_model(connection, name)
    method = method_named(row.method)
    fitted = fit_source(
        source_of(connection, row),
        intensity_term(row.term),
        method,
        kind=row.kind,
        name=row.name,
        seed=seed,
        estimate_m=method.exponent in row.coefficients,
        selection=selection_of(row),
        shared=False,
    )
    judged = fitted.data.judged
    bins = calibration_bins(judged, fitted.result.held_out, seed=seed)
    return HeldOut(row.name, bins, fitted.result.scores, judged.source)
