"""The service under load, asked by `wrk`:  python -m benchmarks.service_load

One block by `GET /v1/predict`, with one and two processes that answer, in turn with FastAPI
operations that answer a constant under the same server. `--soak MINUTES` instead asks for
so long and reports how the memory of the processes grew.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from benchmarks.page import markdown, parser, report
from benchmarks.running_service import free_port, running_program, running_service

QUERY = "?p2=3&kr=0.1&pgv=0.6"

_UNIT_MS = {"us": 1e-3, "ms": 1.0, "s": 1e3}


@dataclass(frozen=True)
class Load:
    """What `wrk` found.

    Args:
        per_s: requests answered a second.
        p50_ms: median time of an answer [ms].
        p99_ms: time that one in a hundred takes longer than [ms].
        bad: answers that were no success, or never came; late ones are in the p99.
        answers: how many came.
        cpu_us: processor time of the server for one of them [µs].
    """

    per_s: float
    p50_ms: float
    p99_ms: float
    bad: int
    answers: int
    cpu_us: float = math.nan


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and report; the exit status is 1 if an answer was bad."""
    options = parser(__doc__)
    options.add_argument("--seconds", type=int, default=10, help="length of one measurement")
    options.add_argument("--repeat", type=int, default=5, help="pairs of measurements")
    options.add_argument("--connections", type=int, default=16)
    options.add_argument("--soak", type=float, metavar="MINUTES", help="watch the memory instead")
    chosen = options.parse_args(arguments)
    if shutil.which("wrk") is None:
        raise SystemExit("wrk is not installed: it is the client of this measurement")
    with tempfile.TemporaryDirectory() as folder:
        if chosen.soak is not None:
            return soak(Path(folder), chosen.soak, chosen.connections, write=chosen.write)
        rows, bad = [], 0
        for workers in (1, 2):
            measured = compared(
                Path(folder), workers, chosen.seconds, chosen.repeat, chosen.connections
            )
            bad += sum(load.bad for loads in measured for load in loads)
            rows += table_rows(workers, measured)
        head = [
            *("processes", "what", "requests a second", "p50", "p99", "processor time a request"),
            *("ratio to it", "of pairs", "by processor time"),
        ]
        report("service-load", markdown((head, rows)), write=chosen.write)
        return int(bad > 0)


def compared(
    folder: Path, workers: int, seconds: int, repeat: int, connections: int
) -> list[list[Load]]:
    """Return loads of the service and of each of the constants, in turn."""
    port = free_port()
    constant = ["-m", "benchmarks.constant_service", str(port), str(workers)]
    address = f"http://127.0.0.1:{port}"
    measured: list[list[Load]] = [[], [], [], []]
    with (
        running_service(folder, workers=workers) as service,
        running_program(constant, folder / "constant.log", f"{address}/bare", {}) as other,
    ):
        targets = (
            (f"{service.address}/v1/predict{QUERY}", service.process.pid, measured[0]),
            (f"{address}/constant{QUERY}", other.pid, measured[1]),
            (f"{address}/model{QUERY}", other.pid, measured[2]),
            (f"{address}/bare", other.pid, measured[3]),
        )
        for url, _, _ in targets:
            wrk(url, 2, connections)
        for _ in range(10 * workers):
            # until every process for long work has come up, which takes processor time
            upload(service.address)
        for turn in range(repeat):
            # the order alternates, so that whatever else the machine does hits each alike
            for url, pid, loads in targets if turn % 2 == 0 else reversed(targets):
                before = processor_s(pid)
                load = wrk(url, seconds, connections)
                spent = processor_s(pid) - before
                loads.append(replace(load, cpu_us=1e6 * spent / max(load.answers, 1)))
    return measured


