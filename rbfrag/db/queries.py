"""Named queries of fits and reports."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, astuple, dataclass, fields
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sqlalchemy import ColumnElement, Connection, and_, case, func, select

from rbfrag.db.conditions import condition_of_combinations
from rbfrag.db.engine import stored_revision
from rbfrag.db.ledger import last_sound
from rbfrag.db.models import load_model
from rbfrag.db.motions import require_suite
from rbfrag.db.rows import IMPORTED, CombinationTable, Vertical, stored_json, stored_number
from rbfrag.db.schema import (
    combination,
    earthquake,
    metadata,
    motion,
    recording,
    simulation,
    suite_motion,
)
from rbfrag.db.schema import suite as suite_table
from rbfrag.errors import DatabaseError, InputError, UnknownModelError
from rbfrag.motions.quality import PGD_IN_DOUBT, STRUCTURE
from rbfrag.results.numbers import count_of
from rbfrag.results.result import Result, ResultList, TextLine, TextTable
from rbfrag.solver.results import NUMERICS_VERSION
from rbfrag.vocabulary.quantities import MEASURES, QUANTITIES
from rbfrag.vocabulary.spectral import spectral_name

_MEASURES = tuple(name for name in MEASURES if QUANTITIES[name].stored)
_OF_TABLE = {*_MEASURES} & {*CombinationTable.__dataclass_fields__}
_METADATA = (
    earthquake.c.mechanism, recording.c.rjb_km, recording.c.rrup_km, recording.c.vs30_m_s
)  # fmt: skip
_ON_STRUCTURE = motion.c.flags.contains(f'"{STRUCTURE}"')


@dataclass(frozen=True, eq=False, repr=False)
class DatabaseInfo(Result):
    """Contents of a database.

    Args:
        dialect: ``sqlite`` or ``postgresql``.
        numerics_versions: versions of the solver that made its combinations.
        default_model: name of the model of toppling that answers when none is named; None
            without one, or where a model is damaged.
        last_sound: when ``rbfrag db check`` last found nothing, UTC; None for never.
        metadata: number of earthquakes with a mechanism and of recordings with R_JB and Vs30, by
            column.
    """

    revision: str
    dialect: str
    rows: dict[str, int]
    combinations_by_status: dict[str, int]
    numerics_versions: tuple[str, ...]
    default_model: str | None
    last_sound: str | None
    metadata: dict[str, int]
    warnings: tuple[str, ...] = ()

    def sentences(self) -> Iterator[str]:
        """Yield the number of motions, earthquakes, combinations and models."""
        motions, earthquakes, combinations, models = (
            count_of(self.rows.get(table, 0), noun)
            for table, noun in (
                ("motion", "motion"), ("earthquake", "earthquake"),
                ("combination", "combination"), ("fragility_model", "fitted model"),
            )
        )  # fmt: skip
        yield f"{motions} of {earthquakes}, {combinations} and {models}"

    def lines(self) -> Iterator[TextLine]:
        """Yield the schema, the solver, the default model and the last check."""
        yield TextLine("Schema", f"{self.revision} ({self.dialect})")
        yield TextLine("Solver", ", ".join(self.numerics_versions) or "none")
        yield TextLine("Default", self.default_model or "none")
        yield TextLine("Checked", self.last_sound or "never")
        yield TextLine(
            "Metadata", ", ".join(f"{name} of {number:,}" for name, number in self.metadata.items())
        )

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:  # noqa: ARG002
        """Yield the number of rows by table, and of combinations by status."""
        yield TextTable(("table", "rows"), [*self.rows.items()])
        if self.combinations_by_status:
            yield TextTable(("combinations", "number"), [*self.combinations_by_status.items()])

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        return asdict(self)


@dataclass(frozen=True)
class SuiteCount:
    """Contents of a database for one suite and one kind of response, as in the dissertation's Table
    4.2.

    Args:
        suite: name of the suite; None for the motions that are in none.
        kind: response kind; None for a suite of which nothing was searched.
        motions: number of its horizontal motions, whether they were searched or not.
        combinations: number of stored combinations, of all versions of the numerics.
        found: of these, those with a critical value.
        below_limit: of these, those in which nothing fails down to the search limit.
        vertical: of these, those with a vertical motion in addition to the horizontal one.
    """

    suite: str | None
    kind: str | None
    motions: int
    combinations: int
    found: int
    below_limit: int
    vertical: int


@dataclass(frozen=True, eq=False, repr=False)
class SuiteCounts(ResultList):
    """Contents of a database by suite and response kind."""

    suites: tuple[SuiteCount, ...]

    def sentences(self) -> Iterator[str]:
        """Yield the number of suites."""
        yield count_of(len({count.suite for count in self.suites} - {None}), "suite")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:  # noqa: ARG002
        """Yield the contents."""
        names = [field.name for field in fields(SuiteCount)]
        yield TextTable(names, [astuple(count) for count in self.suites])

    def rows(self) -> list[dict[str, Any]]:
        """Return the contents of each suite under the keys of the JSON contract."""
        return [asdict(count) for count in self.suites]

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        return {"suites": self.rows()}


def combination_table(
    connection: Connection,
    *,
    suite: str | None = None,
    vertical: Vertical = "without",
    kind: str = "toppling",
    rotation_deg: float | None = None,
    numerics_version: str | None = None,
    doubtful_pgd: bool = False,
    include_structures: bool = False,
    where: str | None = None,
) -> CombinationTable:
    """Return the combinations of a kind, with critical values and the intensity measures of their
    motions.

    A pair of motion, polarity and block appears once, though several campaigns may have searched
    it with different settings: the search that went lowest counts (of equals, the one of the
    smaller natural key). Of blocks that slide it is that of the first motion, whose grid carries
    the displacements. Versions of the numerics never mix.

    Options are those of :class:`rbfrag.db.rows.Selection`, and `numerics_version`; None for the
    newest of which there are such combinations.

    Returns:
        Columns of equal length, sorted by natural key: equal databases give equal tables.

    Raises:
        InputError: there is no such suite; `vertical` is not one of the three; a condition that is
            not supported.
    """
    if vertical not in ("without", "with", "both"):
        raise InputError(f"vertical must be without, with or both, not {vertical!r}")
    columns = (
        "id", "natural_key", "motion_id", "vertical_motion_id", "polarity", "p2", "block",
        "yield_g", "settings", "numerics_version", "status", "search_limit", "kr_over_pga",
        "upper", "kr", "y_m_s",
    )  # fmt: skip
    query = (
        select(
            *(combination.c[name] for name in columns),
            *(motion.c[name] for name in (*_MEASURES, "flags") if name in motion.c),
            earthquake.c.event_id,
            earthquake.c.guessed,
            earthquake.c.magnitude,
        )
        .select_from(
            combination.join(motion, motion.c.id == combination.c.motion_id)
            .join(recording)
            .join(earthquake)
        )
        .where(combination.c.kind == kind, combination.c.linear.is_(False))
    )
    if vertical != "both":
        column = combination.c.vertical_motion_id
        query = query.where(column.is_(None) if vertical == "without" else column.is_not(None))
    if not include_structures:
        query = query.where(~_ON_STRUCTURE)
    if where is not None:
        query = query.where(condition_of_combinations(where))
    if suite is not None:
        suite_id = require_suite(connection, suite)
        query = query.join(
            suite_motion,
            and_(suite_motion.c.motion_id == motion.c.id, suite_motion.c.suite_id == suite_id),
        )
    version = combination.c.numerics_version
    if numerics_version is None:
        versions = connection.scalars(query.with_only_columns(version).distinct())
        # the newest; imported values only where there are no others
        numerics_version = max(
            versions,
            key=lambda version: (version != IMPORTED, len(version), version),
            default=NUMERICS_VERSION,
        )
    query = query.where(version == numerics_version)
    # without a search limit blocks were followed to their end, whatever a search before saw of them
    order = (combination.c.search_limit.nulls_first(), combination.c.natural_key)
    settings_of = cache(lambda text: stored_json(text, dict, "settings of a combination"))
    rows: dict[tuple[Any, ...], Any] = {}
    for row in connection.execute(query.order_by(*order)).mappings():
        settings = settings_of(row["settings"])
        if settings.get("rotation_deg") != rotation_deg or settings.get("displacement_m"):
            continue
        block = (row["p2"], row["block"])
        rows.setdefault((row["motion_id"], row["vertical_motion_id"], row["polarity"], block), row)
    selected = sorted(rows.values(), key=lambda row: str(row["natural_key"]))

    def floats(name: str) -> Any:
        try:
            return np.array(
                [np.nan if row[name] is None else row[name] for row in selected], dtype=np.float64
            )
        except (ValueError, TypeError):
            for row in selected:
                stored_number(row[name], f"{name} of combination {row['id']}")
            raise

    def objects(name: str) -> Any:
        column = np.empty(len(selected), dtype=object)
        column[:] = [row[name] for row in selected]
        return column

    pgd_m = floats("pgd_m")
    if not doubtful_pgd:
        for number, row in enumerate(selected):
            flags = stored_json(row["flags"], list, f"flags of motion {row['motion_id']}")
            if not PGD_IN_DOUBT.isdisjoint(flags):
                pgd_m[number] = np.nan
    numbers = (
        "p2", "yield_g", "search_limit", "kr_over_pga", "upper", "kr", "y_m_s",
        *(_OF_TABLE - {"pgd_m"}),
    )  # fmt: skip
    object_names = ("event_id", "polarity", "status", "natural_key", "block", "numerics_version")
    return CombinationTable(
        combination_id=np.array([row["id"] for row in selected], dtype=np.int64),
        motion_id=np.array([row["motion_id"] for row in selected], dtype=np.int64),
        event_guessed=np.array([row["guessed"] for row in selected], dtype=np.bool_),
        pgd_m=pgd_m,
        measures={_measure_of(name): floats(name) for name in _MEASURES if name not in _OF_TABLE},
        **{name: floats(name) for name in numbers},
        **{name: objects(name) for name in object_names},
    )


def _measure_of(column: str) -> str:
    """Return the measure in a column: ``sa(0.3)`` for ``sa03_g``, else of the same name."""
    period_s = MEASURES[column].period_s
    return column if period_s is None else spectral_name(period_s)


def recordings_of_motions(connection: Connection) -> dict[int, int]:
    """Return the recording of each motion, which is the site in an earthquake."""
    rows = connection.execute(select(motion.c.id, motion.c.recording_id))
    return {int(row.id): int(row.recording_id) for row in rows}


@dataclass(frozen=True, eq=False)
class OutcomeGrid:
    """Outcome grid of a kind, shape (n, m): combination by index in the grid.

    Args:
        k_over_pga: strength over PGA; NaN where a block is not stored.
        outcome: 1 where the block fails, 0 where it does not, NaN where that is not known: not
            stored, undetermined, or outside the model.
        theta_n: peak rotation over the critical angle; NaN where it fails.
        displacement_m: displacement down a level plane [m]; NaN for blocks that do not slide.
        sensitive: 1 where another outcome follows from the motion times 1 ± 1e-6, 0 where not, NaN
            of kinds that store it of no block.
    """

    k_over_pga: NDArray[np.float64]
    outcome: NDArray[np.float64]
    theta_n: NDArray[np.float64]
    displacement_m: NDArray[np.float64]
    sensitive: NDArray[np.float64]


def motions_on_structures(connection: Connection, kind: str) -> int:
    """Return the number of motions recorded on structures among a kind's combinations."""
    query = (
        select(func.count(combination.c.motion_id.distinct()))
        .join(motion, motion.c.id == combination.c.motion_id)
        .where(combination.c.kind == kind, _ON_STRUCTURE)
    )
    return int(connection.scalar(query) or 0)


