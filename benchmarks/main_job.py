"""The main job, from accelerogram files to a fit:  python -m benchmarks.main_job --records FOLDER

All steps are commands of rbfrag, run one after the other on a database of their own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.page import RECORDS_VARIABLE, ROOT, markdown, parser, report
from rbfrag.bench.timing import seconds
from rbfrag.motions.sample_motions import sample_folder

FOLDERS = ("peer_at2_opensees", "nga_at2_misc", "slammer_csv", "geonet_v2a")
"""Folders of a collection that the main job is run on; others are left out."""

TERMS = ("pgv", "pga_tm", "pgd_tm")


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--jobs", type=int, default=None, help="worker processes")
    options.add_argument("--term", nargs="+", default=list(TERMS), help="terms to fit")
    chosen = options.parse_args(arguments)
    root = chosen.records or os.environ.get(RECORDS_VARIABLE) or sample_folder()
    if root is None:
        raise SystemExit("no records: name a folder with --records")
    parts = [str(Path(root) / name) for name in FOLDERS if (Path(root) / name).is_dir()]
    jobs = () if chosen.jobs is None else ("--jobs", str(chosen.jobs))
    with tempfile.TemporaryDirectory() as folder:
        db = ("--db", str(Path(folder) / "job.db"))
        added, add_s = run("motions", "add", *(parts or [str(root)]), *db)
        done, simulate_s = run("simulate", *jobs, *db)
        fits = [run("fit", "--term", term, "--method", "wls", *db) for term in chosen.term]
        _, again_s = run("simulate", *jobs, *db)
    cells = [
        ["`rbfrag motions add`", f"{len(added['added'])} traces", *add_s],
        [
            "`rbfrag simulate`",
            f"{done['combinations']} combinations, {done['found']} found, "
            f"{done['below_limit']} below the limit, {done['runs']:,} runs",
            *simulate_s,
        ],
        *(
            [f"`rbfrag fit --term {term} --method wls`", fit_words(fitted), *fit_s]
            for term, (fitted, fit_s) in zip(chosen.term, fits, strict=True)
        ),
        ["`rbfrag simulate` again", "everything is stored", *again_s],
    ]
    headers = ["command", "result", "wall time", "processor time"]
    report("main-job", markdown((headers, cells)), write=chosen.write)


def run(*arguments: str) -> tuple[dict, list[str]]:
    """Run one rbfrag command in a process of its own: (its JSON, wall and processor time)."""
    code = "from rbfrag.cli.main import run; run()"
    before, used = time.perf_counter(), processor_time()
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments, "--json"],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    passed = [seconds(time.perf_counter() - before), seconds(processor_time() - used)]
    if not done.stdout.strip():
        raise SystemExit(f"rbfrag {' '.join(arguments)}: {done.stderr}")
    return json.loads(done.stdout), passed


def processor_time() -> float:
    """Processor time of all processes started so far that have ended, workers included [s]."""
    times = os.times()
    return times.children_user + times.children_system


def fit_words(fitted: dict) -> str:
    """Return slope and intercept with standard errors, power law, correlation."""
    value, error, power = fitted["coefficients"], fitted["standard_errors"], fitted["power_law"]
    correlation = fitted["log_correlations"].get(fitted["term"])  # none among very few motions
    return (
        f"slope {value['c1']:.3f} ± {error['c1']:.3f}, intercept {value['c0']:.4f} m/s, "
        f"M = {power['exponent_m']:.3f} ± {power['exponent_m_se']:.3f}, "
        f"correlation of logarithms {'-' if correlation is None else f'{correlation:.3f}'}"
    )


if __name__ == "__main__":
    main()
