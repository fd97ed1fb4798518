"""Blocks of a grid, kinds without names in the constraints, a digest in each row.

Revision: 0004
"""

from __future__ import annotations

import json
from collections.abc import Mapping

import sqlalchemy as sa
from alembic import op

from rbfrag.db.keys import canonical_json, key_of_row
from rbfrag.migrations.tables import execute_many, fill_digests, rebuild_table, reflected

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

_TABLES = (
    "campaign", "combination", "earthquake", "fragility_model", "motion", "outcome_interval",
    "recording", "response", "simulation", "suite", "suite_motion", "toppling_spectrum",
)  # fmt: skip
_KIND = "kind IN ('toppling', 'sliding', 'slumping', 'confined_toppling')"
_STATUS = "status IN ('found', 'below_limit', 'no_motion', 'outside_model')"
_AFTER: Mapping[str, Mapping[str, str]] = {
    "combination": {
        "kind": "kind <> ''",
        "status": _STATUS.replace(")", ", 'not_searched')"),
        "ranges": "p2 > 0 AND search_limit > 0 AND n_runs >= 0 AND y_m_s > 0",
        "block": "p2 IS NOT NULL OR block IS NOT NULL",
        "search_limit": "status = 'not_searched' OR search_limit IS NOT NULL",
        "found_has_value": (
            "status <> 'found' OR (kr_over_pga > 0 AND kr > 0 AND kr_over_pga IS NOT NULL "
            "AND kr IS NOT NULL)"
        ),
    },
    "response": {"kind": "kind <> ''"},
    "fragility_model": {"kind": "kind <> ''"},
    "simulation": {"grid": "grid >= 0"},
}
_BEFORE: Mapping[str, Mapping[str, str]] = {
    "combination": {
        "kind": _KIND,
        "status": _STATUS,
        "ranges": "p2 > 0 AND search_limit > 0 AND n_runs >= 0",
        "block_of_kind": "(kind = 'toppling') = (block IS NULL)",
        "p2_of_kind": "p2 IS NOT NULL OR kind = 'sliding'",
        "found_has_value": (
            "status <> 'found' OR (kr_over_pga > 0 AND kr > 0 AND kr_over_pga IS NOT NULL "
            "AND kr IS NOT NULL AND (kind = 'sliding' OR (y_m_s > 0 AND y_m_s IS NOT NULL)))"
        ),
    },
    "response": {"kind": _KIND},
    "fragility_model": {"kind": _KIND},
}
_STRENGTHS_OF_SLIDING = 23


def upgrade() -> None:
    connection = op.get_bind()
    op.add_column("simulation", sa.Column("grid", sa.Integer(), nullable=True))
    _take_maps_out_of_keys(connection)
    _number_curves_of_sliding(connection)
    for name in _TABLES:
        op.add_column(name, sa.Column("digest", sa.BigInteger(), nullable=True))
        fill_digests(connection, name)
        nullable = {"digest": False}
        if name == "combination":
            nullable |= {"reentrant": True, "search_limit": True}
        _change(name, nullable, _BEFORE.get(name, {}), _AFTER.get(name, {}))


def downgrade() -> None:
    # the schema before has no words for other kinds, nor for combinations without a search
    others = (
        f"status = 'not_searched' OR NOT {_KIND} OR (kind = 'toppling') <> (block IS NULL) "
        "OR (p2 IS NULL AND kind <> 'sliding') "
        "OR (status = 'found' AND y_m_s IS NULL AND kind <> 'sliding')"
    )
    for table in ("simulation", "outcome_interval"):
        op.execute(
            f"DELETE FROM {table} WHERE combination_id IN "
            f"(SELECT id FROM combination WHERE {others})"
        )
    op.execute(f"DELETE FROM combination WHERE {others}")
    op.execute("UPDATE combination SET reentrant = (1 = 0) WHERE reentrant IS NULL")
    for table in ("response", "fragility_model"):
        op.execute(f"DELETE FROM {table} WHERE NOT {_KIND}")
    for name in _TABLES:
        nullable = {"reentrant": False, "search_limit": False} if name == "combination" else {}
        left_out = ("digest", "grid") if name == "simulation" else ("digest",)
        _change(name, nullable, _AFTER.get(name, {}), _BEFORE.get(name, {}), left_out)


