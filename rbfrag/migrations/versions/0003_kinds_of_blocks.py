"""Critical values and models of every kind of block: the block, displacements, the model's kind.

Revision: 0003
"""

from __future__ import annotations

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

_KIND = "kind IN ('toppling', 'sliding', 'slumping', 'confined_toppling')"
_FOUND_BEFORE = (
    "status <> 'found' OR (kr_over_pga > 0 AND kr > 0 AND y_m_s > 0 "
    "AND kr_over_pga IS NOT NULL AND kr IS NOT NULL AND y_m_s IS NOT NULL)"
)
_FOUND = (
    "status <> 'found' OR (kr_over_pga > 0 AND kr > 0 AND kr_over_pga IS NOT NULL "
    "AND kr IS NOT NULL AND (kind = 'sliding' OR (y_m_s > 0 AND y_m_s IS NOT NULL)))"
)
_OF_KIND = {
    "block_of_kind": "(kind = 'toppling') = (block IS NULL)",
    "p2_of_kind": "p2 IS NOT NULL OR kind = 'sliding'",
}
_COMBINATION = (
    "id, natural_key, campaign_id, motion_id, vertical_motion_id, polarity, kind, linear, p2, "
    "settings, numerics_version, status, search_limit, kr_over_pga, lower, upper, kr, y_m_s, "
    "certified, k_up_over_pga, undecided, island_width, kr_over_pga_resolved, reentrant, n_runs, "
    "warnings"
)
_MODEL = (
    "id, name, term, method, coefficients, covariance, domain, data_fingerprint, diagnostics, "
    "is_default, created"
)


def upgrade() -> None:
    op.add_column("simulation", sa.Column("displacement_m", sa.Double(), nullable=True))
    op.drop_index("uq_fragility_model_default", "fragility_model")
    if op.get_context().dialect.name == "sqlite":
        _rebuild_combination(with_block=True)
        _rebuild_model(with_kind=True)
    else:
        op.add_column("combination", sa.Column("block", sa.Text(), nullable=True))
        op.alter_column("combination", "p2", nullable=True)
        op.drop_constraint(op.f("ck_combination_found_has_value"), "combination", type_="check")
        for name, rule in {"found_has_value": _FOUND, **_OF_KIND}.items():
            op.create_check_constraint(op.f(f"ck_combination_{name}"), "combination", rule)
        op.add_column("fragility_model", sa.Column("kind", sa.Text(), nullable=True))
        op.execute("UPDATE fragility_model SET kind = 'toppling'")
        op.alter_column("fragility_model", "kind", nullable=False)
        op.create_check_constraint(op.f("ck_fragility_model_kind"), "fragility_model", _KIND)
    _index_default("kind")


def downgrade() -> None:
    # the schema before has no words for the other kinds
    others = "SELECT id FROM combination WHERE kind <> 'toppling'"
    for table in ("simulation", "outcome_interval"):
        op.execute(f"DELETE FROM {table} WHERE combination_id IN ({others})")
    op.execute("DELETE FROM combination WHERE kind <> 'toppling'")
    op.execute("DELETE FROM fragility_model WHERE kind <> 'toppling'")
    op.drop_column("simulation", "displacement_m")
    op.drop_index("uq_fragility_model_default", "fragility_model")
    if op.get_context().dialect.name == "sqlite":
        _rebuild_combination(with_block=False)
        _rebuild_model(with_kind=False)
    else:
        for name in ("found_has_value", *_OF_KIND):
            op.drop_constraint(op.f(f"ck_combination_{name}"), "combination", type_="check")
        op.create_check_constraint(
            op.f("ck_combination_found_has_value"), "combination", _FOUND_BEFORE
        )
        op.alter_column("combination", "p2", nullable=False)
        op.drop_column("combination", "block")
        op.drop_constraint(op.f("ck_fragility_model_kind"), "fragility_model", type_="check")
        op.drop_column("fragility_model", "kind")
    _index_default("is_default")


def _index_default(column: str) -> None:
    op.create_index(
        "uq_fragility_model_default",
        "fragility_model",
        [column],
        unique=True,
        sqlite_where=sa.text("is_default"),
        postgresql_where=sa.text("is_default"),
    )


