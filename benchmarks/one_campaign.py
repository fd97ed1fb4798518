"""One campaign in a process of its own; prints what it did and used as JSON.

python -m benchmarks.one_campaign DATABASE '{"jobs": 2, "grid": 23}'
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.page import ROOT
from rbfrag.campaign.simulate import simulate


def main() -> None:
    summary = simulate(sys.argv[1], **json.loads(sys.argv[2]))
    print(json.dumps({**summary.as_dict(), **used()}))


def used() -> dict[str, float]:
    """Return processor times [s] and peak memory [MB] of this process and of its workers."""
    # counted in kB, on macOS in bytes
    unit = 1e6 if sys.platform == "darwin" else 1e3
    own_usage, workers = (
        resource.getrusage(process) for process in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return {
        "writer_s": own_usage.ru_utime + own_usage.ru_stime,
        "workers_s": workers.ru_utime + workers.ru_stime,
        "writer_mb": own_usage.ru_maxrss / unit,
        "worker_mb": workers.ru_maxrss / unit,
    }


def run_campaign(database: Path, **settings: Any) -> dict[str, Any]:
    """Run one campaign and return its summary with what it used."""
    finished = subprocess.run(
        [sys.executable, "-m", "benchmarks.one_campaign", str(database), json.dumps(settings)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if finished.returncode:
        raise SystemExit(f"a campaign failed: {finished.stderr}")
    summary: dict[str, Any] = json.loads(finished.stdout.splitlines()[-1])
    return summary


if __name__ == "__main__":
    main()
