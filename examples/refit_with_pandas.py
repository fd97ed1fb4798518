"""A fit of one's own from stored results, with pandas and numpy alone.

    python examples/refit_with_pandas.py DATABASE

Nothing is simulated: critical blocks of toppling, those without vertical motion, and measures come
out of the database. As an
example the critical toppling velocity is regressed on PGV and Tm, ln y = a + b ln PGV + c ln Tm,
each earthquake counting the same however many records it has.
"""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd

import rbfrag


def refit(db: str) -> tuple[np.ndarray, float, pd.DataFrame]:
    """Return a, b and c, the scatter of ln y, and the rows that were used."""
    motion = rbfrag.read_table("motion", db=db).set_index("id")
    recording = rbfrag.read_table("recording", db=db).set_index("id")
    rows = rbfrag.read_table("combination", db=db).query("kind == 'toppling' and status == 'found'")
    rows = rows[rows["vertical_motion_id"].isna()]
    rows = rows.join(motion[["recording_id", "pgv_m_s", "tm_s"]], on="motion_id")
    rows = rows.join(recording["earthquake_id"], on="recording_id").dropna(subset=["tm_s"])
    weight = 1.0 / rows.groupby("earthquake_id")["y_m_s"].transform("size")
    x = np.column_stack([np.ones(len(rows)), np.log(rows["pgv_m_s"]), np.log(rows["tm_s"])])
    y = np.log(rows["y_m_s"].to_numpy())
    root = np.sqrt(weight.to_numpy())
    coefficients = np.linalg.lstsq(x * root[:, None], y * root, rcond=None)[0]
    residual = y - x @ coefficients
    scatter = float(np.sqrt(np.average(residual**2, weights=weight)))
    return coefficients, scatter, rows.assign(residual=residual)


def main() -> None:
    """Print coefficients, scatter, and the scatter of each earthquake's mean."""
    (a, b, c), scatter, rows = refit(sys.argv[1])
    if not np.isfinite([a, b, c, scatter]).all():
        sys.exit("no fit: a number is missing among the critical blocks or their motions")
    print(f"ln y = {a:.3f} + {b:.3f} ln PGV + {c:.3f} ln Tm, scatter {scatter:.3f}")
    between = rows.groupby("earthquake_id")["residual"].mean()
    print(f"{len(rows)} critical blocks of {len(between)} earthquakes; "
          f"scatter of their means {between.std():.3f}")  # fmt: skip


if __name__ == "__main__":
    main()
