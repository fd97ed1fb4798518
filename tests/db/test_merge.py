"""Two teams' results in one database: once, in any order, and never against each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import Engine, delete, func, select, true, update

from benchmarks.database_content import CONTENT_TABLES, content_digest, table_rows_by_natural_key
from rbfrag.db import schema
from rbfrag.db.campaigns import start_campaign
from rbfrag.db.check import check_database
from rbfrag.db.check_results import contradictions
from rbfrag.db.engine import open_database, opened_database
from rbfrag.db.insert import insert_if_new, insert_row, renew_digests, update_rows
from rbfrag.db.keys import response_key
from rbfrag.db.ledger import renew_ledger
from rbfrag.db.merge import MergeReport, merge_databases
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import load_model, model_rows, save_model
from rbfrag.db.motions import add_motion
from rbfrag.db.queries import database_info
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import DatabaseError, DatabaseNotFoundError, InputError, MergeConflictError
from rbfrag.motions.ground_motion import GroundMotion

QUAKE = EarthquakeInfo("chi-chi-1999", magnitude=7.62, guessed=False)


@pytest.fixture
def theirs(tmp_path: Path, empty_database: bytes) -> Iterator[Engine]:
    """Another team's database, in a file."""
    (tmp_path / "theirs.db").write_bytes(empty_database)
    engine = open_database(tmp_path / "theirs.db")
    yield engine
    engine.dispose()


def _digest(engine: Engine) -> str:
    with engine.connect() as connection:
        return content_digest(connection)


def _where(engine: Engine) -> str:
    return engine.url.render_as_string(hide_password=False).removeprefix("sqlite:///")


def _merge(theirs: Engine, ours: Engine) -> MergeReport:
    report = merge_databases(_where(theirs), db=_where(ours))
    with ours.connect() as connection:
        assert check_database(connection) == []
    return report


def _change(engine: Engine, *statements: Any) -> None:
    with engine.begin() as connection:
        for statement in statements:
            connection.execute(statement)
        for table in schema.metadata.tables.values():
            renew_digests(connection, table)  # of what is said now
        renew_ledger(connection)


