"""Yield acceleration of a combination's block, used by fits of scaled records.

Revision: 0008
"""

from __future__ import annotations

import json

from alembic import op
from sqlalchemy import Connection, Double, MetaData, Table, select, text

from rbfrag.db.insert import renew_digests
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.mechanism import shaken_mechanism
from rbfrag.solver.models import model_of_kind

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    connection = op.get_bind()
    before = Table("combination", MetaData(), autoload_with=connection)
    number = Double().compile(dialect=connection.dialect)
    op.execute(
        f"ALTER TABLE combination ADD COLUMN yield_g {number} "
        "CONSTRAINT ck_combination_yield_g CHECK (yield_g > 0)"
    )
    _fill(connection, before)
    after = Table("combination", MetaData(), autoload_with=connection)
    renew_digests(connection, after, before)


def _fill(connection: Connection, combination: Table) -> None:
    """Compute the yield acceleration of each block with a geometry; others have none."""
    column = combination.c
    query = select(column.kind, column.block).where(column.block.like('%"s1_m"%')).distinct()
    values = [
        {"of": kind, "stored": block, "yield_g": _yield_g(kind, **json.loads(block))}
        for kind, block in connection.execute(query)
    ]
    if values:
        connection.execute(
            text("UPDATE combination SET yield_g = :yield_g WHERE kind = :of AND block = :stored"),
            values,
        )


def _yield_g(
    kind: str, s1_m: float, s2_m: float, gamma_deg: float, beta_deg: float, phi_deg: float
) -> float:
    block = Block.from_fractures(s1_m, s2_m, gamma_deg)
    return shaken_mechanism(model_of_kind(kind), block, beta_deg=beta_deg, phi_deg=phi_deg).yield_g