def _take_maps_out_of_keys(connection: sa.Connection) -> None:
    """Key combinations without how their map was made; of two that differ in it, keep the finer."""
    combination, motion = reflected(connection, "combination"), reflected(connection, "motion")
    vertical = motion.alias("vertical")
    query = sa.select(
        combination,
        motion.c.samples_sha256,
        motion.c.dt_s,
        vertical.c.samples_sha256.label("vertical_sha256"),
    ).select_from(
        combination.join(motion, motion.c.id == combination.c.motion_id).outerjoin(
            vertical, vertical.c.id == combination.c.vertical_motion_id
        )
    )
    best: dict[str, tuple[tuple[object, ...], int, str]] = {}
    superseded: list[int] = []
    for row in connection.execute(query.order_by(combination.c.id)).mappings():
        settings = json.loads(row["settings"])
        extent, depth = settings.pop("map", None), settings.pop("map_depth", None)
        text = canonical_json(settings)
        key = key_of_row(
            {**row, "settings": text}, row["samples_sha256"], row["dt_s"], row["vertical_sha256"]
        )
        order = (extent != "full", extent is None, depth or 0.0, row["id"])
        other = best.get(key)
        if other is not None:
            superseded.append(max((order, row["id"]), other[:2])[1])
        if other is None or order < other[0]:
            best[key] = (order, row["id"], text)
    for table in ("simulation", "outcome_interval"):
        execute_many(
            connection, f"DELETE FROM {table} WHERE combination_id = :id", {"id": superseded}
        )
    execute_many(connection, "DELETE FROM combination WHERE id = :id", {"id": superseded})
    execute_many(
        connection,
        "UPDATE combination SET natural_key = :key, settings = :settings WHERE id = :id",
        {
            "key": list(best),
            "settings": [settings for _, _, settings in best.values()],
            "id": [row_id for _, row_id, _ in best.values()],
        },
    )


def _number_curves_of_sliding(connection: sa.Connection) -> None:
    """Number the strengths of whole displacement curves: they are the grid of that kind."""
    rows = connection.execute(
        sa.text(
            "SELECT combination_id, kr_over_pga FROM simulation WHERE combination_id IN "
            "(SELECT id FROM combination WHERE kind = 'sliding') "
            "ORDER BY combination_id, kr_over_pga"
        )
    ).all()
    curves: dict[int, list[float]] = {}
    for combination_id, strength in rows:
        curves.setdefault(combination_id, []).append(strength)
    numbers = [
        (number, combination_id, strength)
        for combination_id, strengths in curves.items()
        if len(strengths) == _STRENGTHS_OF_SLIDING
        for number, strength in enumerate(strengths)
    ]
    execute_many(
        connection,
        "UPDATE simulation SET grid = :grid WHERE combination_id = :id AND kr_over_pga = :strength",
        dict(zip(("grid", "id", "strength"), map(list, zip(*numbers, strict=True)), strict=False)),
    )


def _change(
    name: str,
    nullable: Mapping[str, bool],
    checks_before: Mapping[str, str],
    checks_after: Mapping[str, str],
    left_out: tuple[str, ...] = (),
) -> None:
    """Change which columns a table has or may leave empty, and its named checks."""
    if op.get_context().dialect.name == "sqlite":
        rebuild_table(name, nullable, tuple(checks_before), checks_after, left_out=left_out)
        return
    for each in checks_before:
        op.drop_constraint(op.f(f"ck_{name}_{each}"), name, type_="check")
    if "grid" in left_out:
        op.drop_constraint(op.f("ck_simulation_grid"), name, type_="check", if_exists=True)
    for column in left_out:
        op.drop_column(name, column)
    for column, may_be in nullable.items():
        op.alter_column(name, column, nullable=may_be)
    for each, rule in checks_after.items():
        op.create_check_constraint(op.f(f"ck_{name}_{each}"), name, rule)
