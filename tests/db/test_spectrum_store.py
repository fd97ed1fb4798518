"""Stored toppling spectra: written once, read back bit for bit, part of what a database says."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from sqlalchemy import Engine

from benchmarks.database_content import content_digest
from rbfrag.db.campaigns import spectrum_values, store_spectrum
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.motions.ground_motion import GroundMotion

QUAKE = EarthquakeInfo("chi-chi-1999", magnitude=7.62, guessed=False)
P2 = (10.0, 0.1 + 0.2, 3.0)
X = (1.0 / 3.0, 0.5, 0.0)


@pytest.fixture
def motion_id(engine: Engine, make_motion: Callable[..., GroundMotion]) -> int:
    with engine.begin() as connection:
        return add_motion(connection, make_motion(1), earthquake=QUAKE, is_vertical=False)[0]


def test_round_trip(engine: Engine, motion_id: int) -> None:
    with engine.begin() as connection:
        store_spectrum(connection, motion_id, polarity="reverse", p2=P2, x_m_s=X)
    with engine.connect() as connection:
        assert spectrum_values(connection) == {
            (motion_id, "reverse", p2): x for p2, x in zip(P2, X, strict=True)
        }
        assert spectrum_values(connection, p2=[3.0, 10.0]) == {
            (motion_id, "reverse", 3.0): 0.0,
            (motion_id, "reverse", 10.0): 1.0 / 3.0,
        }


def test_what_is_there_stays(engine: Engine, motion_id: int) -> None:
    with engine.begin() as connection:
        store_spectrum(connection, motion_id, polarity="forward", p2=[3.0], x_m_s=[0.5])
        more = np.array([3.0, 1.0])
        store_spectrum(
            connection, motion_id, polarity="forward", p2=more, x_m_s=np.array([9.0, 0.25])
        )
        assert spectrum_values(connection) == {
            (motion_id, "forward", 3.0): 0.5,
            (motion_id, "forward", 1.0): 0.25,
        }


def test_versions_do_not_mix(engine: Engine, motion_id: int) -> None:
    with engine.begin() as connection:
        for version, x in (("old", 0.5), ("new", 0.6)):
            store_spectrum(
                connection,
                motion_id,
                polarity="forward",
                p2=[3.0],
                x_m_s=[x],
                numerics_version=version,
            )
        values = spectrum_values(connection, numerics_version="new")
        assert values == {(motion_id, "forward", 3.0): 0.6}


def test_is_part_of_the_content(engine: Engine, motion_id: int) -> None:
    digests = []
    for x in (None, 0.5):
        with engine.begin() as connection:
            if x is not None:
                store_spectrum(connection, motion_id, polarity="forward", p2=[3.0], x_m_s=[x])
            digests.append(content_digest(connection))
    assert digests[0] != digests[1]
