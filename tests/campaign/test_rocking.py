"""Campaigns of free-standing blocks: the grid of outcomes, what is sensitive, and its fits."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import select, update

import rbfrag.campaign.database_check
from rbfrag.campaign.database_check import resimulate
from rbfrag.campaign.kinds.rocking import Y_OVER_PGV
from rbfrag.campaign.simulate import CampaignProgress, CampaignSummary, simulate
from rbfrag.db import schema
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import update_rows
from rbfrag.db.merge import merge_databases
from rbfrag.db.motions import add_motion, load_motion
from rbfrag.db.queries import combination_table, outcome_grid
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import FitError, InputError, MergeConflictError
from rbfrag.exchange.database_tables import read_table
from rbfrag.fragility.fit.fitting import fit
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.models.rocking import restitution_of_rectangle
from rbfrag.solver.respond import respond
from tests.synthetic import shaking

KIND = "rocking"
FACTORS = (1.0, 0.8)
P2 = (10.0, 1.0)


def fill(place: str | Path, count: int = 2) -> None:
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        for seed in range(count):
            samples = (0.6 + 0.2 * (seed % 4)) * shaking(seed, 450)
            motion = GroundMotion(samples, 0.02, source_file=f"{seed}.txt")
            quake = EarthquakeInfo(f"quake-{seed}", guessed=False)
            add_motion(connection, motion, earthquake=quake, is_vertical=False, recording=str(seed))


def run(place: str | Path, **more: Any) -> CampaignSummary:
    inputs = {"p2": P2, "restitution_factors": FACTORS, "jobs": 1, **more}
    return simulate(place, kind=KIND, **inputs)


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    place = tmp_path_factory.mktemp("rocking") / "r.db"
    fill(place)
    run(place)
    return place.read_bytes()


@pytest.fixture
def database(content: bytes, tmp_path: Path) -> Path:
    place = tmp_path / "r.db"
    place.write_bytes(content)
    return place


def test_each_block_is_stored_as_it_responds(place: str) -> None:
    fill(place)
    summary = run(place)
    assert summary.combinations == summary.not_searched == 2 * len(P2) * len(FACTORS)
    assert (summary.found, summary.runs) == (0, 25 * summary.combinations)
    again = run(place)
    assert (again.resumed, again.runs) == (summary.combinations, 0)
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        assert check_database(connection) == []
        table = combination_table(connection, kind=KIND)
        grid = outcome_grid(connection, table.combination_id)
        assert set(table.polarity) == {"forward"}
        assert set(table.status) == {"not_searched"}
        assert grid.outcome.shape == (summary.combinations, 25)
        assert 0.1 < np.nanmean(grid.outcome) < 0.9
        for i in range(0, summary.combinations, 3):
            motion = load_motion(connection, int(table.motion_id[i]))
            factor = json.loads(table.block[i])["restitution_factor"]
            for j in range(0, 25, 4):
                kr = float(grid.k_over_pga[i, j]) * motion.pga_g
                y = kr * 9.80665 / math.sqrt(table.p2[i])
                assert y == pytest.approx(Y_OVER_PGV[j] * motion.pgv_m_s, rel=1e-12)
                alone = respond(
                    motion, kind=KIND, p2=float(table.p2[i]), kr=kr,
                    restitution=max(factor * restitution_of_rectangle(kr), 1e-12),
                )  # fmt: skip
                assert grid.outcome[i, j] == (alone.outcome == "toppled")
                assert grid.sensitive[i, j] == alone.sensitive
                if alone.peak_theta_n is None:
                    assert np.isnan(grid.theta_n[i, j])
                else:
                    assert grid.theta_n[i, j] == alone.peak_theta_n
        # X(p) is of backed blocks
        assert connection.execute(select(schema.toppling_spectrum)).first() is None


def test_one_and_two_workers_give_equal_databases(
    tmp_path: Path, digest_of: Callable[[Path], str]
) -> None:
    digests = set()
    for jobs in (1, 2):
        place = tmp_path / f"{jobs}.db"
        fill(place)
        run(place, jobs=jobs)
        digests.add(digest_of(place))
    assert len(digests) == 1


def test_an_interrupted_campaign_goes_on_where_it_stopped(
    tmp_path: Path, database: Path, digest_of: Callable[[Path], str]
) -> None:
    place = tmp_path / "stopped.db"
    fill(place)

    def stop(progress: CampaignProgress) -> None:
        if progress.completed:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(place, on_progress=stop)
    rest = run(place)
    assert rest.resumed == len(P2) * len(FACTORS)
    assert digest_of(place) == digest_of(database)


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"restitution_factors": ()}, "the list is empty"),
        ({"restitution_factors": (1.0, 1.0)}, "1 is in the list twice"),
        ({"restitution_factors": (1.1,)}, "would gain speed"),
        ({"restitution_factors": (0.0,)}, "restitution_factor"),
        ({"p2": (-1.0,)}, "p2"),
        ({"rotations_deg": (1.0,)}, "rotations_deg requires kind slumping"),
        ({"full_map": True}, "full_map requires"),
        ({"grid": 5}, "grid requires kind toppling"),
    ],
)
def test_what_cannot_be_run_is_rejected(database: Path, inputs: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        run(database, **inputs)
    with pytest.raises(InputError, match="restitution_factors requires kind rocking"):
        simulate(database, restitution_factors=FACTORS)


def test_what_is_stored_is_computed_again_bit_for_bit(
    database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def again() -> tuple[int, int, list[str]]:
        with opened_database(database, read_only=True) as engine, engine.connect() as connection:
            result = resimulate(connection, sample=100)
        return result.exact, result.within_error, [finding.problem for finding in result.findings]

    assert again() == (8, 0, [])
    point = schema.simulation.c
    first = (point.combination_id == 1) & (point.grid == 0)
    with opened_database(database) as engine, engine.begin() as connection:
        connection.execute(
            update(schema.simulation).where(first).values(sensitive=~point.sensitive)
        )
    exact, _, problems = again()
    assert exact == 7
    assert len(problems) == 1
    assert "sensitive" in problems[0]
    # on another machine the flag may be another one, and with it the outcome
    module = rbfrag.campaign.database_check
    monkeypatch.setattr(module, "processor_and_compiler", lambda: "another machine")
    assert again() == (7, 1, [])
    with opened_database(database) as engine, engine.begin() as connection:
        changed = {"outcome": "stable", "theta_n": 0.5, "sensitive": True}
        connection.execute(update(schema.simulation).where(first).values(**changed))
    assert again()[2] == []
    with opened_database(database) as engine, engine.begin() as connection:
        connection.execute(update(schema.simulation).where(first).values(sensitive=False))
    assert "is stable, computed again toppled" in again()[2][0]


def test_merging_keeps_what_is_sensitive(database: Path, tmp_path: Path) -> None:
    empty, twin = tmp_path / "empty.db", tmp_path / "twin.db"
    fill(empty, 1)
    merge_databases(database, db=empty)
    ours, theirs = (read_table("simulation", db=place) for place in (empty, database))
    assert ours["sensitive"].tolist() == theirs["sensitive"].tolist()
    assert {type(value) for value in ours["sensitive"]} == {bool}
    # elsewhere a sensitive block may end otherwise, and peaks may be chaotic
    twin.write_bytes(database.read_bytes())
    point = schema.simulation.c
    first = (point.combination_id == 1) & (point.grid == 0)
    last = (point.outcome == "stable") & (point.grid == 20)
    with opened_database(twin) as engine, engine.begin() as connection:
        changed = {"outcome": "stable", "theta_n": 0.5, "sensitive": True}
        update_rows(connection, schema.simulation, first, changed)
        update_rows(connection, schema.simulation, last, {"theta_n": 0.3})
    assert merge_databases(twin, db=database).added == {}
    with opened_database(twin) as engine, engine.begin() as connection:
        update_rows(connection, schema.simulation, first, {"sensitive": False})
    with pytest.raises(MergeConflictError, match="the outcome at kr/PGA"):
        merge_databases(twin, db=database)


def test_a_campaign_is_fitted_and_its_model_knows_restitution(tmp_path: Path) -> None:
    place = tmp_path / "f.db"
    fill(place, 12)
    with pytest.raises(FitError, match="rbfrag simulate, of kind rocking"):
        fit(place, kind=KIND, term="pga")
    run(place, p2=(10.0, 1.0, 0.1))
    report = fit(place, kind=KIND, term="pgv")
    row = report.model.row
    assert (row.name, row.kind, row.method) == ("rocking-pgv", KIND, "rocking")
    assert 0.0 <= report.details["sensitive_share"] < 0.2
    low, high = row.domain["restitution"]
    assert 0.3 < low < 0.8
    assert 0.99 < high <= 1.0
    assert row.domain["p2"] == (1.0, 10.0)  # without 0.1, which is fitted too
    # less speed after each impact is safer
    assert row.coefficients["b_s"] < 0.0
    with pytest.raises(InputError, match="rocking cannot be combined with the term xp"):
        fit(place, kind=KIND, term="xp")
