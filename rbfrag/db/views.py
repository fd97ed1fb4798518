"""Views for people who write SQL, and the columns that conditions are over.

They are made from the present schema after each migration, so that no migration changes them.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import (
    Boolean,
    Column,
    ColumnElement,
    Connection,
    Double,
    FromClause,
    Integer,
    MetaData,
    Select,
    Table,
    case,
    literal_column,
    select,
)
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.sql.functions import FunctionElement

from rbfrag.db.schema import (
    MEASURES,
    SITE_COLUMNS,
    combination,
    earthquake,
    motion,
    recording,
    simulation,
)
from rbfrag.motions.quality import STRUCTURE


class _SettingNumber(FunctionElement[float]):
    """A number of the JSON settings of a combination; NULL where they have none of its name."""

    type = Double()
    inherit_cache = True

    def __init__(self, name: str) -> None:
        super().__init__(combination.c.settings, literal_column(f"'{name}'"))


@compiles(_SettingNumber)
def _in_sqlite(element: _SettingNumber, compiler: Any, **options: Any) -> str:
    settings, name = (compiler.process(clause, **options) for clause in element.clauses)
    return f"json_extract({settings}, '$.' || {name})"


@compiles(_SettingNumber, "postgresql")
def _in_postgresql(element: _SettingNumber, compiler: Any, **options: Any) -> str:
    settings, name = (compiler.process(clause, **options) for clause in element.clauses)
    return f"CAST(CAST({settings} AS JSON) ->> {name} AS DOUBLE PRECISION)"


Shown = tuple[Column[Any], ColumnElement[Any]]
"""A column of a view, and what it is computed from."""


def _computed(name: str, type_: Any, meaning: str, unit: str = "") -> Column[Any]:
    return Column(
        name, type_, nullable="missing" in meaning, info={"meaning": meaning, "unit": unit}
    )


def _shown(column: Column[Any], name: str = "") -> Shown:
    """Return a column of a table as a column of a view."""
    kind = Integer if column.foreign_keys else column.type
    about = Column(name or column.name, kind, nullable=column.nullable, info=column.info)
    return about, column


_ON_STRUCTURE = motion.c.flags.contains(f'"{STRUCTURE}"')

OF_MOTION: tuple[Shown, ...] = (
    *(_shown(earthquake.c[name]) for name in ("event_id", "magnitude", "mechanism", "depth_km")),
    _shown(earthquake.c.guessed, "event_guessed"),
    _shown(earthquake.c.name, "event"),
    _shown(recording.c.name, "recording"),
    *(_shown(recording.c[name]) for name in ("station", "network", *SITE_COLUMNS, "attributes")),
    *(_shown(motion.c[name]) for name in ("component", "orientation_deg", "dt_s", *MEASURES)),
    _shown(motion.c.flags),
    (
        _computed("on_structure", Boolean, "true for a sensor on a structure: fits leave it out"),
        _ON_STRUCTURE,
    ),
)
"""Columns of views that say what a motion is, without the results of campaigns."""

_LIMITS: tuple[Shown, ...] = (
    (
        _computed(
            "limit_displacement_m",
            Double,
            "displacement down a level plane that counts as failure; missing of other kinds",
            "m",
        ),
        _SettingNumber("displacement_m"),
    ),
    (
        _computed(
            "limit_rotation_deg",
            Double,
            "rotation that counts as failure; missing for failure past recovery",
            "deg",
        ),
        _SettingNumber("rotation_deg"),
    ),
)

OF_COMBINATION: tuple[Shown, ...] = (
    *(
        _shown(combination.c[name])
        for name in (
            "motion_id", "vertical_motion_id", "kind", "polarity", "p2", "block", "yield_g",
            "linear", "numerics_version",
        )
    ),
    *_LIMITS,
)  # fmt: skip

_EXCEEDS = simulation.c.displacement_m > _SettingNumber("displacement_m")
OF_BLOCK: tuple[Shown, ...] = (
    *(_shown(simulation.c[name]) for name in ("combination_id", "kr_over_pga", "grid", "outcome")),
    (
        _computed("kr", Double, "strength of the block: kr_over_pga times PGA in g"),
        simulation.c.kr_over_pga * motion.c.pga_g,
    ),
    (
        _computed(
            "failed",
            Integer,
            "1: the block topples, or slides more than limit_displacement_m; 0: it does not; "
            "missing where that is not known",
        ),
        case(
            (_EXCEEDS, 1),
            (~_EXCEEDS, 0),
            (simulation.c.outcome == "toppled", 1),
            (simulation.c.outcome == "stable", 0),
        ),
    ),
    *(_shown(simulation.c[name]) for name in ("theta_n", "displacement_m", "sensitive")),
)

views = MetaData()
"""Views for people who write SQL; nothing in rbfrag depends on them, and merges leave them out."""

VIEW_QUERIES: dict[str, Select[Any]] = {}
"""What each view selects, by name."""


def _view(name: str, meaning: str, source: FromClause, key: int, *shown: Shown) -> Table:
    """Declare a view, whose first columns are its key."""
    expressions = (expression.label(about.name) for about, expression in shown)
    VIEW_QUERIES[name] = select(*expressions).select_from(source)
    columns = (
        Column(
            about.name, about.type, primary_key=i < key, nullable=about.nullable, info=about.info
        )
        for i, (about, _) in enumerate(shown)
    )
    return Table(name, views, *columns, info={"meaning": meaning})


def create_views(connection: Connection) -> None:
    """Create the views, whose tables are those of the schema."""
    for name, query in VIEW_QUERIES.items():
        sql = query.compile(dialect=connection.dialect, compile_kwargs={"literal_binds": True})
        connection.exec_driver_sql(f"CREATE VIEW {name} AS {sql}")


def drop_views(connection: Connection) -> None:
    """Drop the views, before their tables change."""
    for name in VIEW_QUERIES:
        connection.exec_driver_sql(f"DROP VIEW IF EXISTS {name}")


_WITH_RECORDINGS = (
    combination.join(motion, motion.c.id == combination.c.motion_id)
    .join(recording)
    .join(earthquake)
)

OUTCOME = _view(
    "outcome",
    "View: one row for each simulated block and motion, with the outcome, the intensity measures "
    "and the metadata.",
    simulation.join(_WITH_RECORDINGS, simulation.c.combination_id == combination.c.id),
    2,
    *OF_BLOCK,
    *OF_COMBINATION,
    *OF_MOTION,
)

CRITICAL_VALUE = _view(
    "critical_value",
    "View: one row for each critical search, with the intensity measures and the metadata.",
    _WITH_RECORDINGS,
    1,
    _shown(combination.c.id, "combination_id"),
    *(
        _shown(combination.c[name])
        for name in (
            "status", "search_limit", "kr_over_pga", "lower", "upper", "kr", "y_m_s", "certified",
        )
    ),
    *OF_COMBINATION,
    *OF_MOTION,
)  # fmt: skip