def _rebuild_combination(*, with_block: bool) -> None:
    """Make the table anew with the block or without it, and move its rows."""
    rules = dict(_OF_KIND) if with_block else {}
    rules["found_has_value"] = _FOUND if with_block else _FOUND_BEFORE
    block = [sa.Column("block", sa.Text(), nullable=True)] if with_block else []
    op.create_table(
        "combination_rebuilt",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("natural_key", sa.Text(), nullable=False),
        sa.Column("campaign_id", sa.Integer(), nullable=False),
        sa.Column("motion_id", sa.Integer(), nullable=False),
        sa.Column("vertical_motion_id", sa.Integer(), nullable=True),
        sa.Column("polarity", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("linear", sa.Boolean(), nullable=False),
        sa.Column("p2", sa.Double(), nullable=with_block),
        *block,
        sa.Column("settings", sa.Text(), nullable=False),
        sa.Column("numerics_version", sa.Text(), nullable=False),
        sa.Column("status", sa.Text(), nullable=False),
        sa.Column("search_limit", sa.Double(), nullable=False),
        sa.Column("kr_over_pga", sa.Double(), nullable=True),
        sa.Column("lower", sa.Double(), nullable=True),
        sa.Column("upper", sa.Double(), nullable=True),
        sa.Column("kr", sa.Double(), nullable=True),
        sa.Column("y_m_s", sa.Double(), nullable=True),
        sa.Column("certified", sa.Boolean(), nullable=False),
        sa.Column("k_up_over_pga", sa.Double(), nullable=True),
        sa.Column("undecided", sa.Double(), nullable=True),
        sa.Column("island_width", sa.Double(), nullable=True),
        sa.Column("kr_over_pga_resolved", sa.Double(), nullable=True),
        sa.Column("reentrant", sa.Boolean(), nullable=False),
        sa.Column("n_runs", sa.Integer(), nullable=False),
        sa.Column("warnings", sa.Text(), nullable=False),
        *(
            sa.CheckConstraint(rule, name=op.f(f"ck_combination_{name}"))
            for name, rule in rules.items()
        ),
        sa.CheckConstraint(_KIND, name=op.f("ck_combination_kind")),
        sa.CheckConstraint(
            "polarity IN ('forward', 'reverse')", name=op.f("ck_combination_polarity")
        ),
        sa.CheckConstraint(
            "status = 'found' OR (kr_over_pga IS NULL AND kr IS NULL AND y_m_s IS NULL)",
            name=op.f("ck_combination_value_is_found"),
        ),
        sa.CheckConstraint(
            "status IN ('found', 'below_limit', 'no_motion', 'outside_model')",
            name=op.f("ck_combination_status"),
        ),
        sa.CheckConstraint("length(natural_key) = 64", name=op.f("ck_combination_natural_key")),
        sa.CheckConstraint(
            "p2 > 0 AND search_limit > 0 AND n_runs >= 0", name=op.f("ck_combination_ranges")
        ),
        *(
            sa.ForeignKeyConstraint(
                [column], [target], name=op.f(f"fk_combination_{column}"), ondelete="RESTRICT"
            )
            for column, target in (
                ("campaign_id", "campaign.id"),
                ("motion_id", "motion.id"),
                ("vertical_motion_id", "motion.id"),
            )
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_combination")),
        sa.UniqueConstraint("natural_key", name=op.f("uq_combination_natural_key")),
    )
    _move("combination", _COMBINATION)
    for column in ("campaign_id", "motion_id", "vertical_motion_id"):
        op.create_index(op.f(f"ix_combination_{column}"), "combination", [column], unique=False)


def _rebuild_model(*, with_kind: bool) -> None:
    """Make the table anew with the kind or without it, and move its rows."""
    kind: Sequence[sa.Column[str] | sa.CheckConstraint] = ()
    if with_kind:
        kind = (
            sa.Column("kind", sa.Text(), nullable=False),
            sa.CheckConstraint(_KIND, name=op.f("ck_fragility_model_kind")),
        )
    op.create_table(
        "fragility_model_rebuilt",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        *kind,
        sa.Column("term", sa.Text(), nullable=False),
        sa.Column("method", sa.Text(), nullable=False),
        sa.Column("coefficients", sa.Text(), nullable=False),
        sa.Column("covariance", sa.Text(), nullable=False),
        sa.Column("domain", sa.Text(), nullable=False),
        sa.Column("data_fingerprint", sa.Text(), nullable=False),
        sa.Column("diagnostics", sa.Text(), nullable=False),
        sa.Column("is_default", sa.Boolean(), nullable=False),
        sa.Column("created", sa.Text(), nullable=False),
        sa.CheckConstraint("name <> ''", name=op.f("ck_fragility_model_name")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_fragility_model")),
        sa.UniqueConstraint("name", name=op.f("uq_fragility_model_name")),
    )
    if with_kind:
        _move("fragility_model", f"{_MODEL}, kind", f"{_MODEL}, 'toppling'")
    else:
        _move("fragility_model", _MODEL)


def _move(table: str, columns: str, of: str | None = None) -> None:
    op.execute(f"INSERT INTO {table}_rebuilt ({columns}) SELECT {of or columns} FROM {table}")
    op.drop_table(table)
    op.rename_table(f"{table}_rebuilt", table)
