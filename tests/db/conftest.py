"""Databases, motions and results for the tests of the store."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import Engine

from rbfrag.db.campaigns import (
    CombinationRecord,
    finish_campaign,
    insert_combinations,
    start_campaign,
)
from rbfrag.db.engine import open_database
from rbfrag.db.keys import combination_key
from rbfrag.db.model_file import ModelRow
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.results import NUMERICS_VERSION, SearchPoints

NOBODY = 65534


@pytest.fixture(scope="session")
def empty_database(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The content of an empty SQLite database; copying it is quicker than migrating."""
    path = tmp_path_factory.mktemp("template") / "empty.db"
    open_database(path, create=True).dispose()
    return path.read_bytes()


@pytest.fixture
def engine(place: str, empty_database: bytes) -> Iterator[Engine]:
    """An empty database."""
    if "://" not in place:
        Path(place).write_bytes(empty_database)
    engine = open_database(place, create=True)
    yield engine
    engine.dispose()


@pytest.fixture
def sqlite_file(tmp_path: Path, empty_database: bytes) -> Path:
    """An empty database in a file, closed."""
    path = tmp_path / "test.db"
    path.write_bytes(empty_database)
    return path


@pytest.fixture
def make_motion() -> Callable[..., GroundMotion]:
    """A little noise; another seed is another motion."""

    def make(seed: int = 0, **labels: Any) -> GroundMotion:
        samples = np.random.default_rng(seed).normal(scale=0.2, size=64)
        labels_of_motion = {
            "station": "HVSC",
            "component": "000",
            "source_file": f"{seed}.txt",
            **labels,
        }
        return GroundMotion(samples, 0.01, **labels_of_motion)

    return make


@pytest.fixture
def make_result() -> Callable[..., CriticalResult]:
    """A consistent answer of the solver for a motion of the given PGA."""

    def make(pga_g: float = 0.5, *, p2: float = 3.0, k: float = 0.4, **changes: Any) -> Any:
        is_found = changes.get("status", "found") == "found"
        kr = k * pga_g
        points = SearchPoints(
            kr_over_pga=np.array([0.9, k + 0.01, k, k]),
            theta_n=np.array([0.1, 0.7, np.nan, np.nan]),
            outcome=("stable", "stable", *["toppled" if is_found else "undetermined"] * 2),
        )
        values: dict[str, Any] = {
            "kind": "toppling",
            "p2": p2,
            "polarity": "forward",
            "pga_g": pga_g,
            "status": "found",
            "search_limit": 0.01,
            "kr_over_pga": k if is_found else None,
            "lower": k if is_found else None,
            "upper": k + 1e-12 if is_found else None,
            "kr": kr if is_found else None,
            "y_m_s": kr * 9.80665 / abs(p2) ** 0.5 if is_found else None,
            "certified": True,
            "k_up_over_pga": 1.0,
            "undecided": 0.0,
            "island_width": 0.1,
            "kr_over_pga_resolved": k if is_found else None,
            "reentrant": False,
            "n_runs": 40,
            "warnings": ("a warning",),
            "points": points,
        }
        return CriticalResult(**{**values, **changes})

    return make


@pytest.fixture
def store_result() -> Callable[..., str]:
    """Write an answer of the solver under its natural key, and return the key."""

    def store(
        connection: Any,
        campaign_id: int,
        motion: GroundMotion,
        motion_id: int,
        result: CriticalResult,
        **changes: Any,
    ) -> str:
        settings = changes.pop("settings", {"search_limit": result.search_limit})
        version = changes.pop("numerics_version", NUMERICS_VERSION)
        vertical = changes.pop("vertical", None)
        key = combination_key(
            motion_sha256=motion.sha256,
            dt_s=motion.dt_s or 0.0,
            vertical_sha256=None if vertical is None else vertical[1].sha256,
            polarity=result.polarity,
            kind="toppling",
            p2=result.p2,
            settings=settings,
            numerics_version=version,
        )
        record = CombinationRecord(
            natural_key=key,
            motion_id=motion_id,
            vertical_motion_id=None if vertical is None else vertical[0],
            polarity=result.polarity,
            kind="toppling",
            p2=result.p2,
            settings=settings,
            result=result,
            numerics_version=version,
        )
        insert_combinations(connection, campaign_id, [record])
        return key

    return store


@pytest.fixture
def fill(make_motion: Any, make_result: Any, store_result: Any) -> Callable[..., None]:
    """Store three motions, two of a stated event, with a found and a censored search each."""
    quake = EarthquakeInfo("chi-chi-1999", magnitude=7.62, guessed=False)

    def store(connection: Any, order: list[int]) -> None:
        motions = {seed: make_motion(seed) for seed in (1, 2, 3)}
        ids = {}
        for seed in order:
            ids[seed], _ = add_motion(
                connection,
                motions[seed],
                earthquake=quake if seed < 3 else EarthquakeInfo("guess"),
                is_vertical=False,
                suite="s" if seed < 3 else None,
            )
        campaign = start_campaign(connection, {"order": order})
        for seed in order:
            pga = motions[seed].pga_g
            for p2, status in ((3.0, "found"), (0.1, "below_limit")):
                result = make_result(pga, p2=p2, k=0.1 * seed, status=status)
                store_result(connection, campaign, motions[seed], ids[seed], result)
        finish_campaign(connection, campaign)

    return store


@pytest.fixture
def filled(engine: Engine, fill: Callable[..., None]) -> Engine:
    """A database that holds what `fill` stores."""
    with engine.begin() as connection:
        fill(connection, [1, 2, 3])
    return engine


@pytest.fixture
def model() -> ModelRow:
    """A fitted model with numbers that no short decimal holds."""
    return ModelRow(
        name="pgv-wls",
        term="pgv",
        method="wls",
        coefficients={"slope": 0.1 + 0.2, "intercept": -1.0 / 3.0, "a": 5e-324},
        covariance=((1.0, 0.1, 0.0), (0.1, 2.0, 1e-300), (0.0, 1e-300, 3.0)),
        domain={"pgv_m_s": (0.01, 2.0 / 3.0)},
        data_fingerprint="f" * 64,
        diagnostics={"n": 12, "warnings": ["Zürich"], "scores": {"log": -1.5}},
        created="2024-01-01T00:00:00+00:00",
        leave_out_steps=((0.1, -1.0 / 3.0, 5e-324), (0.0, 0.2, 1e-300)),
        dependence={"rho_e": 1.0 / 3.0, "errors": {"rho_e": 0.1}},
    )


@pytest.fixture
def locked_folder() -> Iterator[Callable[[], AbstractContextManager[Path]]]:
    """A folder that cannot be written inside the with block, even when root runs the tests."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)

        @contextmanager
        def lock() -> Iterator[Path]:
            for file in folder.iterdir():
                file.chmod(0o444)
            folder.chmod(0o555)
            was_root = os.geteuid() == 0
            if was_root:
                os.seteuid(NOBODY)
            try:
                yield folder
            finally:
                if was_root:
                    os.seteuid(0)
                folder.chmod(0o755)

        lock.folder = folder  # type: ignore[attr-defined]
        yield lock
