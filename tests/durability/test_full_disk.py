"""A disk without room: one sentence, exit status 1, and what was finished is there."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.durability import campaign, digest, environment, stored
from rbfrag.campaign.simulate import CampaignProgress, simulate
from rbfrag.errors import DatabaseFailedError
from tests.durability.conftest import P2

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no file-size limit there")


def _run(place: Path, **limits: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        campaign(str(place), "10,1", 1), env=environment(), text=True, capture_output=True,
        check=False, **limits,  # type: ignore[call-overload]
    )  # fmt: skip


def test_a_quota(database: Path, undisturbed: str) -> None:
    # room for the first motions: the log may grow no further
    room = database.stat().st_size + 24 * 1024

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    process = _run(database, preexec_fn=limit)
    assert process.returncode == 1
    assert "Traceback" not in process.stderr
    last = process.stderr.strip().splitlines()[-1]
    assert last.startswith(f"rbfrag: {database} cannot be read or written")
    assert "what was finished is kept" in last
    assert 0 < stored(str(database)) < 24
    simulate(database, p2=P2, jobs=1)
    assert digest(str(database)) == undisturbed


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of one megabyte."""
    folder = tmp_path / "disk"
    folder.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(words, capture_output=True, check=False).returncode == 0
    except OSError:
        mounted = False
    if not mounted:
        pytest.skip("a small file system can be mounted by root only")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def test_no_space_left(small_disk: Path, untouched: bytes, undisturbed: str) -> None:
    place = small_disk / "a.db"
    place.write_bytes(untouched)
    free_standing = os.statvfs(small_disk)
    ballast = small_disk / "ballast"
    ballast.write_bytes(b"0" * (free_standing.f_bavail * free_standing.f_bsize - 200 * 1024))
    process = _run(place)
    assert process.returncode == 1
    assert "Traceback" not in process.stderr
    last = process.stderr.strip().splitlines()[-1]
    assert last.startswith(f"rbfrag: {place} cannot grow: the disk is full; what was finished")
    assert 0 < stored(str(place)) < 24
    ballast.unlink()
    simulate(place, p2=P2, jobs=1)
    assert digest(str(place)) == undisturbed


def test_a_database_that_may_not_grow(
    database: Path, undisturbed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import rbfrag.db.connect

    connect = rbfrag.db.connect.connect_sqlite
    most = database.stat().st_size // 4096 + 4

    def limited(*arguments: object, **options: object) -> object:
        raw = connect(*arguments, **options)  # type: ignore[arg-type]
        raw.execute(f"PRAGMA max_page_count = {most}")
        return raw

    seen: list[CampaignProgress] = []
    monkeypatch.setattr(rbfrag.db.connect, "connect_sqlite", limited)
    with pytest.raises(DatabaseFailedError, match="the disk is full; what was finished is kept"):
        simulate(database, p2=P2, jobs=1, on_progress=seen.append)
    monkeypatch.undo()
    assert stored(str(database)) == seen[-1].completed
    simulate(database, p2=P2, jobs=1)
    assert digest(str(database)) == undisturbed
