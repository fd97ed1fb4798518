"""Spectra of a campaign: every motion, both polarities, computed where they are missing."""

from __future__ import annotations

from pathlib import Path

from rbfrag.campaign.add_motions import add_motions
from rbfrag.campaign.spectra import store_spectra
from rbfrag.db.content import content_digest
from rbfrag.db.engine import opened_database
from rbfrag.db.motion_store import load_motion
from rbfrag.db.spectrum_store import spectrum_values
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from tests.synthetic import write_suite


def test_values_are_those_of_the_motions(tmp_path: Path) -> None:
    database = tmp_path / "a.db"
    add_motions([write_suite(tmp_path / "records", 2)], db=database)
    with opened_database(database) as engine:
        assert store_spectra(engine, [1, 2], [3.0, 0.5]) == 8
        with engine.connect() as connection:
            stored = spectrum_values(connection)
            for (motion_id, polarity, p2), x in stored.items():
                motion = load_motion(connection, motion_id)
                assert x == toppling_spectrum(motion, p2, polarity)  # type: ignore[call-overload]
    assert len(stored) == 8


def test_order_and_interruption_do_not_matter(tmp_path: Path) -> None:
    digests = []
    for name in ("a.db", "b.db"):
        database = tmp_path / name
        add_motions([write_suite(tmp_path / "records", 3)], db=database)
        with opened_database(database) as engine:
            if name == "b.db":
                assert store_spectra(engine, [3], [0.5]) == 2
                assert store_spectra(engine, [3, 2, 1], [0.5, 3.0]) == 10
            else:
                assert store_spectra(engine, [1, 2, 3], [3.0, 0.5]) == 12
                assert store_spectra(engine, [1, 2, 3], [3.0, 0.5]) == 0
            with engine.connect() as connection:
                digests.append(content_digest(connection))
    assert digests[0] == digests[1]
