"""Fitted models as rows: encoding, decoding, and reading directly from an SQLite file.

Standard library only: `rbfrag predict` loads nothing heavier than `sqlite3` for its model. Both
readers, the one over SQLAlchemy and the one here, decode alike and so agree to the bit: JSON writes
the shortest text that reads back as the same double.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, fields, replace
from os import PathLike
from pathlib import Path
from typing import Any

from rbfrag.db.keys import ValueType, row_digests
from rbfrag.db.sqlite_file import check_sqlite_database, connect_sqlite, explained_sqlite_error
from rbfrag.errors import DatabaseError, InputError, checked_name

MODEL_FORM = 3
"""The form of the predictors that this rbfrag fits and answers with."""


@dataclass(frozen=True)
class ModelRow:
    """One fitted fragility model in stored form.

    Args:
        name: unique name.
        term: set of intensity measures, a name of `rbfrag.fragility.measures.TERMS`.
        method: a name of `rbfrag.fragility.methods`.
        coefficients: value of each parameter by name, in a fixed order.
        covariance: covariance of the parameters in that order.
        domain: fitted range (low, high) of each variable by name.
        data_fingerprint: hash of the data that were fitted.
        diagnostics: everything else a report prints (counts, scores, warnings), JSON-able.
        is_default: True for the model of its kind that answers when none is named: the chosen one,
            else the one of the best score (:func:`with_defaults`).
        created: UTC time of the fit, ISO 8601.
        kind: response kind of the blocks that it answers for.
        form: which form of its predictor was fitted; only :data:`MODEL_FORM` answers.
        leave_out_steps: change of the parameters when each earthquake is left out, a line each.
        dependence: correlation of the blocks of one earthquake, JSON-able, by parameter.
        completions: regressions of the spectral velocity that the model reads, as JSON Lines
            (:func:`rbfrag.fragility.completion.encode_regressions`); they are read when asked for.
    """

    name: str
    term: str
    method: str
    coefficients: Mapping[str, float]
    covariance: tuple[tuple[float, ...], ...]
    domain: Mapping[str, tuple[float, float]]
    data_fingerprint: str
    diagnostics: Mapping[str, object] = field(default_factory=dict)
    is_default: bool = False
    created: str = ""
    kind: str = "toppling"
    form: int = MODEL_FORM
    leave_out_steps: tuple[tuple[float, ...], ...] | None = None
    dependence: Mapping[str, object] | None = None
    completions: str | None = None


COLUMNS = tuple(column.name for column in fields(ModelRow))
"""The columns that make a model, in the order of :func:`decode_model`."""

STORED = (*COLUMNS, "digest")
"""The columns that are read back: with the digest, by which an altered model is rejected."""

_SELECT = f"SELECT {', '.join(STORED)} FROM fragility_model"

_TYPES: Mapping[str, ValueType] = {"is_default": "boolean", "form": "integer"}
"""Types of the columns for the digest; all others are texts."""


def reject_taken(name: str, taken: Collection[str]) -> None:
    """Reject the name of an existing model."""
    if name in taken:
        raise InputError(
            f"the model {name!r} exists: choose another name, or set replace",
            fields=("replace",),
        )


def encode_model(row: ModelRow) -> dict[str, Any]:
    """Return a model as column values.

    Raises:
        InputError: an empty name, a covariance of another size than the coefficients, a number
            that is not finite, a diagnostic that JSON has no word for.
    """
    if not row.name.strip():
        raise InputError("the name of a model must not be empty")
    checked_name(row.name, "the model")
    if not row.name.isprintable():
        raise InputError(f"the name of a model must be printable text, not {row.name!r}")
    n = len(row.coefficients)
    if len(row.covariance) != n or any(len(line) != n for line in row.covariance):
        raise InputError(f"model {row.name}: the covariance is not {n} by {n}")
    steps = row.leave_out_steps
    if steps is not None and any(len(line) != n for line in steps):
        raise InputError(f"model {row.name}: a leave-one-earthquake-out step must have {n} parts")
    numbers = [*row.coefficients.values(), *(v for line in row.covariance for v in line)]
    numbers += [bound for pair in row.domain.values() for bound in pair]
    numbers += [v for line in steps or () for v in line]
    for number in numbers:
        if not math.isfinite(number):
            raise InputError(f"model {row.name} has the value {number}: the fit cannot be stored")
    try:
        diagnostics = json.dumps(dict(row.diagnostics), allow_nan=False)
        dependence = None
        if row.dependence is not None:
            dependence = json.dumps(dict(row.dependence), allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"model {row.name}: its diagnostics or dependence cannot be stored as JSON: {error}"
        ) from error
    return {
        **vars(row),
        "coefficients": json.dumps({k: float(v) for k, v in row.coefficients.items()}),
        "covariance": _lines(row.covariance),
        "domain": json.dumps({k: [float(v) for v in pair] for k, pair in row.domain.items()}),
        "diagnostics": diagnostics,
        "is_default": bool(row.is_default),
        "leave_out_steps": None if steps is None else _lines(steps),
        "dependence": dependence,
    }


def decode_model(values: Sequence[Any]) -> ModelRow:
    """Return the model of one row, with the values in the order of :data:`STORED`.

    Raises:
        DatabaseError: the row is not what was stored: its digest differs, or it does not read as
            a model.
    """
    by_name: Mapping[str, Any] = dict(zip(STORED, values, strict=True))
    steps, dependence = by_name["leave_out_steps"], by_name["dependence"]
    try:
        names = sorted(COLUMNS)
        types = [_TYPES.get(name, "text") for name in names]
        (digest,) = row_digests(types, [[by_name[name]] for name in names])
        if digest != by_name["digest"]:
            raise ValueError("its digest differs: a value was altered after it was stored")
        coefficients = json.loads(by_name["coefficients"])
        ranges = json.loads(by_name["domain"])
        decoded = {
            "coefficients": dict(zip(coefficients, _floats(coefficients.values()), strict=True)),
            "covariance": tuple(map(_floats, json.loads(by_name["covariance"]))),
            "domain": {k: _floats((low, high)) for k, (low, high) in ranges.items()},
            "diagnostics": json.loads(by_name["diagnostics"]),
            "is_default": bool(by_name["is_default"]),
            "form": int(by_name["form"]),
            "leave_out_steps": None if steps is None else tuple(map(_floats, json.loads(steps))),
            "dependence": None if dependence is None else dict(json.loads(dependence)),
        }
        return ModelRow(**{**{name: by_name[name] for name in COLUMNS}, **decoded})
    except (ValueError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        raise DatabaseError(
            f"model {by_name['name']} is damaged in the database ({error}): fit it again in its "
            "place, or restore the database from a backup"
        ) from error


def _lines(numbers: tuple[tuple[float, ...], ...]) -> str:
    return json.dumps([[float(v) for v in line] for line in numbers])


def _floats(values: Iterable[Any]) -> tuple[float, ...]:
    numbers = tuple(map(float, values))
    if not all(map(math.isfinite, numbers)):  # thousands of numbers at each start
        raise ValueError("one of its numbers is not finite")
    return numbers


def unknown_model(name: str | None, names: Sequence[str], where: str) -> str:
    """Return the error text for an unknown model.

    Args:
        name: the name asked for; None for the default.
        where: the database as the user names it.
    """
    if not names:
        return f"{where} holds no model yet: make one by rbfrag fit"
    if name is None:
        return (
            f"{where} has no default model: name one of {', '.join(names)}, or choose "
            "the default by rbfrag models default"
        )
    return f"there is no model {name!r} in {where}; it holds: {', '.join(names)}"


ANSWER_ORDER = (
    "xp", "pgv_pga_ia", "pgv_pga_m", "pgv_pga", "pga", "pgv", "sa", "pga_tm", "pgd_tm",
)  # fmt: skip
"""Terms in the order in which their models answer: what says more of the shaking comes first."""

COMPARED = frozenset({"wls", "lognormal", "logistic"})
"""Methods of the source, of one measure each, that newer ones are compared with: they answer where
they are named, or where no other does."""


def answer_order(row: ModelRow) -> tuple[bool, bool, bool, int, str, str]:
    """Return the key by which models are sorted that suit a question: the first answers.

    The spectrum X(p) of the record comes first, then the model that was chosen as the default, then
    the order of methods and terms.
    """
    term = ANSWER_ORDER.index(row.term) if row.term in ANSWER_ORDER else len(ANSWER_ORDER)
    compared = row.method in COMPARED
    return row.term != "xp", not row.is_default, compared, term, row.created, row.name


def held_out_loss(row: ModelRow, *names: str) -> float:
    """Return the log loss of a model on earthquakes held out; infinite if it has none.

    Args:
        names: scores, of which the first that there is counts; empty for that of blocks of
            k_r >= 0.05, or else of all.
    """
    scores = row.diagnostics.get("scores")
    score_map = scores if isinstance(scores, Mapping) else {}
    names = names or ("log_loss_held_out_kr05", "log_loss_held_out")
    values = (score_map.get(name) for name in names)
    return next((float(value) for value in values if isinstance(value, int | float)), math.inf)


def recommended(rows: Sequence[ModelRow], kind: str = "toppling") -> ModelRow | None:
    """Return the default model of a kind, None if there is none.

    That is the first in the order of :func:`answer_order` of those that need neither a record nor a
    rotation limit.
    """
    usual = [row for row in rows if row.kind == kind]
    general = [
        row for row in usual if row.term != "xp" and row.diagnostics.get("rotation_deg") is None
    ]
    return min(general or usual, key=answer_order, default=None)


def with_defaults(rows: Sequence[ModelRow]) -> list[ModelRow]:
    """Return all models of a database, sorted by name, with the default of each kind.

    That is the recommended one; where no model was chosen and none has a score, there is no
    default, so that what is asked decides.

    Args:
        rows: the models, of which the chosen ones say so.
    """
    best = {kind: recommended(rows, kind) for kind in {row.kind for row in rows}}
    return [
        replace(row, is_default=True)
        if row is best[row.kind] and math.isfinite(held_out_loss(row))
        else row
        for row in sorted(rows, key=lambda row: row.name)
    ]


def read_models(path: str | PathLike[str]) -> list[ModelRow]:
    """Return all models of an SQLite database, sorted by name.

    Works while another process writes to it, and in a folder that cannot be written.

    Args:
        path: the database file.

    Raises:
        DatabaseError: one of its kinds, as for :func:`rbfrag.db.engine.open_database`.
    """
    file = Path(path)
    with closing(connect_sqlite(file, read_only=True)) as connection:
        check_sqlite_database(connection, file)
        try:
            rows = [decode_model(row) for row in connection.execute(_SELECT)]
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise explained_sqlite_error(error, file) from error
        except DatabaseError as error:
            raise DatabaseError(f"{file}: {error}") from error
    return with_defaults(rows)
