"""Stored fragility models: their list, and which of them answers a question.

:func:`suited_models` decides which model answers; the default of a kind, which it prefers, comes
with the rows (:func:`rbfrag.db.model_file.with_defaults`). No library is loaded here.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any, cast

from rbfrag.db.location import DEFAULT_NAME, REFERENCE, data_place, is_unnamed, reference_file
from rbfrag.db.model_file import (
    COMPARED,
    ModelRow,
    answer_order,
    held_out_loss,
    unknown_model,
)
from rbfrag.errors import InputError, ModelError, UnknownModelError
from rbfrag.fragility.completion import Regression
from rbfrag.fragility.describe import fitted_number
from rbfrag.fragility.measures import (
    ABOUT_SCATTER,
    MEASURES,
    SCATTERED,
    TERMS,
    least_inputs,
    missing_inputs,
    terms_from,
)
from rbfrag.fragility.method import TOPPLING_BLOCK, BlockParameters
from rbfrag.fragility.methods import methods
from rbfrag.fragility.model import LOSSES, FragilityModel, Model
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import count_of
from rbfrag.results.result import ResultList, TextLine, TextTable
from rbfrag.vocabulary.quantities import word_of
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, input_of, period_of, spectral_names

SHIPPED = "the built-in data set"
"""Name of the data set that answers where no other database is given or exists."""

_Stamp = tuple[int, ...]


def data_name(place: str) -> str:
    """Return the display name of a database, without folder, server or password."""
    return place if place == SHIPPED else place.partition("?")[0].rpartition("/")[2]


@dataclass(frozen=True, eq=False)
class _Store:
    """Models of one database.

    Args:
        place: its name in messages.
        source: path or URL of a database that may be written; None of the built-in data set.
        stamp: what tells whether the file has changed since; () where nothing can.
        rows: the models of all kinds.
        models: those that have answered, by name.
        suited: those that have been found to suit a question, the recommended first.
    """

    place: str
    stamp: _Stamp
    rows: list[ModelRow]
    source: Path | str | None = None
    models: dict[str, FragilityModel] = field(default_factory=dict)
    suited: dict[tuple[object, ...], list[FragilityModel]] = field(default_factory=dict)

    def row(self, name: str) -> ModelRow:
        """Return a stored model by name."""
        for row in self.rows:
            if row.name == name:
                return row
        names = sorted(row.name for row in self.rows)
        raise UnknownModelError(unknown_model(name, names, self.place))

    def model(self, row: ModelRow) -> FragilityModel:
        """Return a model ready for predictions."""
        model = self.models.get(row.name)
        if model is None:
            complete = None if self.source is None else self._with_dependence
            model = FragilityModel.from_row(row, data_name(self.place), complete, self._regression)
            self.models[row.name] = model
        return model

    def _with_dependence(self, row: ModelRow) -> ModelRow:
        from rbfrag.fragility.fit.stored import with_dependence

        return with_dependence(row, self.source)

    def _regression(
        self, row: ModelRow, used: tuple[str, ...]
    ) -> tuple[Regression | None, tuple[Diagnostic, ...]]:
        from rbfrag.fragility.fit.stored import regression_of

        return regression_of(row, used, REFERENCE if self.source is None else self.source)


_SHIPPED = str(REFERENCE)
_store_cache: dict[tuple[str, bool], _Store] = {}
_model_cache: dict[int, tuple[ModelRow, FragilityModel]] = {}
_MOST_ROWS = 64


def block_of(names: Collection[str], kind: str | None = None) -> BlockParameters:
    """Return the block parameters that the input names describe; toppling if ambiguous.

    Args:
        names: names of what it gives.
        kind: how the block is asked to fail, if the question says so.
    """
    described = {name for name in names if name not in MEASURES}
    toppling = kind is None or kind == TOPPLING_BLOCK.kind
    if toppling and described <= {*TOPPLING_BLOCK.names, *TOPPLING_BLOCK.sigmas}:
        return TOPPLING_BLOCK  # without loading the methods
    blocks = dict.fromkeys((TOPPLING_BLOCK, *(method.block for method in methods())))

    def read(block: BlockParameters) -> int:
        return len({*block.names, *block.options}.intersection(names))

    of_kind = [block for block in blocks if block.kind == kind and read(block)]
    # the first of those that read most of what is said
    return max(of_kind or blocks, key=read)


def find_model(
    model: Model | None,
    names: Collection[str],
    db: str | PathLike[str] | None = None,
    *,
    kind: str | None = None,
    rotation_deg: float | None = None,
) -> FragilityModel:
    """Return the model for a block and the given intensity measures: the named one, or else the
    first of :func:`suited_models`.

    Args:
        model: a model, the name of a stored one, or None.
        names: names of what is known of block and motion (``p2``, ``kr``, ``pgv_m_s``, …).
        db: database; None for ``RBFRAG_DB``, or else ``rbfrag.db`` in the current folder, or
            else the built-in data set.
        kind: how the block fails; None for what it is given by, or what the model is of.
        rotation_deg: rotation that counts as failure [deg], where there are models of several.

    Raises:
        InputError: the measures do not suffice, or the model is of another kind or criterion.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    if type(model) is FragilityModel:
        chosen = model
    elif model is None:
        return suited_models(names, db, kind=kind, rotation_deg=rotation_deg)[0]
    elif isinstance(model, str):
        store = _store(db)
        chosen = store.model(store.row(model))
    elif isinstance(model, ModelRow):
        chosen = _of_row(model)
    else:
        raise InputError(
            f"model is of type {type(model).__name__}: give the name of a stored model, or a model"
        )
    if kind is not None and chosen.row.kind != kind:
        raise InputError(f"model {chosen.name!r} is of kind {chosen.kind}, not {kind}")
    block = chosen.method.block
    if not MEASURES.issuperset(names):  # of measures alone the caller has the block
        check_numbers(chosen.kind, block, names, chosen)
    if block.criterion is not None or rotation_deg is not None:
        _check_criterion(chosen.kind, block, rotation_deg)
        if chosen.criterion != rotation_deg:
            raise InputError(
                f"model {chosen.name!r} is for {_failure(chosen.criterion)}, not for "
                f"{_failure(rotation_deg)}"
            )
    term = TERMS.get(chosen.row.term, chosen.term)
    if missing_inputs(term, names):
        raise InputError(
            f"model {chosen.name!r} requires {' and '.join(term.inputs or ('sa_g',))} "
            f"({term.title}); given: {_measures(names)}. Add it, or choose a model of another term",
            fields=MEASURES,
        )
    return chosen.for_inputs(names)


