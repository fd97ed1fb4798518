"""Metadata from the table of files to the fit: stored, shown, exported, merged, selected by."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import statsmodels.api as sm
from sqlalchemy import text

from rbfrag.campaign.add_motions import add_motions
from rbfrag.campaign.simulate import simulate
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.merge import merge_databases
from rbfrag.db.models import model_rows
from rbfrag.db.motions import motion_rows
from rbfrag.db.queries import combination_table, database_info
from rbfrag.errors import MergeConflictError
from rbfrag.exchange.database_tables import export_database, read_table
from rbfrag.fragility.fit.stored import check_models, fit
from tests.synthetic import write_suite

HEAD = (
    "file,event_id,companion_group,magnitude,mechanism,depth_km,network,lat,lon,rjb_km,vs30,rsn\n"
)


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records of four earthquakes with a table of metadata."""
    folder = write_suite(tmp_path_factory.mktemp("chain") / "records")
    rows = [
        f"{path.name},quake-{i % 4},site-{i},{5.5 + 0.5 * (i % 4)},reverse,8,NET,{40 + i},-120,"
        f"{10 + i},{300 + 100 * i},{i}\n"
        for i, path in enumerate(sorted(folder.glob("*.AT2")))
    ]
    (folder / "meta.csv").write_text(HEAD + "".join(rows))
    return folder


def test_the_chain_with_metadata(place: str, records: Path, tmp_path: Path) -> None:
    report = add_motions([records], db=place, metadata=records / "meta.csv")
    assert report.failed == ()
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        rows = motion_rows(connection)
        info = database_info(connection)
    number = len(rows)
    assert [row.vs30_m_s for row in rows] == [300.0 + 100.0 * i for i in range(number)]
    assert (rows[1].lat, rows[1].lon, rows[1].rjb_km) == (41.0, -120.0, 11.0)
    assert (rows[1].mechanism, rows[1].depth_km, rows[1].network) == ("reverse", 8.0, "NET")
    assert dict(rows[1].attributes) == {"rsn": "1"}
    assert info.metadata == {"mechanism": 4, "rjb_km": number, "rrup_km": 0, "vs30_m_s": number}
    summary = simulate(
        place, p2=[3.0, 1.0], where="vs30_m_s > 350 and mechanism != 'normal'", jobs=1
    )
    assert summary.combinations == 2 * 2 * (number - 1)
    settings = json.loads(read_table("campaign", db=place)["settings"][0])
    assert settings["where"] == "vs30_m_s > 350 and mechanism != 'normal'"
    model = fit(place, term="pgv", method="logistic", where="rjb_km <= 14")
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        selected = combination_table(connection, where="rjb_km <= 14").combination_id
        query = text("SELECT DISTINCT combination_id FROM outcome WHERE rjb_km <= 14")
        assert {*selected.tolist()} == {*connection.scalars(query)}
        assert len(selected) < summary.combinations
        assert check_database(connection) == []
        assert check_models(connection, model_rows(connection)).is_passed
    assert model.details["where"] == "rjb_km <= 14"
    assert [line.text for line in model.lines() if line.label == "Where"] == ["rjb_km <= 14"]
    # the same fit, from the view
    view = read_table("outcome", db=place)
    assert view["kr"].tolist() == (view["kr_over_pga"] * view["pga_g"]).tolist()
    view = view[(view["rjb_km"] <= 14) & view["grid"].notna()]
    top = view[view["grid"] == view["grid"].max()]
    more = [top.assign(kr=top["kr"] * 40.0 ** (n / 24), failed=0) for n in range(1, 11)]
    view = pd.concat([view, *more]).dropna(subset=["failed"]).query("0.02 <= kr <= 1")
    p = np.sqrt(view["p2"])
    h = np.exp(0.18 * np.log(p) - 0.06 * np.log(p) ** 2)
    x = np.column_stack([h, h * np.log(view["pgv_m_s"] * p / (9.80665 * view["kr"]))])
    family = sm.families.Binomial()
    again = sm.GLM(view["failed"].astype(float), x, family).fit(tol=1e-13, tol_criterion="params")
    assert again.params.tolist() == pytest.approx([*model.coefficients.values()], rel=1e-9)
    # exports and merges
    export_database(tmp_path / "tables", db=place, format="csv")
    table = pd.read_csv(tmp_path / "tables" / "recording.csv")
    assert table["vs30_m_s"].tolist() == [row.vs30_m_s for row in rows]
    assert not (tmp_path / "tables" / "outcome.csv").exists()
    merge_databases(place, db=tmp_path / "other.db")
    merge_databases(place, db=tmp_path / "other.db")
    merged = read_table("outcome", db=tmp_path / "other.db")
    assert merged["vs30_m_s"].tolist() == read_table("outcome", db=place)["vs30_m_s"].tolist()


def table(records: Path, folder: Path, name: str, columns: int = 99, **changed: str) -> Path:
    """Write a copy of the metadata, of the first columns or with changed cells."""
    lines = (records / "meta.csv").read_text().splitlines()
    lines = [lines[0], *(f"{records}/{line}" for line in lines[1:])]
    body = "\n".join(",".join(line.split(",")[:columns]) for line in lines) + "\n"
    for before, after in changed.items():
        body = body.replace(f",{before.removeprefix('of_')},", f",{after},")
    (folder / name).write_text(body)
    return folder / name


def test_missing_metadata_are_filled_in_and_others_rejected(
    place: str, records: Path, tmp_path: Path
) -> None:
    add_motions([records], db=place, metadata=table(records, tmp_path, "bare.csv", 4))
    report = add_motions([records], db=place, metadata=records / "meta.csv")
    assert (report.added, report.failed[1:]) == ((), ())
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        rows = motion_rows(connection)
        assert check_database(connection) == []
    assert [row.vs30_m_s for row in rows] == [300.0 + 100.0 * i for i in range(len(rows))]
    assert {row.mechanism for row in rows} == {"reverse"}
    assert dict(rows[2].attributes) == {"rsn": "2"}
    other = table(records, tmp_path, "other.csv", of_300="333")
    reasons = [bad.reason for bad in add_motions([records], db=place, metadata=other).failed]
    words = "recording 'site-0' has vs30_m_s 300.0, not 333.0: correct the metadata"
    assert any(words in reason for reason in reasons)


def test_a_merge_fills_in_missing_metadata(records: Path, tmp_path: Path) -> None:
    bare, full, other = (tmp_path / f"{name}.db" for name in ("bare", "full", "other"))
    add_motions([records], db=bare, metadata=table(records, tmp_path, "bare.csv", 4))
    add_motions([records], db=full, metadata=records / "meta.csv")
    add_motions([records], db=other, metadata=table(records, tmp_path, "o.csv", of_300="333"))
    merge_databases(full, db=bare)
    assert read_table("recording", db=bare)["vs30_m_s"].tolist() == [
        300.0 + 100.0 * i for i in range(6)
    ]
    with pytest.raises(MergeConflictError, match="site-0: vs30_m_s is 300"):
        merge_databases(other, db=bare)
