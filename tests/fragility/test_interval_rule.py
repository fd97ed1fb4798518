"""Knowing less of a motion never narrows the interval: the shipped models, any fitted motion."""

from __future__ import annotations

import math
import sqlite3
from functools import cache
from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from rbfrag.db.location import REFERENCE
from rbfrag.fragility.predict import predict
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


@cache
def fitted_motions() -> list[tuple[float, float, float]]:
    """PGV [m/s], PGA [g] and Tm [s] of the horizontal motions that were fitted."""
    connection = sqlite3.connect(f"file:{REFERENCE}?mode=ro&immutable=1", uri=True)
    rows = connection.execute(
        "SELECT DISTINCT pgv_m_s, pga_g, tm_s FROM motion JOIN combination "
        "ON motion.id = combination.motion_id WHERE pgv_m_s > 0 AND pga_g > 0 AND tm_s > 0"
    ).fetchall()
    connection.close()
    return rows


@settings(max_examples=600, deadline=None)
@given(
    number=st.integers(0, 10_000),
    ln_p2=st.floats(math.log(0.1), math.log(30.0)),
    ln_share=st.floats(math.log(0.02), math.log(2.0)),
)
def test_no_interval_is_narrower_than_one_that_knows_more(
    number: int, ln_p2: float, ln_share: float
) -> None:
    motions = fitted_motions()
    assert len(motions) > 200
    pgv, pga, tm = motions[number % len(motions)]
    p2 = math.exp(ln_p2)
    kr = math.exp(ln_share) * pgv * math.sqrt(p2) / STANDARD_GRAVITY_M_S2
    chains: tuple[tuple[dict[str, float], ...], ...] = (
        ({"pgv_m_s": pgv}, {"pgv_m_s": pgv, "pga_g": pga},
         {"pgv_m_s": pgv, "pga_g": pga, "tm_s": tm}),
        ({"pga_g": pga, "tm_s": tm}, {"pgv_m_s": pgv, "pga_g": pga, "tm_s": tm}),
    )  # fmt: skip
    for chain in chains:
        answers = [predict(p2, kr, db=REFERENCE, **known) for known in chain]
        for less, more in pairwise(answers):
            assert less.ci_high - less.ci_low >= more.ci_high - more.ci_low - 1e-12
