"""A campaign that is killed again and again ends equal to one that was not.

    python -m benchmarks.durability --kills 20 --seed 1
    python -m benchmarks.durability --kills 20 --server postgresql://user@host/name
    python -m benchmarks.durability --kills 10 --kind sliding --sequence

Main process and workers are killed by SIGKILL at random moments, each kill followed by the same
command. With --server both databases are made in schemas of random names, which are dropped.
"""

from __future__ import annotations

import argparse
import os
import random
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.database_content import content_digest
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion
from rbfrag.db.queries import database_info
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.motions.ground_motion import GroundMotion

ROOT = Path(__file__).resolve().parent.parent
COMMAND = (sys.executable, "-c", "from rbfrag.cli.main import run; run()")
PATIENCE_S = 120.0
Blocks = str | Sequence[str]


@dataclass(frozen=True)
class Kill:
    """One SIGKILL.

    Args:
        target: ``main`` or ``worker``.
        combinations: how many were stored when it came.
        status: exit status of the main process.
        orphans: workers that outlived the main process by ten seconds.
        output: what the main process wrote to standard error at the end.
    """

    target: str
    combinations: int
    status: int
    orphans: int
    output: str


def make_database(place: str, motions: int, npts: int = 600) -> None:
    """Make a database of enveloped noise with a long pulse, each motion of its own event."""
    t = np.arange(npts) * 0.02
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        for seed in range(motions):
            rng = np.random.default_rng(seed)
            noise = np.convolve(rng.standard_normal(npts), np.hanning(9), mode="same")
            pulse = 0.3 * np.sin(2.0 * np.pi * t / (0.6 + 0.1 * (seed % 7)))
            samples = np.exp(-(((t - 5.0) / 2.0) ** 2)) * (0.1 * noise + pulse)
            add_motion(
                connection,
                GroundMotion(samples, 0.02, source_file=f"made{seed}.txt", station=f"S{seed}"),
                earthquake=EarthquakeInfo(f"event {seed}", guessed=False),
                is_vertical=False,
            )


def campaign(place: str, blocks: Blocks, jobs: int) -> list[str]:
    """Return the command of the campaign."""
    words = ("--p2", blocks) if isinstance(blocks, str) else blocks
    return [*COMMAND, "simulate", "--db", place, *words, "--jobs", str(jobs)]


def environment() -> dict[str, str]:
    """Return the environment of the commands: this source tree, whatever the folder."""
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def run_to_the_end(place: str, blocks: Blocks, jobs: int) -> None:
    """Run the campaign undisturbed."""
    subprocess.run(
        campaign(place, blocks, jobs),
        env=environment(),
        check=True,
        capture_output=True,
        timeout=600,
    )


def stored(place: str) -> int:
    """Return the number of combinations, and of pairs of shocks, stored."""
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        rows = database_info(connection).rows
    return rows["combination"] + rows["shock_pair"]


def digest(place: str) -> str:
    """Return the digest of a database that passes its check."""
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        findings = check_database(connection)
        if findings:
            raise AssertionError(findings)
        return content_digest(connection)


