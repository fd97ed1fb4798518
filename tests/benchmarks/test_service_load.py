"""Output of `wrk`, and ratios of pairs."""

from __future__ import annotations

import subprocess
from typing import Any

import pytest

from benchmarks import service_load
from benchmarks.service_load import Load, table_rows

PRINTED = """\
Running 10s test @ http://127.0.0.1:8000/v1/predict?p2=3&kr=0.1&pgv=0.6
  1 threads and 16 connections
  Thread Stats   Avg      Stdev     Max   +/- Stdev
    Latency     4.32ms    1.53ms  40.10ms   93.05%
    Req/Sec     3.79k   411.56     4.35k    86.00%
  Latency Distribution
     50%  980.00us
     75%    4.40ms
     90%    5.20ms
     99%    1.02s
  37745 requests in 10.01s, 20.66MB read
"""
TROUBLE = """\
  Socket errors: connect 0, read 3, write 1, timeout 2
  Non-2xx or 3xx responses: 7
"""
END = "Requests/sec:   3771.14\nTransfer/sec:      2.06MB\n"


@pytest.mark.parametrize(("trouble", "bad"), [("", 0), (TROUBLE, 3 + 1 + 7)])
def test_what_wrk_prints(monkeypatch: pytest.MonkeyPatch, trouble: str, bad: int) -> None:
    def run(words: list[str], **options: Any) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(words, 0, PRINTED + trouble + END, "")

    monkeypatch.setattr(subprocess, "run", run)
    load = service_load.wrk("http://127.0.0.1:8000/", 10, 16)
    assert (load.per_s, load.p50_ms, load.p99_ms) == (3771.14, 0.98, 1020.0)
    assert (load.bad, load.answers) == (bad, 37745)


def test_what_wrk_does_not_print_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    process = subprocess.CompletedProcess([], 0, "something else", "")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: process)
    with pytest.raises(SystemExit, match="something else"):
        service_load.wrk("http://127.0.0.1:8000/", 10, 16)


def test_ratios_are_of_pairs() -> None:
    ours = [Load(50.0, 1.0, 2.0, 0, 500, 200.0), Load(300.0, 1.0, 2.0, 0, 3000, 210.0)]
    other = [Load(100.0, 1.0, 2.0, 0, 1000, 100.0), Load(400.0, 1.0, 2.0, 0, 4000, 126.0)]
    _, row, *_ = table_rows(1, [ours, other, other, other])
    # 50/100 and 300/400; by processor time 100/200 and 126/210
    assert row[-3:] == ["0.62", "0.50 to 0.75", "0.55"]
