"""Campaigns of blocks that slump or slide: what is stored, resumed, checked and merged."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine, select, update

from benchmarks.database_content import table_rows_by_natural_key
from rbfrag.campaign.database_check import resimulate
from rbfrag.campaign.kind import CaseRequest
from rbfrag.campaign.kinds.slumping import CAMPAIGN, FAMILY
from rbfrag.campaign.scaled_records import BlockClass, ScaledRecords
from rbfrag.campaign.simulate import CampaignProgress, CampaignSummary, simulate
from rbfrag.db import schema
from rbfrag.db.check import check_database
from rbfrag.db.engine import open_database, opened_database
from rbfrag.db.merge import merge_databases
from rbfrag.db.models import model_rows, save_model
from rbfrag.db.motions import add_motion, load_motion
from rbfrag.db.queries import combination_table, outcome_grid
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError, UnknownModelError
from rbfrag.exchange.database_tables import export_database
from rbfrag.fragility.fit.fitting import fit
from rbfrag.fragility.fit.stored import check_models
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.question.question import predict
from rbfrag.solver.critical import critical
from rbfrag.solver.kind import Shaking
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.models.sliding import KY_OVER_PGA, sliding_displacements
from rbfrag.solver.respond import respond
from rbfrag.solver.simulation import shaken_mechanism
from tests.synthetic import shaking

TWO = (FAMILY[0], FAMILY[2])


def fill(place: str | Path, count: int = 2) -> None:
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        for seed in range(count):
            motion = GroundMotion(shaking(seed, 450), 0.02, source_file=f"{seed}.txt")
            quake = EarthquakeInfo(f"quake-{seed}", guessed=False)
            add_motion(connection, motion, earthquake=quake, is_vertical=False, recording=str(seed))


@pytest.fixture
def database(tmp_path: Path) -> Path:
    fill(tmp_path / "k.db")
    return tmp_path / "k.db"


def slump(place: str | Path, **more: Any) -> CampaignSummary:
    options: dict[str, Any] = {"family": TWO, "jobs": 1, "rotations_deg": (1.0, None), **more}
    return simulate(place, kind="slumping", **options)


def rows(engine: Engine, kind: str) -> list[Any]:
    query = select(schema.combination).where(schema.combination.c.kind == kind)
    with engine.connect() as connection:
        return list(connection.execute(query.order_by(schema.combination.c.id)).mappings())


def findings(engine: Engine) -> list[Any]:
    with engine.connect() as connection:
        return list(check_database(connection))


def test_every_block_of_the_family_slumps_and_is_stable_at_rest() -> None:
    assert len(FAMILY) == len(set(FAMILY)) == 18
    for item in FAMILY:
        shaken = shaken_mechanism(
            model_of_kind("slumping"), item.block, beta_deg=item.beta_deg, phi_deg=item.phi_deg
        )
        assert 0.05 < shaken.yield_g < 1.0
        assert shaken.p2 > 0.0


def test_slumps_are_stored_as_respond_follows_them(place: str) -> None:
    fill(place)
    summary = slump(place)
    assert summary.combinations == summary.not_searched == 2 * 2 * len(TWO) * 2
    assert summary.resumed == 0
    engine = open_database(place)
    lost = 0
    try:
        stored = rows(engine, "slumping")
        assert len(stored) == summary.combinations
        for row in stored[:6]:
            with engine.connect() as connection:
                motion = load_motion(connection, row["motion_id"])
                points = connection.execute(
                    select(schema.simulation)
                    .where(schema.simulation.c.combination_id == row["id"])
                    .order_by(schema.simulation.c.grid)
                ).all()
            assert [point.kr_over_pga for point in points] == list(ScaledRecords.ratios)
            block = BlockClass(**json.loads(row["block"]))
            rotation = json.loads(row["settings"])["rotation_deg"]
            for point in points[::3]:
                scale = row["yield_g"] / (point.kr_over_pga * motion.pga_g)
                assert motion.dt_s is not None
                answer = respond(
                    GroundMotion(scale * motion.acceleration_g, motion.dt_s),
                    block=block.block,
                    beta_deg=block.beta_deg,
                    phi_deg=block.phi_deg,
                    polarity=row["polarity"],
                )
                peak = answer.peak_theta_rad
                fails = peak is None or (rotation is not None and peak >= math.radians(rotation))
                assert point.outcome == ("toppled" if fails else "stable")
                lost += len(answer.mode_changes) > 1
                if peak is not None:
                    assert point.theta_n == pytest.approx(answer.peak_theta_n, rel=1e-6, abs=1e-12)
        # past a lost contact too
        assert lost
        assert findings(engine) == []
    finally:
        engine.dispose()


def test_a_slump_whose_run_ended_at_a_lost_contact_is_not_computed_again() -> None:
    # as it was stored with a search before blocks were followed to their end
    (case,) = CAMPAIGN.cases(family=TWO[:1], rotations_deg=(None,))
    case = replace(case, settings={**case.settings, "search_limit": 0.01})
    shaken = Shaking(GroundMotion(shaking(1, 450), 0.02), None, "forward")
    with pytest.raises(InputError, match="simulate it again"):
        CAMPAIGN.run_cases(shaken, [case], CaseRequest())


def test_slides_are_stored_with_their_displacements(place: str) -> None:
    fill(place)
    summary = simulate(place, kind="sliding", displacements_m=(0.01, 0.1), jobs=1)
    assert summary.combinations == 2 * 2 * 3
    engine = open_database(place)
    try:
        for row in rows(engine, "sliding"):
            distance = json.loads(row["settings"])["displacement_m"]
            with engine.connect() as connection:
                motion = load_motion(connection, row["motion_id"])
                points = connection.execute(
                    select(schema.simulation)
                    .where(schema.simulation.c.combination_id == row["id"])
                    .order_by(schema.simulation.c.kr_over_pga)
                ).all()
            result = critical(motion, displacement_m=distance, polarity=row["polarity"])
            assert (row["kr_over_pga"], row["status"]) == (result.kr_over_pga, result.status)
            assert (row["p2"], row["y_m_s"]) == (None, None)
            if distance == 0.0:
                assert [point.kr_over_pga for point in points] == list(KY_OVER_PGA)
                slid = sliding_displacements(motion, polarity=row["polarity"])
                assert [point.displacement_m for point in points] == slid.tolist()
        assert findings(engine) == []
    finally:
        engine.dispose()


def test_one_and_two_workers_give_equal_databases(
    database: Path, copy_of: Callable[[Path, str], Path], digest_of: Callable[[Path], str]
) -> None:
    other = copy_of(database, "other.db")
    for place, jobs in ((database, 1), (other, 2)):
        slump(place, jobs=jobs)
        simulate(place, kind="sliding", jobs=jobs)
    assert digest_of(database) == digest_of(other)


def test_an_interrupted_campaign_goes_on_where_it_stopped(
    database: Path, copy_of: Callable[[Path, str], Path], digest_of: Callable[[Path], str]
) -> None:
    other = copy_of(database, "other.db")
    slump(other)

    def stop(progress: CampaignProgress) -> None:
        if progress.completed:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        slump(database, on_progress=stop)
    again = slump(database)
    assert 0 < again.resumed < again.combinations
    assert slump(database).runs == 0
    assert digest_of(database) == digest_of(other)


def test_toppling_rows_do_not_notice(database: Path) -> None:
    def toppling() -> list[Any]:
        with opened_database(database, read_only=True) as engine, engine.connect() as connection:
            return [
                row
                for row in table_rows_by_natural_key(connection, "combination")
                if "toppling" in row
            ]

    simulate(database, p2=(10.0, 1.0), jobs=1)
    before = toppling()
    slump(database)
    simulate(database, kind="sliding", jobs=1)
    assert toppling() == before
    assert simulate(database, p2=(10.0, 1.0), jobs=1).runs == 0


def test_tables_of_one_rotation_hold_each_block_once(database: Path) -> None:
    slump(database)
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        single = combination_table(connection, kind="slumping", rotation_deg=1.0)
        recovery = combination_table(connection, kind="slumping")
        none = combination_table(connection, kind="slumping", rotation_deg=7.0)
        grids = [outcome_grid(connection, table.combination_id) for table in (single, recovery)]
        assert combination_table(connection).p2.size == 0
    assert single.p2.size == recovery.p2.size == 2 * 2 * len(TWO)
    assert none.p2.size == 0
    # the keys sort differently: compare how many fail
    failed = [int((grid.outcome == 1.0).sum()) for grid in grids]
    assert failed[0] >= failed[1] > 0


def test_a_sample_is_computed_again_bit_for_bit(database: Path) -> None:
    slump(database)
    simulate(database, kind="sliding", jobs=1)
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        answer = resimulate(connection, sample=12, seed=2)
    assert (answer.sampled, answer.exact, answer.findings) == (12, 12, ())


def test_damage_is_found(database: Path) -> None:
    simulate(database, kind="sliding", jobs=1)
    table = schema.simulation
    with opened_database(database) as engine:
        with engine.begin() as connection:
            connection.execute(
                update(table).where(table.c.kr_over_pga == 0.2).values(displacement_m=99.0)
            )
        assert any("further than" in item.problem for item in findings(engine))
        with engine.connect() as connection:
            again = resimulate(connection, sample=100)
        assert any("computed again" in item.problem for item in again.findings)


def test_what_two_databases_found_is_merged_and_exported(
    database: Path, tmp_path: Path, digest_of: Callable[[Path], str]
) -> None:
    both = tmp_path / "both.db"
    both.write_bytes(database.read_bytes())
    other = tmp_path / "other.db"
    other.write_bytes(database.read_bytes())
    slump(database)
    simulate(other, kind="sliding", jobs=1)
    slump(both)
    simulate(both, kind="sliding", jobs=1)
    merge_databases(other, db=database)
    assert digest_of(database) == digest_of(both)
    export_database(tmp_path / "out", db=database, format="csv", tables=["combination"])
    text = (tmp_path / "out" / "combination.csv").read_text()
    assert '""gamma_deg"":20.0' in text
    assert "displacement_m" in text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"kind": "slumping", "rotations_deg": ()}, "the list is empty"),
        ({"kind": "slumping", "rotations_deg": (2.0, 2.0)}, "2 is in the list twice"),
        ({"kind": "sliding", "displacements_m": (0.0,)}, "above zero"),
        (
            {"kind": "confined_toppling", "rotations_deg": (2.0,)},
            "rotations_deg requires kind slumping",
        ),
        ({"kind": "sliding", "jobs": 0}, "at least 1"),
        ({"kind": "sliding", "full_map": True}, "full_map requires kind toppling"),
        ({"kind": "slumping", "p2": (1.0,)}, "p2 requires kind rocking or topp"),
        ({"rotations_deg": (2.0,)}, "rotations_deg requires kind slumping"),
    ],
)
def test_what_cannot_be_run_is_rejected(
    database: Path, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        simulate(database, **options)


def test_models_are_fitted_stored_and_asked(tmp_path: Path) -> None:
    place = tmp_path / "m.db"
    fill(place, 5)
    slump(place, rotations_deg=(1.0,))
    simulate(place, kind="sliding", jobs=1)
    with opened_database(place) as engine:
        for kind, rotation_deg in (("sliding", None), ("slumping", 1.0)):
            for term in ("pgv_pga", "pgv") if kind == "sliding" else ("pgv_pga",):
                with engine.connect() as connection:
                    fitted = fit(connection, kind=kind, term=term, rotation_deg=rotation_deg)
                with engine.begin() as connection:
                    row = save_model(connection, fitted.model.row)
                assert row.coefficients == fitted.coefficients
                assert row.is_default == (term == "pgv_pga")
        with engine.connect() as connection:
            checks = check_models(connection, model_rows(connection))
        assert [row["state"] for row in checks.rows()] == ["unchanged"] * 3
    slid = predict(ky=0.05, displacement_m=0.02, pgv_m_s=0.5, pga_g=0.4, db=place)
    assert slid.model == "sliding-pgv_pga"
    assert 0.0 < slid.probability <= 1.0
    assert predict(ky=0.05, displacement_m=0.02, pgv_m_s=0.5, db=place).model == "sliding-pgv"
    fell = predict(ks=0.1, ps2=5.0, pgv_m_s=0.5, pga_g=0.4, rotation_deg=1.0, db=place)
    assert fell.model == "slumping-1deg-pgv_pga"
    with pytest.raises(UnknownModelError, match="rotation of 1°"):
        predict(ks=0.1, ps2=5.0, pgv_m_s=0.5, pga_g=0.4, db=place)
