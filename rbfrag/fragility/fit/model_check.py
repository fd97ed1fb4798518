"""Whether the data that a model was fitted on are still those of the database."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import FitError, InputError, ModelError
from rbfrag.fragility.fit.data import fit_data
from rbfrag.fragility.fit.kind_data import sliding_data, slumping_data
from rbfrag.fragility.fit.source import FitSource, read_source
from rbfrag.fragility.model import FragilityModel

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from rbfrag.db.queries import Vertical

Selection = tuple[str | None, str, bool]
"""Suite, vertical motion, and whether doubtful PGD is read: what a fit was asked to read."""

State = Literal["unchanged", "changed", "no data", "unreadable"]


@dataclass(frozen=True)
class ModelCheck:
    """What became of one model's data.

    Args:
        name: the model.
        state: ``unchanged``; ``changed`` (fit it again); ``no data`` (the database holds models
            without the data they came from, as a reference does); ``unreadable``.
        remark: what changed or why it cannot be told; empty if unchanged.
    """

    name: str
    state: State
    remark: str

    def as_dict(self) -> dict[str, str]:
        """Return the fields by name."""
        return {"name": self.name, "state": self.state, "remark": self.remark}


def check_models(connection: Connection, rows: list[ModelRow]) -> list[ModelCheck]:
    """Compare the fingerprint of each model with that of the data its fit would read today."""
    sources: dict[Selection, FitSource] = {}
    return [
        _check(connection, row, sources) if row.kind == "toppling" else _check_kind(connection, row)
        for row in rows
    ]


def _check(
    connection: Connection, row: ModelRow, sources: dict[Selection, FitSource]
) -> ModelCheck:
    try:
        model = FragilityModel.from_row(row)
    except ModelError as error:
        return ModelCheck(row.name, "unreadable", str(error))
    suite = cast("str | None", row.diagnostics.get("suite"))
    vertical = str(row.diagnostics.get("vertical", "without"))
    doubtful = bool(row.diagnostics.get("doubtful_pgd", False))
    key = (suite, vertical, doubtful)
    try:
        if key not in sources:
            kind = cast("Vertical", vertical)
            sources[key] = read_source(
                connection, suite=suite, vertical=kind, doubtful_pgd=doubtful
            )
        data = fit_data(sources[key], model.term)
    except (FitError, InputError) as error:
        return ModelCheck(row.name, "no data", str(error))
    if data.fingerprint == row.data_fingerprint:
        return ModelCheck(row.name, "unchanged", "")
    return _changed(row, int(data.found.sum()))


def _check_kind(connection: Connection, row: ModelRow) -> ModelCheck:
    told = cast("dict[str, Any]", row.diagnostics)
    selection = {"suite": told.get("suite"), "vertical": told.get("vertical", "without")}
    try:
        FragilityModel.from_row(row)
        if row.kind == "sliding":
            data = sliding_data(connection, **selection)
        else:
            rotation_deg = told.get("rotation_deg")
            data = slumping_data(connection, rotation_deg=rotation_deg, **selection)
    except (FitError, InputError) as error:  # a refused fit is one kind of ModelError
        return ModelCheck(row.name, "no data", str(error))
    except ModelError as error:
        return ModelCheck(row.name, "unreadable", str(error))
    if data.fingerprint == row.data_fingerprint:
        return ModelCheck(row.name, "unchanged", "")
    return _changed(row, int(data.found.sum()))


def _changed(row: ModelRow, now: int) -> ModelCheck:
    then = row.diagnostics.get("n")
    counts = f"fitted to {then} critical values, {now} today" if then != now else "other values"
    return ModelCheck(row.name, "changed", f"{counts}: fit it again with  rbfrag fit --replace")