def suited_models(
    names: Collection[str],
    db: str | PathLike[str] | None = None,
    *,
    kind: str | None = None,
    rotation_deg: float | None = None,
) -> list[FragilityModel]:
    """Return one stored model for each suitable set of intensity measures, the recommended first.

    The order is that of :func:`rbfrag.db.model_file.answer_order` (docs/theory/fragility.md, "Which
    model answers"). Methods kept for comparison answer where no other does.

    Arguments as for :func:`find_model`.
    """
    store, key = _store(db), (tuple(names), kind, rotation_deg)
    if key not in store.suited:
        store.suited[key] = _suited_in(store, *key)
    return [*store.suited[key]]


def unused_measures(model: FragilityModel, names: Collection[str]) -> tuple[Diagnostic, ...]:
    """Return warnings about intensity measures that a model does not use."""
    read = model.term.inputs
    unused = [
        name
        for name in names
        if name not in read and name in MEASURES
        if name not in ABOUT_SCATTER or SCATTERED.get(name, read[0]) not in read
    ]
    if not unused:
        return ()
    uses = " and ".join(dict.fromkeys(map(input_of, read)))
    alone = [
        name for name in unused
        if input_of(name) == "sa_sigma" and name.removesuffix("_sigma") not in names
    ]  # fmt: skip
    unused = [name for name in unused if name not in alone]
    texts = [f"{name} was not used: {name.removesuffix('_sigma')} is not given" for name in alone]
    if model.form.velocity is not None and ("pga_g" in read or spectral_names(read)):
        # SA is used, but not at these periods
        spectral = spectral_names(unused)
        deviations = {f"{name}_sigma" for name in spectral}
        unused = [name for name in unused if name not in spectral and name not in deviations]
        short = [name for name in spectral if (period_of(name) or 0.0) < SPECTRUM_PERIODS_S[0]]
        if short and "pga_g" in read:
            texts.append("spectral accelerations below 0.1 s were not used: PGA stands for them")
        if len(short) < len(spectral):
            texts.append(
                "spectral accelerations at other periods were not used: those at the 21 periods of "
                "the fitted spectra suffice"
            )
    texts += [f"{name} was not used: model {model.name} uses {uses}"
              for name in dict.fromkeys(map(input_of, unused))]  # fmt: skip
    hints = [Diagnostic(model.form.hint, "model_choice")] if texts and model.form.hint else []
    return (*(Diagnostic(text, "unused_measures") for text in texts), *hints)


