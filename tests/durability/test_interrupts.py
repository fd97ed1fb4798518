"""Ctrl-C of a campaign: once it ends after the motion in hand, twice at once; nothing is lost."""

from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from benchmarks.durability import (
    PATIENCE_S,
    campaign,
    digest,
    environment,
    make_database,
    stored,
    workers_of,
)
from rbfrag.campaign.executors import STOPPING
from rbfrag.campaign.simulate import simulate

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="finds the workers under /proc")

MOTIONS, SAMPLES = 250, 2400  # so much that a busy test still finds the campaign at work
SIZES = (10.0, 1.0)
COMPLETE = MOTIONS * 2 * len(SIZES)


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("several") / "a.db"
    make_database(str(place), MOTIONS, SAMPLES)
    return place


@pytest.fixture
def place(several: Path, tmp_path: Path) -> Path:
    path = tmp_path / "a.db"
    path.write_bytes(several.read_bytes())
    return path


@contextmanager
def running(place: Path, jobs: int) -> Iterator[subprocess.Popen[bytes]]:
    """A campaign in a process group of its own, that has stored something."""
    command = campaign(str(place), ",".join(map(str, SIZES)), jobs)
    process = subprocess.Popen(
        command,
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    try:
        end = time.monotonic() + PATIENCE_S
        while stored(str(place)) == 0:
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.02)
        yield process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def said_until(process: subprocess.Popen[bytes], words: str) -> str:
    """Return the standard error of a process as soon as it holds some words."""
    assert process.stderr is not None
    message, end = b"", time.monotonic() + PATIENCE_S
    while words.encode() not in message:
        assert time.monotonic() < end, message
        if select.select([process.stderr], [], [], 0.1)[0]:
            part = os.read(process.stderr.fileno(), 4096)
            assert part, message
            message += part
    return message.decode()


def interrupt(process: subprocess.Popen[bytes], *, group: bool) -> None:
    if process.poll() is None:
        (os.killpg if group else os.kill)(process.pid, signal.SIGINT)


@pytest.mark.parametrize("jobs", [1, 2])
def test_once_ends_after_the_motion_in_hand(place: Path, jobs: int) -> None:
    with running(place, jobs) as process:
        interrupt(process, group=True)
        said_until(process, STOPPING)
        rest = process.communicate(timeout=PATIENCE_S)[1].decode()
    assert process.returncode == 130
    completed = stored(str(place))
    assert 0 < completed < COMPLETE
    assert completed % (2 * len(SIZES)) == 0  # whole motions
    assert re.search(rf"stopped: {completed} of {COMPLETE} stored; the same command goes on", rest)
    assert "Traceback" not in rest
    summary = simulate(place, p2=SIZES, jobs=1)
    assert summary.resumed == completed
    assert stored(str(place)) == COMPLETE


@pytest.mark.parametrize("group", [True, False])
@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("pause_s", [0.01, 0.3])
def test_twice_ends_at_once(place: Path, jobs: int, group: bool, pause_s: float) -> None:
    with running(place, jobs) as process:
        workers = workers_of(process.pid)
        interrupt(process, group=group)
        said_until(process, STOPPING)
        time.sleep(pause_s)
        interrupt(process, group=group)
        rest = process.communicate(timeout=PATIENCE_S)[1].decode()
        assert process.returncode == 130
        assert "Traceback" not in rest
        assert "resource_tracker" not in rest
        end = time.monotonic() + PATIENCE_S
        while any(Path(f"/proc/{pid}/cmdline").exists() for pid in workers):
            assert time.monotonic() < end, "a worker goes on"
            time.sleep(0.02)
    assert 0 < stored(str(place)) <= COMPLETE
    digest(str(place))  # passes the check of the database


IN_A_KERNEL = """
import hashlib
from rbfrag.campaign.executors import stopped_by_interrupts
with stopped_by_interrupts():
    print("ready", flush=True)
    # like a kernel: it gives up the lock of the interpreter, and looks at no signal
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)
"""


def test_presses_are_answered_while_a_kernel_runs() -> None:
    command = [sys.executable, "-c", IN_A_KERNEL]
    with subprocess.Popen(
        command, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == b"ready\n"
            interrupt(process, group=False)
            said_until(process, STOPPING)
            interrupt(process, group=False)
            assert process.wait(PATIENCE_S) == 130
        finally:
            process.kill()
