"""The toppling spectra that belong to a campaign: computed where they are missing, and stored."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sqlalchemy import Engine

from rbfrag.db.motion_store import load_motion
from rbfrag.db.spectrum_store import spectrum_values, store_spectrum
from rbfrag.motions.polarity import POLARITIES
from rbfrag.motions.toppling_spectrum import toppling_spectrum


def store_spectra(engine: Engine, motion_ids: Iterable[int], p2: Sequence[float]) -> int:
    """Compute and store X(p) of motions, both polarities, where it is not stored yet.

    One transaction a motion. The order of calls does not matter to what is stored.

    Args:
        engine: the database.
        motion_ids: horizontal motions.
        p2: frequency parameters [1/s²].

    Returns:
        How many values were new.
    """
    with engine.connect() as connection:
        known = spectrum_values(connection, p2=p2)
    made = 0
    for motion_id in motion_ids:
        missing = {
            polarity: [each for each in map(float, p2) if (motion_id, polarity, each) not in known]
            for polarity in POLARITIES
        }
        if not any(missing.values()):
            continue
        with engine.begin() as connection:
            motion = load_motion(connection, motion_id)
            for polarity, sizes in missing.items():
                made += store_spectrum(
                    connection,
                    motion_id,
                    polarity=polarity,
                    p2=sizes,
                    x_m_s=toppling_spectrum(motion, sizes, polarity),
                )
    return made