def _suited_in(
    store: _Store, names: tuple[str, ...], kind: str | None, rotation_deg: float | None
) -> list[FragilityModel]:
    possible = terms_from(names)
    if not possible:
        raise InputError(
            f"{_measures(names)} is given: a prediction requires {_enough(TERMS)}, or a motion, or "
            "magnitude with rjb_km and vs30_m_s",
            fields=(*MEASURES, "rjb_km", "vs30_m_s"),
        )
    block = block_of(names)
    kind = block.kind if kind is None else kind
    if not store.rows:
        raise UnknownModelError(unknown_model(None, [], store.place))
    of_kind = [row for row in store.rows if row.kind == kind]
    if not of_kind:
        from rbfrag.solver.kinds import KINDS

        stored = [name for name, model in sorted(KINDS.items()) if model.parameters]
        advice = f"make one by rbfrag simulate and rbfrag fit, both of kind {kind}"
        if kind not in stored:
            advice = f"there are models of {', '.join(stored)}"
        raise UnknownModelError(f"{store.place} has no {kind} model: {advice}")
    named = [row.name for row in of_kind if TERMS[row.term].by_name and not row.is_default]
    of_kind = [row for row in of_kind if row.name not in named]

    suited = sorted((row for row in of_kind if row.term in possible), key=answer_order)
    for row in suited:
        with suppress(ModelError):
            block = store.model(row).method.block
            break
    if not MEASURES.issuperset(names):
        check_numbers(kind, block, names)
    _check_criterion(kind, block, rotation_deg)
    best: dict[str, FragilityModel] = {}
    unreadable: list[ModelError] = []
    for row in suited:
        compared = row.method in COMPARED and not row.is_default
        if row.term in best or (compared and best):
            continue
        if block.criterion_of(row.diagnostics) != rotation_deg:
            continue
        try:
            best[row.term] = store.model(row).for_inputs(names)
        except ModelError as error:  # another may answer
            unreadable.append(error)
    if best:
        return [*best.values()]
    if unreadable:
        raise unreadable[0]
    if suited:
        have = ", ".join(
            f"{row.name} ({_failure(block.criterion_of(row.diagnostics))})" for row in of_kind
        )
        raise UnknownModelError(
            f"no stored {kind} model of {_failure(rotation_deg)} works with "
            f"{_measures(names)}; the stored models are for {have}"
        )
    fitted = {name for method in methods() if method.block.kind == kind for name in method.forms}
    terms = [name for name in possible if name in fitted and not TERMS[name].by_name]
    raise InputError(
        f"no stored {kind} model works with {_measures(names)}: give "
        f"{_enough(row.term for row in of_kind)}"
        + (f", or fit a model of {' or '.join(terms)}" if terms else "")
        + (f"; {' and '.join(named)}: by name alone" if named else "")
    )


def _enough(terms: Iterable[str]) -> str:
    """Describe the intensity measures that suffice for any of the terms."""
    return ", or ".join(" and ".join(inputs) for inputs in least_inputs(terms))


SIDES = ("height_m", "width_m")


