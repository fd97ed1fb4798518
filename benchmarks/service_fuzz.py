"""The service asked at random:  python -m benchmarks.service_fuzz --cases 600

`schemathesis` makes up requests from the OpenAPI document of a service that runs, right ones and
wrong ones, and judges each answer: no server error, no status, content type or body that the
document does not announce, and no wrong request that is taken for a right one.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from benchmarks.running_service import ROOT, running_service

CHECKS = (
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "negative_data_rejection",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Ask and report; the exit status is 1 if an answer was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=600, help="most made-up cases an operation")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--phases", default="examples,coverage,fuzzing")
    chosen = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # a small limit of rows keeps the rock masses short that are made up
        with running_service(folder, jobs=1, row_limit=2000, time_limit=60.0) as service:
            status = run_schemathesis(
                service.address, folder, chosen.cases, chosen.seed, chosen.phases
            )
            summary = json.loads((folder / "report.json").read_text())
            statuses = Counter(
                line["status"] for line in service.lines() if line["event"] == "request"
            )
            errors = [line for line in service.lines() if line["level"] == "error"]
    for line in errors:
        print(line.get("exception", line["message"]))
    cases = summary["test_cases"]
    print(
        f"{cases['generated']} cases on {summary['operations']['tested']} operations, seed "
        f"{chosen.seed}: {cases['unique_failures']} kinds of failures, {cases['errored']} not "
        f"sent or not answered; answers by status "
        + ", ".join(f"{status}: {count}" for status, count in sorted(statuses.items()))
    )
    return int(status != 0 or bool(errors))


def run_schemathesis(address: str, folder: Path, cases: int, seed: int, phases: str) -> int:
    """Let schemathesis ask; print what it complains of and return its exit status."""
    words = [
        *("run", f"{address}/v1/openapi.json"),
        *("--checks", ",".join(CHECKS)),
        *("--phases", phases),
        *("--max-examples", str(cases)),
        *("--seed", str(seed)),
        *("--request-timeout", "150"),
        *("--generation-database", "none"),
        *("--suppress-health-check", "all"),
        *("--report", "json"),
        *("--report-json-path", str(folder / "report.json")),
        *("--warnings", "off"),
        *("--continue-on-failure", "--no-color"),
    ]
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "SCHEMATHESIS_HOOKS": "benchmarks.toml_serializer",
    }
    program = "from schemathesis.cli import schemathesis; schemathesis()"
    process = subprocess.run(
        [sys.executable, "-c", program, *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
    )
    if process.returncode != 0:
        print(re.sub(r"(?s).*?(=+ (ERRORS|FAILURES) =+)", r"\1", process.stdout, count=1))
        print(process.stderr)
    return process.returncode


if __name__ == "__main__":
    raise SystemExit(main())