def outcome_grid(connection: Connection, combination_id: ArrayLike) -> OutcomeGrid:
    """Return the outcomes of the grid blocks of combinations of one kind.

    Args:
        combination_id: row ids, such as ``CombinationTable.combination_id``, shape (n,).

    Returns:
        Arrays of shape (n, m), m being the greatest number in the grid that is stored plus one.
    """
    ids = np.atleast_1d(np.asarray(combination_id, dtype=np.int64))
    column = simulation.c
    rows: list[Any] = []
    if ids.size:
        fails = case((column.outcome == "toppled", 1.0), (column.outcome == "stable", 0.0))
        query = select(
            column.combination_id,
            column.grid,
            column.kr_over_pga,
            fails,
            column.theta_n,
            column.displacement_m,
            column.sensitive,
        ).where(
            column.combination_id.between(int(ids.min()), int(ids.max())),
            column.grid.is_not(None),
        )
        rows = list(connection.execute(query))
    values = np.array([tuple(row) for row in rows], dtype=np.float64).reshape(-1, 7)
    owner, number = values[:, 0].astype(np.int64), values[:, 1].astype(np.int64)
    grid = np.full((5, ids.size, int(number.max(initial=-1)) + 1), np.nan)
    order = np.argsort(ids)
    at = np.searchsorted(ids, owner, sorter=order)
    at = order[np.minimum(at, ids.size - 1)]
    mine = ids[at] == owner
    grid[:, at[mine], number[mine]] = values[mine, 2:].T
    return OutcomeGrid(*grid)


