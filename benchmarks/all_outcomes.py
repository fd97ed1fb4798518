"""Outcomes of the grid that a database leaves open, each block simulated for itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion
from rbfrag.fragility.fit.data import FitSource, kr_over_pga_of_grid
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.single_run import STABLE, TOPPLED
from rbfrag.solver.toppling_run import runner

KNOWN = {TOPPLED: 1.0, STABLE: 0.0}


def with_all_outcomes(source: FitSource, samples: Path) -> FitSource:
    """Return a source whose outcomes are all known, but for those closer than the error of a run.

    Blocks below the search limit are simulated too.

    Args:
        source: critical values without vertical motion and what their maps decide.
        samples: database with the samples of its motions, under the same ids.
    """
    table, failed = source.table, source.failed.copy()
    k = kr_over_pga_of_grid(table.p2, table.pgv_m_s, table.pga_g)
    kr = k * table.pga_g[:, None]
    with opened_database(samples, read_only=True) as engine, engine.connect() as connection:
        motion_id, motion = -1, None
        for i in np.argsort(table.motion_id, kind="stable"):
            if motion is None or motion_id != table.motion_id[i]:
                motion_id = int(table.motion_id[i])
                motion = load_motion(connection, motion_id)
            drive = excitation(motion, None, table.polarity[i])
            run = runner(drive, p2=float(table.p2[i]), linear=False)
            for j in np.flatnonzero(np.isnan(failed[i])):
                failed[i, j] = KNOWN.get(run(float(kr[i, j])).outcome, np.nan)
    return FitSource(table, source.xp_m_s, k, failed)
