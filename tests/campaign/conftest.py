"""Databases of made-up recordings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.database_content import content_digest
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.motions.ground_motion import GroundMotion
from tests.synthetic import shaking


@pytest.fixture
def three_component_database(tmp_path: Path) -> Path:
    """Two recordings with two horizontals each; the second one's vertical is shorter.

    A fifth horizontal, of a third recording, has no vertical.
    """
    place = tmp_path / "three.db"
    quake = EarthquakeInfo("somewhere", guessed=False)
    with opened_database(place, create=True) as engine, engine.begin() as connection:

        def add(seed: int, recording: str, component: str, npts: int = 600) -> None:
            up = component == "UP"
            samples = shaking(seed, npts) * (0.4 if up else 1.0)
            motion = GroundMotion(samples, 0.02, source_file=f"{recording}.{component}")
            add_motion(
                connection,
                motion,
                earthquake=quake,
                is_vertical=up,
                recording=recording,
                station=recording,
                component=component,
                suite=None if up else "horizontals",
            )

        for recording, seed in (("a", 0), ("b", 3)):
            add(seed, recording, "000")
            add(seed + 1, recording, "090")
            add(seed + 2, recording, "UP", npts=600 if recording == "a" else 450)
        add(9, "c", "000")
    return place


@pytest.fixture
def copy_of() -> Callable[[Path, str], Path]:
    """Copy a closed database under another name beside it."""

    def copy(database: Path, name: str) -> Path:
        other = database.with_name(name)
        other.write_bytes(database.read_bytes())
        return other

    return copy


@pytest.fixture
def digest_of() -> Callable[[Path], str]:
    """Return what makes databases equal."""

    def digest(database: Path) -> str:
        with opened_database(database, read_only=True) as engine, engine.connect() as connection:
            return content_digest(connection)

    return digest