def check_numbers(
    kind: str, block: BlockParameters, names: Collection[str], model: FragilityModel | None = None
) -> None:
    """Reject inputs that do not describe a block of this kind.

    Args:
        kind: how the block fails.
        block: what describes such a block.
        names: names of what is given of block and shaking.
        model: the model that is asked for, if it decides about the kind.
    """
    missing = [name for name in block.names if name not in names]
    accepted = {*block.names, *block.options, *block.sigmas}
    unexpected = [name for name in names if name not in MEASURES and name not in accepted]
    if unexpected and len(missing) == len(block.names):
        subject = f"kind {kind}" if model is None else f"model {model.name!r} is of kind {kind}: it"
        raise InputError(
            f"{subject} uses {' and '.join(block.names)}, not {' and '.join(unexpected)}",
            fields=(*block.names, *unexpected),
        )
    if missing:
        raise InputError(
            f"{missing[0]} is missing: a block of kind {kind} is given by "
            f"{' and '.join(block.names)}, or by its shape, such as {' and '.join(SIDES)}",
            fields=(*block.names, *SIDES),
        )
    if unexpected:
        raise InputError(
            f"{unexpected[0]} cannot be combined with kind {kind}: omit it", fields=(unexpected[0],)
        )


def _check_criterion(kind: str, block: BlockParameters, rotation_deg: float | None) -> None:
    """Reject a failure criterion that this kind does not have."""
    if rotation_deg is None:
        return
    if block.criterion is None:
        raise InputError(f"rotation_deg is not a failure criterion of kind {kind}: omit it")
    if isinstance(rotation_deg, bool) or not isinstance(rotation_deg, int | float):
        raise InputError(f"rotation_deg = {rotation_deg!r} is not a number")


def _failure(rotation_deg: float | None) -> str:
    return "failure past recovery" if rotation_deg is None else f"a rotation of {rotation_deg:g}°"


def _measures(names: Collection[str]) -> str:
    return " and ".join(name for name in names if name in MEASURES) or "no intensity measure"


def _of_row(row: ModelRow) -> FragilityModel:
    cached = _model_cache.get(id(row))
    if cached is not None and cached[0] is row:
        return cached[1]
    model = FragilityModel.from_row(row)
    if len(_model_cache) >= _MOST_ROWS:
        _model_cache.clear()
    _model_cache[id(row)] = (row, model)
    return model


def stored_row(name: str, db: str | PathLike[str] | None = None) -> ModelRow:
    """Return a stored model of a database by name.

    Args:
        db: database, as for :func:`find_model`.

    Raises:
        UnknownModelError: no model of that name.
    """
    return _store(db).row(name)


def stored_rows(db: str | PathLike[str] | None = None) -> list[ModelRow]:
    """Return the stored models of a database, sorted by name.

    Args:
        db: database, as for :func:`find_model`.
    """
    return list(_store(db).rows)


def _store(db: str | PathLike[str] | None) -> _Store:
    """Return the models of a database; a file is read again only after it has changed.

    A database that nobody names and that holds no model does not take the place of the reference.
    """
    store = _in_memory(db)
    if store is not None:
        return store
    place, shipped = data_place(db)
    if not isinstance(place, Path):
        from rbfrag.db.engine import opened_database
        from rbfrag.db.models import model_rows

        with opened_database(place, read_only=True) as engine, engine.connect() as connection:
            return _Store(str(engine.url), (), model_rows(connection), place)
    store = _unchanged(str(place), shipped) or _read_again(place, shipped)
    if not store.rows and is_unnamed(db) and reference_file() is not None:
        return _unchanged(_SHIPPED, True) or _read_again(REFERENCE, True)
    return store


def models_in_memory(db: str | PathLike[str] | None = None) -> bool:
    """Return whether the models of a database are in memory, so that no file has to be read."""
    return _in_memory(db) is not None


def _in_memory(db: str | PathLike[str] | None) -> _Store | None:
    if not is_unnamed(db):
        try:
            named = os.environ["RBFRAG_DB"] if db is None else os.fspath(db)
        except TypeError:
            return None  # what reads it rejects it
        return _unchanged(named, False)
    if not _stamp(DEFAULT_NAME, False):
        return _unchanged(_SHIPPED, True)
    store = _unchanged(DEFAULT_NAME, False)
    return store if store is None or store.rows else _unchanged(_SHIPPED, True)


