"""Time and memory of `rbfrag predict --blocks`.

    python -m benchmarks.batch_tables --folder FOLDER [--rows 10000000] [--db DATABASE]

Makes a table of random blocks and shaking as Parquet and as CSV in FOLDER (about a gigabyte for ten
million rows), answers both, and prints wall time, processor time and greatest memory.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pc
import pyarrow.parquet as pq

from benchmarks.page import ROOT


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--rows", type=int, default=10_000_000)
    parser.add_argument("--db", help="database of the model (default: the shipped reference)")
    given = parser.parse_args()
    random = np.random.default_rng(1)
    table = pa.table(
        {
            "block_id": np.arange(given.rows),
            "p2_1_s2": 10.0 ** random.uniform(-1.0, 1.4, given.rows),
            "kr": random.uniform(0.02, 0.5, given.rows),
            "pgv_m_s": random.uniform(0.01, 2.0, given.rows),
        }
    )
    pq.write_table(table, given.folder / "blocks.parquet")
    pc.write_csv(table, given.folder / "blocks.csv")
    del table
    for suffix in ("parquet", "csv"):
        code = (
            "import resource, sys; from rbfrag.cli.main import app; app(standalone_mode=False); "
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)"
        )
        command = [sys.executable, "-c", code, "predict", "--blocks", f"blocks.{suffix}", "--out",
                   f"answers.{suffix}"]  # fmt: skip
        if given.db:
            command += ["--db", str(Path(given.db).resolve())]
        before, start = os.times(), time.perf_counter()
        done = subprocess.run(
            command, cwd=given.folder, check=True, capture_output=True, text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        wall, after = time.perf_counter() - start, os.times()
        used = (after.children_user + after.children_system) - (
            before.children_user + before.children_system
        )
        memory = int(done.stderr.split()[-1]) / 1024.0
        print(f"{suffix}: {given.rows} rows, {wall:.1f} s wall, {used:.1f} s of processor, "
              f"{memory:.0f} MB", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
