"""Blocks under two motions, one after the other.

Revision: 0007
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

_REFERENCES = {
    "campaign_id": "campaign.id",
    "first_motion_id": "motion.id",
    "second_motion_id": "motion.id",
}
_CHECKS = {
    "natural_key": "length(natural_key) = 64",
    "pairing": "pairing IN ('station', 'drawn')",
    "polarity": "polarity IN ('forward', 'reverse')",
    "kind": "kind <> ''",
    "ranges": "yield_g > 0 AND critical_rad > 0",
    "outcome": "first_outcome <> '' AND second_outcome <> '' AND intact_outcome <> ''",
}


def upgrade() -> None:
    op.create_table(
        "shock_pair",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("natural_key", sa.Text(), nullable=False),
        *(sa.Column(name, sa.Integer(), nullable=False) for name in _REFERENCES),
        *(
            sa.Column(name, sa.Text(), nullable=False)
            for name in ("pairing", "polarity", "kind", "block")
        ),
        sa.Column("yield_g", sa.Double(), nullable=False),
        sa.Column("critical_rad", sa.Double(), nullable=True),
        sa.Column("numerics_version", sa.Text(), nullable=False),
        *(column for of in ("first", "second", "intact") for column in _end(of)),
        sa.Column("digest", sa.BigInteger(), nullable=False),
        *(
            sa.CheckConstraint(rule, name=op.f(f"ck_shock_pair_{name}"))
            for name, rule in _CHECKS.items()
        ),
        *(
            sa.ForeignKeyConstraint(
                [name],
                [to],
                name=op.f(f"fk_shock_pair_{name}"),
                ondelete="RESTRICT",
            )
            for name, to in _REFERENCES.items()
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_shock_pair")),
        sa.UniqueConstraint("natural_key", name=op.f("uq_shock_pair_natural_key")),
    )
    for name in _REFERENCES:
        op.create_index(op.f(f"ix_shock_pair_{name}"), "shock_pair", [name], unique=False)


def _end(of: str) -> list[sa.Column[object]]:
    numbers = ("displacement_m", "rotation_rad", "peak_rad")
    return [
        sa.Column(f"{of}_outcome", sa.Text(), nullable=of == "second"),
        *(sa.Column(f"{of}_{name}", sa.Double(), nullable=True) for name in numbers),
    ]


def downgrade() -> None:
    op.drop_table("shock_pair")