def wrk(url: str, seconds: int, connections: int) -> Load:
    """Return what `wrk` finds at an address."""
    words = ["wrk", "-t1", f"-c{connections}", f"-d{seconds}s", "--latency", url]
    printed = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    errors = re.search(r"Socket errors: connect (\d+), read (\d+), write (\d+), timeout", printed)
    rejected = re.search(r"Non-2xx or 3xx responses: (\d+)", printed)
    return Load(
        per_s=float(_groups(r"Requests/sec:\s+([\d.]+)", printed)[0]),
        p50_ms=_milliseconds(printed, "50"),
        p99_ms=_milliseconds(printed, "99"),
        answers=int(_groups(r"(\d+) requests in", printed)[0]),
        bad=(int(rejected[1]) if rejected else 0)
        + (sum(map(int, errors.groups())) if errors else 0),
    )


def _groups(pattern: str, text: str) -> tuple[str, ...]:
    match = re.search(pattern, text)
    if match is None:
        raise SystemExit(f"wrk printed something else than expected:\n{text}")
    return match.groups()


def _milliseconds(printed: str, percent: str) -> float:
    value, unit = _groups(rf"\s{percent}%\s+([\d.]+)(us|ms|s)\b", printed)
    return float(value) * _UNIT_MS[unit]


NAMES = (
    "`GET /v1/predict`",
    "a constant, the three parameters given",
    "a constant, all parameters of predict as FastAPI reads them",
    "a constant, no parameters",
)


def table_rows(workers: int, measured: list[list[Load]]) -> list[list[str]]:
    """Return the rows of the table for one number of processes."""
    rows = []
    ours = measured[0]
    for name, loads in zip(NAMES, measured, strict=True):
        ratios = [a.per_s / b.per_s for a, b in zip(ours, loads, strict=True)]
        of_cpu = [b.cpu_us / a.cpu_us for a, b in zip(ours, loads, strict=True)]
        rows.append(
            [
                str(workers),
                name,
                f"{median(load.per_s for load in loads):.0f}",
                f"{median(load.p50_ms for load in loads):.2f} ms",
                f"{median(load.p99_ms for load in loads):.1f} ms",
                f"{median(load.cpu_us for load in loads):.0f} µs",
                "" if loads is ours else f"{median(ratios):.2f}",
                "" if loads is ours else f"{min(ratios):.2f} to {max(ratios):.2f}",
                "" if loads is ours else f"{median(of_cpu):.2f}",
            ]
        )
    return rows


def soak(folder: Path, minutes: float, connections: int, *, write: bool) -> int:
    """Ask for a long time; report memory at the start and the end."""
    with running_service(folder, workers=1) as service:
        url = f"{service.address}/v1/predict{QUERY}"
        wrk(url, 20, connections)
        upload(service.address)
        first = memory_kb(service.process.pid)
        end = time.monotonic() + 60.0 * minutes
        answered, bad, most = 0.0, 0, first
        while time.monotonic() < end:
            seconds = max(1, min(20, int(end - time.monotonic())))
            load = wrk(url, seconds, connections)
            upload(service.address)
            answered += load.per_s * seconds
            bad += load.bad
            most = max(most, memory_kb(service.process.pid))
        last = memory_kb(service.process.pid)
        size = service.log.stat().st_size
    head = ["minutes", "answers", "bad", "memory at the start", "at the end", "most", "growth"]
    row = [
        f"{minutes:g}",
        f"{answered:.0f}",
        str(bad),
        *(f"{kb / 1024:.1f} MiB" for kb in (first, last, most)),
        f"{100.0 * (last / first - 1.0):+.1f} %",
    ]
    report("service-soak", markdown((head, [row])), write=write)
    print(f"log: {size / 1e6:.0f} MB")
    return int(bad > 0)


def processor_s(pid: int) -> float:
    """Return the processor time of a process and of those it started [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    fields_s = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return fields_s + sum(processor_s(int(child)) for child in children)


def upload(address: str) -> None:
    """Ask for a spectrum once, so that the processes for long work are used too."""
    from rbfrag.service.work import EXAMPLE

    with urllib.request.urlopen(f"{address}/v1/spectrum?p2=3", EXAMPLE.encode()) as answer:
        answer.read()


def memory_kb(pid: int) -> int:
    """Return the resident memory of a process that answers [KiB]."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(_groups(r"VmRSS:\s+(\d+) kB", status)[0])


if __name__ == "__main__":
    os.environ.pop("WEB_CONCURRENCY", None)
    raise SystemExit(main())
