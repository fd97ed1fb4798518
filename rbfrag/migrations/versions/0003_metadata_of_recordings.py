"""Metadata of earthquakes and recordings: mechanism, depth, distances, Vs30, place.

Revision: 0003
"""

from __future__ import annotations

from alembic import op
from sqlalchemy import Double, MetaData, Table, Text

from rbfrag.db.insert import renew_digests

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

MECHANISMS = "'unspecified', 'strike-slip', 'normal', 'reverse'"

COLUMNS = {
    "earthquake": (
        ("mechanism", Text, f"mechanism IN ({MECHANISMS})"),
        ("depth_km", Double, "depth_km >= -10 AND depth_km <= 800"),
    ),
    "recording": (
        ("network", Text, ""),
        ("lat", Double, "lat >= -90 AND lat <= 90"),
        ("lon", Double, "lon >= -180 AND lon <= 360"),
        *((name, Double, f"{name} >= 0") for name in ("rjb_km", "rrup_km", "repi_km")),
        ("vs30_m_s", Double, "vs30_m_s > 0"),
        ("attributes", Text, ""),
    ),
}


def upgrade() -> None:
    connection = op.get_bind()
    for name, columns in COLUMNS.items():
        before = Table(name, MetaData(), autoload_with=connection)
        for column, kind, condition in columns:
            sql_type = kind().compile(dialect=connection.dialect)
            check = f" CONSTRAINT ck_{name}_{column} CHECK ({condition})" if condition else ""
            op.execute(f"ALTER TABLE {name} ADD COLUMN {column} {sql_type}{check}")
        renew_digests(connection, Table(name, MetaData(), autoload_with=connection), before)