def kill_once(
    place: str, blocks: Blocks, jobs: int, rng: random.Random, target: str, per_motion: int
) -> Kill | None:
    """Start the campaign and kill it at a random moment; None when it ended before.

    Args:
        place: the database.
        blocks: the sizes p² of a toppling campaign, or the options of another.
        jobs: number of workers.
        rng: decides when.
        target: ``main`` or ``worker``.
        per_motion: combinations of one motion.
    """
    goal = stored(place) + per_motion * rng.randint(0, 2)
    running = subprocess.Popen(
        campaign(place, blocks, jobs), env=environment(), stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + PATIENCE_S
    workers: list[int] = []
    while running.poll() is None and (stored(place) < goal or len(workers) < jobs):
        workers = workers_of(running.pid)
        if time.monotonic() > deadline:
            running.kill()
            raise AssertionError("the campaign does not get on")
        time.sleep(0.005)
    time.sleep(rng.uniform(0.0, 0.1))
    workers = workers_of(running.pid)
    if running.poll() is not None or (target == "worker" and not workers):
        output = running.communicate()[1]
        if running.returncode:
            raise AssertionError(f"the campaign failed by itself: {output}")
        return None
    reached = stored(place)
    try:
        os.kill(running.pid if target == "main" else rng.choice(workers), signal.SIGKILL)
    except ProcessLookupError:
        running.communicate()
        return None
    output = running.communicate(timeout=PATIENCE_S)[1]
    if target == "worker" and running.returncode == 0:
        return None  # it had done its work
    end = time.monotonic() + 10.0
    while (alive := [pid for pid in workers if _lives(pid)]) and time.monotonic() < end:
        time.sleep(0.02)
    lines = output.strip().splitlines()
    return Kill(target, reached, running.returncode, len(alive), lines[-1] if lines else "")


def workers_of(pid: int) -> list[int]:
    """Return the worker processes of a campaign (Linux)."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return []
    return [int(child) for child in children if "spawn_main" in _command_line(int(child))]


def _command_line(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


def _lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def kill_and_resume(
    place: str, blocks: Blocks, *, kills: int, seed: int, jobs: int = 2, per_motion: int
) -> Iterator[Kill]:
    """Yield the kills of one campaign, main process and workers in turn by chance.

    Args:
        place: the database.
        blocks: the sizes p² of a toppling campaign, or the options of another.
        kills: how many, if the campaign lasts.
        seed: of the moments and the targets.
        jobs: number of workers.
        per_motion: combinations of one motion.
    """
    rng = random.Random(seed)
    for _ in range(kills):
        kill = kill_once(place, blocks, jobs, rng, rng.choice(("main", "worker")), per_motion)
        if kill is None:
            return
        yield kill


@contextmanager
def two_places(server: str | None, folder: Path) -> Iterator[tuple[str, str]]:
    """Yield two places for databases: files, or schemas of random names on a server."""
    if server is None:
        yield str(folder / "killed.db"), str(folder / "undisturbed.db")
        return
    import psycopg
    from psycopg import sql

    with psycopg.connect(server, autocommit=True) as connection, ExitStack() as stack:
        databases = []
        for _ in range(2):
            schema = f"rbfrag_durability_{secrets.token_hex(6)}"
            name = sql.Identifier(schema)
            connection.execute(sql.SQL("CREATE SCHEMA {}").format(name))
            drop = sql.SQL("DROP SCHEMA {} CASCADE").format(name)
            stack.callback(connection.execute, drop)
            databases.append(f"{server}?options=-csearch_path%3D{schema}")
        connection.execute("SET client_min_messages = warning")
        yield databases[0], databases[1]


def main() -> int:
    """Kill, resume, compare; exit 1 if anything differs."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--motions", type=int, default=60)
    parser.add_argument("--p2", help="toppling and rocking: sizes [1/s²]; 10,1 if left out")
    parser.add_argument("--kind", default="toppling")
    parser.add_argument("--sequence", action="store_true")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--server", help="PostgreSQL URL; without it SQLite")
    options = parser.parse_args()
    blocks = ["--kind", options.kind, *(["--sequence"] if options.sequence else [])]
    if options.kind in ("toppling", "rocking"):
        blocks += ["--p2", options.p2 or "10,1"]
    with (
        tempfile.TemporaryDirectory() as folder,
        two_places(options.server, Path(folder)) as (killed, undisturbed),
    ):
        for place in (killed, undisturbed):
            make_database(place, options.motions)
        run_to_the_end(undisturbed, blocks, options.jobs)
        expected = stored(undisturbed)
        kills = []
        for kill in kill_and_resume(
            killed, blocks, kills=options.kills, seed=options.seed, jobs=options.jobs,
            per_motion=expected // options.motions,
        ):  # fmt: skip
            kills.append(kill)
            print(
                f"kill {len(kills):2d}: {kill.target:6s} at {kill.combinations}/{expected} "
                f"combinations, exit status {kill.status}, orphans {kill.orphans}",
                flush=True,
            )
        run_to_the_end(killed, blocks, options.jobs)
        equal = digest(killed) == digest(undisturbed)
        main_kills = sum(kill.target == "main" for kill in kills)
        print(
            f"{len(kills)} kills ({main_kills} of the main process), {stored(killed)} "
            f"combinations, contents {'equal' if equal else 'DIFFER'}"
        )
        return 0 if equal and not any(kill.orphans for kill in kills) else 1


if __name__ == "__main__":
    sys.exit(main())
