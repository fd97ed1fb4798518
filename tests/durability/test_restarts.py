"""A campaign whose server is restarted in the midst of it says so, keeps what it has, goes on."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from benchmarks.durability import (
    PATIENCE_S,
    campaign,
    digest,
    environment,
    make_database,
    run_to_the_end,
    stored,
)
from benchmarks.running_service import free_port
from rbfrag.campaign.simulate import CampaignProgress, simulate
from rbfrag.db.merge import merge_databases
from rbfrag.errors import DatabaseFailedError

if TYPE_CHECKING:
    import psycopg

P2, MOTIONS, SAMPLES = "10,1", 40, 1200
COMPLETE = MOTIONS * 4
Server = tuple[str, Callable[..., None]]
PROGRAM = shutil.which("pg_ctl") or next(Path("/usr/lib/postgresql").glob("*/bin/pg_ctl"), None)
pytestmark = pytest.mark.skipif(
    PROGRAM is None or not hasattr(os, "geteuid"), reason="starts a PostgreSQL server of its own"
)


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("motions") / "a.db"
    make_database(str(place), MOTIONS, SAMPLES)
    return place


@pytest.fixture(scope="module")
def undisturbed(motions: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    place = tmp_path_factory.mktemp("undisturbed") / "a.db"
    shutil.copyfile(motions, place)
    run_to_the_end(str(place), P2, 2)
    return digest(str(place))


@pytest.fixture
def server() -> Iterator[Server]:
    """URL of a server of this test alone, and what stops or starts it."""
    pytest.importorskip("psycopg")
    # PostgreSQL rejects to run as root, and its user enters no folder of root's
    user = "postgres" if os.geteuid() == 0 else None
    folder = tempfile.mkdtemp(prefix="rbfrag-server-")
    if user is not None:
        shutil.chown(folder, user)
    port = free_port()

    def control(*words: str) -> None:
        command = [str(PROGRAM), "-D", f"{folder}/data", "-l", f"{folder}/log", "-w", *words]
        subprocess.run(command, user=user, cwd=folder, check=True, stdout=subprocess.DEVNULL)

    try:
        control("initdb", "-o", "-A trust -U rbfrag --no-sync")
        with Path(folder, "data", "postgresql.conf").open("a") as settings:
            settings.write(
                f"port = {port}\nunix_socket_directories = '{folder}'\n"
                "listen_addresses = '127.0.0.1'\n"
            )
        control("start")
        try:
            yield f"postgresql://rbfrag@127.0.0.1:{port}/postgres", control
        finally:
            control("stop", "-m", "immediate")
    finally:
        shutil.rmtree(folder)


def resumed(place: str, undisturbed: str) -> None:
    process = stored(place)
    assert 8 <= process < COMPLETE
    run_to_the_end(place, P2, 2)
    assert stored(place) == COMPLETE
    assert digest(place) == undisturbed


def rows_when_locked(connection: psycopg.Connection) -> int:
    """Lock the table of combinations against further rows, and return how many there are."""
    connection.execute("LOCK TABLE combination IN EXCLUSIVE MODE")
    row = connection.execute("SELECT count(*) FROM combination").fetchone()
    assert row is not None
    return int(row[0])


def test_a_server_that_is_restarted(server: Server, motions: Path, undisturbed: str) -> None:
    import psycopg

    place, control = server
    merge_databases(motions, db=place)
    with subprocess.Popen(
        campaign(place, P2, 2), env=environment(), stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True,
    ) as running:  # fmt: skip
        try:
            with closing(psycopg.connect(place)) as connection:
                end = time.monotonic() + PATIENCE_S
                while rows_when_locked(connection) < 8:
                    connection.rollback()
                    assert running.poll() is None
                    assert time.monotonic() < end
                # while this transaction has its lock, the campaign cannot end before the restart
                control("restart", "-m", "immediate")
            message = running.communicate(timeout=PATIENCE_S)[1]
        finally:
            running.kill()
    assert running.returncode == 1
    assert "the server gave up" in message
    assert message.rstrip().endswith("what was finished is kept: run the same command again")
    assert all(re.match("simulate: |rbfrag: ", line) for line in message.splitlines()), message
    resumed(place, undisturbed)


def test_a_server_that_is_gone_between_two_transactions(
    server: Server, motions: Path, undisturbed: str
) -> None:
    place, control = server
    merge_databases(motions, db=place)

    def stop(progress: CampaignProgress) -> None:
        if progress.completed >= 8:
            control("stop", "-m", "immediate")

    with pytest.raises(DatabaseFailedError, match=r"the server gave up.* run the same command"):
        simulate(place, p2=(10.0, 1.0), jobs=1, on_progress=stop)
    control("start")
    resumed(place, undisturbed)
