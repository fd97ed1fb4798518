"""The page of the shipped reference tells of the file that is shipped."""

from __future__ import annotations

import hashlib
from pathlib import Path

from benchmarks.database_content import content_digest
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE

PAGE = Path(__file__).parents[2] / "docs" / "evidence" / "reference-data.md"


def test_identity_of_the_reference() -> None:
    page = PAGE.read_text(encoding="utf-8")
    content = REFERENCE.read_bytes()
    assert f"`{hashlib.sha256(content).hexdigest()}`" in page
    assert f"| size | {len(content):,} bytes |" in page
    with opened_database(REFERENCE, read_only=True) as engine, engine.connect() as connection:
        assert f"`{content_digest(connection)}`" in page