def _unchanged(path: str, shipped: bool) -> _Store | None:
    cached = _store_cache.get((path, shipped))
    return cached if cached is not None and cached.stamp == _stamp(path, shipped) else None


def _read_again(path: Path, shipped: bool) -> _Store:
    from rbfrag.db.model_file import read_models

    key = str(path)
    stamp = _stamp(key, shipped)
    store = _Store(SHIPPED if shipped else key, stamp, read_models(path), None if shipped else path)
    if stamp:
        _store_cache[key, shipped] = store
    return store


def _stamp(path: str, shipped: bool) -> _Stamp:
    """Return the signature of a file's content; a name alone is ambiguous, since a relative one
    depends on the folder.
    """
    try:
        file = os.stat(path)  # noqa: PTH116  (Path takes ten times as long)
    except OSError:
        return ()
    stamp = (file.st_mtime_ns, file.st_size, file.st_ino, file.st_dev)
    if shipped:  # nobody writes into that one
        return stamp
    try:
        log = os.stat(path + "-wal")  # noqa: PTH116
    except OSError:
        return stamp
    return (*stamp, log.st_mtime_ns, log.st_size)


@dataclass(frozen=True, eq=False, repr=False)
class ModelList(ResultList):
    """The fitted models of a database, by kind, the best of a kind first."""

    models: Sequence[ModelRow]

    def sentences(self) -> Iterator[str]:
        """Yield the number of models."""
        yield count_of(len(self.models), "fitted model")

    def lines(self) -> Iterator[TextLine]:
        """Yield the default of each kind."""
        defaults = [f"{row['name']} ({row['kind']})" for row in self.rows() if row["is_default"]]
        if defaults:
            yield TextLine("Default", ", ".join(defaults))

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the models with their log loss by what is given of the shaking."""
        headers = ("model", "kind", "predictors", "log loss", "default")
        cells: list[tuple[str, str, str, str, str]] = []
        for row in self.rows():
            default = "yes" if row["is_default"] else ""
            losses = row["losses_by_inputs"] or [row]
            for losses_of in losses if verbose else filter(_is_usual, losses):
                loss = losses_of["log_loss_kr05"] or losses_of["log_loss"]
                reads = _predictors(losses_of["reads"])
                text = "" if loss is None else f"{loss:.4f}"
                cells.append((row["name"], row["kind"], reads, text, default))
                default = ""
        yield TextTable(headers, cells)

    def rows(self) -> list[dict[str, Any]]:
        """Return the models under the keys of the JSON contract."""
        return [
            {
                **{
                    name: getattr(row, name)
                    for name in ("name", "kind", "term", "method", "is_default")
                },
                "n": fitted_number(row.diagnostics),
                "reads": list(TERMS[row.term].inputs) if row.term in TERMS else [],
                "log_loss": _finite(held_out_loss(row, "log_loss_held_out")),
                "log_loss_kr05": _finite(held_out_loss(row, "log_loss_held_out_kr05")),
                "losses_by_inputs": [
                    {"reads": inputs.split(), **losses}
                    for inputs, losses in cast("Any", row.diagnostics.get(LOSSES, {})).items()
                ],
                "events": row.diagnostics.get("events"),
                "sensitive_share": row.diagnostics.get("sensitive_share"),
                "domain": dict(row.domain),
                "created": row.created,
            }
            for row in sorted(self.models, key=lambda row: (row.kind, held_out_loss(row)))
        ]


def _is_usual(losses: Mapping[str, Any]) -> bool:
    """Return whether a set of measures is listed without being asked for."""
    ordinates = len(spectral_names(losses["reads"]))
    return ordinates in (0, 1, 3, len(SPECTRUM_PERIODS_S))


def _predictors(reads: Sequence[str]) -> str:
    """Describe a set of measures in a few words."""
    spectrum = spectral_names(reads)
    if len(spectrum) > _MOST_LISTED:
        return ", ".join([*map(word_of, reads[: -len(spectrum)]), f"SA at {len(spectrum)} periods"])
    return ", ".join(map(word_of, reads))


_MOST_LISTED = 5


def _finite(loss: float) -> float | None:
    return loss if loss < math.inf else None