def database_info(connection: Connection) -> DatabaseInfo:
    """Return the counts of a database, and its default model for toppling."""
    by_status = select(combination.c.status, func.count().label("number")).group_by(
        combination.c.status
    )
    versions = select(combination.c.numerics_version).distinct()
    try:
        default_model = load_model(connection).name
    except (DatabaseError, UnknownModelError):  # none, or one that is damaged
        default_model = None
    return DatabaseInfo(
        revision=stored_revision(connection) or "",
        dialect=connection.dialect.name,
        rows={
            name: int(connection.scalar(select(func.count()).select_from(table)) or 0)
            for name, table in sorted(metadata.tables.items())
        },
        combinations_by_status={
            row.status: row.number for row in connection.execute(by_status.order_by("status"))
        },
        numerics_versions=tuple(sorted(connection.scalars(versions))),
        default_model=default_model,
        last_sound=last_sound(connection),
        metadata={
            column.name: int(connection.scalar(select(func.count(column))) or 0)
            for column in _METADATA
        },
    )


def suite_counts(connection: Connection) -> SuiteCounts:
    """Return the contents of every suite and kind, by name.

    A motion that is in several suites counts in each, so that columns need not add up to the
    numbers of rows.

    References:
        Gibson's dissertation, Table 4.2.
    """
    name = suite_table.c.name
    motions = dict.fromkeys(connection.scalars(select(name)), 0)
    in_suite = (
        select(name, func.count())
        .select_from(motion.outerjoin(suite_motion).outerjoin(suite_table))
        .where(motion.c.is_vertical.is_(False))
        .group_by(name)
    )
    motions.update((row[0], row[1]) for row in connection.execute(in_suite))

    def number(condition: ColumnElement[bool]) -> ColumnElement[int]:
        return func.sum(case((condition, 1), else_=0))

    searched = (
        select(
            name,
            combination.c.kind,
            func.count(),
            number(combination.c.status == "found"),
            number(combination.c.status == "below_limit"),
            number(combination.c.vertical_motion_id.is_not(None)),
        )
        .select_from(
            combination.outerjoin(
                suite_motion, suite_motion.c.motion_id == combination.c.motion_id
            ).outerjoin(suite_table)
        )
        .group_by(name, combination.c.kind)
    )
    counts = [
        SuiteCount(row[0], row[1], motions.get(row[0], 0), *map(int, row[2:]))
        for row in connection.execute(searched)
    ]
    without = motions.keys() - {count.suite for count in counts}
    counts += [SuiteCount(suite, None, motions[suite], 0, 0, 0, 0) for suite in without]
    counts.sort(key=lambda c: (c.suite is None, c.suite or "", c.kind or ""))
    return SuiteCounts(tuple(counts))
