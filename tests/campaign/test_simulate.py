"""Campaigns: equal databases whatever happens on the way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import delete, func, select, update

from benchmarks.database_content import content_digest
from rbfrag.campaign.add_motions import add_motions
from rbfrag.campaign.kind import Case
from rbfrag.campaign.kinds import campaign_of_kind
from rbfrag.campaign.simulate import CampaignProgress, simulate
from rbfrag.db.campaigns import intervals_of, spectrum_values
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion
from rbfrag.db.queries import combination_table, database_info, outcome_grid
from rbfrag.db.schema import combination, outcome_interval, simulation
from rbfrag.errors import InputError, WorkFailedError
from rbfrag.solver.toppling_run import respond
from tests.synthetic import write_suite

P2 = (10.0, 1.0)


@pytest.fixture
def database(tmp_path: Path) -> Path:
    place = tmp_path / "a.db"
    add_motions([write_suite(tmp_path / "records")], db=place, suite="s")
    return place


def _copy(database: Path, name: str) -> Path:
    other = database.with_name(name)
    other.write_bytes(database.read_bytes())
    return other


def _digest(database: Path) -> str:
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        return content_digest(connection)


def _combinations(database: Path) -> int:
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        return database_info(connection).rows["combination"]


def test_one_and_two_workers_give_equal_databases(database: Path) -> None:
    other = _copy(database, "b.db")
    single = simulate(database, p2=P2, jobs=1)
    two = simulate(other, p2=P2, jobs=2)
    assert (single.combinations, single.found, single.runs) == (
        two.combinations,
        two.found,
        two.runs,
    )
    assert single.found > 0
    assert _digest(database) == _digest(other)


def test_the_stored_maps_tell_what_every_block_does(database: Path) -> None:
    simulate(database, p2=P2, full_map=True, jobs=1)
    k = np.geomspace(0.012, 1.1, 40)
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection)
        maps = intervals_of(connection, table.combination_id.tolist())
        motions = {int(i): load_motion(connection, int(i)) for i in set(table.motion_id)}
    document = np.full((table.p2.size, k.size), np.nan)
    for row, owner in zip(document, table.combination_id.tolist(), strict=True):
        assert maps[owner]
        for low, high, outcome, *_ in maps[owner]:
            if outcome != "undecided":
                row[(k >= low) & (k <= high)] = outcome == "topples"
        row[k > max(high for _, high, *_ in maps[owner])] = 0.0
    decided = np.isfinite(document)
    assert decided.mean() > 0.99
    topples = np.where(decided, document, 0.0).astype(bool)
    assert topples.any(axis=1).tolist() == (table.status == "found").tolist()
    for i in range(0, table.p2.size, 3):
        motion = motions[int(table.motion_id[i])]
        for value, toppling in zip(k[decided[i]], document[i, decided[i]], strict=True):
            run = respond(
                motion, p2=table.p2[i], kr=value * motion.pga_g, polarity=table.polarity[i]
            )
            assert (run.outcome == "toppled") == bool(toppling)


def test_every_block_of_the_grid_is_simulated(database: Path) -> None:
    simulate(database, p2=(10.0, 0.1, 0.005), jobs=1)
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection)
        motions = {int(i): load_motion(connection, int(i)) for i in set(table.motion_id)}
        stored = outcome_grid(connection, table.combination_id)
        assert connection.scalar(select(func.count()).select_from(outcome_interval)) == 0
    model = campaign_of_kind("toppling")
    assert stored.outcome.shape == (table.p2.size, 35)
    assert (stored.k_over_pga < 0.01).any()
    for i in range(0, table.p2.size, 3):
        motion = motions[int(table.motion_id[i])]
        strengths = model.grid(Case("toppling", table.p2[i]), motion)
        np.testing.assert_array_equal(stored.k_over_pga[i], strengths)
        for k, failed, theta_n in zip(strengths, stored.outcome[i], stored.theta_n[i], strict=True):
            run = respond(motion, p2=table.p2[i], kr=k * motion.pga_g, polarity=table.polarity[i])
            assert (run.outcome == "toppled") == bool(failed)
            np.testing.assert_equal(theta_n, np.nan if failed else run.peak_theta_n)


def test_what_a_stored_combination_lacks_is_added(database: Path) -> None:
    """The grid alone where the search is stored, the map alone where both are."""
    at_once, without = _copy(database, "b.db"), _copy(database, "c.db")
    simulate(at_once, p2=P2, full_map=True, jobs=1)
    first = simulate(without, p2=P2, jobs=1)
    with opened_database(without) as engine, engine.begin() as connection:
        complete = content_digest(connection)
        connection.execute(delete(simulation).where(simulation.c.grid.is_not(None)))
        assert content_digest(connection) != complete
    again = simulate(without, p2=P2, jobs=1)
    assert (again.resumed, again.found) == (0, first.found)
    assert again.runs == 35 * again.combinations
    with opened_database(without, read_only=True) as engine, engine.connect() as connection:
        assert content_digest(connection) == complete
    mapped = simulate(without, p2=P2, full_map=True, jobs=2)
    assert (mapped.resumed, mapped.found) == (first.no_motion, first.found)
    assert simulate(without, p2=P2, full_map=True, jobs=1).runs == 0
    assert _digest(without) == _digest(at_once)


def test_a_search_that_contradicts_what_is_stored_is_rejected(database: Path) -> None:
    simulate(database, p2=P2, jobs=1)
    column = combination.c.kr_over_pga
    with opened_database(database) as engine, engine.begin() as connection:
        connection.execute(
            update(combination).where(column.is_not(None)).values(kr_over_pga=0.9 * column)
        )
    with pytest.raises(WorkFailedError, match="the search repeated for its map gives found"):
        simulate(database, p2=P2, full_map=True, jobs=1)


def test_progress_is_told_after_each_motion(database: Path) -> None:
    seen: list[CampaignProgress] = []
    simulate(database, p2=P2, jobs=1, on_progress=seen.append)
    assert [progress.completed for progress in seen] == [0, 4, 8, 12, 16, 20, 24]
    assert seen[-1].total == 24
    assert seen[-1].seconds_left == 0.0
    assert seen[3].rate_per_s > 0.0


def test_repeating_adds_nothing(database: Path) -> None:
    first = simulate(database, p2=P2, jobs=1)
    before = _digest(database)
    again = simulate(database, p2=P2, jobs=1)
    assert (again.resumed, again.runs) == (first.combinations, 0)
    assert _digest(database) == before


def test_a_wider_list_reuses_what_is_stored(database: Path) -> None:
    simulate(database, p2=P2, jobs=1)
    wider = simulate(database, p2=(10.0, 3.0, 1.0), jobs=1)
    assert (wider.combinations, wider.resumed) == (36, 24)


def test_interruption_keeps_what_is_done(database: Path) -> None:
    undisturbed = _copy(database, "b.db")
    simulate(undisturbed, p2=P2, jobs=1)

    def stop(progress: CampaignProgress) -> None:
        if progress.completed >= 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(database, p2=P2, jobs=2, on_progress=stop)
    assert 8 <= _combinations(database) < 24
    simulate(database, p2=P2, jobs=2)
    assert _digest(database) == _digest(undisturbed)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_killed_campaign_is_resumed(tmp_path: Path, jobs: int) -> None:
    database = tmp_path / "a.db"
    add_motions([write_suite(tmp_path / "records", 12)], db=database)
    undisturbed = _copy(database, "b.db")
    p2 = "30,10,3,1,0.3,0.1"
    sizes = [float(value) for value in p2.split(",")]
    simulate(undisturbed, p2=sizes, jobs=1)

    # every combination is slowed down, so that the kill surely comes half-way
    program = (
        "import time, rbfrag.campaign.simulate as s\n"
        "store = s._store\n"
        "def slow(*arguments):\n"
        "    time.sleep(0.2)\n"
        "    store(*arguments)\n"
        "s._store = slow\n"
        "if __name__ == '__main__':\n"
        f"    s.simulate({str(database)!r}, p2={sizes!r}, jobs={jobs})\n"
    )
    script = tmp_path / "slow.py"
    script.write_text(program)
    running = subprocess.Popen(
        [sys.executable, str(script)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    deadline = time.monotonic() + 60.0
    while _combinations(database) < 24:
        assert running.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    running.send_signal(signal.SIGKILL)
    running.wait()
    assert 24 <= _combinations(database) < 144
    resumed = simulate(database, p2=sizes, jobs=jobs)
    assert 24 <= resumed.resumed < 144
    assert _digest(database) == _digest(undisturbed)


def test_nothing_to_run_is_said(tmp_path: Path) -> None:
    database = tmp_path / "a.db"
    add_motions([write_suite(tmp_path / "records", 1)], db=database)
    with pytest.raises(InputError, match="twice"):
        simulate(database, p2=(3.0, 3.0))
    with pytest.raises(InputError, match="empty"):
        simulate(database, p2=())


def test_spectra_are_stored_with_the_campaign(database: Path) -> None:
    simulate(database, p2=P2, jobs=1)
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        x = spectrum_values(connection)
        table = combination_table(connection)
    assert len(x) == 6 * 2 * len(P2)
    bound = [
        x[item]
        for item in zip(
            table.motion_id.tolist(), table.polarity.tolist(), table.p2.tolist(), strict=True
        )
    ]
    result = table.status == "found"
    assert result.any()
    assert (table.y_m_s[result] <= 1.02 * np.array(bound)[result]).all()
