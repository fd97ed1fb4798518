"""Spectra of a campaign: every motion, both polarities, computed where they are missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sqlalchemy import delete

from rbfrag.campaign.add_motions import add_motions
from rbfrag.campaign.plan import missing_sizes
from rbfrag.campaign.simulate import simulate
from rbfrag.db.campaigns import spectrum_values
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion
from rbfrag.db.schema import toppling_spectrum as table
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from tests.synthetic import write_suite

Digest = Callable[[Path], str]
Copy = Callable[[Path, str], Path]


def test_values_are_those_of_the_motions(tmp_path: Path) -> None:
    database = tmp_path / "a.db"
    add_motions([write_suite(tmp_path / "records", 2)], db=database)
    simulate(database, p2=[3.0, 0.5], jobs=1)
    with opened_database(database) as engine, engine.connect() as connection:
        stored = spectrum_values(connection)
        for (motion_id, polarity, p2), x in stored.items():
            motion = load_motion(connection, motion_id)
            assert x == toppling_spectrum(motion, p2, polarity)  # type: ignore[call-overload]
    assert len(stored) == 8


def test_order_and_interruption_do_not_matter(
    tmp_path: Path, copy_of: Copy, digest_of: Digest
) -> None:
    database = tmp_path / "a.db"
    add_motions([write_suite(tmp_path / "records", 3)], db=database)
    other = copy_of(database, "b.db")
    simulate(database, p2=[3.0, 0.5], jobs=1)
    simulate(other, p2=[0.5], jobs=1)
    simulate(other, p2=[0.5, 3.0], jobs=1)
    assert digest_of(database) == digest_of(other)
    # what is lost is made again, though every search is stored
    with opened_database(other) as engine, engine.begin() as connection:
        connection.execute(delete(table).where(table.c.p2 == 0.5))
    assert digest_of(database) != digest_of(other)
    again = simulate(other, p2=[0.5, 3.0], jobs=1)
    assert (again.runs, again.resumed) == (0, again.combinations)
    assert digest_of(database) == digest_of(other)


def test_only_what_is_missing_is_asked_for() -> None:
    expected = {(1, "forward", 3.0), (1, "forward", 0.5), (1, "reverse", 3.0)}
    assert missing_sizes(expected, 1, [3.0, 0.5]) == {"reverse": (0.5,)}
    assert missing_sizes(expected, 2, [3.0]) == {"forward": (3.0,), "reverse": (3.0,)}
