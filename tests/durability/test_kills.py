"""SIGKILL at random moments: nothing committed is lost, nothing is doubled."""

from __future__ import annotations

import random
import signal
import sys
from pathlib import Path

import pytest

from benchmarks.durability import digest, kill_once, make_database, stored
from rbfrag.campaign.simulate import simulate
from rbfrag.db.merge import merge_databases
from tests.durability.conftest import P2

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="finds the workers under /proc")

MOTIONS = 14


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("many") / "a.db"
    make_database(str(place), MOTIONS)
    return place


@pytest.fixture(scope="module")
def expected(many: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    place = tmp_path_factory.mktemp("expected") / "a.db"
    place.write_bytes(many.read_bytes())
    simulate(place, p2=P2, jobs=1)
    return digest(str(place))


def test_a_killed_campaign_ends_equal(place: str, many: Path, expected: str) -> None:
    merge_databases(many, db=place)
    rng = random.Random(3)
    kills = []
    # each start of a campaign takes its time: the server sees the one that its sessions notice
    for target in ("main",) if "://" in place else ("worker", "main"):
        before = stored(place)
        kill = kill_once(place, "10,1", 2, rng, target, per_motion=4)
        if kill is not None:
            kills.append(kill)
            assert kill.orphans == 0
            if target == "main":
                assert kill.status == -signal.SIGKILL
            else:
                assert kill.status == 1
                assert kill.output.startswith("rbfrag: a worker process died")
            assert before <= kill.combinations <= stored(place)
            assert stored(place) % 4 == 0  # whole motions
    assert kills, "the campaign was over before the first kill"
    simulate(place, p2=P2, jobs=1)
    assert digest(place) == expected
