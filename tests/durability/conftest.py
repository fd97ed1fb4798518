"""A small campaign on made-up motions, and what it leaves when nothing happens to it."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.durability import digest, make_database
from rbfrag.campaign.simulate import simulate

P2 = (10.0, 1.0)
MOTIONS = 6


@pytest.fixture(scope="session")
def untouched(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The content of a database of motions."""
    place = tmp_path_factory.mktemp("untouched") / "a.db"
    make_database(str(place), MOTIONS)
    return place.read_bytes()


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory, untouched: bytes) -> str:
    """The digest of the same database after its campaign."""
    place = tmp_path_factory.mktemp("undisturbed") / "a.db"
    place.write_bytes(untouched)
    simulate(place, p2=P2, jobs=1)
    return digest(str(place))


@pytest.fixture
def database(tmp_path: Path, untouched: bytes) -> Path:
    """A database of motions."""
    place = tmp_path / "a.db"
    place.write_bytes(untouched)
    return place
