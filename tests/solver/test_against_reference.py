"""Real records: rbfrag against the independent integrator."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import Outcome, Polarity
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import respond
from tests.solver.reference import integrate

HORIZONTALS = (
    "peer_at2_opensees/CHY028-N.AT2",
    "peer_at2_opensees/CHY041-N.AT2",
    "peer_at2_opensees/NST-N.AT2",
    "peer_at2_opensees/ALH360.AT2",
    "peer_at2_opensees/A-BEN360.AT2",
    "peer_at2_opensees/ANLCSOU.AT2",
    "peer_at2_opensees/A-LAD180.AT2",
    "nga_at2_misc/RSN763_LOMAP_GIL067.AT2",
    "nga_at2_misc/RSN30_PARKF_C05085.AT2",
    "nga_at2_misc/RSN31_PARKF_C08050.AT2",
    "nga_at2_misc/RSN33_PARKF_TMB205.AT2",
    "nga_at2_misc/RSN77_SFERN_PUL164.AT2",
    "nga_at2_misc/RSN95_MANAGUA_A-ESO090.AT2",
    "nga_at2_misc/RSN8884_14383980_13873090.AT2",
)
FOLDERS = ("slammer_csv", "geonet_v2a")
WITH_VERTICAL = (
    ("nga_at2_misc/Rinaldi228.AT2", "nga_at2_misc/RinaldiUP.AT2"),
    ("nga_at2_misc/Rinaldi318.AT2", "nga_at2_misc/RinaldiUP.AT2"),
)

ABOVE = (1.01, 1.1, 1.5, 3.0, 6.0, 12.0)
BELOW = (0.98, 0.9, 0.6, 0.3, 0.1)
"""Strengths over critical. The first whose motion is short enough is taken."""

MOST_INTERVALS = {30.0: 200, 3.0: 350, 0.3: 900}
"""The reference takes about a millisecond for each interval in which the block moves."""

GREATEST_DEVIATION = 1e-7
"""Agreement asked for; what is seen is some 1e-12."""


def motions(records_dir: Path) -> list[tuple[GroundMotion, GroundMotion | None]]:
    values: list[tuple[GroundMotion, GroundMotion | None]] = [
        (read_motions(records_dir / file)[0], None) for file in HORIZONTALS
    ]
    for file, up in WITH_VERTICAL:
        values.append((read_motions(records_dir / file)[0], read_motions(records_dir / up)[0]))
    for folder in FOLDERS:
        for file in sorted(p for p in (records_dir / folder).iterdir() if p.is_file())[:5]:
            horizontal = [m for m in read_motions(file) if m.is_vertical is not True]
            values.append((horizontal[0], None))
    return values


def compare(
    motion: GroundMotion,
    vertical: GroundMotion | None,
    p2: float,
    kr: float,
    polarity: Polarity,
) -> tuple[str, float]:
    """Return the outcome both agree on and the relative deviation of the peak."""
    run = respond(motion, vertical=vertical, p2=p2, kr=kr, polarity=polarity)
    excited = excitation(motion, vertical, polarity)
    truth = integrate(excited.time_s, excited.k_h, excited.w - 1.0, p2=p2, kr=kr)
    assert run.outcome == truth.outcome, (motion.source_file, p2, kr)
    if run.outcome is not Outcome.STABLE:
        assert run.peak_theta_rad is None
        return run.outcome, 0.0
    assert run.peak_theta_rad is not None
    assert truth.peak_rad is not None
    assert truth.peak_rad > 0.0
    deviation = abs(run.peak_theta_rad - truth.peak_rad)
    # DOP853 itself is good to some 1e-12 of the peak
    assert deviation <= run.error_estimate + 2e-11 * truth.peak_rad, (motion.source_file, p2, kr)
    return run.outcome, deviation / truth.peak_rad


def test_same_outcome_and_peak_on_real_records(records_dir: Path) -> None:
    suite = motions(records_dir)
    assert len(suite) >= 20
    outcomes: Counter[tuple[float, str]] = Counter()
    deviations = []
    for number, (motion, vertical) in enumerate(suite):
        polarity: Polarity = "forward" if number % 2 == 0 else "reverse"
        for p2 in (30.0, 3.0, 0.3):
            result = critical(
                motion, p2=p2, vertical=vertical, polarity=polarity, search_limit=1e-3
            )
            # the vertical of a record may throw the block: then there is nothing to compare
            if result.kr is None:
                continue
            for factors in (ABOVE, BELOW):
                for factor in factors:
                    kr = factor * result.kr
                    run = respond(motion, vertical=vertical, p2=p2, kr=kr, polarity=polarity)
                    if 0 < run.samples_moved <= MOST_INTERVALS[p2]:
                        break
                else:
                    continue
                outcome, deviation = compare(motion, vertical, p2, kr, polarity)
                outcomes[p2, outcome] += 1
                deviations.append(deviation)
    worst = max(deviations)
    assert worst < GREATEST_DEVIATION
    for p2 in (30.0, 3.0, 0.3):
        assert outcomes[p2, "toppled"] >= 6
        assert outcomes[p2, "stable"] >= 6


@pytest.mark.parametrize("exponent", [-3, -6, -9])
def test_outcome_close_to_critical(records_dir: Path, exponent: int) -> None:
    for file in HORIZONTALS[:2] + HORIZONTALS[8:10]:
        motion = read_motions(records_dir / file)[0]
        result = critical(motion, p2=30.0)
        if result.kr is None or not result.certified:
            continue
        for side in (-1.0, 1.0):
            kr = result.kr * (1.0 + side * 10.0**exponent)
            outcome, deviation = compare(motion, None, 30.0, kr, "forward")
            assert outcome == ("toppled" if side < 0.0 else "stable")
            assert deviation < GREATEST_DEVIATION


def test_vertical_motion_changes_the_answer(records_dir: Path) -> None:
    # so that a solver which ignores the vertical cannot pass the comparison above
    for file, up in WITH_VERTICAL:
        motion, vertical = (read_motions(records_dir / f)[0] for f in (file, up))
        plain = critical(motion, p2=3.0).kr_over_pga
        shaken = critical(motion, p2=3.0, vertical=vertical).kr_over_pga
        assert plain is not None
        assert shaken is not None
        assert not np.isclose(plain, shaken, rtol=1e-4)
