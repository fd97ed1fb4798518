"""A fitted model of blocks that slide or slump, ready to answer. No library is loaded here."""

from __future__ import annotations

import math
from dataclasses import dataclass
from os import PathLike

from rbfrag.db.rows import ModelRow
from rbfrag.errors import InputError, ModelError, UnknownModelError
from rbfrag.fragility.kind_formulas import FORMULAS, METHODS, Formula
from rbfrag.fragility.lookup import FROM_REFERENCE, stored_rows, uses_reference


@dataclass(frozen=True)
class KindModel:
    """One fitted model: a stored row in the form that answers.

    Args:
        row: the model as stored.
        formula: its formula.
        parameters: values of its coefficients.
        degrees_of_freedom: earthquakes less one.
        rotation_deg: slumping: the rotation that counts as failure [deg]; None past recovery.
        notes: what every answer says of the model, such as where it comes from.
    """

    row: ModelRow
    formula: Formula
    parameters: tuple[float, ...]
    degrees_of_freedom: int
    rotation_deg: float | None
    notes: tuple[str, ...] = ()

    @classmethod
    def from_row(cls, row: ModelRow, notes: tuple[str, ...] = ()) -> KindModel:
        """Return the model of a stored row.

        Raises:
            ModelError: this rbfrag does not know the model, or the row is not whole.
        """
        formula = FORMULAS.get((row.kind, row.term))
        if formula is None or row.method != METHODS[row.kind]:
            raise ModelError(
                f"model {row.name!r} is of kind {row.kind}, term {row.term!r} and method "
                f"{row.method!r}, which this rbfrag does not know: update rbfrag or choose another"
            )
        size = len(formula.parameters)
        square = len(row.covariance) == size and all(len(line) == size for line in row.covariance)
        if tuple(row.coefficients) != formula.parameters or not square:
            raise ModelError(
                f"model {row.name!r} has the coefficients {', '.join(row.coefficients)}, but its "
                f"formula has {', '.join(formula.parameters)}, each with its covariance: fit it "
                "again"
            )
        freedom = row.diagnostics.get("degrees_of_freedom")
        rotation = row.diagnostics.get("rotation_deg")
        return cls(
            row=row,
            formula=formula,
            parameters=tuple(row.coefficients.values()),
            degrees_of_freedom=freedom if isinstance(freedom, int) else 0,
            rotation_deg=float(rotation) if isinstance(rotation, int | float) else None,
            notes=notes,
        )

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.row.name

    def standard_error(self, gradient: tuple[float, ...]) -> float:
        """Return the standard error of eta, by the delta method."""
        variance = sum(
            one * other * self.row.covariance[i][j]
            for i, one in enumerate(gradient)
            for j, other in enumerate(gradient)
        )
        return math.sqrt(max(variance, 0.0))

    def outside(self, values: dict[str, float]) -> list[str]:
        """Return, in words, which values lie outside the fitted ranges."""
        said = []
        for name, value in values.items():
            low, high = self.row.domain.get(name, (-math.inf, math.inf))
            if not low <= value <= high:
                said.append(
                    f"{name} = {value:.4g} lies outside the fitted range {low:.4g} to {high:.4g}: "
                    "the answer is an extrapolation"
                )
        return said


def find_kind_model(
    kind: str,
    *,
    with_pga: bool,
    rotation_deg: float | None = None,
    model: ModelRow | KindModel | str | None = None,
    db: str | PathLike[str] | None = None,
) -> KindModel:
    """Return the model that answers for a kind.

    Args:
        kind: ``sliding`` or ``slumping``.
        with_pga: whether PGA is known beside PGV: the model that reads both is the better one.
        rotation_deg: slumping: the rotation that counts as failure [deg]; None past recovery.
        model: a model, the name of a stored one, or None.
        db: database, as for :func:`rbfrag.fragility.predict.predict`.

    Raises:
        UnknownModelError: none that fits; the message says what there is.
        InputError: the named model needs PGA, or is of another kind or rotation.
        DatabaseError: the database cannot be read.
    """
    if isinstance(model, KindModel):
        chosen = model
    elif isinstance(model, ModelRow):
        chosen = KindModel.from_row(model)
    else:
        chosen = _stored(kind, with_pga, rotation_deg, model, db)
    if chosen.row.kind != kind:
        raise InputError(f"model {chosen.name!r} is of kind {chosen.row.kind}, not {kind}")
    if chosen.rotation_deg != rotation_deg:
        raise InputError(
            f"model {chosen.name!r} tells of {_failure(chosen.rotation_deg)}, asked is "
            f"{_failure(rotation_deg)}"
        )
    if "pga_g" in chosen.formula.inputs and not with_pga:
        raise InputError(f"model {chosen.name!r} reads PGA beside PGV: give --pga (pga_g) too")
    return chosen


def _stored(
    kind: str,
    with_pga: bool,
    rotation_deg: float | None,
    name: str | None,
    db: str | PathLike[str] | None,
) -> KindModel:
    notes = (FROM_REFERENCE,) if uses_reference(db) else ()
    rows = [row for row in stored_rows(db) if row.kind == kind]
    models = [KindModel.from_row(row, notes) for row in rows]
    if name is not None:
        for model in models:
            if model.name == name:
                return model
        have = ", ".join(model.name for model in models) or "none"
        raise UnknownModelError(f"there is no {kind} model {name!r}; stored are: {have}")
    fitting = [
        model
        for model in models
        if model.rotation_deg == rotation_deg and (with_pga or "pga_g" not in model.formula.inputs)
    ]
    if not fitting:
        have = ", ".join(f"{m.name} ({m.row.term}, {_failure(m.rotation_deg)})" for m in models)
        asked = f" of {_failure(rotation_deg)}" if kind == "slumping" else ""
        raise UnknownModelError(
            f"there is no {kind} model{asked} that PGV{' and PGA' if with_pga else ' alone'} "
            f"suffices for; stored are: {have or 'none'}; make one with  rbfrag simulate --kind "
            f"{kind}  and  rbfrag fit --kind {kind}"
        )
    return max(
        fitting, key=lambda m: ("pga_g" in m.formula.inputs, m.row.is_default, m.row.created)
    )


def _failure(rotation_deg: float | None) -> str:
    return "failure past recovery" if rotation_deg is None else f"a rotation of {rotation_deg:g}°"