class TestTogether:
    def test_into_an_empty_database_it_is_a_copy(
        self, filled: Engine, theirs: Engine, model: ModelRow
    ) -> None:
        with filled.begin() as connection:
            save_model(connection, model)
        # from SQLite or the server into a file
        report = _merge(filled, theirs)
        assert _digest(theirs) == _digest(filled)
        assert report.added["combination"] == 6
        assert report.added["simulation"] == 18
        assert report.same == {}
        assert report.warnings == ()

    def test_and_from_a_file_into_any_database(
        self, engine: Engine, theirs: Engine, fill: Callable[..., None]
    ) -> None:
        with theirs.begin() as connection:
            fill(connection, [1, 2, 3])
        _merge(theirs, engine)
        assert _digest(theirs) == _digest(engine)

    def test_twice_is_once(self, filled: Engine, theirs: Engine, model: ModelRow) -> None:
        with filled.begin() as connection:
            save_model(connection, model)
        _merge(filled, theirs)
        with theirs.connect() as connection:
            rows = database_info(connection).rows
        again = _merge(filled, theirs)
        with theirs.connect() as connection:
            assert database_info(connection).rows == rows
        assert again.added == {}
        assert again.same["combination"] == 6
        assert again.within_error == 0

    def test_two_halves_make_the_whole_in_either_order(
        self, engine: Engine, theirs: Engine, fill: Callable[..., None], tmp_path: Path
    ) -> None:
        with engine.begin() as connection:
            fill(connection, [3, 1])
        with theirs.begin() as connection:
            fill(connection, [2, 1])
        with opened_database(tmp_path / "whole.db", create=True) as complete:
            with complete.begin() as connection:
                fill(connection, [1, 2, 3])
            expected = _digest(complete)
        with opened_database(tmp_path / "copy.db", create=True) as copy:
            _merge(theirs, copy)
            _merge(engine, copy)
            assert _digest(copy) == expected
        _merge(theirs, engine)
        assert _digest(engine) == expected

    @settings(
        max_examples=8,
        suppress_health_check=[HealthCheck.function_scoped_fixture],
    )
    @given(
        parts=st.lists(
            st.lists(st.sampled_from([1, 2, 3]), min_size=1, max_size=3, unique=True),
            min_size=1,
            max_size=3,
        ),
        seed=st.randoms(use_true_random=False),
    )
    def test_any_parts_in_any_order_make_one_content(
        self,
        parts: list[list[int]],
        seed: Any,
        tmp_path_factory: pytest.TempPathFactory,
        empty_database: bytes,
        fill: Callable[..., None],
    ) -> None:
        folder = tmp_path_factory.mktemp("parts")
        files = []
        for number, part in enumerate(parts):
            files.append(folder / f"{number}.db")
            files[-1].write_bytes(empty_database)
            with opened_database(files[-1]) as source, source.begin() as connection:
                fill(connection, part)
        digests = set()
        for number in range(2):
            (folder / f"all{number}.db").write_bytes(empty_database)
            seed.shuffle(files)
            for file in files:
                merge_databases(file, db=folder / f"all{number}.db")
            with opened_database(folder / f"all{number}.db", read_only=True) as merged:
                digests.add(_digest(merged))
        assert len(digests) == 1

    def test_a_database_is_made(self, filled: Engine, tmp_path: Path) -> None:
        merge_databases(_where(filled), db=tmp_path / "new.db")
        with opened_database(tmp_path / "new.db", read_only=True) as merged:
            assert _digest(merged) == _digest(filled)

    def test_rows_in_any_number(
        self, filled: Engine, theirs: Engine, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("rbfrag.db.merge_rows._AT_ONCE", 2)
        _merge(filled, theirs)
        assert _digest(theirs) == _digest(filled)

    def test_spectra_maps_and_histories(self, filled: Engine, theirs: Engine) -> None:
        with filled.begin() as connection:
            motion_id = connection.scalar(select(func.min(schema.motion.c.id)))
            combination_id = connection.scalar(
                select(func.min(schema.combination.c.id)).where(
                    schema.combination.c.status == "found"
                )
            )
            block_of_key: dict[str, Any] = {"polarity": "forward", "p2": 3.0}
            block = {"motion_id": motion_id, **block_of_key}
            x = {**block, "numerics_version": "0", "x_m_s": 0.3}
            insert_if_new(connection, schema.toppling_spectrum, x)
            for low, high, outcome in ((0.01, 0.1, "topples"), (0.1, 1.0, "safe")):
                row = {"combination_id": combination_id, "k_lo": low, "k_hi": high}
                insert_if_new(connection, schema.outcome_interval, {**row, "outcome": outcome})
            sha = select(schema.motion.c.samples_sha256).where(schema.motion.c.id == motion_id)
            key = response_key(
                motion_sha256=str(connection.scalar(sha)), dt_s=0.01, kind="toppling", kr=0.1,
                vertical_sha256=connection.scalar(sha), numerics_version="2", **block_of_key,
            )  # fmt: skip
            arrays = ("time_s", "theta_rad", "theta_dot_rad_s", "k_h", "k_v")
            values = {
                "natural_key": key, "kind": "toppling", "linear": False, "kr": 0.1, "npts": 1,
                "numerics_version": "2", "outcome": "stable", "peak_theta_n": 0.5,
                "vertical_motion_id": motion_id, **block, **dict.fromkeys(arrays, b"\x00" * 8),
            }  # fmt: skip
            insert_row(connection, schema.response, values)
        for _ in range(2):
            _merge(filled, theirs)
            assert _digest(theirs) == _digest(filled)

    def test_a_campaign_is_one_campaign(self, filled: Engine, theirs: Engine) -> None:
        _merge(filled, theirs)
        with theirs.begin() as connection:
            update_rows(connection, schema.campaign, true(), {"finished": None})
        _merge(filled, theirs)
        with theirs.connect() as connection:
            assert connection.scalar(select(func.count()).select_from(schema.campaign)) == 1
            assert connection.scalar(select(schema.campaign.c.finished)) is not None

    def test_runs_of_grids_are_united(self, filled: Engine, theirs: Engine) -> None:
        _merge(filled, theirs)
        least = select(func.min(schema.combination.c.id)).scalar_subquery()
        for place, k in ((filled, 0.2), (theirs, 0.3)):
            row = {"kr_over_pga": k, "theta_n": k, "outcome": "stable"}
            with place.begin() as connection:
                number = connection.scalar(select(least))
                insert_if_new(connection, schema.simulation, {**row, "combination_id": number})
        report = _merge(filled, theirs)
        assert report.added == {"simulation": 1}
        _merge(theirs, filled)
        assert _digest(theirs) == _digest(filled)

    def test_samples_fill_a_reference_database(self, filled: Engine, theirs: Engine) -> None:
        _merge(filled, theirs)
        _change(theirs, update(schema.motion).values(samples=None))
        _merge(filled, theirs)
        assert _digest(theirs) == _digest(filled)
        _change(filled, update(schema.motion).values(samples=None))
        _merge(filled, theirs)
        with theirs.connect() as connection:
            samples = connection.scalars(select(schema.motion.c.samples)).all()
        assert None not in samples


def _filtered(motion: GroundMotion, scale: float) -> GroundMotion:
    """The same samples of a file behind the same filter, rounded by another machine."""
    return replace(
        motion,
        acceleration_g=motion.acceleration_g * scale,
        source_sha256="5" * 64,
        processing_applied={"filter": "Butterworth"},
    )


def test_filters_that_round_otherwise_make_no_second_motion(
    engine: Engine, theirs: Engine, make_motion: Any, make_result: Any, store_result: Any
) -> None:
    for place, scale, sizes in ((engine, 1.0, (3.0,)), (theirs, 1.0 + 1e-15, (3.0, 1.0))):
        motion = _filtered(make_motion(1), scale)
        with place.begin() as connection:
            motion_id, _ = add_motion(connection, motion, earthquake=QUAKE, is_vertical=False)
            campaign = start_campaign(connection, {"p2": list(sizes)})
            for p2 in sizes:
                result = make_result(motion.pga_g, p2=p2)
                store_result(connection, campaign, motion, motion_id, result)
    report = _merge(theirs, engine)
    assert report.added == {"campaign": 1, "combination": 1, "simulation": 3}
    assert report.same["motion"] == 1
    assert _merge(theirs, engine).added == {}


class TestGuesses:
    def _motion(self, engine: Engine, motion: Any, info: EarthquakeInfo, **labels: Any) -> int:
        with engine.begin() as connection:
            motion_id, _ = add_motion(
                connection, motion, earthquake=info, is_vertical=False, **labels
            )
            return motion_id

    def _events(self, engine: Engine) -> list[tuple[str, bool]]:
        columns = (schema.earthquake.c.event_id, schema.earthquake.c.guessed)
        with engine.connect() as connection:
            rows = connection.execute(select(*columns).order_by(*columns)).all()
        return [(row.event_id, row.guessed) for row in rows]

    def test_a_guess_and_a_statement_stand_side_by_side(
        self, engine: Engine, theirs: Engine, make_motion: Any
    ) -> None:
        self._motion(engine, make_motion(1), QUAKE)
        self._motion(theirs, make_motion(2), EarthquakeInfo(QUAKE.event_id))
        _merge(theirs, engine)
        assert self._events(engine) == [(QUAKE.event_id, False), (QUAKE.event_id, True)]

    def test_a_statement_replaces_a_guess_and_is_reported(
        self, engine: Engine, theirs: Engine, make_motion: Any
    ) -> None:
        self._motion(engine, make_motion(1), EarthquakeInfo("header"), recording="r")
        self._motion(theirs, make_motion(1), QUAKE, recording="stated")
        report = _merge(theirs, engine)
        assert report.restated == 1
        assert self._events(engine) == [(QUAKE.event_id, False)]
        assert _digest(engine) == _digest(theirs)

    def test_a_guess_does_not_touch_a_statement(
        self, engine: Engine, theirs: Engine, make_motion: Any
    ) -> None:
        self._motion(engine, make_motion(1), QUAKE)
        self._motion(theirs, make_motion(1), EarthquakeInfo("header"), component="up")
        before = _digest(engine)
        report = _merge(theirs, engine)
        assert (report.restated, report.warnings) == (0, ())
        assert _digest(engine) == before

    def test_of_two_guesses_the_one_here_stays(
        self, engine: Engine, theirs: Engine, make_motion: Any
    ) -> None:
        self._motion(engine, make_motion(1), EarthquakeInfo("a"))
        self._motion(theirs, make_motion(1), EarthquakeInfo("b"))
        _merge(theirs, engine)
        assert self._events(engine) == [("a", True)]

    def test_files_of_one_name_do_not_become_companions(
        self, engine: Engine, theirs: Engine, make_motion: Any
    ) -> None:
        labels = {"source_file": "record.csv", "station": ""}
        self._motion(engine, make_motion(1, **labels), EarthquakeInfo(""))
        self._motion(theirs, make_motion(2, **labels), EarthquakeInfo(""))
        (note,) = _merge(theirs, engine).warnings
        assert (
            "recording 'record.csv#0' of unknown earthquakes: that of the other is stored as"
            in note
        )
        assert len(self._events(engine)) == 2
        assert _merge(theirs, engine).added == {}

    def test_what_is_not_known_is_filled_in(
        self, engine: Engine, theirs: Engine, make_motion: Any
    ) -> None:
        self._motion(engine, make_motion(1), EarthquakeInfo("e", guessed=False))
        earthquake = EarthquakeInfo("e", name="Chi-Chi", magnitude=7.6, time="1999", guessed=False)
        self._motion(theirs, make_motion(1), earthquake)
        assert _merge(theirs, engine).warnings == ()
        assert _digest(engine) == _digest(theirs)

    def test_of_two_names_the_one_here_stays(
        self, engine: Engine, theirs: Engine, make_motion: Any
    ) -> None:
        for place, name in ((engine, "Chi-Chi"), (theirs, "Jiji")):
            info = EarthquakeInfo("e", name=name, guessed=False)
            for seed in (1, 2):
                self._motion(place, make_motion(seed), info)
        assert _merge(theirs, engine).added == {}
        with engine.connect() as connection:
            assert connection.scalar(select(schema.earthquake.c.name)) == "Chi-Chi"


def _change_first_found(values: Any) -> Any:
    least = select(func.min(schema.combination.c.id)).where(schema.combination.c.status == "found")
    matching = schema.combination.c.id == least.scalar_subquery()
    return update(schema.combination).where(matching).values(**values)


LAST_BITS = _change_first_found(
    {
        name: schema.combination.c[name] * (1.0 + 1e-13)
        for name in ("kr_over_pga", "lower", "upper", "kr", "y_m_s")
    }
)


class TestContradictions:
    @pytest.mark.parametrize(
        ("statements", "message"),
        [
            (
                (
                    update(schema.earthquake)
                    .where(~schema.earthquake.c.guessed)
                    .values(magnitude=7.0),
                ),
                r"earthquake chi-chi-1999: magnitude is 7\.62 here and 7\.0 there",
            ),
            (
                (
                    update(schema.earthquake)
                    .where(~schema.earthquake.c.guessed)
                    .values(event_id="x"),
                ),
                r"motion 1\.txt#0: event_id is 'chi-chi-1999' here and 'x' there",
            ),
            (
                (update(schema.motion).values(is_vertical=True),),
                r"motion 1\.txt#0: is_vertical is False here and True there",
            ),
            (
                (
                    delete(schema.simulation),
                    update(schema.combination).values(
                        status="no_motion", kr_over_pga=None, kr=None, y_m_s=None
                    ),
                ),
                "status is 'found' here and 'no_motion' there",
            ),
            (
                (
                    update(schema.simulation)
                    .where(schema.simulation.c.theta_n > 0.05)
                    .values(theta_n=0.5),
                ),
                r"theta_n at kr/PGA 0\.[0-9]+ is 0\.[17] here and 0\.5 there",
            ),
        ],
    )
    def test_nothing_is_written(
        self, filled: Engine, theirs: Engine, statements: Any, message: str
    ) -> None:
        _merge(filled, theirs)
        _change(theirs, *statements)
        before = _digest(filled)
        with pytest.raises(MergeConflictError, match=message) as caught:
            merge_databases(_where(theirs), db=_where(filled))
        assert "Nothing was written" in str(caught.value)
        assert _digest(filled) == before

    def test_a_bracket_elsewhere(
        self,
        filled: Engine,
        theirs: Engine,
        make_motion: Any,
        make_result: Any,
        store_result: Any,
    ) -> None:
        motion = make_motion(1)
        with theirs.begin() as connection:
            motion_id, _ = add_motion(connection, motion, earthquake=QUAKE, is_vertical=False)
            campaign = start_campaign(connection, {})
            store_result(connection, campaign, motion, motion_id, make_result(motion.pga_g, k=0.11))
        before = _digest(filled)
        with pytest.raises(MergeConflictError, match=r"kr_over_pga is 0\.1 here and 0\.11 there"):
            merge_databases(_where(theirs), db=_where(filled))
        assert _digest(filled) == before

    def test_what_another_processor_makes_is_no_contradiction(
        self, filled: Engine, theirs: Engine
    ) -> None:
        _merge(filled, theirs)
        shifted = update(schema.simulation).where(schema.simulation.c.outcome == "toppled")
        last_bit = schema.simulation.c.kr_over_pga * (1.0 + 1e-13)
        _change(theirs, LAST_BITS, shifted.values(kr_over_pga=last_bit))
        # the critical simulations of the other combinations are off now: only these move too
        _change(
            theirs,
            update(schema.combination)
            .where(schema.combination.c.status == "found", schema.combination.c.id != 1)
            .values(
                **{
                    name: schema.combination.c[name] * (1.0 + 1e-13)
                    for name in ("kr_over_pga", "lower", "upper", "kr", "y_m_s")
                }
            ),
        )
        before = _digest(filled)
        report = _merge(theirs, filled)
        assert report.within_error == 3
        assert report.added == {}
        assert _digest(filled) == before

    def test_many_are_counted(self, filled: Engine, theirs: Engine) -> None:
        _merge(filled, theirs)
        _change(
            theirs,
            update(schema.simulation)
            .where(schema.simulation.c.theta_n > 0.05)
            .values(theta_n=schema.simulation.c.theta_n * 1.01),
        )
        with pytest.raises(MergeConflictError, match=r"and 7 more\. Nothing was written"):
            merge_databases(_where(theirs), db=_where(filled))

    def test_maps(self) -> None:
        scan = [(0.01, 0.1, "topples"), (0.1, 0.2, "undecided"), (0.2, 1.0, "safe")]
        near = [(0.01, 0.1 + 1e-12, "topples"), (0.1 + 1e-12, 1.0, "safe")]
        assert list(contradictions(scan, near)) == []
        other = [(0.01, 0.05, "safe"), (0.05, 0.3, "topples"), (0.3, 1.0, "safe")]
        assert list(contradictions(scan, other)) == [
            (0.01, 0.05, "topples", "safe"),
            (0.2, 0.3, "safe", "topples"),
        ]


class TestModels:
    def test_one_name_two_models(
        self, engine: Engine, theirs: Engine, model: ModelRow, tmp_path: Path
    ) -> None:
        with engine.begin() as connection:
            save_model(connection, replace(model, is_default=True))
        other = replace(model, data_fingerprint="0" * 64, created="2025-01-01T00:00:00+00:00")
        with theirs.begin() as connection:
            save_model(connection, other)
            save_model(connection, replace(model, name="pgd"))
        report = _merge(theirs, engine)
        assert report.warnings == (
            "the databases differ in model 'pgv-wls': that of the other is stored as 'pgv-wls-2'",
        )
        assert _merge(theirs, engine).warnings == ()
        with engine.connect() as connection:
            assert [m.name for m in model_rows(connection)] == ["pgd", "pgv-wls", "pgv-wls-2"]
            assert load_model(connection).name == "pgv-wls"  # the default stays
            assert load_model(connection, "pgv-wls-2").data_fingerprint == "0" * 64

    def test_the_default_comes_along_where_there_is_none(
        self, engine: Engine, theirs: Engine, model: ModelRow
    ) -> None:
        with theirs.begin() as connection:
            save_model(connection, model)
        _merge(theirs, engine)
        with engine.connect() as connection:
            assert load_model(connection) == load_model(connection, model.name)

    def test_the_time_of_a_fit_makes_no_other_model(
        self, engine: Engine, theirs: Engine, model: ModelRow
    ) -> None:
        with engine.begin() as connection:
            save_model(connection, model)
        with theirs.begin() as connection:
            save_model(connection, replace(model, created="2025-01-01T00:00:00+00:00"))
        assert _merge(theirs, engine).added == {}


class TestRefusals:
    def test_itself(self, filled: Engine, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="the same database"):
            merge_databases(_where(filled), db=_where(filled))

    def test_itself_by_another_name(self, sqlite_file: Path) -> None:
        link = sqlite_file.with_name("link.db")
        link.symlink_to(sqlite_file)
        with pytest.raises(InputError, match="the same database"):
            merge_databases(link, db=sqlite_file)

    def test_nothing_there(self, engine: Engine, tmp_path: Path) -> None:
        with pytest.raises(DatabaseNotFoundError):
            merge_databases(tmp_path / "none.db", db=_where(engine))

    def test_no_database_is_made_for_one_that_cannot_be_read(self, tmp_path: Path) -> None:
        with pytest.raises(DatabaseNotFoundError):
            merge_databases(tmp_path / "none.db", db=tmp_path / "new.db")
        assert list(tmp_path.iterdir()) == []

    def test_damage_does_not_spread(self, filled: Engine, theirs: Engine) -> None:
        _merge(filled, theirs)
        _change(theirs, update(schema.motion).values(pga_g=9.0))
        before = _digest(filled)
        with pytest.raises(DatabaseError, match="damaged in 6 places and was not merged"):
            merge_databases(_where(theirs), db=_where(filled))
        assert _digest(filled) == before

    def test_content_tables_are_all_merged(self, filled: Engine, theirs: Engine) -> None:
        # A table that a later schema adds must not be forgotten here.
        assert len(CONTENT_TABLES) == 14
        _merge(filled, theirs)
        for table in CONTENT_TABLES:
            with filled.connect() as a, theirs.connect() as b:
                assert list(table_rows_by_natural_key(a, table)) == list(
                    table_rows_by_natural_key(b, table)
                )
